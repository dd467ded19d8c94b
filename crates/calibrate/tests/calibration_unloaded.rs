//! Payloads on arms with known gains, which one recording without a payload calibrated.

use tactid_batch::BatchSettings;
use tactid_calibrate::{CalibrationSettings, calibrate};
use tactid_identify::HALF_WIDTH_95;

use crate::effort_arm::{JOINTS, World, payload, record, values};

/// Recordings of 6 s after a calibration of 15 s: masses have no bias, and intervals hold. They are
/// rather too wide: the rms error of the mass is some 0.6 standard deviations.
#[test]
fn masses_have_no_bias_and_intervals_hold() {
    let (mut held, mut relative, mut std_devs) = (0, Vec::new(), Vec::new());
    for seed in 300..340 {
        let mut world = World::new(seed);
        world.gains = [1.0; JOINTS];
        let unloaded = record(&mut world, None, 15.0);
        let calibrated = calibrate(&[(unloaded, None)], &CalibrationSettings::default());
        let calibration = calibrated.unwrap().calibration;
        let body = payload(2.0, &mut world);
        let loaded = record(&mut world, Some(&body), 6.0);
        let found = calibration.identify(&[loaded], &[], &BatchSettings::default());
        let estimate = found.unwrap().result.estimate;
        let of_values = estimate.std_devs;
        let errors = estimate.values().into_iter().zip(values(&body));
        let errors = errors.map(|(value, truth)| value - truth);
        let errors: Vec<f64> = errors
            .zip(of_values)
            .map(|(e, std_dev)| e / std_dev)
            .collect();
        held += errors
            .iter()
            .filter(|error| error.abs() <= HALF_WIDTH_95)
            .count();
        relative.push(errors[0]);
        std_devs.push(of_values[0]);
    }
    assert!(held >= 388, "{held} of 400");
    let mean = relative.iter().sum::<f64>() / 40.0;
    assert!(mean.abs() < 0.3, "{mean}");
    let rms = (relative.iter().map(|error| error * error).sum::<f64>() / 40.0).sqrt();
    assert!((0.4..1.2).contains(&rms), "{rms}");
    std_devs.sort_by(f64::total_cmp);
    assert!((0.02..0.04).contains(&std_devs[20]), "{std_devs:?}");
}
