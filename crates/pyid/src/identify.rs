//! From samples or a log to a payload.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;
use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;
use tactid_dynamics::Wrench;
use tactid_identify::{BaseState, EstimatorKind, Pushed, Sample, Settings, Way};

use crate::arrays::{Poses, Series, common_length, output};
use crate::dynamics::Manipulator;
use crate::errors::{ArgumentError, IntoPyErr};
use crate::inertia::MassProperties;
use crate::pulse::Pulse;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;
type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// A payload as identified, in the end-effector frame.
#[pyclass(module = "tactid", frozen)]
#[derive(Clone)]
pub(crate) struct PayloadEstimate(tactid_identify::PayloadEstimate);

#[pymethods]
impl PayloadEstimate {
    /// The payload alone.
    #[getter]
    fn body(&self) -> MassProperties {
        MassProperties(self.0.body)
    }

    /// Gripper and payload as one body, for the joint-sensing way; else None.
    #[getter]
    fn composite(&self) -> Option<MassProperties> {
        self.0.composite.map(MassProperties)
    }

    /// Mass, kg; centre of mass, m; inertia about it, kg m²; in the order of ``VALUE_NAMES``, (10,).
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        output(py, self.0.values().to_vec(), None, &[10])
    }

    /// For each of ``VALUE_NAMES``: whether the motion determined it. Where it did not, the number is where
    /// the estimator happened to start or drift.
    #[getter]
    fn identifiable(&self) -> [bool; 10] {
        self.0.identifiable
    }

    /// The names of the values that the motion did not determine.
    #[getter]
    fn not_identifiable(&self) -> Vec<&'static str> {
        self.0.not_identifiable().collect()
    }

    /// How strongly the motion excited mass and centre of mass: rms singular values of the rows of equation
    /// (48), descending, (4,), m/s².
    #[getter]
    fn mass_singular_values<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        output(py, self.0.singular_values.mass.to_vec(), None, &[4])
    }

    /// How strongly the motion excited the inertia: rms singular values of the rows of equation (46),
    /// descending, (6,), rad/s².
    #[getter]
    fn inertia_singular_values<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        output(py, self.0.singular_values.inertia.to_vec(), None, &[6])
    }

    /// Whether a body with these parameters can exist, within 1 % of its largest principal moment: a plate,
    /// such as the paper's payload, lies on the border of what can, and no estimate is exact.
    #[getter]
    fn is_physical(&self) -> bool {
        self.0.is_physical
    }

    /// Intervals that gave rows.
    #[getter]
    fn intervals(&self) -> u64 {
        self.0.intervals
    }

    /// Samples refused: not finite, or not later than the one before.
    #[getter]
    fn refused(&self) -> u64 {
        self.0.refused
    }

    /// Intervals that were too long to be bridged.
    #[getter]
    fn gaps(&self) -> u64 {
        self.0.gaps
    }
}

/// Identifies the payload of one robot online: samples in, asked at any time.
///
/// Args:
///     robot: The robot with its gripper and without the payload.
///     tool: The end-effector frame, a link of the robot. What is below it is the gripper.
///     sensors: The links in whose frames the wrenches of each sample are.
///     way: ``"tactile"``, from the contact wrenches, or ``"joint-sensing"``, from the motion of a
///         free-floating robot, the known gripper taken off.
///     estimator: ``"nlms"``, the paper's filter, or ``"rls"``, least squares.
///     alpha: Of NLMS, in (0, 2).
///     beta: Of NLMS, in (0, 1).
///     gravity: Gravitational acceleration in world axes, (3,), m/s², pointing down. Where left out:
///         zero for a floating base, 9.81 along -z for a fixed one.
///     average: The estimate is the mean over this last time, s, or the latest value for 0. Where left out:
///         10 for NLMS, as in the paper, and 0 for least squares.
///     interval: Rows are formed of the means over intervals of this length, s; 0 for one sample each. It
///         keeps noise above its frequency out of the estimator, and must be short against the motion.
///     max_gap: Samples further apart are not bridged, s.
///
/// Raises:
///     ModelError: The robot has no such link.
///     ArgumentError: A setting is out of range.
///     IdentificationError: The way does not fit the robot or the sensors.
#[pyclass(module = "tactid", frozen)]
pub(crate) struct Identifier {
    identifier: Mutex<tactid_identify::Identifier>,
    dof: usize,
    sensors: usize,
}

#[pymethods]
impl Identifier {
    #[new]
    #[pyo3(signature = (robot, tool, sensors=Vec::new(), *, way="tactile", estimator="nlms", alpha=1.8, beta=0.9, gravity=None, average=None, interval=0.05, max_gap=0.1))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: Vec<String>,
        way: &str,
        estimator: &str,
        alpha: f64,
        beta: f64,
        gravity: Argument<'_, '_>,
        average: Option<f64>,
        interval: f64,
        max_gap: f64,
    ) -> PyResult<Self> {
        let settings = Given {
            way,
            estimator,
            alpha,
            beta,
            gravity,
            average,
            interval,
            epochs: None,
            max_gap,
        }
        .read()?;
        let names: Vec<&str> = sensors.iter().map(String::as_str).collect();
        let identifier = tactid_identify::Identifier::new(&robot.0, tool, &names, settings)
            .map_err(IntoPyErr::into_py_err)?;
        Ok(Self {
            identifier: Mutex::new(identifier),
            dof: robot.0.dof(),
            sensors: names.len(),
        })
    }

    /// Takes one sample, or N in a row.
    ///
    /// Args:
    ///     time: On one clock, s, () or (N,).
    ///     q: Joint positions in the order of the robot's ``joint_names``, (n,) or (N, n), rad or m.
    ///     qd: Joint velocities, (n,) or (N, n), rad/s or m/s.
    ///     wrenches: Force then moment **on the payload**, each in its sensor's frame and about that frame's
    ///         origin, (S, 6) or (N, S, 6), N and N m. May be left out without sensors.
    ///     base_pose: ``world_from_base``, (4, 4) or (7,), or N of them; identity where left out.
    ///     base_twist: Velocity of the base frame's origin, then angular velocity, in world axes, (6,) or
    ///         (N, 6); zero where left out.
    ///
    /// Returns:
    ///     How many samples were used: they gave rows once an interval was full. Bad ones (not finite, not
    ///     later than the one before) are refused and counted, and the first of all, or after a gap, only
    ///     starts an interval.
    ///
    /// Raises:
    ///     ArgumentError: A shape does not fit.
    #[pyo3(signature = (time, q, qd, wrenches=None, *, base_pose=None, base_twist=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn push(
        &self,
        py: Python<'_>,
        time: &Bound<'_, PyAny>,
        q: &Bound<'_, PyAny>,
        qd: &Bound<'_, PyAny>,
        wrenches: Argument<'_, '_>,
        base_pose: Argument<'_, '_>,
        base_twist: Argument<'_, '_>,
    ) -> PyResult<usize> {
        let time = Series::read(time, "time", &[])?;
        let q = Series::read(q, "q", &[self.dof])?;
        let qd = Series::read(qd, "qd", &[self.dof])?;
        let wrenches = match wrenches {
            Some(given) => Series::read(given, "wrenches", &[self.sensors, 6])?,
            None if self.sensors == 0 => Series::read_or_zero(None, "wrenches", 0)?,
            None => {
                return Err(ArgumentError::new_err(format!(
                    "`wrenches` is missing: the identifier has {} sensors",
                    self.sensors
                )));
            }
        };
        let pose = Poses::read_or_identity(base_pose, "base_pose")?;
        let twist = Series::read_or_zero(base_twist, "base_twist", 6)?;
        let count = common_length(&[&time, &q, &qd, &wrenches, &pose, &twist])?.unwrap_or(1);
        py.detach(|| {
            let mut identifier = self.lock();
            let (mut used, mut loads) = (0, Vec::with_capacity(self.sensors));
            for k in 0..count {
                loads.clear();
                loads.extend(wrenches.at(k).chunks_exact(6).map(|wrench| Wrench {
                    force: Vector3::from_column_slice(&wrench[..3]),
                    moment: Vector3::from_column_slice(&wrench[3..]),
                }));
                let sample = Sample {
                    time_s: time.at(k)[0],
                    base: BaseState {
                        pose: *pose.at(k),
                        velocity: twist.vector(k, 0),
                        angular_velocity: twist.vector(k, 3),
                    },
                    joint_position: q.at(k),
                    joint_velocity: qd.at(k),
                    wrenches: &loads,
                };
                let pushed = identifier.push(&sample).map_err(IntoPyErr::into_py_err)?;
                used += usize::from(pushed == Pushed::Used);
            }
            Ok(used)
        })
    }

    /// Prepares for the same samples once more: what was learnt stays, times and counts begin anew.
    fn rewind(&self, py: Python<'_>) {
        py.detach(|| self.lock().rewind());
    }

    /// The payload as known now: the mean over the last ``average``, or the latest value for 0.
    fn estimate(&self, py: Python<'_>) -> PayloadEstimate {
        py.detach(|| PayloadEstimate(self.lock().estimate()))
    }
}

impl Identifier {
    fn lock(&self) -> MutexGuard<'_, tactid_identify::Identifier> {
        // A push that panicked has left numbers behind, not broken memory.
        self.identifier
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// What :func:`identify` found in a log.
#[pyclass(module = "tactid", frozen)]
pub(crate) struct Identification(tactid_identify::Identification);

#[pymethods]
impl Identification {
    /// The payload.
    #[getter]
    fn estimate(&self) -> PayloadEstimate {
        PayloadEstimate(self.0.estimate)
    }

    /// The end-effector frame in which the payload is.
    #[getter]
    fn tool(&self) -> &str {
        &self.0.tool
    }

    /// ``"tactile"`` or ``"joint-sensing"``.
    #[getter]
    fn way(&self) -> &'static str {
        way_name(self.0.settings.way)
    }

    /// ``"nlms"`` or ``"rls"``.
    #[getter]
    fn estimator(&self) -> &'static str {
        self.0.settings.estimator.name()
    }

    /// The estimate is the mean over this last time, s; 0 where it is the latest value.
    #[getter]
    fn average(&self) -> f64 {
        self.0.settings.average_s
    }

    /// How often the log was presented to the estimator.
    #[getter]
    fn epochs(&self) -> u32 {
        self.0.settings.epochs
    }

    /// The length of the intervals over which rows were formed, s; 0 for one sample each.
    #[getter]
    fn interval(&self) -> f64 {
        self.0.settings.interval_s
    }

    /// Which presentation of the log each entry of ``history`` belongs to, from 0, (H,), unsigned integers.
    #[getter]
    fn history_epoch<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_iter(py, self.0.history.iter().map(|point| point.epoch))
    }

    /// Times of ``history`` since the start of the log, (H,), s: every 0.1 s, and every 0.01 s in the last
    /// 10 s. They begin anew with each epoch.
    #[getter]
    fn history_time<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let times = self.0.history.iter().map(|point| point.time_s).collect();
        output(py, times, Some(self.0.history.len()), &[])
    }

    /// The estimate over time, not averaged, in the order of ``VALUE_NAMES``, (H, 10).
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let values = self.0.history.iter().flat_map(|point| point.values);
        output(py, values.collect(), Some(self.0.history.len()), &[10])
    }

    /// Gravitational acceleration that was assumed, in world axes, (3,), m/s², pointing down.
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        output(py, self.0.gravity.as_slice().to_vec(), None, &[3])
    }

    /// From the first sample to the last, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration_s
    }

    /// Where the log could not be read further, and why, a line each; empty for a sound log.
    #[getter]
    fn damage(&self) -> Vec<String> {
        self.0.damage.clone()
    }
}

/// Identifies the payload from a log, and from nothing else.
///
/// Args:
///     log: An ``.mcap`` file, or the folder of a rosbag2 bag.
///     tool: The end-effector frame, a link of the log's robot description.
///     way: ``"tactile"``, from the contact wrenches, or ``"joint-sensing"``, from the motion of a
///         free-floating robot, the known gripper taken off.
///     estimator: ``"nlms"``, the paper's filter, or ``"rls"``, least squares.
///     alpha: Of NLMS, in (0, 2).
///     beta: Of NLMS, in (0, 1).
///     gravity: Gravitational acceleration in world axes, (3,), m/s², pointing down. Where left out:
///         zero for a floating base, 9.81 along -z for a fixed one.
///     average: The estimate is the mean over this last time, s, or the latest value for 0. Where left out:
///         10 for NLMS, as in the paper, and 0 for least squares.
///     interval: Rows are formed of the means over intervals of this length, s; 0 for one sample each. It
///         keeps noise above its frequency out of the estimator, and must be short against the motion.
///     epochs: How often the log is presented to the estimator. Where left out: 2 for NLMS, which corrects
///         what it learnt of the inertia while the centre of mass was still wrong, and 1 for least squares.
///     max_gap: Samples further apart are not bridged, s.
///     progress: Called with the fraction done, about twenty times a second. An exception that it raises
///         stops the work, as Ctrl-C does.
///
/// Raises:
///     LogError: The log cannot be read.
///     ModelError: Its robot cannot be modelled, or has no such link.
///     IdentificationError: It lacks what is needed.
///     ArgumentError: A setting is out of range.
#[pyfunction]
#[pyo3(signature = (log, *, tool="tool0", way="tactile", estimator="nlms", alpha=1.8, beta=0.9, gravity=None, average=None, interval=0.05, epochs=None, max_gap=0.1, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn identify(
    py: Python<'_>,
    log: PathBuf,
    tool: &str,
    way: &str,
    estimator: &str,
    alpha: f64,
    beta: f64,
    gravity: Argument<'_, '_>,
    average: Option<f64>,
    interval: f64,
    epochs: Option<u32>,
    max_gap: f64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Identification> {
    let settings = Given {
        way,
        estimator,
        alpha,
        beta,
        gravity,
        average,
        interval,
        epochs,
        max_gap,
    }
    .read()?;
    let mut pulse = Pulse::new(progress);
    let result = py.detach(|| {
        tactid_identify::identify_log(&log, tool, &settings, &mut |progress| {
            pulse.beat(progress.fraction)
        })
    });
    let result = result.map(Identification).map_err(IntoPyErr::into_py_err);
    pulse.finish(py, result)
}

/// The settings as Python gives them; `None` where the estimator has a default of its own.
struct Given<'a, 'py> {
    way: &'a str,
    estimator: &'a str,
    alpha: f64,
    beta: f64,
    gravity: Argument<'a, 'py>,
    average: Option<f64>,
    interval: f64,
    epochs: Option<u32>,
    max_gap: f64,
}

impl Given<'_, '_> {
    fn read(&self) -> PyResult<Settings> {
        let way = match self.way {
            "tactile" => Way::Tactile,
            "joint-sensing" => Way::JointSensing,
            _ => return Err(unknown("way", self.way, "\"tactile\" or \"joint-sensing\"")),
        };
        let defaults = match self.estimator {
            "nlms" => Settings {
                estimator: EstimatorKind::Nlms {
                    alpha: self.alpha,
                    beta: self.beta,
                },
                ..Settings::default()
            },
            "rls" => Settings::least_squares(),
            _ => return Err(unknown("estimator", self.estimator, "\"nlms\" or \"rls\"")),
        };
        let gravity = match self.gravity {
            None => None,
            Some(given) => {
                let gravity = Series::read(given, "gravity", &[3])?;
                Some(Vector3::from_column_slice(gravity.single()?))
            }
        };
        Ok(Settings {
            way,
            gravity,
            average_s: self.average.unwrap_or(defaults.average_s),
            interval_s: self.interval,
            epochs: self.epochs.unwrap_or(defaults.epochs),
            max_gap_s: self.max_gap,
            ..defaults
        })
    }
}

fn unknown(name: &str, given: &str, expected: &str) -> PyErr {
    ArgumentError::new_err(format!("`{name}` is {given:?}: expected {expected}"))
}

fn way_name(way: Way) -> &'static str {
    match way {
        Way::Tactile => "tactile",
        Way::JointSensing => "joint-sensing",
    }
}
