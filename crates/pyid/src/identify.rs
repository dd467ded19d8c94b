//! From a log, or from arrays, to a payload. The package's `identify` calls these.

use std::path::PathBuf;

use pyo3::prelude::*;
use tactid_recordings::{Arrays, HistoryPoint, Observer};

use crate::arrays::{Poses, Sampled, Series, common_length};
use crate::dynamics::Manipulator;
use crate::errors::IntoPyErr;
use crate::identification::IdentificationData;
use crate::interruption::InterruptionCheck;
use crate::options;

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Identifies the payload from a log: see :func:`tactid.identify`.
#[pyfunction]
#[pyo3(signature = (log, options, progress=None))]
pub(crate) fn identify_log(
    py: Python<'_>,
    log: PathBuf,
    options: &Bound<'_, PyAny>,
    progress: Option<Py<PyAny>>,
) -> PyResult<IdentificationData> {
    let request = options::request(options)?;
    run(py, progress, |observer| {
        tactid_recordings::identify_log(&log, &request, observer)
    })
}

/// Identifies the payload from arrays: see :func:`tactid.identify`.
#[pyfunction]
#[pyo3(signature = (time, options, progress=None, *, robot=None, q=None, qd=None, effort=None, wrench=None, pose=None, twist=None, acceleration=None, sensors=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn identify_arrays(
    py: Python<'_>,
    time: &Bound<'_, PyAny>,
    options: &Bound<'_, PyAny>,
    progress: Option<Py<PyAny>>,
    robot: Option<&Manipulator>,
    q: Argument<'_, '_>,
    qd: Argument<'_, '_>,
    effort: Argument<'_, '_>,
    wrench: Argument<'_, '_>,
    pose: Argument<'_, '_>,
    twist: Argument<'_, '_>,
    acceleration: Argument<'_, '_>,
    sensors: Option<Vec<String>>,
) -> PyResult<IdentificationData> {
    let request = options::request(options)?;
    let dof = robot.map_or(0, |robot| robot.0.dof());
    let names: Option<Vec<&str>> = sensors
        .as_ref()
        .map(|names| names.iter().map(String::as_str).collect());
    let time = Series::read(time, "source", &[])?;
    let q = Series::read_or_empty(q, "q", dof)?;
    let qd = Series::read_or_empty(qd, "qd", dof)?;
    let effort = Series::read_or_empty(effort, "effort", dof)?;
    let wrench = read_wrench(wrench, names.as_ref().map_or(1, Vec::len))?;
    let has_pose = pose.is_some();
    let pose = Poses::read_measured_or_identity(pose, "pose")?;
    let twist = Series::read_or_empty(twist, "twist", 6)?;
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
        robot: robot.map(|robot| &robot.0),
        sensors: names.as_deref(),
        times_s: &time,
        joint_position: &q,
        joint_velocity: &qd,
        joint_effort: &effort,
        wrenches: &wrench,
        poses: if has_pose { pose.as_slice() } else { &[] },
        twists: &twist,
        accelerations: &acceleration,
    };
    run(py, progress, |observer| {
        tactid_recordings::identify_arrays(&arrays, &request, observer)
    })
}

/// Wrenches of one sensor, (N, 6) or (N, 1, 6), or of several, (N, S, 6).
fn read_wrench(given: Argument<'_, '_>, sensors: usize) -> PyResult<Series> {
    let Some(given) = given else {
        return Series::read_or_empty(None, "wrench", 6);
    };
    if sensors != 1 {
        return Series::read(given, "wrench", &[sensors, 6]);
    }
    let one = Series::read(given, "wrench", &[6]);
    one.or_else(|error| Series::read(given, "wrench", &[1, 6]).map_err(|_| error))
}

/// Runs an identification with the interpreter released.
fn run(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(
        &mut Observer<'_>,
    )
        -> Result<tactid_recordings::Identification, tactid_recordings::RecordingError>
    + Send,
) -> PyResult<IdentificationData> {
    let mut interruption = InterruptionCheck::new(progress);
    let result = py.detach(|| work(&mut |progress| interruption.check(progress.fraction)));
    let found = interruption.finish(py, result.map_err(IntoPyErr::into_py_err))?;
    IdentificationData::new(py, found)
}

/// Writes an estimate over time as a log: see :meth:`tactid.Identification.write_estimates`.
///
/// Args:
///     path: The ``.mcap`` file to write.
///     frame: Name of the frame in which the payload is expressed.
///     start_ns: Stamp of time zero, ns since the epoch.
///     times: Times of the estimates, (H,), s.
///     values: The ten values at each time, (H, 10).
///     std_devs: Their standard deviations, (H, 10); NaN where none are known.
///
/// Raises:
///     LogError: The file cannot be written.
///     ArgumentError: A shape does not fit.
#[pyfunction]
#[pyo3(signature = (path, *, frame, start_ns, times, values, std_devs))]
pub(crate) fn write_estimates(
    py: Python<'_>,
    path: PathBuf,
    frame: &str,
    start_ns: i64,
    times: &Bound<'_, PyAny>,
    values: &Bound<'_, PyAny>,
    std_devs: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let times = Series::read(times, "times", &[])?;
    let values = Series::read(values, "values", &[10])?;
    let std_devs = Series::read(std_devs, "std_devs", &[10])?;
    let count = common_length(&[&times, &values, &std_devs])?.unwrap_or(1);
    let ten = |series: &Series, k| std::array::from_fn(|entry| series.at(k)[entry]);
    let point = |k| {
        let uncertain: [f64; 10] = ten(&std_devs, k);
        HistoryPoint {
            epoch: 0,
            time_s: times.at(k)[0],
            values: ten(&values, k),
            std_devs: (!uncertain.iter().any(|entry| entry.is_nan())).then_some(uncertain),
        }
    };
    let points: Vec<_> = (0..count).map(point).collect();
    py.detach(|| tactid_recordings::write_estimates(&path, frame, start_ns, &points))
        .map_err(IntoPyErr::into_py_err)
}
