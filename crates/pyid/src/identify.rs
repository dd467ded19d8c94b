//! From a log, or from arrays, to a payload. The package's `identify` calls these.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tactid_dynamics::BaseKind;
use tactid_recordings::{Arrays, Observer, RecordingError, Request, UnloadedArrays};

use crate::arguments::{borrowed, read_joints, read_robot, read_sensors, read_wrenches};
use crate::arrays::{Sampled, Series, common_length};
use crate::dynamics::Manipulator;
use crate::errors::{IntoPyErr, detached, option_error, urdf_is_at_fault, with_option};
use crate::identification::{identification, identified};
use crate::interruption::InterruptionCheck;
use crate::joint_arrays::JointArrays;
use crate::options;
use crate::poses::Poses;
use crate::ranges::GivenLog;

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Identifies the payload from a log: see :func:`tactid.identify`.
#[pyfunction]
#[pyo3(signature = (log, options, progress=None))]
pub(crate) fn identify_log(
    py: Python<'_>,
    log: GivenLog,
    options: &Bound<'_, PyDict>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Py<PyDict>> {
    let request = options::log_request(options)?;
    let result = run(py, progress, |observer| log.identify(&request, observer));
    identified(py, &urdf_errors(py, &request, result)?)
}

/// Returns the parts of a log with one payload each: the times at which each begins and ends, s.
#[pyfunction]
pub(crate) fn split_log(
    py: Python<'_>,
    log: GivenLog,
    options: &Bound<'_, PyDict>,
) -> PyResult<Vec<(f64, f64)>> {
    let request = options::log_request(options)?;
    let result = run(py, None, |observer| log.split(&request, observer));
    let segments = urdf_errors(py, &request, result)?;
    Ok(segments
        .iter()
        .map(|each| (each.begin_s, each.end_s))
        .collect())
}

/// Adds the option of the URDF to an error that is about the given one.
pub(crate) fn urdf_errors<T>(
    py: Python<'_>,
    request: &Request,
    result: PyResult<T>,
) -> PyResult<T> {
    match result {
        Err(error) if request.urdf.is_some() && urdf_is_at_fault(py, &error)? => {
            with_option(Err(error), "urdf")
        }
        result => result,
    }
}

/// Identifies the payload from arrays: see :func:`tactid.identify`.
#[pyfunction]
#[pyo3(signature = (time, options, arrays, progress=None))]
pub(crate) fn identify_arrays(
    py: Python<'_>,
    time: &Bound<'_, PyAny>,
    options: &Bound<'_, PyDict>,
    arrays: GivenArrays<'_>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Py<PyDict>> {
    arrays.with(time, options, |arrays, request| {
        let found = run(py, progress, |observer| {
            tactid_recordings::identify_arrays(arrays, request, observer)
        })?;
        identified(py, &found)
    })
}

/// The arrays of a recording besides its times, by their keywords.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct GivenArrays<'py> {
    robot: Option<Bound<'py, PyAny>>,
    q: Option<Bound<'py, PyAny>>,
    qd: Option<Bound<'py, PyAny>>,
    effort: Option<Bound<'py, PyAny>>,
    wrench: Option<Bound<'py, PyAny>>,
    pose: Option<Bound<'py, PyAny>>,
    twist: Option<Bound<'py, PyAny>>,
    acceleration: Option<Bound<'py, PyAny>>,
    sensors: Option<Bound<'py, PyAny>>,
}

impl GivenArrays<'_> {
    /// Reads the arrays and the options, and does some work with them.
    pub(crate) fn with<T>(
        &self,
        time: &Bound<'_, PyAny>,
        options: &Bound<'_, PyDict>,
        work: impl FnOnce(&Arrays<'_>, &Request) -> PyResult<T>,
    ) -> PyResult<T> {
        let request = options::request(options)?;
        let robot = self.robot.as_ref().map(read_robot).transpose()?;
        let dof = dof_of(robot.as_ref(), &request)?;
        let names = self.sensors.as_ref().map(read_sensors).transpose()?;
        let names = names.as_ref().map(|names| borrowed(names));
        let time = Series::read(time, "time", &[])?;
        let joints = [&self.q, &self.qd, &self.effort].map(Option::as_ref);
        let [q, qd, effort] = read_joints(joints, dof)?;
        let sensors = names.as_ref().map_or(1, Vec::len);
        let wrench = read_wrenches(self.wrench.as_ref(), sensors)?;
        let unloaded = Unloaded::read(options, dof)?;
        let pose = Poses::read_measured_or_identity(self.pose.as_ref(), "pose")?;
        let twist = Series::read_or_empty(self.twist.as_ref(), "twist", 6)?;
        let acceleration = self.acceleration.as_ref();
        let acceleration = Series::read_or_empty(acceleration, "acceleration", 6)?;
        let all: [&dyn Sampled; 8] = [
            &time,
            &q,
            &qd,
            &effort,
            &wrench,
            &pose,
            &twist,
            &acceleration,
        ];
        let count = common_length(&all)?.unwrap_or(1);
        let [time, q, qd, effort, wrench, twist, acceleration] =
            [time, q, qd, effort, wrench, twist, acceleration].map(|series| series.repeated(count));
        let arrays = Arrays {
            robot: robot.as_ref().map(|robot| &robot.get().robot),
            sensors: names.as_deref(),
            time: &time,
            q: &q,
            qd: &qd,
            effort: &effort,
            wrench: &wrench,
            pose: match self.pose {
                Some(_) => pose.as_slice(),
                None => &[],
            },
            twist: &twist,
            acceleration: &acceleration,
            unloaded: unloaded.as_ref().map(Unloaded::arrays),
        };
        work(&arrays, &request)
    }
}

/// Identifies the payload from poses at rest: see :func:`tactid.identify_poses`.
#[pyfunction]
#[pyo3(signature = (options, *, robot=None, q=None, wrench=None, pose=None, sensors=None))]
pub(crate) fn identify_poses(
    py: Python<'_>,
    options: &Bound<'_, PyDict>,
    robot: Argument<'_, '_>,
    q: Argument<'_, '_>,
    wrench: Argument<'_, '_>,
    pose: Argument<'_, '_>,
    sensors: Argument<'_, '_>,
) -> PyResult<Py<PyDict>> {
    let request = options::request(options)?;
    let robot = robot.map(read_robot).transpose()?;
    let [q, _, _] = read_joints([q, None, None], dof_of(robot.as_ref(), &request)?)?;
    let names = sensors.map(read_sensors).transpose()?;
    let names = names.as_ref().map(|names| borrowed(names));
    let wrench = read_wrenches(wrench, names.as_ref().map_or(1, Vec::len))?;
    let given_pose = pose.is_some();
    let pose = Poses::read_measured_or_identity(pose, "pose")?;
    let count = common_length(&[&q as &dyn Sampled, &wrench, &pose])?.unwrap_or(1);
    let [q, wrench] = [q, wrench].map(|series| series.repeated(count));
    let arrays = Arrays {
        robot: robot.as_ref().map(|robot| &robot.get().robot),
        sensors: names.as_deref(),
        q: &q,
        wrench: &wrench,
        pose: if given_pose { pose.as_slice() } else { &[] },
        ..Arrays::default()
    };
    let found = detached(py, || tactid_recordings::identify_poses(&arrays, &request))?;
    let found = found.map_err(IntoPyErr::into_py_err)?;
    identification(py, &found, &found.recording)
}

/// Returns the number of joints of the robot, which is given or read from the URDF; `None` where
/// there is no robot.
pub(crate) fn dof_of(
    robot: Option<&Bound<'_, Manipulator>>,
    request: &Request,
) -> PyResult<Option<usize>> {
    match (robot, &request.urdf) {
        (Some(robot), _) => Ok(Some(robot.get().robot.dof())),
        (None, Some(urdf)) => {
            let robot = urdf.manipulator(BaseKind::Fixed);
            let robot = with_option(robot.map_err(IntoPyErr::into_py_err), "urdf")?;
            Ok(Some(robot.dof()))
        }
        (None, None) => Ok(None),
    }
}

/// The unloaded reference of arrays.
struct Unloaded(JointArrays);

impl Unloaded {
    /// Reads the option `unloaded`: a mapping with the arrays `time`, `q` and `effort`.
    fn read(options: &Bound<'_, PyDict>, dof: Option<usize>) -> PyResult<Option<Self>> {
        let Some(given) = options::unloaded_arrays(options)? else {
            return Ok(None);
        };
        let get = |key: &str| match given.get_item(key) {
            Ok(value) if !value.is_none() => Ok(value),
            _ => Err(option_error(
                format!("the unloaded reference has no `{key}`: it needs `time`, `q` and `effort`"),
                "unloaded",
            )),
        };
        let names = [
            "unloaded[\"time\"]",
            "unloaded[\"q\"]",
            "unloaded[\"effort\"]",
        ];
        let [time, q, effort] = [get("time")?, get("q")?, get("effort")?];
        let given = JointArrays::read(names, [&time, &q, &effort], None, dof.unwrap_or(0))?;
        Ok(Some(Self(given)))
    }

    fn arrays(&self) -> UnloadedArrays<'_> {
        UnloadedArrays {
            time: &self.0.time,
            q: &self.0.q,
            effort: &self.0.effort,
        }
    }
}

/// Runs an identification with the interpreter released.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&mut Observer<'_>) -> Result<T, RecordingError> + Send,
) -> PyResult<T> {
    let mut interruption = InterruptionCheck::new(progress);
    let result = detached(py, || {
        work(&mut |progress| interruption.check(progress.fraction))
    })?;
    interruption.finish(py, result.map_err(IntoPyErr::into_py_err))
}

/// Writes an estimate over time as a log: see :meth:`tactid.Identification.write_estimates`.
///
/// Args:
///     path: The ``.mcap`` file to write.
///     frame: Name of the frame in which the payload is expressed.
///     start_ns: Stamp of time zero, ns since the epoch.
///     times: Times of the estimates, (H,), s.
///     values: The ten values at each time, (H, 10).
///     std_devs: Their standard deviations, (H, 10), if the estimator has any.
///
/// Raises:
///     LogError: The file cannot be written.
///     ArgumentError: A shape does not fit.
#[pyfunction]
#[pyo3(signature = (path, *, frame, start_ns, times, values, std_devs=None))]
pub(crate) fn write_estimates(
    py: Python<'_>,
    path: PathBuf,
    frame: &str,
    start_ns: i64,
    times: &Bound<'_, PyAny>,
    values: &Bound<'_, PyAny>,
    std_devs: Argument<'_, '_>,
) -> PyResult<()> {
    let times = Series::read(times, "times", &[])?;
    let values = Series::read(values, "values", &[10])?;
    let std_devs = std_devs.map(|given| Series::read(given, "std_devs", &[10]));
    let std_devs = std_devs.transpose()?;
    let mut all: Vec<&dyn Sampled> = vec![&times, &values];
    all.extend(std_devs.iter().map(|series| series as &dyn Sampled));
    let count = common_length(&all)?.unwrap_or(1);
    let ten = |series: &Series, k| std::array::from_fn(|entry| series.at(k)[entry]);
    let uncertainty = |k| std_devs.as_ref().map(|series| ten(series, k));
    let points = (0..count).map(|k| (times.at(k)[0], ten(&values, k), uncertainty(k)));
    detached(py, || {
        tactid_recordings::write_estimates(&path, frame, start_ns, points)
    })?
    .map_err(IntoPyErr::into_py_err)
}
