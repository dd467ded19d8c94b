//! An arm that holds still: gravity determines the mass, and the noise of the joints determines nothing.

#![allow(clippy::unwrap_used)]

#[allow(dead_code, reason = "each test file uses a part of what is shared")]
#[path = "common/arm.rs"]
mod arm;

use arm::{JOINTS, TOOL, arm};
use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, Workspace, Wrench, motion,
    wrench_regressor,
};
use tactid_identify::{
    BaseState, BatchIdentifier, BatchResult, BatchSettings, EquationSettings, HALF_WIDTH_95, Sample,
};

const MASS_KG: f64 = 2.0;
const RATE_HZ: f64 = 500.0;

fn draw(random: &mut SmallRng, std_dev: f64) -> f64 {
    let normal: f64 = random.sample(StandardNormal);
    std_dev * normal
}

/// Identifies a payload in a random posture, with white noise of the positions, rad, and velocities, rad/s, of the joints and of
/// the wrench.
fn identify(seed: u64, duration_s: f64, [of_position, of_velocity]: [f64; 2]) -> BatchResult {
    let mut random = SmallRng::seed_from_u64(seed);
    let robot = arm(BaseKind::Fixed);
    let posture: [f64; JOINTS] = std::array::from_fn(|_| random.random_range(-1.5..1.5));
    let mut workspace = Workspace::new(&robot);
    let base = FrameMotion::at_rest(Isometry3::identity());
    let still = JointMotion {
        position: &posture,
        velocity: &[0.0; JOINTS],
        acceleration: &[0.0; JOINTS],
    };
    motion(&mut workspace, &base, still).unwrap();
    let tool = robot.frame(TOOL).unwrap();
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let regressor = wrench_regressor(&workspace.frame_motion(tool).in_frame(&gravity));
    let payload = InertialParameters::from(arm::body(MASS_KG, [0.02, 0.01, 0.08], [0.1; 3]));
    let load = regressor * payload.as_vector();
    let settings = EquationSettings::default();
    let batch = BatchSettings::default();
    let mut batch = BatchIdentifier::new(&robot, TOOL, &[TOOL], settings, batch).unwrap();
    for k in 0..(duration_s * RATE_HZ) as usize {
        let position = posture.map(|position| position + draw(&mut random, of_position));
        let velocity = [0.0; JOINTS].map(|_: f64| draw(&mut random, of_velocity));
        let noise = [0.05, 0.005].map(|size| Vector3::from_fn(|_, _| draw(&mut random, size)));
        let wrench = Wrench {
            force: load.fixed_rows::<3>(0) + noise[0],
            moment: load.fixed_rows::<3>(3) + noise[1],
        };
        let sample = Sample {
            time_s: k as f64 / RATE_HZ,
            base: BaseState::fixed(),
            joint_position: &position,
            joint_velocity: &velocity,
            joint_effort: &[],
            wrenches: &[wrench],
        };
        batch.push(&sample).unwrap();
    }
    batch.solve().unwrap()
}

/// Noise of the joints, from rounding to that of a coarse encoder, leaves the mass as gravity shows it, and contradicts nothing.
#[test]
fn noise_of_the_joints_does_not_move_the_mass() {
    let fine = [
        [0.0, 0.0],
        [0.0, 1e-13],
        [1e-9, 1e-9],
        [1e-6, 1e-6],
        [1e-5, 1e-3],
    ];
    for duration_s in [2.0, 10.0] {
        for noise in fine {
            check(noise, duration_s, 1e-3);
        }
    }
    check([1e-4, 1e-2], 10.0, 3e-3);
}

/// Asserts that the mass of ten postures is within its interval, of no more than this half width in kg, without any finding.
fn check(noise: [f64; 2], duration_s: f64, widest_kg: f64) {
    for seed in 0..10 {
        let result = identify(seed, duration_s, noise);
        let about = format!("{noise:?}, {duration_s} s, {seed}: {result:?}");
        let mass_kg = result.estimate.values()[0];
        let half_width = HALF_WIDTH_95 * result.estimate.std_devs.unwrap()[0];
        assert!((mass_kg - MASS_KG).abs() < 2.0 * half_width, "{about}");
        assert!(half_width < widest_kg, "{about}");
        assert!(result.findings.is_empty(), "{about}");
    }
}
