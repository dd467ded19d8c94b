//! Many states at once give what each gives alone, on the widest vector unit and on the baseline.

use crate::common::{self, State, assert_close, rng, robots, six, vector};
use nalgebra::{DVector, SMatrix, Vector3, Vector6};
use tactid_dynamics::{
    BatchDynamics, FrameMotion, JointMotion, Manipulator, StateError, StateSeries, VectorUnit,
    Workspace, inverse_dynamics, wrench_regressor,
};

const UNITS: [VectorUnit; 2] = [VectorUnit::Widest, VectorUnit::Baseline];

/// States in the layout of a series.
struct Series {
    bases: Vec<FrameMotion>,
    joints: [Vec<f64>; 3],
}

impl Series {
    fn new(states: &[State]) -> Self {
        let joined = |of: fn(&State) -> &Vec<f64>| states.iter().flat_map(of).copied().collect();
        Self {
            bases: states.iter().map(|state| state.base).collect(),
            joints: [
                joined(|state| &state.position),
                joined(|state| &state.velocity),
                joined(|state| &state.acceleration),
            ],
        }
    }

    fn states(&self) -> StateSeries<'_> {
        let [position, velocity, acceleration] = &self.joints;
        StateSeries {
            base: &self.bases,
            joints: JointMotion {
                position,
                velocity,
                acceleration,
            },
        }
    }
}

/// Checks a series of each robot against the states one by one.
fn check(robot: &Manipulator, states: &[State], series: &StateSeries<'_>, gravity: &Vector3<f64>) {
    let (dof, count) = (robot.dof(), states.len());
    let frame = robot.frame(robot.frame_names().last().unwrap()).unwrap();
    for unit in UNITS {
        let workspace = BatchDynamics::new(robot).with_unit(unit);
        let (mut torques, mut wrenches) = (vec![f64::NAN; dof * count], vec![[f64::NAN; 6]; count]);
        let mut regressors = vec![SMatrix::<f64, 6, 10>::zeros(); count];
        workspace
            .inverse_dynamics(series, gravity, &mut torques, &mut wrenches)
            .unwrap();
        workspace
            .wrench_regressors(frame, series, gravity, &mut regressors)
            .unwrap();
        let mut alone = Workspace::new(robot);
        for (k, state) in states.iter().enumerate() {
            inverse_dynamics(&mut alone, &state.base, state.joints(), gravity).unwrap();
            let given = DVector::from_column_slice(&torques[k * dof..(k + 1) * dof]);
            let expected = DVector::from_column_slice(alone.joint_torques().unwrap());
            assert!(
                (given - &expected).norm() <= 1e-12 * (1.0 + expected.norm()),
                "{unit:?}"
            );
            let expected = six(alone.base_wrench().unwrap());
            assert_close(&Vector6::from(wrenches[k]), &expected, 1e-12, "base wrench");
            let expected = wrench_regressor(&alone.tool_motion(frame, gravity));
            assert_close(&regressors[k], &expected, 1e-12, "regressor");
        }
    }
}

/// Any count of states, also one that does not fill the lanes, gives the results of single states.
#[test]
fn series_equal_their_states() {
    let rng = &mut rng(1);
    for (robot, count) in robots()
        .iter()
        .flat_map(|robot| [0, 1, 3, 4, 5, 8, 9, 23].map(|count| (robot, count)))
    {
        let mut states: Vec<_> = (0..count)
            .map(|_| State::random(rng, robot.dof()))
            .collect();
        for state in &mut states {
            state.position[0] *= 1e7; // beyond what the lanes reduce themselves
        }
        let gravity = vector(rng, 10.0);
        check(robot, &states, &Series::new(&states).states(), &gravity);
    }
}

/// An entry that is given once holds for all states.
#[test]
fn one_entry_holds_for_all_states() {
    let rng = &mut rng(2);
    for robot in robots() {
        let first = State::random(rng, robot.dof());
        let mut states: Vec<_> = (0..6).map(|_| first.clone()).collect();
        for state in &mut states {
            state.position = common::numbers(rng, robot.dof(), 2.0);
        }
        let all = Series::new(&states);
        let (one, gravity) = (Series::new(&[first]), vector(rng, 10.0));
        let mut series = one.states();
        series.joints.position = &all.joints[0];
        check(&robot, &states, &series, &gravity);
    }
}

/// A length that fits neither one state nor all is refused, with its name.
#[test]
fn wrong_lengths_are_refused() {
    let robot = common::tactid();
    let dof = robot.dof();
    let states: Vec<_> = (0..3).map(|_| State::random(&mut rng(3), dof)).collect();
    let series = Series::new(&states);
    let workspace = BatchDynamics::new(&robot);
    let refused = |states: &StateSeries<'_>, torques: usize| {
        let mut torques = vec![0.0; torques];
        let gravity = Vector3::zeros();
        workspace
            .inverse_dynamics(states, &gravity, &mut torques, &mut [[0.0; 6]; 3])
            .unwrap_err()
    };
    let mut short = series.states();
    short.joints.velocity = &series.joints[1][1..];
    let mut few_bases = series.states();
    few_bases.base = &series.bases[1..];
    let (given, each, count) = (3 * dof - 1, dof, 3);
    let cases = [
        (
            refused(&short, 3 * dof),
            StateError::Series {
                what: "velocity",
                given,
                each,
                count,
            },
        ),
        (
            refused(&few_bases, 3 * dof),
            StateError::Series {
                what: "the base",
                given: 2,
                each: 1,
                count,
            },
        ),
        (
            refused(&series.states(), 1),
            StateError::Series {
                what: "the torques",
                given: 1,
                each,
                count,
            },
        ),
    ];
    for (given, expected) in cases {
        assert_eq!(given, expected);
    }
}
