//! Payloads on six-axis arms with a joint's zero moved since their calibration.

use tactid_batch::BatchSettings;
use tactid_calibrate::{Assumption, Calibration, CalibrationSettings, EffortRecording};
use tactid_identify::KnownMass;

use crate::effort_arm::{World, calibrated, payload, record, recorded};

/// Measures an arm with positions of one joint that are too large by an angle, rad.
fn moved(world: &mut World<6>, mass_kg: f64, joint: usize, angle: f64) -> EffortRecording {
    let body = payload(mass_kg, world);
    let mut measured = world.measure(Some(&body), 30.0);
    for [position, ..] in &mut measured {
        position[joint] += angle;
    }
    recorded(&world.described, &measured, &CalibrationSettings::default())
}

/// Identifies a payload of 0.5 and one of 2.5 kg on each of some calibrated arms, and counts the
/// results that name the right zero with its size, and those that name another.
fn found(arms: &[(World<6>, Calibration)], joint: usize, angle: f64) -> (usize, usize) {
    let (mut named, mut misnamed) = (0, 0);
    for (world, calibration) in arms {
        let mut world = world.clone();
        for mass_kg in [0.5, 2.5] {
            let loaded = moved(&mut world, mass_kg, joint, angle);
            let identified = calibration.identify(&[loaded], &[], &BatchSettings::default());
            let Some(found) = identified.unwrap().moved_zero else {
                continue;
            };
            assert_eq!(found.assumption, Assumption::JointZero);
            let is_right = found.joint == world.described.joint_names()[joint]
                && (found.size + angle).abs() < 0.5 * angle.abs();
            *(if is_right { &mut named } else { &mut misnamed }) += 1;
        }
    }
    (named, misnamed)
}

/// A zero that has moved by 0.6 degrees or more is found and named: 12 of 12 at the shoulder.
#[test]
fn zeros_that_have_moved() {
    let arms: Vec<_> = (300..306)
        .map(|seed| {
            let mut world = World::six_axes(seed);
            let calibration = calibrated(&mut world, 30.0).calibration;
            (world, calibration)
        })
        .collect();
    for (joint, angle) in [(1, 0.01), (1, -0.02), (1, 0.05), (2, 0.02)] {
        let (named, misnamed) = found(&arms, joint, angle);
        let about = format!("joint {joint}, {angle} rad: {named} named, {misnamed} misnamed");
        assert!(named >= 11, "{about}");
        assert_eq!(misnamed, 0, "{about}");
    }
}

/// Nothing is found on arms with zeros that have not moved, also where gains have changed by 5 %.
#[test]
fn zeros_that_have_not_moved() {
    for seed in 310..326 {
        let mut world = World::six_axes(seed);
        let calibration = calibrated(&mut world, 30.0).calibration;
        for (mass_kg, factor) in [(0.5, 1.0), (2.5, 1.0), (5.0, 1.0), (2.5, 1.05)] {
            world.gains.iter_mut().for_each(|gain| *gain /= factor);
            let body = payload(mass_kg, &mut world);
            let loaded = [record(&mut world, Some(&body), 30.0)];
            let identified = calibration.identify(&loaded, &[], &BatchSettings::default());
            assert_eq!(
                identified.unwrap().moved_zero,
                None,
                "{seed}, {mass_kg} kg, {factor}"
            );
        }
    }
}

/// A known mass that is wrong is not taken for a zero that has moved.
#[test]
fn a_wrong_mass_is_no_moved_zero() {
    let mut world = World::six_axes(300);
    let calibration = calibrated(&mut world, 30.0).calibration;
    let body = payload(2.5, &mut world);
    let loaded = [record(&mut world, Some(&body), 30.0)];
    for mass_kg in [2.7, 2500.0] {
        let settings = BatchSettings {
            known_mass: Some(KnownMass {
                mass_kg,
                std_dev_kg: 0.0,
            }),
            ..BatchSettings::default()
        };
        let identified = calibration.identify(&loaded, &[], &settings);
        assert_eq!(identified.unwrap().moved_zero, None, "{mass_kg} kg");
    }
}
