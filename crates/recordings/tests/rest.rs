//! Arrays of poses at rest, of sensors that do not measure every channel.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_recordings::{Arrays, Finding, Identification, Request, identify_poses};

const MASS_KG: f64 = 1.2;
const CENTER: Vector3<f64> = Vector3::new(0.001, -0.002, 0.045);
/// Noise of a force, N, and of a moment, N m.
const NOISE: [f64; 2] = [0.05, 0.002];

/// Identifies from poses whose wrenches have `absent` in the place of some channels.
fn identify(count: usize, unmeasured: &[usize], absent: f64) -> Identification {
    let mut random = SmallRng::seed_from_u64(5);
    let mut normal = || random.sample::<f64, _>(StandardNormal);
    let (mut poses, mut wrenches) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let turn = Quaternion::new(normal(), normal(), normal(), normal());
        let turn = UnitQuaternion::from_quaternion(turn);
        let force = turn.inverse() * Vector3::new(0.0, 0.0, 9.81 * MASS_KG);
        let moment = CENTER.cross(&force);
        let exact = force.iter().chain(&moment).enumerate();
        wrenches.extend(exact.map(|(k, value)| {
            let noisy = value + NOISE[k / 3] * normal();
            if unmeasured.contains(&k) {
                absent
            } else {
                noisy
            }
        }));
        poses.push(Isometry3::from_parts(Vector3::zeros().into(), turn));
    }
    let arrays = Arrays {
        pose: &poses,
        wrench: &wrenches,
        ..Arrays::default()
    };
    identify_poses(&arrays, &Request::default()).unwrap()
}

/// Channels that are zero or no number in all poses are not taken for measured: three forces show
/// the mass alone, and a missing force leaves the centre of mass to the moments.
#[test]
fn what_is_not_measured_is_left_out() {
    for absent in [0.0, f64::NAN] {
        for unmeasured in [&[3, 4, 5][..], &[0]] {
            let found = identify(6, unmeasured, absent);
            assert!(
                found.recording.faults.is_empty(),
                "{:?}",
                found.recording.faults
            );
            let estimate = &found.estimate;
            let error_kg = (estimate.body.mass_kg - MASS_KG).abs();
            assert!(
                error_kg < 1.96 * estimate.std_devs[0].min(0.1),
                "{error_kg}"
            );
            let knows_center = unmeasured.len() == 1;
            assert_eq!(estimate.identifiable()[1..4], [knows_center; 3]);
            for (interval, truth) in estimate.intervals[1..4].iter().zip(&CENTER) {
                assert!((interval[0]..interval[1]).contains(truth), "{interval:?}");
            }
            let left_out = found
                .recording
                .findings
                .iter()
                .find_map(|finding| match finding {
                    Finding::Data(tactid_batch::Finding::ConstantChannels {
                        channels,
                        is_left_out,
                        ..
                    }) => Some((channels.len(), *is_left_out)),
                    _ => None,
                });
            assert_eq!(left_out, Some((unmeasured.len(), true)));
            let is_exchanged =
                |finding: &Finding| matches!(finding, Finding::ForcesAndMomentsExchanged { .. });
            let mut findings = found.recording.findings.iter();
            assert!(!findings.any(is_exchanged), "{unmeasured:?}");
        }
    }
    let whole = identify(6, &[], 0.0);
    assert!(whole.estimate.identifiable()[..4].iter().all(|each| *each));
}
