//! Design of motions. The package's `design_excitation` calls it.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;

use nalgebra::{Point3, Unit, Vector3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tactid_dynamics::{InertialParameters, JointKind};
use tactid_excitation::{
    BaseBounds, Criterion, Design, DesignSettings, Grip, JointLimits, JointStates, Motion, Problem,
    Progress, Sensing, ShortestSettings, design_observed, margins, predict, shortest,
    targets_within,
};
use tactid_identify::{EquationSettings, Method, values_of_body};
use tactid_logs::messages::{Duration, JointTrajectory, JointTrajectoryPoint};
use tactid_logs::{Durability, LogError, LogWriter};

use crate::arguments::read_robot;
use crate::arrays::{Series, common_length};
use crate::collision_model::{Places, collision_model};
use crate::errors::{ArgumentError, IntoPyErr, detached, option_error};
use crate::inertia::MassProperties;
use crate::interruption::InterruptionCheck;
use crate::motion::{DesignedMotion, GivenMotion, MotionHistory};
use crate::options;
use crate::record::fields;
use crate::text::Text;

/// Number of beginnings of a motion for which intervals are predicted.
const BEGINNINGS: usize = 24;

/// Number of designs that the search for the shortest motion needs, about.
const DESIGNS_OF_SHORTEST: usize = 8;

/// Accuracy of the inertia of an expected payload, relative to its size: a plate that is given in four digits is a body.
const ROUNDING_OF_INERTIA: f64 = 1e-3;

/// Topic of a designed motion.
const TRAJECTORY_TOPIC: &str = "/joint_trajectory";

/// Name of the metadata of a designed motion.
const METADATA: &str = "tactid.motion";

/// Time of the message of a designed motion, ns. ROS takes a stamp of zero for a missing one.
const LOG_TIME_NS: u64 = 1_000_000_000;

/// Lower and upper limit of a joint's position, rad or m, and that unit.
type RangeData = (f64, f64, &'static str);

/// A grip: centre, normal, distance of the pads, force, friction, torsion radius, fraction that may be used.
type GripData = ([f64; 3], [f64; 3], f64, f64, f64, f64, f64);

/// The keywords of `design_excitation` that are no options of an identification.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Given {
    start: Vec<f64>,
    sensors: Vec<String>,
    sample_rate: f64,
    base_noise: Option<[f64; 6]>,
    limit_scale: f64,
    acceleration: f64,
    payloads: Vec<Py<MassProperties>>,
    duration: Option<f64>,
    within: f64,
    longest: f64,
    wrench_limit: Option<[f64; 6]>,
    grip: Option<GripData>,
    base_attitude: Option<f64>,
    base_position: Option<f64>,
    places: Places,
    read_mesh: Option<Py<PyAny>>,
    volume: bool,
    seed: u64,
    rate: f64,
    assumed_noise: Vec<String>,
    surroundings: Vec<String>,
}

/// Returns a posture within the limits of all joints, zero or the middle of a range that excludes it; the indices of the joints that
/// move a link; and the range of each joint, with its unit, `rad` or `m`.
#[pyfunction]
pub(crate) fn default_posture(
    robot: &Bound<'_, PyAny>,
    tip: Text,
) -> PyResult<(Vec<f64>, Vec<usize>, Vec<RangeData>)> {
    let robot = read_robot(robot)?;
    let robot = &robot.get().robot;
    let tip = robot.frame(&tip).map_err(IntoPyErr::into_py_err)?;
    let all = 0..robot.dof();
    let rest = |joint| match robot.joint_limits(joint) {
        Some((low, high)) if low > 0.0 || high < 0.0 => 0.5 * (low + high),
        _ => 0.0,
    };
    let moving = all.clone().filter(|&joint| robot.moves(joint, tip));
    let range = |joint| {
        let (low, high) = robot
            .joint_limits(joint)
            .unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let is_angle = robot.joint_kind(joint) != Some(JointKind::Prismatic);
        (low, high, if is_angle { "rad" } else { "m" })
    };
    let ranges = all.clone().map(range).collect();
    Ok((all.map(rest).collect(), moving.collect(), ranges))
}

/// Designs a motion: see :func:`tactid.design_excitation`.
#[pyfunction]
#[pyo3(signature = (robot, given, options, progress=None))]
pub(crate) fn design_excitation(
    py: Python<'_>,
    robot: &Bound<'_, PyAny>,
    given: Given,
    options: &Bound<'_, PyDict>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Py<PyDict>> {
    let robot = read_robot(robot)?;
    let problem = problem(&robot, &given, options)?;
    let settings = DesignSettings {
        seed: given.seed,
        ..DesignSettings::default()
    };
    let mut interruption = InterruptionCheck::new(progress);
    let result = detached(py, || {
        let design = designed(&problem, settings, &given, &mut interruption)?;
        let beginnings = beginnings(&problem, &design, &mut interruption)?;
        Ok((design, beginnings))
    })?;
    let result = result.map_err(|error: tactid_excitation::ExcitationError| error.into_py_err());
    let (design, beginnings) = interruption.finish(py, result)?;
    let expected = given.payloads.first().ok_or_else(no_payload)?.get().0;
    let given = GivenMotion {
        expected_payload: values_of_body(&expected),
        within: given.within,
        seed: given.seed,
        assumed_noise: given.assumed_noise,
        surroundings: given.surroundings,
        rate_hz: given.rate,
    };
    let motion = DesignedMotion::new(&problem, design, beginnings, given)?;
    Ok(fields(py, &motion)?.unbind())
}

/// Returns the problem that the keywords describe.
fn problem(
    robot: &Bound<'_, crate::dynamics::Manipulator>,
    given: &Given,
    options: &Bound<'_, PyDict>,
) -> PyResult<Problem> {
    let request = options::request(options)?;
    let defaults = EquationSettings::default();
    let equations = EquationSettings {
        method: request.method.unwrap_or(Method::Tactile),
        gravity: request.gravity,
        cutoff_hz: request.cutoff_hz.unwrap_or(defaults.cutoff_hz),
        wrench_offset: request.wrench_offset.unwrap_or(defaults.wrench_offset),
        wrench_noise: request.wrench_noise.unwrap_or_default(),
        effort_noise: request.effort_noise.unwrap_or_default(),
        ..defaults
    };
    let model = &robot.get().robot;
    let limits = JointLimits::of_robot(model, given.acceleration, given.limit_scale)
        .map_err(IntoPyErr::into_py_err)?;
    let sensing = Sensing {
        sensors: given.sensors.clone(),
        equations,
        rate_hz: given.sample_rate,
        base_noise: given.base_noise,
    };
    let mut payloads = given.payloads.iter().map(|body| body.get().0.into());
    let expected: InertialParameters = payloads.next().ok_or_else(no_payload)?;
    let targets = targets(&expected, given.within)?;
    let tip = request.tip.as_deref().unwrap_or("tool0");
    let read_mesh = given.read_mesh.as_ref();
    let collisions = read_mesh
        .map(|read| collision_model(robot, read))
        .transpose()?;
    let model = model.clone();
    let mut problem = Problem::new(model, tip, &given.start, limits, sensing, expected, targets);
    problem.payloads.extend(payloads);
    if problem.payloads.len() > 1 {
        // With the hand that holds nothing, efforts and wrenches on a fixed base hold for all bodies between the payloads.
        problem.payloads.push(InertialParameters::zero());
    }
    problem.duration_s = given
        .duration
        .unwrap_or(problem.duration_s.min(given.longest));
    problem.base = BaseBounds {
        attitude_rad: given.base_attitude,
        position_m: given.base_position,
    };
    problem.wrench = given.wrench_limit;
    problem.grip = given.grip.map(grip).transpose()?;
    problem.collisions = collisions;
    given.places.set(&mut problem);
    if given.volume {
        problem.criterion = Criterion::Volume;
    }
    Ok(problem)
}

fn no_payload() -> PyErr {
    ArgumentError::new_err("`payload` is missing")
}

/// Returns the targets of an expected payload, which must be a body with an inertia.
fn targets(expected: &InertialParameters, within: f64) -> PyResult<[f64; 10]> {
    // A point is a payload of which the inertia is not known.
    if !expected.is_physical_within(ROUNDING_OF_INERTIA) {
        let message = "the inertia of the expected payload is that of no body: expected a positive definite matrix whose \
                       largest principal moment is at most the sum of the others";
        return Err(option_error(message.to_owned(), "payload"));
    }
    let (Some(targets), Some(body)) =
        (targets_within(expected, within), expected.mass_properties())
    else {
        let message = "the expected payload has no mass";
        return Err(option_error(message.to_owned(), "payload"));
    };
    if body.inertia.trace() <= 0.0 {
        let message = "the inertia of the expected payload is zero, so that no precision can be a fraction of it: give an \
                       estimate of it";
        return Err(option_error(message.to_owned(), "payload"));
    }
    Ok(targets)
}

fn grip((center, normal, distance, force, friction, radius, used): GripData) -> PyResult<Grip> {
    let normal = Unit::try_new(Vector3::from(normal), 0.0);
    let no_normal = || option_error("the normal of the grip is zero".to_owned(), "grip");
    Ok(Grip {
        center: Point3::from(center),
        normal: normal.ok_or_else(no_normal)?,
        distance_m: distance,
        grip_force_n: force,
        friction,
        torsion_radius_m: radius,
        used_fraction: used,
    })
}

/// Designs the motion, of the given duration or the shortest.
fn designed(
    problem: &Problem,
    design: DesignSettings,
    given: &Given,
    interruption: &mut InterruptionCheck,
) -> Result<Design, tactid_excitation::ExcitationError> {
    let steps = 10 * design.starts + design.iterations + 20;
    let designs = if given.duration.is_some() {
        1
    } else {
        DESIGNS_OF_SHORTEST
    };
    let mut done = 0;
    let mut observer = |_: &Progress| {
        done += 1;
        interruption.check((done as f64 / (steps * designs) as f64).min(0.99))
    };
    if given.duration.is_some() {
        return design_observed(problem, &design, &mut observer);
    }
    let settings = ShortestSettings {
        design,
        longest_s: given.longest,
        ..ShortestSettings::default()
    };
    shortest(problem, &settings, &mut observer)
}

/// The beginning of a motion.
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

/// Predicts the intervals after each of some beginnings of a motion; NaN where one does not determine every value.
fn beginnings(
    problem: &Problem,
    design: &Design,
    interruption: &mut InterruptionCheck,
) -> Result<MotionHistory, tactid_excitation::ExcitationError> {
    let duration_s = design.trajectory.duration_s();
    let mut found = MotionHistory::default();
    for k in 1..=BEGINNINGS {
        let beginning = Beginning {
            motion: &design.trajectory,
            duration_s: duration_s * k as f64 / BEGINNINGS as f64,
        };
        if let ControlFlow::Break(()) = interruption.check(0.99) {
            return Err(tactid_excitation::ExcitationError::Interrupted);
        }
        // A short beginning does not determine all values.
        let std_devs = predict(problem, &beginning).map_or([f64::NAN; 10], |found| found.std_devs);
        let (_, excursion) = margins(problem, &beginning)?;
        found.times_s.push(beginning.duration_s);
        found.std_devs.push(std_devs);
        let attitude_deg = excursion.attitude_rad.to_degrees();
        found.base_attitude_deg.push(attitude_deg);
    }
    Ok(found)
}

/// Writes a motion as a log with one `trajectory_msgs/msg/JointTrajectory`: see :meth:`tactid.DesignedMotion.write`.
///
/// Args:
///     path: The ``.mcap`` file to write.
///     joints: Names of the joints.
///     time: Times since the start of the motion, (N,), s.
///     q: Positions, (N, n); ``qd`` and ``qdd`` likewise.
///     metadata: What the log says of the motion, by keys: an MCAP metadata record named ``tactid.motion``.
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
