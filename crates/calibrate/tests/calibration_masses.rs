//! Gains that are found with a payload of approximately known mass.

use tactid_batch::BatchSettings;
use tactid_calibrate::{EffortRecording, KnownPayload, calibrate};
use tactid_identify::HALF_WIDTH_95;

use crate::effort_arm::{World, payload, record, uncertain_gains};

const BODY_KG: f64 = 2.5;

/// Recordings of one arm: without payload, with weights, and with a payload of 2.5 kg.
struct Recordings {
    unloaded: EffortRecording,
    loaded: Vec<EffortRecording>,
    with_body: [EffortRecording; 1],
}

impl Recordings {
    fn new(seed: u64, weights_kg: &[f64]) -> Self {
        let mut world = World::new(seed);
        let loaded = weights_kg.iter().map(|mass_kg| {
            let weight = payload(*mass_kg, &mut world);
            record(&mut world, Some(&weight), 20.0)
        });
        let loaded = loaded.collect();
        let body = payload(BODY_KG, &mut world);
        Self {
            unloaded: record(&mut world, None, 20.0),
            with_body: [record(&mut world, Some(&body), 20.0)],
            loaded,
        }
    }

    /// Returns the mass that a calibration with weights of these masses and standard deviations
    /// finds, and the half width of its 95 % interval, kg.
    fn identify(&self, known: &[(f64, f64)]) -> [f64; 2] {
        let mut given = vec![(self.unloaded.clone(), None)];
        let loaded = self.loaded.iter().zip(known);
        given.extend(loaded.map(|(recording, (mass_kg, std_dev_kg))| {
            let payload = KnownPayload::of_mass(*mass_kg, *std_dev_kg);
            (recording.clone(), Some(payload))
        }));
        let calibration = calibrate(&given, &uncertain_gains()).unwrap().calibration;
        let found = calibration.identify(&self.with_body, &[], &BatchSettings::default());
        let estimate = found.unwrap().result.estimate;
        let [std_dev, ..] = estimate.std_devs;
        [estimate.values()[0], HALF_WIDTH_95 * std_dev]
    }
}

/// Other payloads have the uncertainty of the weight that finds the gains: the mass stays the same
/// when less is known of the weight, intervals grow in proportion, and contain an error of the
/// weight.
#[test]
fn the_uncertainty_of_a_known_mass_is_that_of_other_payloads() {
    for (seed, error) in [(60, -1.0), (62, 1.0)] {
        let recordings = Recordings::new(seed, &[4.0]);
        let [exact, least] = recordings.identify(&[(4.0, 0.0)]);
        assert!((exact - BODY_KG).abs() < 0.02, "{exact}");
        for std_dev_kg in [0.1, 0.2, 0.4] {
            let [free, half_width] = recordings.identify(&[(4.0, std_dev_kg)]);
            // Gains known to 20 % weigh at most a fifth, and contradict the weight by some 10 %.
            assert!((free / exact - 1.0).abs() < 0.03, "{free} {exact}");
            // 2.3 standard deviations of 8 degrees of freedom, less what the gains know.
            let expected = least.hypot(2.3 * BODY_KG * std_dev_kg / 4.0);
            let ratio = half_width / expected;
            assert!((0.88..1.05).contains(&ratio), "{half_width} {expected}");
            let [mass, half_width] = recordings.identify(&[(4.0 + error * std_dev_kg, std_dev_kg)]);
            assert!((mass - BODY_KG).abs() < half_width, "{mass} {half_width}");
        }
    }
}

/// Of two weights the one that is known better decides the scale, and two that are known equally
/// well share it.
#[test]
fn weights_decide_the_scale_together() {
    let recordings = Recordings::new(64, &[4.0, 2.0]);
    let [exact, _] = recordings.identify(&[(4.0, 0.0), (2.0, 0.0)]);
    let [better, half_width] = recordings.identify(&[(4.4, 0.4), (2.0, 0.002)]);
    assert!((better / exact - 1.0).abs() < 0.005, "{better} {exact}");
    assert!(half_width < 0.05, "{half_width}");
    let [shared, _] = recordings.identify(&[(4.4, 0.2), (2.0, 0.1)]);
    assert!((shared / exact - 1.05).abs() < 0.01, "{shared} {exact}");
}
