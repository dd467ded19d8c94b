//! Poses at rest of a sensor without a robot.

#![allow(dead_code)]

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{BatchResult, Finding, Hypothesis, RestIdentifier, RestingPoses};
use tactid_dynamics::Manipulator;
use tactid_identify::{BaseState, EquationSettings, IdentifyError, Sample, Unknowns, Wrench};

pub(crate) const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);
pub(crate) const MASS_KG: f64 = 1.2;
pub(crate) const CENTER: Vector3<f64> = Vector3::new(0.001, -0.002, 0.045);
pub(crate) const OFFSET: [f64; 6] = [-3.4, -4.7, -16.7, 0.005, -0.06, 0.005];
/// Noise of a force, N, and of a moment, N m.
pub(crate) const NOISE: [f64; 2] = [0.05, 0.002];

/// The sensor carries the payload on its own, or stands 0.1 m below the tip and is turned about its
/// z axis.
pub(crate) fn sensor_below_the_tip() -> Manipulator {
    let urdf = r#"<robot name="probe"><link name="base"/><link name="sensor"/><link name="tip"/>
      <joint name="mount" type="fixed"><parent link="base"/><child link="sensor"/></joint>
      <joint name="plate" type="fixed"><parent link="sensor"/><child link="tip"/>
        <origin xyz="0 0.02 0.1" rpy="0 0 0.5"/></joint></robot>"#;
    Manipulator::from_urdf(urdf, tactid_identify::BaseKind::Floating).unwrap()
}

pub(crate) fn attitude(random: &mut SmallRng) -> UnitQuaternion<f64> {
    let [w, i, j, k] = std::array::from_fn(|_| random.sample(StandardNormal));
    UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k))
}

pub(crate) fn wrench(attitude: &UnitQuaternion<f64>, noise: &mut dyn FnMut() -> f64) -> Wrench {
    let force = attitude.inverse() * (-MASS_KG * GRAVITY);
    let moment = CENTER.cross(&force);
    let [x, y, z, a, b, c] = OFFSET;
    let mut noisy = |size: f64| Vector3::from_fn(|_, _| size * noise());
    Wrench {
        force: force + Vector3::new(x, y, z) + noisy(NOISE[0]),
        moment: moment + Vector3::new(a, b, c) + noisy(NOISE[1]),
    }
}

pub(crate) fn settings(wrench_offset: bool) -> EquationSettings {
    EquationSettings {
        gravity: Some(GRAVITY),
        wrench_offset,
        ..EquationSettings::default()
    }
}

pub(crate) fn identify(
    samples: &[(UnitQuaternion<f64>, Wrench)],
) -> Result<BatchResult, IdentifyError> {
    identify_with(samples, &settings(true))
}

pub(crate) fn identify_with(
    samples: &[(UnitQuaternion<f64>, Wrench)],
    settings: &EquationSettings,
) -> Result<BatchResult, IdentifyError> {
    let robot = Manipulator::lone_body("sensor");
    let identifier = RestIdentifier::new(&robot, "sensor", &["sensor"], settings, None);
    solve(identifier?, samples)
}

/// Gravity in the world of the poses is along `down`, and its direction is unknown.
pub(crate) fn unknown_gravity(down: Vector3<f64>) -> EquationSettings {
    EquationSettings {
        gravity: Some(down),
        unknowns: Unknowns {
            gravity: true,
            weight: false,
        },
        ..settings(true)
    }
}

pub(crate) fn solve(
    mut identifier: RestIdentifier,
    samples: &[(UnitQuaternion<f64>, Wrench)],
) -> Result<BatchResult, IdentifyError> {
    for (attitude, wrench) in samples {
        let pose = Isometry3::from_parts(Vector3::new(0.4, 0.0, 0.5).into(), *attitude);
        identifier.push(&Sample {
            time_s: 0.0,
            base: BaseState {
                pose,
                ..BaseState::fixed()
            },
            joint_position: &[],
            joint_velocity: &[],
            joint_effort: &[],
            wrenches: &[*wrench],
        })?;
    }
    identifier.solve()
}

pub(crate) fn poses(count: usize, random: &mut SmallRng) -> Vec<(UnitQuaternion<f64>, Wrench)> {
    let attitudes: Vec<_> = (0..count).map(|_| attitude(random)).collect();
    let mut noise = || random.sample(StandardNormal);
    let measured = attitudes.iter().map(|each| wrench(each, &mut noise));
    attitudes.iter().copied().zip(measured).collect()
}

pub(crate) fn about(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * angle)
}

pub(crate) fn exact(attitudes: &[UnitQuaternion<f64>]) -> Vec<(UnitQuaternion<f64>, Wrench)> {
    let measured = attitudes.iter().map(|each| wrench(each, &mut || 0.0));
    attitudes.iter().copied().zip(measured).collect()
}

pub(crate) fn resting(result: &BatchResult) -> &RestingPoses {
    let found = result.findings.iter().find_map(|finding| match finding {
        Finding::PosesAtRest(found) => Some(found),
        _ => None,
    });
    found.unwrap()
}

/// Returns the causes that a result names, the first one first.
pub(crate) fn causes(result: &BatchResult) -> Vec<Hypothesis> {
    let of_finding = |finding: &Finding| match finding {
        Finding::WrongAssumption(found) => Some(found.cause),
        _ => None,
    };
    result.findings.iter().filter_map(of_finding).collect()
}

/// Counts the intervals that contain the truth: four values of the payload, then six of the offset.
pub(crate) fn count_inside(result: &BatchResult, inside: &mut [usize]) {
    let truth = [MASS_KG, CENTER.x, CENTER.y, CENTER.z];
    for (k, truth) in truth.into_iter().enumerate() {
        let [low, high] = result.estimate.intervals[k];
        inside[k] += usize::from((low..high).contains(&truth));
    }
    let offset = result.fit.wrench_offset.as_ref().unwrap();
    let std_devs = offset.std_devs.unwrap();
    for k in 0..6 {
        let error = offset.values()[k] - OFFSET[k];
        inside[4 + k] += usize::from(error.abs() < 1.96 * std_devs[k]);
    }
}

/// Checks that 93 to 97 % of the intervals of each quantity contain the truth.
pub(crate) fn check_coverage(inside: &[usize], draws: usize) {
    for count in inside {
        assert!(
            (0.93..=0.97).contains(&(*count as f64 / draws as f64)),
            "{inside:?}"
        );
    }
}
