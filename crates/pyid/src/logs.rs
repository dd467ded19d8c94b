//! What is in a log.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pyo3::prelude::*;

use crate::errors::IntoPyErr;

/// A topic of a log.
#[pyclass(module = "tactid", frozen, get_all)]
#[derive(Clone)]
pub(crate) struct Topic {
    /// Such as ``/joint_states``.
    name: String,
    /// Such as ``sensor_msgs/msg/JointState``.
    type_name: String,
    /// How its messages are encoded: ``cdr`` in ROS 2.
    encoding: String,
    /// How many messages it has.
    count: u64,
    /// Messages in a second, on average; None for fewer than two messages.
    frequency: Option<f64>,
}

/// What is in a log, as :func:`info` found it.
#[pyclass(module = "tactid", frozen, get_all)]
pub(crate) struct LogInfo {
    /// The topics, by name.
    topics: Vec<Topic>,
    /// First log time, s since the epoch of the log's clock; None for a log without messages.
    start: Option<f64>,
    /// From the first to the last message, s; None for a log without messages.
    duration: Option<f64>,
    /// The metadata records by name.
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// Where files could not be read further, a line each; empty for a sound log.
    damage: Vec<String>,
}

/// Says what is in a log, from its index.
///
/// Args:
///     log: An ``.mcap`` file, or the folder of a rosbag2 bag.
///
/// Raises:
///     LogError: There is no log that can be read. A log that is damaged is opened as far as it goes.
#[pyfunction]
pub(crate) fn info(py: Python<'_>, log: PathBuf) -> PyResult<LogInfo> {
    let reader = py
        .detach(|| tactid_logs::LogReader::open(log))
        .map_err(IntoPyErr::into_py_err)?;
    let topics = reader.topics().iter().map(|topic| Topic {
        name: topic.name.clone(),
        type_name: topic.type_name.clone(),
        encoding: topic.encoding.clone(),
        count: topic.count,
        frequency: topic.frequency_hz(),
    });
    let times = reader.times_ns();
    Ok(LogInfo {
        topics: topics.collect(),
        start: times.map(|(first, _)| first as f64 * 1e-9),
        duration: times.map(|(first, last)| last.saturating_sub(first) as f64 * 1e-9),
        metadata: reader.metadata().clone(),
        damage: reader.damage().iter().map(ToString::to_string).collect(),
    })
}
