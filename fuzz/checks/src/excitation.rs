//! Designs motions from any request with the least number of steps: one error, or a motion within
//! the limits of its joints.

use crate::{Number, base_kind, numbers, parsed, robot};
use arbitrary::Arbitrary;
use tactid_dynamics::InertialParameters;
use tactid_excitation::{Design, DesignSettings, JointLimits, Motion, Problem, Sensing, design};
use tactid_identify::EquationSettings;

/// Number of times at which a motion is compared with its limits.
const SAMPLES: u16 = 300;

/// Rounding of the motion, as a fraction of a limit.
const TOLERANCE: f64 = 1e-6;

#[derive(Arbitrary, Debug)]
struct Input {
    floating: bool,
    start: [Number; 2],
    limits: Vec<[Number; 5]>,
    rate_hz: Number,
    duration_s: Number,
    noise: [Number; 6],
    cutoff_hz: Number,
    payload: [Number; 10],
    targets: [Number; 10],
    joints: Vec<u8>,
    wrench: Option<[Number; 6]>,
    attitude: Option<Number>,
    position: Option<Number>,
}

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold.
pub fn run(bytes: &[u8]) {
    let Some(input) = parsed::<Input>(bytes) else {
        return;
    };
    let base = base_kind(input.floating);
    let limit = |all: &[Number; 5]| JointLimits {
        position: (all[0].0, all[1].0),
        velocity: all[2].0,
        acceleration: all[3].0,
        effort: all[4].0,
    };
    let sensing = Sensing {
        sensors: vec!["tool0".to_owned()],
        equations: EquationSettings {
            wrench_noise: vec![input.noise.map(|number| number.0)],
            cutoff_hz: input.cutoff_hz.0,
            ..EquationSettings::default()
        },
        rate_hz: input.rate_hz.0,
        base_noise: None,
    };
    let payload = InertialParameters::from_vector(input.payload.map(|number| number.0).into());
    let mut problem = Problem::new(
        robot(base).clone(),
        "tool0",
        &numbers(&input.start),
        input.limits.iter().map(limit).collect(),
        sensing,
        payload,
        input.targets.map(|number| number.0),
    );
    problem.duration_s = input.duration_s.0;
    problem.joints = input
        .joints
        .iter()
        .map(|&joint| usize::from(joint))
        .collect();
    problem.wrench = input.wrench.map(|all| all.map(|number| number.0));
    problem.base.attitude_rad = input.attitude.map(|number| number.0);
    problem.base.position_m = input.position.map(|number| number.0);
    let settings = DesignSettings {
        starts: 1,
        iterations: 1,
        ..DesignSettings::default()
    };
    if let Ok(found) = design(&problem, &settings) {
        check(&problem, &found);
    }
}

/// Asserts that the motion is finite and within the limits of the joints at any time, and that no
/// predicted interval is NaN.
fn check(problem: &Problem, found: &Design) {
    let (_, ratio) = found.prediction.largest();
    assert!(!ratio.is_nan(), "a ratio that is no number");
    let duration_s = found.trajectory.duration_s();
    for sample in 0..=SAMPLES {
        let time_s = duration_s * f64::from(sample) / f64::from(SAMPLES);
        let states = found.trajectory.at(time_s);
        for (joint, limits) in problem.limits.iter().enumerate() {
            let (q, qd, qdd) = (
                states.position[joint],
                states.velocity[joint],
                states.acceleration[joint],
            );
            let (low, high) = limits.position;
            let range = TOLERANCE * (high - low);
            assert!(
                q >= low - range && q <= high + range,
                "{q} in {low} to {high}"
            );
            let most = 1.0 + TOLERANCE;
            assert!(
                qd.abs() <= most * limits.velocity,
                "{qd} of {}",
                limits.velocity
            );
            assert!(
                qdd.abs() <= most * limits.acceleration,
                "{qdd} of {}",
                limits.acceleration
            );
        }
    }
}
