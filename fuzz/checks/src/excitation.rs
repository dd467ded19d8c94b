//! Designs motions from any request with the least number of steps: one error, or a motion with finite states.

use crate::{Number, numbers, parsed, robot};
use arbitrary::Arbitrary;
use tactid_dynamics::{BaseKind, InertialParameters};
use tactid_excitation::{DesignSettings, JointLimits, Problem, Sensing, design};
use tactid_identify::EquationSettings;

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
    let base = if input.floating {
        BaseKind::Floating
    } else {
        BaseKind::Fixed
    };
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
        let (_, ratio) = found.prediction.largest();
        assert!(!ratio.is_nan(), "a ratio that is no number");
    }
}
