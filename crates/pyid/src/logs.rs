//! The contents of a log, for Python.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pyo3::prelude::*;

use tactid_logs::LogReader;

use crate::errors::{ArgumentError, IntoPyErr, detached};
use crate::interruption::InterruptionCheck;

/// A topic of a log.
#[pyclass(module = "tactid", frozen, get_all)]
#[derive(Clone)]
pub(crate) struct Topic {
    /// Name of the topic, such as ``/joint_states``.
    name: String,
    /// Type of the messages, such as ``sensor_msgs/msg/JointState``.
    type_name: String,
    /// Encoding of the messages: ``cdr`` in ROS 2.
    encoding: String,
    /// Number of messages on the topic.
    count: u64,
    /// Mean rate of the messages, Hz; None for fewer than two messages.
    frequency: Option<f64>,
}

/// Contents of a log, as :func:`info` returns them.
#[pyclass(module = "tactid", frozen, get_all)]
pub(crate) struct LogInfo {
    /// Topics of the log, in the order of their names.
    topics: Vec<Topic>,
    /// First log time, s since the epoch of the log's clock; None for a log without messages.
    start: Option<f64>,
    /// Time from the first message to the last, s; None for a log without messages.
    duration: Option<f64>,
    /// Metadata records of the log, by their names.
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// Places where files could not be read further, a line each; empty for a sound log.
    damage: Vec<String>,
}

/// Sets the memory that the messages of a log may occupy at once: 256 MiB until it is set.
///
/// It holds for every log that this process opens afterwards. A log that needs more, because its
/// chunks are large or overlap in time, is refused with a :class:`LogError`, whatever its files
/// claim. Its index may occupy half as much.
///
/// Args: mebibytes: The memory in MiB (2**20 bytes), more than zero. A single chunk or message is
/// at most 256 MiB anyway.
///
/// Raises:
///     ArgumentError: The memory is not more than zero.
#[pyfunction]
pub(crate) fn set_log_memory(mebibytes: f64) -> PyResult<()> {
    if mebibytes.is_nan() || mebibytes <= 0.0 {
        return Err(ArgumentError::new_err(format!(
            "`mebibytes` is {mebibytes}: expected more than 0"
        )));
    }
    tactid_logs::set_memory_limit((mebibytes * (1 << 20) as f64) as u64);
    Ok(())
}

/// Returns the contents of a log, which its index lists.
///
/// Args:
///     log: The folder of a rosbag2 bag, or an ``.mcap`` or ``.db3`` file.
///
/// Raises: LogError: There is no log that can be read. A log that is damaged is opened as far as it
/// goes.
#[pyfunction]
pub(crate) fn info(py: Python<'_>, log: PathBuf) -> PyResult<LogInfo> {
    let mut interruption = InterruptionCheck::new(None);
    let opened = detached(py, || {
        LogReader::open_watched(log, &mut || interruption.check(0.0))
    })?;
    let reader = interruption.finish(py, opened.map_err(IntoPyErr::into_py_err))?;
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
