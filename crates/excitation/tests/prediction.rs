//! Predicted covariances against identifications from noisy samples.

use nalgebra::Isometry3;
use rand::{SeedableRng, rngs::StdRng};
use rand_distr::{Distribution, StandardNormal};
use tactid_batch::{BatchIdentifier, BatchSettings};
use tactid_dynamics::{FrameMotion, Workspace, motion, wrench_regressor};
use tactid_excitation::{
    Design, DesignSettings, JointStates, Motion, MotionWindows, Problem, design, margins, predict,
};
use tactid_identify::{BaseState, Sample, Wrench, values_of_body};

use crate::common::{NOISE, TOOL, in_orbit, on_ground};

const RUNS: usize = 400;

/// Settings of a design that need not be good.
fn quick() -> DesignSettings {
    DesignSettings {
        starts: 1,
        iterations: 10,
        ..DesignSettings::default()
    }
}

/// A sample of the motion without noise.
struct Exact {
    time_s: f64,
    position: Vec<f64>,
    velocity: Vec<f64>,
    wrench: Wrench,
}

/// Returns a problem of a short motion.
fn short() -> Problem {
    let mut problem = on_ground();
    problem.duration_s = 2.0;
    problem
}

fn exact(problem: &Problem, design: &Design, offset: &Wrench) -> Vec<Exact> {
    let tool = problem.robot.frame(TOOL).unwrap();
    let mut workspace = Workspace::new(&problem.robot);
    let gravity = problem.robot.base_kind().default_gravity();
    let base = FrameMotion::at_rest(Isometry3::identity());
    let count = (problem.duration_s * problem.sensing.rate_hz) as usize;
    let sample = |k: usize| {
        let time_s = k as f64 / problem.sensing.rate_hz;
        let states = design.trajectory.at(time_s);
        motion(&mut workspace, &base, states.joints()).unwrap();
        let regressor = wrench_regressor(&workspace.tool_motion(tool, &gravity));
        let wrench = regressor * problem.payloads[0].as_vector();
        let wrench = Wrench {
            force: wrench.fixed_rows::<3>(0).into(),
            moment: wrench.fixed_rows::<3>(3).into(),
        };
        Exact {
            time_s,
            position: states.position,
            velocity: states.velocity,
            wrench: wrench + *offset,
        }
    };
    (0..=count).map(sample).collect()
}

/// Returns the root mean square error of each of the ten values over many identifications, in units
/// of its predicted standard deviation.
fn achieved(problem: &Problem, design: &Design, offset: Wrench) -> [f64; 10] {
    let samples = exact(problem, design, &offset);
    let truth = values_of_body(&problem.payloads[0].mass_properties().unwrap());
    let mut random = StdRng::seed_from_u64(3);
    let mut squares = [0.0; 10];
    for _ in 0..RUNS {
        let mut identifier = BatchIdentifier::new(
            &problem.robot,
            TOOL,
            &[TOOL],
            problem.sensing.equations.clone(),
            BatchSettings::default(),
        )
        .unwrap();
        for sample in &samples {
            let mut noise = NOISE.map(|s| -> f64 {
                let normal: f64 = StandardNormal.sample(&mut random);
                s * normal
            });
            noise
                .iter_mut()
                .zip(sample.wrench.force.iter().chain(&sample.wrench.moment))
                .for_each(|(noise, exact)| *noise += exact);
            let wrench = Wrench {
                force: [noise[0], noise[1], noise[2]].into(),
                moment: [noise[3], noise[4], noise[5]].into(),
            };
            identifier
                .push(&Sample {
                    time_s: sample.time_s,
                    base: BaseState::fixed(),
                    joint_position: &sample.position,
                    joint_velocity: &sample.velocity,
                    joint_effort: &[],
                    wrenches: &[wrench],
                })
                .unwrap();
        }
        let estimate = identifier.solve().unwrap().estimate;
        let pairs = estimate.values().into_iter().zip(truth);
        for (square, (value, truth)) in squares.iter_mut().zip(pairs) {
            *square += (value - truth).powi(2) / RUNS as f64;
        }
    }
    std::array::from_fn(|k| squares[k].sqrt() / design.prediction.std_devs[k])
}

/// Over 400 noisy recordings of a designed motion, the error of each value is as predicted.
#[test]
fn errors_are_as_predicted() {
    let problem = short();
    let design = design(&problem, &quick()).unwrap();
    let achieved = achieved(&problem, &design, Wrench::zero());
    assert!(
        achieved.iter().all(|r| (0.9..1.12).contains(r)),
        "{achieved:?}"
    );
}

/// The same holds where the sensors have an unknown offset, which costs information.
#[test]
fn errors_with_an_unknown_offset_are_as_predicted() {
    let mut problem = short();
    problem.sensing.equations.wrench_offset = true;
    let with_offset = design(&problem, &quick()).unwrap();
    let offset = Wrench {
        force: [3.0, -2.0, 1.0].into(),
        moment: [0.2, 0.1, -0.3].into(),
    };
    let achieved = achieved(&problem, &with_offset, offset);
    assert!(
        achieved.iter().all(|r| (0.9..1.12).contains(r)),
        "{achieved:?}"
    );
    problem.sensing.equations.wrench_offset = false;
    let tared = predict(&problem, &with_offset.trajectory).unwrap();
    let pairs = tared.std_devs.iter().zip(&with_offset.prediction.std_devs);
    assert!(pairs.clone().all(|(a, b)| a < b), "{tared:?}");
}

/// A motion that ends earlier than another one.
struct Beginning<'a> {
    motion: &'a dyn Motion,
    duration_s: f64,
}

impl Motion for Beginning<'_> {
    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn at(&self, time_s: f64) -> JointStates {
        self.motion.at(time_s)
    }
}

/// What is predicted for a beginning of a motion is what is predicted for a motion that ends there,
/// and the base has gone as far until then.
#[test]
fn beginnings_are_motions_of_their_own() {
    let mut problem = in_orbit();
    problem.sensing.equations.wrench_offset = true;
    let design = design(&problem, &quick()).unwrap();
    let motion = &design.trajectory;
    let windows = MotionWindows::new(&problem, motion).unwrap();
    assert!(windows.prediction(0.1).is_err());
    for fraction in [0.5, 0.77, 1.0] {
        let beginning = Beginning {
            motion,
            duration_s: fraction * motion.duration_s(),
        };
        let alone = predict(&problem, &beginning).unwrap();
        let found = windows.prediction(beginning.duration_s).unwrap();
        assert_eq!(found, alone);
        let (_, expected) = margins(&problem, &beginning).unwrap();
        let found = design.base_path.excursion(beginning.duration_s);
        let error = found.attitude_rad - expected.attitude_rad;
        assert!(
            error.abs() < 1e-3 * expected.attitude_rad,
            "{found:?} {expected:?}"
        );
    }
}

/// Twice the samples per second halve the variances.
#[test]
fn variances_fall_with_the_rate() {
    let mut problem = on_ground();
    let trajectory = design(&problem, &quick()).unwrap().trajectory;
    let slow = predict(&problem, &trajectory).unwrap();
    problem.sensing.rate_hz *= 2.0;
    let fast = predict(&problem, &trajectory).unwrap();
    for (slow, fast) in slow.std_devs.iter().zip(&fast.std_devs) {
        assert!((slow / fast - 2f64.sqrt()).abs() < 0.03, "{slow} {fast}");
    }
}
