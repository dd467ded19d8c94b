//! One topic of a log as whole arrays.

use std::path::PathBuf;

use pyo3::prelude::*;
use tactid_logs::messages::{
    AccelStamped, Imu, InertiaStamped, JointState, Odometry, StringMsg, WrenchStamped,
};
use tactid_logs::{LogReader, Message};

use crate::errors::{ArgumentError, IntoPyErr, LogError, detached};
use crate::interruption::InterruptionCheck;
use crate::samples::{Samples, listed};
use crate::table::{Rows, Table};
use crate::text::Text;

/// Number of messages that are read between two checks for user interruption.
const CHECK_EVERY: usize = 1_000;

/// Reads one topic of a log into arrays.
///
/// Args: log: The folder of a rosbag2 bag, or an ``.mcap`` or ``.db3`` file. topic: Name of the
/// topic, such as ``/joint_states``. every: Keeps at most one message in this time, s, to look at a
/// long log; all of them for 0. Of joint states, one from each publisher.
///
/// Raises: LogError: The log cannot be read, has no such topic, or that holds a type without
/// numbers to read.
#[pyfunction]
#[pyo3(signature = (log, topic, *, every=0.0))]
pub(crate) fn read(py: Python<'_>, log: PathBuf, topic: Text, every: f64) -> PyResult<Samples> {
    // Nanoseconds in an i64 end after 292 years.
    if !(0.0..9.0e9).contains(&every) {
        return Err(ArgumentError::new_err(format!(
            "`every` is {every}: expected seconds, 0 or more"
        )));
    }
    let mut interruption = InterruptionCheck::new(None);
    let every_ns = (every * 1e9).round() as i64;
    let result = detached(py, || {
        let log = LogReader::open_watched(&log, &mut || interruption.check(0.0));
        let log = log.map_err(IntoPyErr::into_py_err)?;
        read_topic(&log, &topic, every_ns, &mut interruption)
    })?;
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
