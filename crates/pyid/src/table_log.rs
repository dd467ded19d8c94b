//! Rows of a table as a log of joint states and wrenches, so that whatever reads logs reads tables.

use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

use pyo3::prelude::*;
use tactid_logs::messages::{Header, JointState, Time, Wrench, WrenchStamped};
use tactid_logs::{Durability, LogError, LogWriter, Message};

use crate::arrays::{Series, common_length};
use crate::errors::{IntoPyErr, detached};
use crate::interruption::InterruptionCheck;

/// Number of messages that are written between two checks for user interruption.
const CHECK_EVERY: usize = 4_096;

type Log = LogWriter<BufWriter<File>>;
type Given<'py> = Bound<'py, PyAny>;

/// The topic of the joints and their names; times, s; positions, velocities and efforts.
type GivenJoints<'py> = (
    String,
    Vec<String>,
    Given<'py>,
    Given<'py>,
    Option<Given<'py>>,
    Option<Given<'py>>,
);

/// The topic of the wrenches; times, s; forces and moments.
type GivenWrenches<'py> = (String, Given<'py>, Given<'py>);

/// Writes rows of a table as a log, in which each row is a message with the row's time as its
/// stamp.
///
/// Times are later than zero. Where they decrease, the times of logging do not, so that the
/// messages stay in the order of the rows. The wrenches name no frame.
#[pyfunction]
#[pyo3(signature = (path, *, joints=None, wrench=None))]
pub(crate) fn write_samples(
    py: Python<'_>,
    path: PathBuf,
    joints: Option<GivenJoints<'_>>,
    wrench: Option<GivenWrenches<'_>>,
) -> PyResult<()> {
    let joints = joints.map(Rows::<Joints>::read).transpose()?;
    let wrench = wrench.map(Rows::<Wrenches>::read).transpose()?;
    let mut interruption = InterruptionCheck::new(None);
    let written = detached(py, || {
        let mut log = LogWriter::create(&path)?;
        write(&mut log, joints.as_ref(), &mut interruption)?;
        write(&mut log, wrench.as_ref(), &mut interruption)?;
        log.finish().map(|_| ())
    })?;
    interruption.finish(py, written.map_err(IntoPyErr::into_py_err))
}

/// Rows of a table that are messages of one topic.
struct Rows<V> {
    topic: String,
    /// Times of the rows, s.
    time: Series,
    values: V,
}

/// Values of rows.
trait Values {
    type Message: Message;

    /// Returns the message of a row.
    fn message(&self, header: Header, row: usize) -> Self::Message;
}

/// Values of the joints, a row each.
struct Joints {
    names: Vec<String>,
    q: Series,
    qd: Series,
    effort: Series,
}

impl Rows<Joints> {
    fn read((topic, names, time, q, qd, effort): GivenJoints<'_>) -> PyResult<Self> {
        let time = Series::read(&time, "time", &[])?;
        let q = Series::read(&q, "q", &[names.len()])?;
        let qd = Series::read_or_empty(qd.as_ref(), "qd", names.len())?;
        let effort = Series::read_or_empty(effort.as_ref(), "effort", names.len())?;
        common_length(&[&time, &q, &qd, &effort])?;
        let values = Joints {
            names,
            q,
            qd,
            effort,
        };
        Ok(Self {
            topic,
            time,
            values,
        })
    }
}

impl Values for Joints {
    type Message = JointState;

    fn message(&self, header: Header, row: usize) -> JointState {
        JointState {
            header,
            name: self.names.clone(),
            position: self.q.at(row).to_vec(),
            velocity: self.qd.at(row).to_vec(),
            effort: self.effort.at(row).to_vec(),
        }
    }
}

/// Wrenches, a row each.
struct Wrenches(Series);

impl Rows<Wrenches> {
    fn read((topic, time, wrench): GivenWrenches<'_>) -> PyResult<Self> {
        let time = Series::read(&time, "time", &[])?;
        let wrench = Series::read(&wrench, "wrench", &[6])?;
        common_length(&[&time, &wrench])?;
        Ok(Self {
            topic,
            time,
            values: Wrenches(wrench),
        })
    }
}

impl Values for Wrenches {
    type Message = WrenchStamped;

    fn message(&self, header: Header, row: usize) -> WrenchStamped {
        let vector = |first| <[f64; 3]>::from(self.0.vector(row, first)).into();
        WrenchStamped {
            header,
            wrench: Wrench {
                force: vector(0),
                torque: vector(3),
            },
        }
    }
}

/// Writes the rows of one topic, unless the user interrupts.
fn write<V: Values>(
    log: &mut Log,
    rows: Option<&Rows<V>>,
    interruption: &mut InterruptionCheck,
) -> Result<(), LogError> {
    let Some(rows) = rows else {
        return Ok(());
    };
    let channel = log.channel::<V::Message>(&rows.topic, Durability::Volatile)?;
    let mut logged_ns = 0;
    for (k, &time_s) in rows.time.as_slice().iter().enumerate() {
        if k.is_multiple_of(CHECK_EVERY) && interruption.check(0.0).is_break() {
            break; // the check has the exception
        }
        logged_ns = nanoseconds(time_s).max(logged_ns);
        log.write(&channel, logged_ns, &rows.values.message(header(time_s), k))?;
    }
    Ok(())
}

fn header(time_s: f64) -> Header {
    Header {
        stamp: Time::from_ns(nanoseconds(time_s)),
        ..Header::default()
    }
}

/// Returns a time later than zero in ns.
fn nanoseconds(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}
