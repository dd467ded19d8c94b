//! A designed motion as `tactid.DesignedMotion` has it.

use pyo3::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use tactid_batch::Table;
use tactid_dynamics::BaseKind;
use tactid_excitation::{Design, Margin, Motion, MotionPlan};
use tactid_identify::Method;
use tactid_identify::serial::TenValues;

use crate::collision_model::{FindingData, finding};
use crate::errors::IntoPyErr;

/// What the motion up to each of K times determines, and where the base has been.
#[derive(Default, Serialize, JsonSchema)]
pub(crate) struct MotionHistory {
    /// Times since the start, s, (K,).
    pub(crate) times_s: Vec<f64>,
    /// Predicted standard deviations of the ten values, kg, m and kg m², (K, 10); unknown where the
    /// motion up to there does not determine every value.
    pub(crate) std_devs: Vec<[f64; 10]>,
    /// Largest angle by which the base has turned until these times, degrees, (K,).
    pub(crate) base_attitude_deg: Vec<f64>,
}

/// A motion of all n joints of a robot, at N times: what it will determine, and how much of its
/// limits it uses.
#[derive(Serialize, JsonSchema)]
pub(crate) struct DesignedMotion {
    /// Link in whose frame the payload is described.
    tip: String,
    /// Method that the payload is to be identified by.
    method: Method,
    /// Names of all joints, in the robot's order.
    joints: Vec<String>,
    /// Names of the joints that move, in the robot's order.
    moving_joints: Vec<String>,
    /// Duration, s.
    duration_s: f64,
    /// Seed of the search.
    seed: u64,
    /// Times since the start, s, (N,); the last is the end of the motion.
    #[schemars(extend("kept" = "memory"))]
    times_s: Vec<f64>,
    /// Positions, rad or m, (N, n).
    #[schemars(extend("kept" = "memory"))]
    q: Table,
    /// Velocities, rad/s or m/s, (N, n).
    #[schemars(extend("kept" = "memory"))]
    qd: Table,
    /// Accelerations, rad/s² or m/s², (N, n).
    #[schemars(extend("kept" = "memory"))]
    qdd: Table,
    /// The ten values of the payload that the intervals are predicted for, (10,).
    #[schemars(with = "TenValues<f64>")]
    expected_payload: [f64; 10],
    /// Predicted standard deviation of each of the ten values, (10,).
    #[schemars(with = "TenValues<f64>")]
    predicted_std_devs: [f64; 10],
    /// Target for half of each 95 % interval, as a fraction of the largest value of its kind,
    /// without a unit.
    within: f64,
    /// Half of each predicted 95 % interval over its target, without a unit, (10,).
    #[schemars(with = "TenValues<f64>")]
    interval_ratios: [f64; 10],
    /// Options whose noise was not given, so that a default stands for it.
    assumed_noise: Vec<&'static str>,
    /// Largest angle by which the base turns with the expected payload, degrees; `None` where it is
    /// fixed.
    base_attitude_deg: Option<f64>,
    /// Largest distance by which the origin of the base moves with the expected payload, m; `None`
    /// where it is fixed.
    base_position_m: Option<f64>,
    /// How much of each limit is used, by the payload that uses most.
    margins: Vec<Margin>,
    /// The limits that bind: relaxing one allows smaller intervals.
    binding_constraints: Vec<String>,
    /// What the test for collisions leaves out; `None` where collisions of the robot were not
    /// tested.
    collision_findings: Option<Vec<FindingData>>,
    /// Whether the box of the payload was given, so that its collisions were tested.
    payload_tested: bool,
    /// The boxes around the robot that were given, such as `the workspace` and `the keep-out box
    /// table`; empty where nothing around the robot was tested.
    surroundings: Vec<String>,
    /// What the motion up to some times determines.
    history: MotionHistory,
}

impl DesignedMotion {
    pub(crate) fn new(plan: MotionPlan, design: Design, history: MotionHistory) -> PyResult<Self> {
        let problem = &plan.problem;
        let (duration_s, robot) = (design.trajectory.duration_s(), &problem.robot);
        let joints: Vec<String> = robot
            .joint_names()
            .iter()
            .map(ToString::to_string)
            .collect();
        let moving = problem.moving_joints().map_err(IntoPyErr::into_py_err)?;
        let (times_s, [q, qd, qdd]) = states(&design, plan.rate_hz, joints.len());
        let floats = robot.base_kind() == BaseKind::Floating;
        let excursion = design.excursion();
        let is_tested = problem.collisions.is_some();
        Ok(Self {
            tip: problem.tool.clone(),
            method: problem.sensing.equations.method,
            moving_joints: moving.iter().map(|&joint| joints[joint].clone()).collect(),
            joints,
            duration_s,
            seed: plan.settings.seed,
            times_s,
            q,
            qd,
            qdd,
            expected_payload: plan.expected_payload,
            predicted_std_devs: design.prediction.std_devs,
            within: plan.within,
            interval_ratios: design.prediction.ratios,
            assumed_noise: plan.assumed_noise,
            base_attitude_deg: floats.then(|| excursion.attitude_rad.to_degrees()),
            base_position_m: floats.then_some(excursion.position_m),
            binding_constraints: design.binding().map(ToString::to_string).collect(),
            collision_findings: is_tested.then(|| design.findings.iter().map(finding).collect()),
            payload_tested: problem.payload_box.is_some(),
            surroundings: plan.surroundings,
            margins: design.margins,
            history,
        })
    }
}

/// Returns times, and positions, velocities and accelerations at them; the last is the end of the
/// motion, at rest.
fn states(design: &Design, rate_hz: f64, dof: usize) -> (Vec<f64>, [Table; 3]) {
    let duration_s = design.trajectory.duration_s();
    let mut times_s = Vec::new();
    let mut of_joints = [Vec::new(), Vec::new(), Vec::new()];
    for k in 0..=(duration_s * rate_hz).ceil() as usize {
        let time_s = (k as f64 / rate_hz).min(duration_s);
        let states = design.trajectory.at(time_s);
        times_s.push(time_s);
        let each = [states.position, states.velocity, states.acceleration];
        for (all, one) in of_joints.iter_mut().zip(each) {
            all.extend(one);
        }
    }
    let table = |values| Table {
        columns: dof,
        values,
    };
    (times_s, of_joints.map(table))
}
