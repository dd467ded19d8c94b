//! Gains that are found with a payload whose mass is known approximately.

#![allow(clippy::unwrap_used)]

#[path = "common/effort_arm.rs"]
mod effort_arm;

use effort_arm::{World, payload, record, uncertain_gains};
use tactid_identify::calibration::{KnownPayload, calibrate};
use tactid_identify::{BatchSettings, HALF_WIDTH_95};

/// The uncertainty of the weight that finds the gains is that of other payloads: intervals contain an error of the weight,
/// and do not shrink where less is known of it.
#[test]
fn the_uncertainty_of_a_known_mass_is_that_of_other_payloads() {
    let (mut held, mut count) = (0, 0);
    for (seed, error) in [(60, -1.0), (61, 0.5), (62, 1.0), (63, -0.5)] {
        let mut world = World::new(seed);
        let weight = payload(4.0, &mut world);
        let unloaded = record(&mut world, None, 20.0);
        let loaded = record(&mut world, Some(&weight), 20.0);
        let body = payload(2.5, &mut world);
        let with_body = [record(&mut world, Some(&body), 20.0)];
        let half_widths = [0.0, 0.1, 0.2, 0.4].map(|std_dev_kg| {
            let known = KnownPayload::of_mass(4.0 + error * std_dev_kg, std_dev_kg);
            let given = [(unloaded.clone(), None), (loaded.clone(), Some(known))];
            let calibration = calibrate(&given, &uncertain_gains()).unwrap().calibration;
            let found = calibration.identify(&with_body, &[], &BatchSettings::default());
            let estimate = found.unwrap().result.estimate;
            let half_width = HALF_WIDTH_95 * estimate.std_devs.unwrap()[0];
            held += u32::from((estimate.values()[0] - 2.5).abs() <= half_width);
            count += 1;
            half_width
        });
        // 2.5 % of the mass, and then ever more; what the robot's description says of the links limits it.
        assert!(half_widths[1] > 4.0 * half_widths[0], "{half_widths:?}");
        assert!(half_widths[2] > 1.3 * half_widths[1], "{half_widths:?}");
        assert!(half_widths[3] > 0.95 * half_widths[2], "{half_widths:?}");
    }
    assert!(held >= count - 1, "{held} of {count}");
}
