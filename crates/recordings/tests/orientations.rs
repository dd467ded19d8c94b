//! Orientations that are not what they are taken for, at rest and in motion.

use std::ops::ControlFlow;

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::Finding as Data;
use tactid_recordings::{
    ActsOn, Arrays, Finding, OrientationReading, Request, identify_arrays, identify_poses,
};

const READINGS: [OrientationReading; 3] = [
    OrientationReading::Inverse,
    OrientationReading::ScalarFirst,
    OrientationReading::InverseScalarFirst,
];

/// Returns what a program records that means this.
fn recorded(pose: &Isometry3<f64>, reading: OrientationReading) -> Isometry3<f64> {
    let scalar_first = |rotation: UnitQuaternion<f64>| {
        let [x, y, z, w]: [f64; 4] = rotation.coords.into();
        UnitQuaternion::new_unchecked(Quaternion::new(z, w, x, y))
    };
    let rotation = match reading {
        OrientationReading::Inverse => return pose.inverse(),
        OrientationReading::ScalarFirst => scalar_first(pose.rotation),
        OrientationReading::InverseScalarFirst => scalar_first(pose.rotation.inverse()),
    };
    Isometry3::from_parts(pose.translation, rotation)
}

/// The wrenches on a sensor with an offset, at rest in random attitudes.
fn at_rest(count: usize, seed: u64) -> (Vec<Isometry3<f64>>, Vec<f64>) {
    let mut random = SmallRng::seed_from_u64(seed);
    let mut normal = || random.sample::<f64, _>(StandardNormal);
    let mass_kg = (0.5 * normal()).exp();
    let center = 0.05 * Vector3::new(normal(), normal(), normal());
    let noise = 0.05 * (0.5 * normal()).exp();
    let offset: [f64; 6] = std::array::from_fn(|k| [5.0, 0.2][k / 3] * normal());
    let (mut poses, mut wrenches) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let turn = Quaternion::new(normal(), normal(), normal(), normal());
        let turn = UnitQuaternion::from_quaternion(turn);
        let force = turn.inverse() * Vector3::new(0.0, 0.0, -9.81 * mass_kg);
        let moment = center.cross(&force);
        let exact = force.iter().chain(&moment).enumerate();
        wrenches.extend(
            exact.map(|(k, value)| value + offset[k] + noise * [1.0, 0.05][k / 3] * normal()),
        );
        poses.push(Isometry3::from_parts(Vector3::zeros().into(), turn));
    }
    (poses, wrenches)
}

/// Returns the findings of poses at rest that contradict.
fn contradictions(pose: &[Isometry3<f64>], wrench: &[f64]) -> Vec<Finding> {
    let arrays = Arrays {
        pose,
        wrench,
        ..Arrays::default()
    };
    let request = Request {
        wrench_acts_on: Some(ActsOn::Sensor),
        ..Request::default()
    };
    let mut findings = identify_poses(&arrays, &request)
        .unwrap()
        .recording
        .findings;
    findings.retain(|finding| {
        !matches!(
            finding,
            Finding::Data(Data::PosesAtRest(_) | Data::OutlyingPose(_))
        )
    });
    findings
}

#[test]
fn poses_at_rest_with_other_orientations_are_named_first() {
    for (seed, count) in [4, 5, 6, 8, 12, 20, 30]
        .into_iter()
        .cycle()
        .take(70)
        .enumerate()
    {
        let (poses, wrenches) = at_rest(count, seed as u64);
        for reading in READINGS {
            let given: Vec<_> = poses.iter().map(|pose| recorded(pose, reading)).collect();
            let found = contradictions(&given, &wrenches);
            let is_named = matches!(
                found.first(),
                Some(Finding::OrientationContradicted { reading: named, .. }) if *named == reading
            );
            assert!(
                is_named,
                "{count} poses, {reading:?}, seed {seed}: {found:?}"
            );
        }
    }
}

#[test]
fn moments_in_the_places_of_forces_are_named_first() {
    for (seed, count) in [4, 6, 12, 30].into_iter().enumerate() {
        let (poses, mut wrenches) = at_rest(count, seed as u64);
        for wrench in wrenches.chunks_exact_mut(6) {
            wrench.rotate_left(3);
        }
        let found = contradictions(&poses, &wrenches);
        let first = found.first();
        let is_named = matches!(first, Some(Finding::ForcesAndMomentsExchanged { .. }));
        assert!(is_named, "{count} poses: {found:?}");
    }
}

#[test]
fn forces_in_millinewtons_are_named_first() {
    let (poses, mut wrenches) = at_rest(8, 0);
    for value in &mut wrenches {
        *value *= 1e3;
    }
    let found = contradictions(&poses, &wrenches);
    assert!(
        matches!(found[..], [Finding::HeavyLoad { .. }]),
        "{found:?}"
    );
}

#[test]
fn sound_poses_have_no_other_reading() {
    for seed in 0..2000 {
        let (poses, wrenches) = at_rest(4 + seed as usize % 27, seed);
        let found = contradictions(&poses, &wrenches);
        let is_blamed = |finding: &Finding| {
            matches!(
                finding,
                Finding::OrientationContradicted { .. }
                    | Finding::ForcesAndMomentsExchanged { .. }
                    | Finding::HeavyLoad { .. }
            )
        };
        assert!(!found.iter().any(is_blamed), "seed {seed}: {found:?}");
    }
}

/// The motion of a sensor without a robot, whose poses alone are recorded.
#[test]
fn recorded_poses_with_other_orientations_are_named() {
    let (mut poses, mut times_s, mut wrench) = (Vec::new(), Vec::new(), Vec::new());
    let mut random = SmallRng::seed_from_u64(1);
    for k in 0..3000 {
        let time_s = 0.01 * f64::from(k);
        let angles = [0.7, 1.1, 0.5].map(|rate| 1.2 * (rate * time_s + rate).sin());
        let turn = UnitQuaternion::from_euler_angles(angles[0], angles[1], 2.0 * angles[2]);
        let force = turn.inverse() * Vector3::new(0.0, 0.0, -9.81 * 1.2);
        let moment = Vector3::new(0.01, -0.02, 0.05).cross(&force);
        let all = force.iter().chain(&moment);
        wrench.extend(all.map(|value| value + 0.01 * random.sample::<f64, _>(StandardNormal)));
        poses.push(Isometry3::from_parts(Vector3::zeros().into(), turn));
        times_s.push(time_s);
    }
    for reading in READINGS {
        let given: Vec<_> = poses.iter().map(|pose| recorded(pose, reading)).collect();
        let arrays = Arrays {
            time: &times_s,
            pose: &given,
            wrench: &wrench,
            ..Arrays::default()
        };
        let request = Request {
            wrench_acts_on: Some(ActsOn::Sensor),
            ..Request::default()
        };
        let found = identify_arrays(&arrays, &request, &mut |_| ControlFlow::Continue(()));
        let found = found
            .unwrap()
            .into_least_squares()
            .unwrap()
            .recording
            .findings;
        let is_named = |finding: &Finding| matches!(finding, Finding::OrientationContradicted { reading: named, .. } if *named == reading);
        assert!(found.iter().any(is_named), "{reading:?}: {found:?}");
    }
}
