//! One topic of a log as whole arrays.

use std::collections::BTreeMap;
use std::iter::repeat_n;
use std::path::PathBuf;

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use tactid_logs::messages::{
    AccelStamped, Imu, InertiaStamped, JointState, Odometry, Quaternion, StringMsg, Vector3,
    WrenchStamped,
};
use tactid_logs::{LogReader, Message};

use crate::arrays::output;
use crate::errors::{ArgumentError, IntoPyErr, LogError};
use crate::pulse::Pulse;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// How many messages are read between two looks at Ctrl-C.
const BEAT_EVERY: usize = 1_000;

/// What one topic of a log holds, as :func:`read` found it.
///
/// ``samples["position"]`` is an array with one entry a message; :meth:`keys` tells which there are:
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
    topic: String,
    /// Such as ``sensor_msgs/msg/JointState``.
    #[pyo3(get)]
    type_name: String,
    /// When ``time`` is zero, ns since the epoch of the log's clock: the first message's time.
    #[pyo3(get)]
    start_ns: i64,
    /// When each message was measured, in the order of logging, (N,), s: its header's stamp, or its log time
    /// where there is none.
    #[pyo3(get)]
    time: Py<PyArrayDyn<f64>>,
    /// The joints, in the order in which the topic first names them; empty for other types.
    #[pyo3(get)]
    names: Vec<String>,
    /// The frame that the headers name; empty for joints and texts.
    #[pyo3(get)]
    frame_id: String,
    /// The frame that moves, of an odometry; empty for other types.
    #[pyo3(get)]
    child_frame_id: String,
    /// The texts of ``std_msgs/msg/String``, one a message; empty for other types.
    #[pyo3(get)]
    text: Vec<String>,
    /// Where the log could not be read further, and why, a line each; empty for a sound log.
    #[pyo3(get)]
    damage: Vec<String>,
    arrays: BTreeMap<&'static str, Py<PyArrayDyn<f64>>>,
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
    let mut pulse = Pulse::new(None);
    let every_ns = (every * 1e9).round() as i64;
    let result = py.detach(|| {
        let log = LogReader::open(&log).map_err(IntoPyErr::into_py_err)?;
        read_topic(&log, topic, every_ns, &mut pulse)
    });
    pulse.finish(py, result)?.into_samples(py)
}

/// A message as rows of numbers.
trait Rows: Message {
    /// Names and widths of the arrays.
    const ARRAYS: &'static [(&'static str, usize)];

    /// Adds a row to each array, in their order.
    fn put(&self, table: &mut Table);

    /// What tells the publishers of one topic apart.
    fn publisher(&self) -> &[String] {
        &[]
    }

    /// The frame whose motion is told.
    fn child_frame(&self) -> &str {
        ""
    }

    /// The frame in whose axes the numbers are.
    fn frame(&self) -> &str {
        self.header().map_or("", |header| &header.frame_id)
    }
}

impl Rows for JointState {
    // As wide as there are joints, which the messages tell.
    const ARRAYS: &'static [(&'static str, usize)] =
        &[("position", 0), ("velocity", 0), ("effort", 0)];

    fn put(&self, table: &mut Table) {
        if self.name != table.last_names {
            table.last_names.clone_from(&self.name);
            table.order = self.name.iter().map(|name| table.joint(name)).collect();
        }
        for (array, values) in [&self.position, &self.velocity, &self.effort]
            .into_iter()
            .enumerate()
        {
            let mut row = vec![f64::NAN; table.names.len()];
            // A list that is too short leaves the rest unmeasured.
            for (&joint, &value) in table.order.iter().zip(values) {
                row[joint] = value;
            }
            table.arrays[array].put(row);
        }
    }

    fn publisher(&self) -> &[String] {
        &self.name
    }

    fn frame(&self) -> &str {
        "" // joints have none, whatever the header says
    }
}

impl Rows for WrenchStamped {
    const ARRAYS: &'static [(&'static str, usize)] = &[("wrench", 6)];

    fn put(&self, table: &mut Table) {
        table.arrays[0].put(six(self.wrench.force, self.wrench.torque));
    }
}

impl Rows for Odometry {
    const ARRAYS: &'static [(&'static str, usize)] = &[("pose", 7), ("twist", 6)];

    fn put(&self, table: &mut Table) {
        let (pose, twist) = (&self.pose.pose, &self.twist.twist);
        let position: [f64; 3] = pose.position.into();
        table.arrays[0].put(position.into_iter().chain(four(pose.orientation)));
        table.arrays[1].put(six(twist.linear, twist.angular));
    }

    fn child_frame(&self) -> &str {
        &self.child_frame_id
    }
}

impl Rows for AccelStamped {
    const ARRAYS: &'static [(&'static str, usize)] = &[("acceleration", 6)];

    fn put(&self, table: &mut Table) {
        table.arrays[0].put(six(self.accel.linear, self.accel.angular));
    }
}

impl Rows for Imu {
    const ARRAYS: &'static [(&'static str, usize)] = &[
        ("orientation", 4),
        ("angular_velocity", 3),
        ("linear_acceleration", 3),
    ];

    fn put(&self, table: &mut Table) {
        // A covariance that begins with -1 says that nothing was measured.
        let known = |covariance: &[f64; 9]| {
            if covariance[0] == -1.0 { f64::NAN } else { 1.0 }
        };
        let orientation = known(&self.orientation_covariance);
        let rate = known(&self.angular_velocity_covariance);
        let acceleration = known(&self.linear_acceleration_covariance);
        table.arrays[0].put(four(self.orientation).map(|value| orientation * value));
        table.arrays[1].put(three(self.angular_velocity).map(|value| rate * value));
        table.arrays[2].put(three(self.linear_acceleration).map(|value| acceleration * value));
    }
}

impl Rows for InertiaStamped {
    const ARRAYS: &'static [(&'static str, usize)] = &[("values", 10)];

    fn put(&self, table: &mut Table) {
        let body = &self.inertia;
        let [x, y, z] = body.com.into();
        table.arrays[0].put([
            body.m, x, y, z, body.ixx, body.ixy, body.ixz, body.iyy, body.iyz, body.izz,
        ]);
    }
}

impl Rows for StringMsg {
    const ARRAYS: &'static [(&'static str, usize)] = &[];

    fn put(&self, table: &mut Table) {
        table.text.push(self.data.clone());
    }
}

fn three(vector: Vector3) -> [f64; 3] {
    vector.into()
}

fn four(rotation: Quaternion) -> [f64; 4] {
    [rotation.x, rotation.y, rotation.z, rotation.w]
}

fn six(first: Vector3, second: Vector3) -> impl Iterator<Item = f64> {
    three(first).into_iter().chain(three(second))
}

/// Rows of one width, one after the other.
struct Rectangle {
    name: &'static str,
    width: usize,
    values: Vec<f64>,
}

impl Rectangle {
    fn put(&mut self, row: impl IntoIterator<Item = f64>) {
        self.values.extend(row);
    }

    /// Adds a column that no row has had so far.
    fn widen(&mut self, rows: usize) {
        let row = |row: usize| &self.values[row * self.width..(row + 1) * self.width];
        let wider = |k: usize| row(k).iter().copied().chain(repeat_n(f64::NAN, 1));
        self.values = (0..rows).flat_map(wider).collect();
        self.width += 1;
    }
}

/// What was read so far.
struct Table {
    topic: String,
    type_name: String,
    time_ns: Vec<i64>,
    arrays: Vec<Rectangle>,
    names: Vec<String>,
    /// The joints of the last message, and the column of each.
    last_names: Vec<String>,
    order: Vec<usize>,
    /// The frames of the first message.
    frames: Option<(String, String)>,
    text: Vec<String>,
    /// When each publisher's last message was kept.
    kept_ns: BTreeMap<Vec<String>, i64>,
    damage: Vec<String>,
}

impl Table {
    /// The column of a joint, a new one where it is named for the first time.
    fn joint(&mut self, name: &str) -> usize {
        let found = self.names.iter().position(|known| known == name);
        found.unwrap_or_else(|| {
            for array in &mut self.arrays {
                array.widen(self.time_ns.len());
            }
            self.names.push(name.to_owned());
            self.names.len() - 1
        })
    }

    /// Whether this message is due; where time goes back, it begins anew.
    fn is_due(&mut self, publisher: &[String], time_ns: i64, every_ns: i64) -> bool {
        if every_ns == 0 {
            return true;
        }
        match self.kept_ns.get_mut(publisher) {
            Some(kept) => {
                let due = time_ns < *kept || time_ns >= kept.saturating_add(every_ns);
                if due {
                    *kept = time_ns;
                }
                due
            }
            None => {
                self.kept_ns.insert(publisher.to_vec(), time_ns);
                true
            }
        }
    }

    fn take<M: Rows>(&mut self, message: &M, log_time_ns: u64, every_ns: i64) -> PyResult<()> {
        let time_ns = match message.stamp().map_or(0, |stamp| stamp.as_ns()) {
            0 => i64::try_from(log_time_ns).unwrap_or(i64::MAX),
            stamp_ns => stamp_ns,
        };
        if !self.is_due(message.publisher(), time_ns, every_ns) {
            return Ok(());
        }
        let given = (message.frame(), message.child_frame());
        let (frame, child) = self
            .frames
            .get_or_insert_with(|| (given.0.to_owned(), given.1.to_owned()));
        if (frame.as_str(), child.as_str()) != given {
            return Err(LogError::new_err(format!(
                "topic {} begins in the frame `{frame}` `{child}` and goes on in `{}` `{}`: \
                 one array cannot hold both",
                self.topic, given.0, given.1
            )));
        }
        message.put(self);
        self.time_ns.push(time_ns);
        Ok(())
    }

    fn into_samples(self, py: Python<'_>) -> PyResult<Samples> {
        let rows = Some(self.time_ns.len());
        let start_ns = self.time_ns.first().copied().unwrap_or(0);
        let seconds = |ns: &i64| ns.saturating_sub(start_ns) as f64 * 1e-9;
        let time = self.time_ns.iter().map(seconds).collect();
        let (frame_id, child_frame_id) = self.frames.unwrap_or_default();
        let mut arrays = BTreeMap::new();
        for array in self.arrays {
            let values = output(py, array.values, rows, &[array.width])?;
            arrays.insert(array.name, values.unbind());
        }
        Ok(Samples {
            topic: self.topic,
            type_name: self.type_name,
            start_ns,
            time: output(py, time, rows, &[])?.unbind(),
            names: self.names,
            frame_id,
            child_frame_id,
            text: self.text,
            damage: self.damage,
            arrays,
        })
    }
}

type Read = fn(&LogReader, &str, i64, &mut Pulse) -> PyResult<Table>;

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

fn read_topic(log: &LogReader, topic: &str, every_ns: i64, pulse: &mut Pulse) -> PyResult<Table> {
    // A topic that is not there is refused with the list of those that are.
    log.messages_on([topic]).map_err(IntoPyErr::into_py_err)?;
    let type_name = log.topic(topic).map_or("", |found| &found.type_name);
    let full_name = type_name.replace("/msg/", "/").replacen('/', "/msg/", 1);
    match READABLE.iter().find(|(known, _)| *known == full_name) {
        Some((_, read)) => read(log, topic, every_ns, pulse),
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
    pulse: &mut Pulse,
) -> PyResult<Table> {
    let array = |&(name, width): &(&'static str, usize)| Rectangle {
        name,
        width,
        values: Vec::new(),
    };
    let mut table = Table {
        topic: topic.to_owned(),
        type_name: M::TYPE.to_owned(),
        time_ns: Vec::new(),
        arrays: M::ARRAYS.iter().map(array).collect(),
        names: Vec::new(),
        last_names: Vec::new(),
        order: Vec::new(),
        frames: None,
        text: Vec::new(),
        kept_ns: BTreeMap::new(),
        damage: Vec::new(),
    };
    let mut messages = log.messages_on([topic]).map_err(IntoPyErr::into_py_err)?;
    for (count, raw) in messages.by_ref().enumerate() {
        let raw = raw.map_err(IntoPyErr::into_py_err)?;
        let message: M = raw.decode().map_err(IntoPyErr::into_py_err)?;
        table.take(&message, raw.log_time_ns, every_ns)?;
        if count.is_multiple_of(BEAT_EVERY) && pulse.beat(0.0).is_break() {
            break; // the pulse has the exception
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
