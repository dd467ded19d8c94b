//! Arms that are calibrated with the description of another one.

use crate::effort_arm::{JOINTS, World, arm, record};
use tactid_calibrate::{Assumption, CalibrationSettings, Contradiction, calibrate};
use tactid_dynamics::{BaseKind, Notice, Severity};

/// Returns what a calibration with efforts as torques finds where each link is described with its
/// mass times a factor; the true masses are up to 10 % off.
fn found(seed: u64, factors: [f64; JOINTS]) -> Vec<Contradiction> {
    let mut world = World::new(seed);
    world.gains = [1.0; JOINTS];
    world.described = arm(&factors, BaseKind::Fixed);
    let unloaded = record(&mut world, None, 20.0);
    let settings = CalibrationSettings::default();
    let calibrated = calibrate(&[(unloaded, None)], &settings).unwrap();
    calibrated.report.contradictions
}

/// The masses of a robot that is lighter or heavier by a factor of two are doubtful.
#[test]
fn masses_of_a_similar_robot() {
    for seed in 500..510 {
        for (factor, ratios) in [(0.45, 1.8..2.6), (2.2, 0.38..0.56)] {
            let found = found(seed, [factor; JOINTS]);
            let [doubtful] = found.as_slice() else {
                panic!("{seed} {factor}: {found:?}")
            };
            assert_eq!(doubtful.assumption, Assumption::Links);
            assert_eq!(doubtful.severity(), Severity::Doubts);
            assert_eq!(doubtful.joint, "joint_2");
            assert!(ratios.contains(&(1.0 + doubtful.size)), "{doubtful:?}");
        }
    }
}

/// Masses that are 20 % off, in either direction or link by link, and links without mass are not.
#[test]
fn masses_that_are_plausible() {
    for seed in 500..510 {
        for factors in [[0.8; 4], [1.2; 4], [1.2, 0.8, 1.2, 0.8], [0.0; 4]] {
            assert_eq!(found(seed, factors), [], "{seed} {factors:?}");
        }
    }
}
