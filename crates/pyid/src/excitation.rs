//! Design of motions. The package's `design_excitation` calls it.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tactid_dynamics::Manipulator;
use tactid_excitation::{
    Design, Motion, MotionPlan, MotionRequest, MotionWindows, Problem, Progress, design_observed,
    shortest,
};
use tactid_logs::messages::{Duration, JointTrajectory, JointTrajectoryPoint};
use tactid_logs::{Durability, LogError, LogWriter};
use tactid_recordings::DEFAULT_TIP;

use crate::arguments::read_robot;
use crate::arrays::{Series, common_length};
use crate::collision_model::collision_model;
use crate::errors::{IntoPyErr, detached};
use crate::interruption::InterruptionCheck;
use crate::motion::{DesignedMotion, MotionHistory};
use crate::options;
use crate::record::fields;

/// Number of beginnings of a motion for which intervals are predicted.
const BEGINNINGS: usize = 24;

/// Number of designs that the search for the shortest motion needs, about.
const DESIGNS_OF_SHORTEST: usize = 8;

/// Topic of a designed motion.
const TRAJECTORY_TOPIC: &str = "/joint_trajectory";

/// Name of the metadata of a designed motion.
const METADATA: &str = "tactid.motion";

/// Time of the message of a designed motion, ns. ROS takes a stamp of zero for a missing one.
const LOG_TIME_NS: u64 = 1_000_000_000;

/// Designs a motion: see :func:`tactid.design_excitation`. `given` are its own options, and
/// `read_mesh` reads a mesh.
#[pyfunction]
#[pyo3(signature = (robot, given, options, read_mesh, progress=None))]
pub(crate) fn design_excitation(
    py: Python<'_>,
    robot: &Bound<'_, PyAny>,
    given: &Bound<'_, PyDict>,
    options: &Bound<'_, PyDict>,
    read_mesh: Py<PyAny>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Py<PyDict>> {
    let robot = read_robot(robot)?;
    let mut plan = plan(&robot.get().robot, given, options)?;
    if plan.tests_collisions {
        plan.problem.collisions = Some(collision_model(&robot, &read_mesh)?);
    }
    let mut interruption = InterruptionCheck::new(progress);
    let result = detached(py, || {
        let design = designed(&plan, &mut interruption)?;
        let beginnings = beginnings(&plan.problem, &design)?;
        Ok((design, beginnings))
    })?;
    let result = result.map_err(|error: tactid_excitation::ExcitationError| error.into_py_err());
    let (design, beginnings) = interruption.finish(py, result)?;
    Ok(fields(py, &DesignedMotion::new(plan, design, beginnings)?)?.unbind())
}

/// Returns what is to be designed.
fn plan(
    robot: &Manipulator,
    given: &Bound<'_, PyDict>,
    options: &Bound<'_, PyDict>,
) -> PyResult<MotionPlan> {
    let motion: MotionRequest = options::read(given, MotionRequest::OPTIONS)?;
    let request = options::request(options)?;
    request.check().map_err(IntoPyErr::into_py_err)?;
    let tip = request.tip.as_deref().unwrap_or(DEFAULT_TIP);
    let equations = request.equation_settings(request.method.unwrap_or_default());
    let plan = motion.plan(robot, tip, equations);
    plan.map_err(IntoPyErr::into_py_err)
}

/// Designs the motion, of the given duration or the shortest.
fn designed(
    plan: &MotionPlan,
    interruption: &mut InterruptionCheck,
) -> Result<Design, tactid_excitation::ExcitationError> {
    let (problem, settings) = (&plan.problem, &plan.settings);
    let steps = 10 * settings.starts + settings.iterations + 20;
    let designs = plan.shortest.map_or(1, |_| DESIGNS_OF_SHORTEST);
    let mut done = 0;
    let mut observer = |_: &Progress| {
        done += 1;
        interruption.check((done as f64 / (steps * designs) as f64).min(0.99))
    };
    match &plan.shortest {
        Some(shortest_settings) => shortest(problem, shortest_settings, &mut observer),
        None => design_observed(problem, settings, &mut observer),
    }
}

/// Predicts the intervals after each of some beginnings of a motion; NaN where one does not
/// determine every value.
fn beginnings(
    problem: &Problem,
    design: &Design,
) -> Result<MotionHistory, tactid_excitation::ExcitationError> {
    let windows = MotionWindows::new(problem, &design.trajectory)?;
    let mut found = MotionHistory::default();
    for k in 1..=BEGINNINGS {
        let until_s = design.trajectory.duration_s() * k as f64 / BEGINNINGS as f64;
        // A short beginning does not determine all values.
        let prediction = windows.prediction(until_s);
        found.times_s.push(until_s);
        found
            .std_devs
            .push(prediction.map_or([f64::NAN; 10], |found| found.std_devs));
        let attitude_rad = design.base_path.excursion(until_s).attitude_rad;
        found.base_attitude_deg.push(attitude_rad.to_degrees());
    }
    Ok(found)
}

/// Writes a motion as a log with one `trajectory_msgs/msg/JointTrajectory`: see
/// :meth:`tactid.DesignedMotion.write`.
///
/// Args: path: The ``.mcap`` file to write. joints: Names of the joints. time: Times since the
/// start of the motion, (N,), s. q: Positions, (N, n); ``qd`` and ``qdd`` likewise. metadata: What
/// the log says of the motion, by keys: an MCAP metadata record named ``tactid.motion``.
///
/// Raises:
///     LogError: The file cannot be written.
///     ArgumentError: A shape does not fit.
#[pyfunction]
#[pyo3(signature = (path, *, joints, time, q, qd, qdd, metadata))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn write_trajectory(
    py: Python<'_>,
    path: PathBuf,
    joints: Vec<String>,
    time: &Bound<'_, PyAny>,
    q: &Bound<'_, PyAny>,
    qd: &Bound<'_, PyAny>,
    qdd: &Bound<'_, PyAny>,
    metadata: BTreeMap<String, String>,
) -> PyResult<()> {
    let time = Series::read(time, "time", &[])?;
    let q = Series::read(q, "q", &[joints.len()])?;
    let qd = Series::read(qd, "qd", &[joints.len()])?;
    let qdd = Series::read(qdd, "qdd", &[joints.len()])?;
    let count = common_length(&[&time, &q, &qd, &qdd])?.unwrap_or(1);
    let point = |k| JointTrajectoryPoint {
        positions: q.at(k).to_vec(),
        velocities: qd.at(k).to_vec(),
        accelerations: qdd.at(k).to_vec(),
        effort: Vec::new(),
        time_from_start: Duration::from_ns((time.at(k)[0] * 1e9).round() as u64),
    };
    // A stamp of zero starts the motion as soon as it arrives at a controller.
    let message = JointTrajectory {
        points: (0..count).map(point).collect(),
        joint_names: joints,
        ..JointTrajectory::default()
    };
    let write = || {
        let mut log = LogWriter::create(&path)?;
        let channel = log.channel::<JointTrajectory>(TRAJECTORY_TOPIC, Durability::Volatile)?;
        log.write(&channel, LOG_TIME_NS, &message)?;
        log.metadata(METADATA, metadata)?;
        log.finish()?;
        Ok::<_, LogError>(())
    };
    detached(py, write)?.map_err(IntoPyErr::into_py_err)
}
