//! Poses at rest: gravity, contacts, repeated visits and units that are not as assumed.

use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{BatchResult, Finding, Hypothesis, OutlyingPose, RestIdentifier};
use tactid_dynamics::{Manipulator, Notice, Severity};
use tactid_identify::{BaseState, EquationSettings, IdentifyError, Method, Sample, Wrench};

use crate::at_rest::*;

/// A wrong sensor or gravity is named, and right ones are not, however few the poses are.
#[test]
fn wrong_assumptions_are_named_and_right_ones_are_not() {
    for seed in 0..300 {
        let mut random = SmallRng::seed_from_u64(seed);
        let count = random.random_range(3..25);
        let found = causes(&identify(&poses(count, &mut random)).unwrap());
        assert!(found.is_empty(), "{seed}: {found:?} in {count} poses");
    }
    let right = poses(16, &mut SmallRng::seed_from_u64(2));
    for [of_force, of_moment] in [[true, true], [true, false], [false, true]] {
        let swapped = right.iter().map(|(attitude, wrench)| {
            let swap = |v: Vector3<f64>, is| if is { Vector3::new(v.y, v.x, v.z) } else { v };
            let wrench = Wrench {
                force: swap(wrench.force, of_force),
                moment: swap(wrench.moment, of_moment),
            };
            (*attitude, wrench)
        });
        let swapped = swapped.collect::<Vec<_>>();
        for settings in [settings(true), unknown_gravity(GRAVITY)] {
            let swapped = identify_with(&swapped, &settings).unwrap();
            let Some(Finding::WrongAssumption(found)) = swapped.findings.first() else {
                panic!("{:?}", swapped.findings);
            };
            assert_eq!(found.cause, Hypothesis::Axes);
            // No sign is turned.
            assert!(found.values.iter().all(|sign| *sign == 1.0), "{found:?}");
            let first = swapped.findings.first().map(Notice::severity);
            assert_eq!(first, Some(Severity::Contradicts), "{:?}", swapped.findings);
        }
    }
    let slope = about(Vector3::x(), 0.5);
    let tilted = right
        .iter()
        .map(|(attitude, wrench)| (slope * attitude, *wrench));
    let tilted = identify(&tilted.collect::<Vec<_>>()).unwrap();
    assert_eq!(causes(&tilted).first(), Some(&Hypothesis::Gravity));
    let first = tilted.findings.first().map(Notice::severity);
    assert!(first <= Some(Severity::Doubts), "{:?}", tilted.findings);
}

/// Exact poses give the exact direction of gravity, whatever the given one is, in a tip frame that
/// is not that of the sensor.
#[test]
fn an_unknown_direction_of_gravity_is_identified() {
    let robot = sensor_below_the_tip();
    let attitudes: Vec<_> = poses(6, &mut SmallRng::seed_from_u64(4))
        .iter()
        .map(|pose| pose.0)
        .collect();
    for given in [
        GRAVITY,
        -GRAVITY,
        Vector3::new(9.81, 0.0, 0.0),
        about(Vector3::x(), 0.15) * GRAVITY,
    ] {
        let settings = unknown_gravity(given);
        let identifier = RestIdentifier::new(&robot, "tip", &["sensor"], &settings, None);
        let result = solve(identifier.unwrap(), &exact(&attitudes)).unwrap();
        assert!(
            (result.estimate.body.mass_kg - MASS_KG).abs() < 1e-6,
            "{given}"
        );
        let found = Vector3::from(result.fit.gravity.as_ref().unwrap().values);
        assert!((found - GRAVITY).norm() < 1e-5, "{given}: {found}");
        assert!(causes(&result).is_empty());
        assert!(result.estimate.identifiable()[..4].iter().all(|is| *is));
        assert!(!result.estimate.identifiable()[4]);
    }
}

/// The 95 % intervals of the payload, the offset and the direction of gravity contain the truth in
/// 93 to 97 % of 1000 draws.
#[test]
fn intervals_hold_with_an_unknown_gravity() {
    const DRAWS: usize = 1000;
    let mut inside = [0; 12];
    for seed in 0..DRAWS {
        let mut random = SmallRng::seed_from_u64(seed as u64);
        let count = random.random_range(6..25);
        let settings = unknown_gravity(Vector3::new(1.0, 0.0, -9.759));
        let result = identify_with(&poses(count, &mut random), &settings).unwrap();
        count_inside(&result, &mut inside);
        let gravity = result.fit.gravity.unwrap();
        // The entry along gravity has no first-order error.
        for k in 0..2 {
            inside[10 + k] += usize::from(gravity.values[k].abs() < 1.96 * gravity.std_devs[k]);
        }
    }
    check_coverage(&inside, DRAWS);
}

/// The weight of a payload that a controller subtracts along a gravity of its own contradicts the
/// result, be the true direction of gravity given as that or unknown.
#[test]
fn a_weight_along_another_gravity_contradicts() {
    let down = about(Vector3::x(), 1.2) * GRAVITY;
    let right = poses(12, &mut SmallRng::seed_from_u64(3));
    let felt = right.iter().map(|(attitude, wrench)| {
        let weight = attitude.inverse() * (0.5 * down);
        let at = Vector3::new(0.0, 0.0, 0.02);
        let wrench = Wrench {
            force: wrench.force + weight,
            moment: wrench.moment + at.cross(&weight),
        };
        (*attitude, wrench)
    });
    let felt = felt.collect::<Vec<_>>();
    let settings = EquationSettings {
        gravity: Some(down),
        ..settings(true)
    };
    for settings in [settings, unknown_gravity(down)] {
        let result = identify_with(&felt, &settings).unwrap();
        let mut severities = result.findings.iter().map(Notice::severity);
        let is_contradicted = severities.any(|each| each == Severity::Contradicts);
        assert!(is_contradicted, "{:#?}", result.findings);
    }
}

/// A given direction of gravity that is wrong, as on a wall or a slope, is named first, and
/// contradicts the result.
#[test]
fn a_wrong_direction_of_gravity_contradicts() {
    for degrees in [90.0_f64, 30.0, 9.0] {
        for seed in 0..20 {
            let right = poses(12, &mut SmallRng::seed_from_u64(seed));
            let slope = about(Vector3::x(), degrees.to_radians());
            let mounted = right
                .iter()
                .map(|(attitude, wrench)| (slope * attitude, *wrench));
            let result = identify(&mounted.collect::<Vec<_>>()).unwrap();
            assert_eq!(
                causes(&result).first(),
                Some(&Hypothesis::Gravity),
                "{degrees} {seed}"
            );
            let first = result.findings.first().map(Notice::severity);
            assert_eq!(
                first,
                Some(Severity::Contradicts),
                "{degrees} {seed}: {:?}",
                result.findings
            );
        }
    }
}

fn outliers(result: &BatchResult) -> Vec<&OutlyingPose> {
    let mut outliers = Vec::new();
    for finding in &result.findings {
        if let Finding::OutlyingPose(found) = finding {
            outliers.push(found);
        }
    }
    outliers
}

/// A pose in contact is named by its rows and left out, so that the result is that of the others.
/// Of sound poses, none is.
#[test]
fn a_pose_in_contact_is_left_out() {
    for count in [5, 8, 24] {
        for seed in 0..30 {
            let mut samples = poses(count, &mut SmallRng::seed_from_u64(seed));
            let bad = seed as usize % count;
            let sound = samples.iter().enumerate();
            let sound: Vec<_> = sound
                .filter(|(k, _)| *k != bad)
                .map(|(_, sample)| *sample)
                .collect();
            let expected = identify(&sound).unwrap();
            assert!(outliers(&expected).is_empty(), "{count} {seed}");
            samples[bad].1.force += Vector3::new(2.0, -3.0, 1.0);
            samples[bad].1.moment.y += 0.3;
            let result = identify(&samples).unwrap();
            let found = outliers(&result);
            assert_eq!(found.len(), 1, "{count} {seed}: {:?}", result.findings);
            assert_eq!((found[0].first_row, found[0].last_row), (bad + 1, bad + 1));
            assert!(found[0].is_left_out && found[0].distance > 10.0);
            assert!(causes(&result).is_empty());
            for k in 0..4 {
                let [found, expected] =
                    [&result, &expected].map(|result| result.estimate.intervals[k]);
                assert!((found[0] - expected[0]).abs() < 1e-9, "{count} {seed}");
            }
        }
    }
}

/// An attitude that is visited again shows the noise, but nothing about the payload that the first
/// visit does not.
#[test]
fn an_attitude_that_is_visited_again_is_none() {
    let mut random = SmallRng::seed_from_u64(8);
    let twice = [UnitQuaternion::identity(), about(Vector3::x(), 1.5)];
    let samples: Vec<_> = (0..8)
        .map(|k| {
            // The arm returns within a quarter of a degree.
            let off = Vector3::from_fn(|_, _| random.random_range(-0.004..0.004));
            let attitude = twice[k % 2] * UnitQuaternion::from_scaled_axis(off);
            (
                attitude,
                wrench(&attitude, &mut || random.sample(StandardNormal)),
            )
        })
        .collect();
    let result = identify(&samples).unwrap();
    let found = resting(&result);
    assert_eq!((found.attitudes, found.poses, found.samples), (2, 8, 8));
    let determined = result.estimate.identifiable();
    assert_eq!(
        determined[..4].iter().filter(|is| **is).count(),
        2,
        "{determined:?}"
    );
    let error = identify(&[samples[0], samples[2]]).unwrap_err();
    assert_eq!(error.option(), Some("wrench_offset"));
}

/// Poses at rest are for wrenches alone, and show no weight that was subtracted.
#[test]
fn what_poses_cannot_show_is_refused() {
    let samples = poses(6, &mut SmallRng::seed_from_u64(1));
    let mut of_weight = unknown_gravity(GRAVITY);
    of_weight.unknowns.weight = true;
    let error = identify_with(&samples, &of_weight).unwrap_err();
    assert_eq!(error.option(), Some("configured_payload"));
    let of_efforts = EquationSettings {
        method: Method::Effort,
        ..settings(false)
    };
    let error = identify_with(&samples, &of_efforts).unwrap_err();
    assert!(matches!(error, IdentifyError::Method(_)), "{error}");
}

/// Moments in N mm put the centre of mass farther away than any arm holds something, and are named
/// first; of an unknown mass, nothing is known to be far away.
#[test]
fn moments_in_other_units_are_named() {
    let mut samples = poses(8, &mut SmallRng::seed_from_u64(1));
    for (_, wrench) in &mut samples {
        wrench.moment *= 1e3;
    }
    let found = identify(&samples).unwrap().findings;
    assert!(matches!(found[0], Finding::CenterFarAway(_)), "{found:?}");
    let mut random = SmallRng::seed_from_u64(2);
    for (_, wrench) in &mut samples {
        *wrench = Wrench {
            force: Vector3::from_fn(|_, _| random.sample(StandardNormal)),
            moment: Vector3::from_fn(|_, _| 10.0 * random.sample::<f64, _>(StandardNormal)),
        };
    }
    let found = identify(&samples).unwrap().findings;
    assert!(
        !found
            .iter()
            .any(|each| matches!(each, Finding::CenterFarAway(_))),
        "{found:?}"
    );
}

/// Joint positions in degrees are named first.
#[test]
fn positions_in_degrees_are_named() {
    let urdf = r#"<robot name="arm"><link name="base"/><link name="upper"/><link name="tip"/>
      <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
        <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
      <joint name="wrist" type="revolute"><parent link="upper"/><child link="tip"/><axis xyz="1 0 0"/>
        <limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"#;
    let robot = Manipulator::from_urdf(urdf, tactid_identify::BaseKind::Fixed).unwrap();
    let mut identifier =
        RestIdentifier::new(&robot, "tip", &["tip"], &settings(true), None).unwrap();
    for joints in [
        [0.0, 0.0],
        [90.0, 0.0],
        [-90.0, 40.0],
        [0.0, 90.0],
        [30.0, -60.0],
    ] {
        let [shoulder, wrist] = joints.map(f64::to_radians);
        let attitude = about(Vector3::y(), shoulder) * about(Vector3::x(), wrist);
        identifier
            .push(&Sample {
                time_s: 0.0,
                base: BaseState::fixed(),
                joint_position: &joints,
                joint_velocity: &[],
                joint_effort: &[],
                wrenches: &[wrench(&attitude, &mut || 0.0)],
            })
            .unwrap();
    }
    let found = identifier.solve().unwrap().findings;
    let is_named = matches!(&found[0], Finding::PositionsBeyondLimits(found) if found.are_degrees);
    assert!(is_named, "{found:?}");
}

/// Too few poses contradict nothing: two sound ones, and four with an unknown gravity.
#[test]
fn few_sound_poses_contradict_nothing() {
    for seed in 0..100 {
        let random = &mut SmallRng::seed_from_u64(seed);
        let unknown = unknown_gravity(GRAVITY);
        for (count, settings) in [(2, settings(true)), (4, unknown)] {
            let result = identify_with(&poses(count, random), &settings).unwrap();
            let [Finding::PosesAtRest(found)] = &result.findings[..] else {
                panic!("{seed}, {count}: {:?}", result.findings);
            };
            assert_eq!(found.poses, count);
        }
    }
}
