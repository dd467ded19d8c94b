//! One topic of a log as whole arrays.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use tactid_logs::messages::{
    AccelStamped, Imu, InertiaStamped, JointState, Odometry, StringMsg, WrenchStamped,
};
use tactid_logs::{LogReader, Message};

use crate::errors::{ArgumentError, IntoPyErr, LogError};
use crate::interruption::InterruptionCheck;
use crate::rows::Rows;
use crate::table::Table;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Number of messages that are read between two checks for user interruption.
const CHECK_EVERY: usize = 1_000;

/// What one topic of a log holds, as :func:`read` found it.
///
/// ``samples["position"]`` is an array with one entry a message; :meth:`keys` lists them:
///
/// - ``sensor_msgs/msg/JointState``: ``position``, ``velocity``, ``effort``, each (N, joints), in the order of
///   :attr:`names`; rad or m and seconds, N m or N.
/// - ``geometry_msgs/msg/WrenchStamped``: ``wrench`` (N, 6), force then moment, N and N m, in the axes of
///   :attr:`frame_id` and about its origin.
/// - ``nav_msgs/msg/Odometry``: ``pose`` (N, 7), ``[x, y, z, qx, qy, qz, qw]`` of :attr:`child_frame_id` in
///   :attr:`frame_id`, m; ``twist`` (N, 6), linear then angular, in the axes of the child, m/s and rad/s.
/// - ``geometry_msgs/msg/AccelStamped``: ``acceleration`` (N, 6), linear then angular, m/s² and rad/s².
/// - ``sensor_msgs/msg/Imu``: ``orientation`` (N, 4), ``[qx, qy, qz, qw]``; ``angular_velocity`` (N, 3), rad/s;
///   ``linear_acceleration`` (N, 3), the specific force, m/s².
/// - ``geometry_msgs/msg/InertiaStamped``: ``values`` (N, 10), in the order of ``VALUE_NAMES``.
/// - ``std_msgs/msg/String``: no array, but :attr:`text`.
///
/// NaN stands for what was not measured.
#[pyclass(module = "tactid", frozen)]
pub(crate) struct Samples {
    /// Such as ``/joint_states``.
    #[pyo3(get)]
    pub(crate) topic: String,
    /// Such as ``sensor_msgs/msg/JointState``.
    #[pyo3(get)]
    pub(crate) type_name: String,
    /// When ``time`` is zero, ns since the epoch of the log's clock: the first message's time.
    #[pyo3(get)]
    pub(crate) start_ns: i64,
    /// When each message was measured, in the order of logging, (N,), s: its header's stamp, or its log time
    /// where there is none.
    #[pyo3(get)]
    pub(crate) time: Py<PyArrayDyn<f64>>,
    /// The joints, in the order in which the topic first names them; empty for other types.
    #[pyo3(get)]
    pub(crate) names: Vec<String>,
    /// The frame that the headers name; empty for joints and texts.
    #[pyo3(get)]
    pub(crate) frame_id: String,
    /// The frame that moves, of an odometry; empty for other types.
    #[pyo3(get)]
    pub(crate) child_frame_id: String,
    /// The texts of ``std_msgs/msg/String``, one a message; empty for other types.
    #[pyo3(get)]
    pub(crate) text: Vec<String>,
    /// Where the log could not be read further, and why, a line each; empty for a sound log.
    #[pyo3(get)]
    pub(crate) damage: Vec<String>,
    pub(crate) arrays: BTreeMap<&'static str, Py<PyArrayDyn<f64>>>,
}

#[pymethods]
impl Samples {
    /// The names of the arrays.
    fn keys(&self) -> Vec<&'static str> {
        self.arrays.keys().copied().collect()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Array<'py>> {
        match self.arrays.get(key) {
            Some(array) => Ok(array.bind(py).clone()),
            None => Err(ArgumentError::new_err(format!(
                "{} has no array {key:?}; it has {}",
                self.topic,
                listed(&self.keys())
            ))),
        }
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.time.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (topic, type_name, count) = (&self.topic, &self.type_name, self.__len__(py)?);
        Ok(format!("<Samples: {topic}, {count} of {type_name}>"))
    }
}

/// Reads one topic of a log into arrays.
///
/// Args:
///     log: An ``.mcap`` file, or the folder of a rosbag2 bag.
///     topic: Such as ``/joint_states``.
///     every: Keeps at most one message in this time, s, to look at a long log; all of them for 0. Of joint
///         states, one from each publisher.
///
/// Raises:
///     LogError: The log cannot be read, has no such topic, or that holds a type without numbers to read.
#[pyfunction]
#[pyo3(signature = (log, topic, *, every=0.0))]
pub(crate) fn read(py: Python<'_>, log: PathBuf, topic: &str, every: f64) -> PyResult<Samples> {
    // Nanoseconds in an i64 end after 292 years.
    if !(0.0..9.0e9).contains(&every) {
        return Err(ArgumentError::new_err(format!(
            "`every` is {every}: expected seconds, 0 or more"
        )));
    }
    let mut interruption = InterruptionCheck::new(None);
    let every_ns = (every * 1e9).round() as i64;
    let result = py.detach(|| {
        let log = LogReader::open(&log).map_err(IntoPyErr::into_py_err)?;
        read_topic(&log, topic, every_ns, &mut interruption)
    });
    interruption.finish(py, result)?.into_samples(py)
}

type Read = fn(&LogReader, &str, i64, &mut InterruptionCheck) -> PyResult<Table>;

/// The types that can be read.
const READABLE: [(&str, Read); 7] = [
    (JointState::TYPE, read_all::<JointState>),
    (WrenchStamped::TYPE, read_all::<WrenchStamped>),
    (Odometry::TYPE, read_all::<Odometry>),
    (AccelStamped::TYPE, read_all::<AccelStamped>),
    (Imu::TYPE, read_all::<Imu>),
    (InertiaStamped::TYPE, read_all::<InertiaStamped>),
    (StringMsg::TYPE, read_all::<StringMsg>),
];

fn read_topic(
    log: &LogReader,
    topic: &str,
    every_ns: i64,
    interruption: &mut InterruptionCheck,
) -> PyResult<Table> {
    // The error for a topic that does not exist lists those that do.
    log.messages_on([topic]).map_err(IntoPyErr::into_py_err)?;
    let type_name = log.topic(topic).map_or("", |found| &found.type_name);
    let full_name = type_name.replace("/msg/", "/").replacen('/', "/msg/", 1);
    match READABLE.iter().find(|(known, _)| *known == full_name) {
        Some((_, read)) => read(log, topic, every_ns, interruption),
        None => {
            let known = READABLE.map(|(name, _)| name);
            Err(LogError::new_err(format!(
                "topic {topic} holds {type_name}, which is not read into arrays; these are: {}",
                listed(&known)
            )))
        }
    }
}

fn read_all<M: Rows>(
    log: &LogReader,
    topic: &str,
    every_ns: i64,
    interruption: &mut InterruptionCheck,
) -> PyResult<Table> {
    let mut table = Table::new::<M>(topic);
    let mut messages = log.messages_on([topic]).map_err(IntoPyErr::into_py_err)?;
    for (count, raw) in messages.by_ref().enumerate() {
        let raw = raw.map_err(IntoPyErr::into_py_err)?;
        let message: M = raw.decode().map_err(IntoPyErr::into_py_err)?;
        table.add(&message, raw.log_time_ns, every_ns)?;
        if count.is_multiple_of(CHECK_EVERY) && interruption.check(0.0).is_break() {
            break; // the check has the exception
        }
    }
    table.damage = messages.damage().iter().map(ToString::to_string).collect();
    Ok(table)
}

fn listed(names: &[&str]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}
