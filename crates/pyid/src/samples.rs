//! The messages of one topic as arrays that Python reads.

use std::collections::BTreeMap;

use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::errors::ArgumentError;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Messages of one topic of a log as arrays, as :func:`read` returns them.
///
/// ``samples["position"]`` is an array with one entry a message; :meth:`keys` lists them:
///
/// - ``sensor_msgs/msg/JointState``: ``position``, ``velocity``, ``effort``, each (N, joints), in
///   the order of :attr:`names`; rad or m and seconds, N m or N.
/// - ``geometry_msgs/msg/WrenchStamped``: ``wrench`` (N, 6), force then moment, N and N m, in the
///   axes of :attr:`frame_id` and about its origin.
/// - ``nav_msgs/msg/Odometry``: ``pose`` (N, 7), ``[x, y, z, qx, qy, qz, qw]`` of
///   :attr:`child_frame_id` in :attr:`frame_id`, m; ``twist`` (N, 6), linear then angular, in the
///   axes of the child, m/s and rad/s. Arrays of samples need it in the axes of the world: turn
///   both vectors by the quaternion of the pose.
/// - ``geometry_msgs/msg/AccelStamped``: ``acceleration`` (N, 6), linear then angular, m/s² and
///   rad/s².
/// - ``sensor_msgs/msg/Imu``: ``orientation`` (N, 4), ``[qx, qy, qz, qw]``; ``angular_velocity``
///   (N, 3), rad/s; ``linear_acceleration`` (N, 3), the specific force, m/s².
/// - ``geometry_msgs/msg/InertiaStamped``: ``values`` (N, 10), in the order of ``VALUE_NAMES``.
/// - ``std_msgs/msg/String``: no array, but :attr:`text`.
///
/// NaN stands for what was not measured.
#[pyclass(module = "tactid", frozen)]
pub(crate) struct Samples {
    /// Name of the topic, such as ``/joint_states``.
    #[pyo3(get)]
    pub(crate) topic: String,
    /// Type of the messages, such as ``sensor_msgs/msg/JointState``.
    #[pyo3(get)]
    pub(crate) type_name: String,
    /// Time of the first message, at which ``time`` is zero, ns since the epoch of the log's clock.
    #[pyo3(get)]
    pub(crate) start_ns: i64,
    /// Time of each message, in the order of logging, (N,), s: its header's stamp, or its log time
    /// where there is none.
    #[pyo3(get)]
    pub(crate) time: Py<PyArrayDyn<f64>>,
    /// Names of the joints, in the order in which the topic first names them; empty for other
    /// types.
    #[pyo3(get)]
    pub(crate) names: Vec<String>,
    /// Name of the frame in the messages' headers; empty for joints and texts.
    #[pyo3(get)]
    pub(crate) frame_id: String,
    /// Name of the moving frame of an odometry; empty for other types.
    #[pyo3(get)]
    pub(crate) child_frame_id: String,
    /// Texts of the messages of ``std_msgs/msg/String``; empty for other types.
    #[pyo3(get)]
    pub(crate) text: Vec<String>,
    /// Places where the log could not be read further, with the reason, a line each; empty for a
    /// sound log.
    #[pyo3(get)]
    pub(crate) damage: Vec<String>,
    pub(crate) arrays: BTreeMap<&'static str, Py<PyArrayDyn<f64>>>,
}

#[pymethods]
impl Samples {
    /// Returns the names of the arrays.
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

pub(crate) fn listed(names: &[&str]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}
