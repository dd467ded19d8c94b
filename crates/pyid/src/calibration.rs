//! Calibration of an arm from logs and arrays. The package's `calibrate` calls it.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyMapping, PyTuple};
use schemars::JsonSchema;
use serde::Serialize;
use tactid_batch::Table;
use tactid_calibrate::EffortComparison;
use tactid_dynamics::Manipulator;
use tactid_recordings::{
    CalibrationRecording, CalibrationRequest, CalibrationSource, CalibrationSources, Kind,
    RecordingRole, Request,
};

use crate::arguments::read_robot;
use crate::arm_model::ArmModel;
use crate::errors::{ArgumentError, IntoPyErr, detached, in_recording};
use crate::faults::faults;
use crate::findings::findings;
use crate::identify::{dof_of, urdf_errors};
use crate::interruption::InterruptionCheck;
use crate::joint_arrays::JointArrays;
use crate::options;
use crate::record::{AddedFaults, AddedFindings, fields};

/// A recording of a calibration: measured and modelled efforts of W windows and n joints.
#[derive(Serialize, JsonSchema)]
#[serde(rename = "CalibrationRecording")]
pub(crate) struct RecordingData {
    /// Path of the log; of arrays, their place among the arguments, such as `unloaded[0]`.
    #[schemars(extend("x-class" = "Path"))]
    path: String,
    /// What the recording is to the calibration: without a payload, with a known one, or not used.
    role: Role,
    /// Time from the first sample to the last, s.
    duration_s: f64,
    /// Time of the middle of each window on the recording's clock, s, (W,).
    #[schemars(extend("kept" = "memory"))]
    times_s: Vec<f64>,
    /// Joint velocities, rad/s or m/s, (W, n).
    #[schemars(extend("kept" = "memory"))]
    velocity: Table,
    /// Measured efforts without their delay, N m or N, (W, n).
    #[schemars(extend("kept" = "memory"))]
    measured: Table,
    /// Efforts of the URDF alone, with the payload and without friction, N m or N, (W, n).
    #[schemars(extend("kept" = "memory"))]
    described: Table,
    /// Efforts of the calibrated model with the payload, N m or N, (W, n).
    #[schemars(extend("kept" = "memory"))]
    calibrated: Table,
    /// What `calibrated` contains beside the torques of the links and the payload, N m or N, (W,
    /// n).
    #[schemars(extend("kept" = "memory"))]
    friction: Table,
    /// What was wrong with messages or samples, and how often.
    faults: AddedFaults,
    /// What was noticed about the recording.
    findings: AddedFindings,
    /// Where the log could not be read further, and why, an entry each.
    damage: Vec<String>,
}

/// What a recording is to a calibration.
#[derive(Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Role {
    Unloaded,
    Loaded,
    HoldOut,
}

/// Returns the fields of `tactid.CalibrationRecording`.
fn recording_data(py: Python<'_>, recording: CalibrationRecording) -> PyResult<Py<PyDict>> {
    let EffortComparison {
        joints,
        times_s,
        velocities,
        measured,
        described,
        calibrated,
        friction,
    } = recording.comparison;
    let table = |values| Table {
        columns: joints.len(),
        values,
    };
    let data = RecordingData {
        path: recording.path.to_string_lossy().into_owned(),
        role: match recording.role {
            RecordingRole::Unloaded => Role::Unloaded,
            RecordingRole::Loaded => Role::Loaded,
            RecordingRole::HeldOut => Role::HoldOut,
        },
        duration_s: recording.duration_s,
        times_s,
        velocity: table(velocities),
        measured: table(measured),
        described: table(described),
        calibrated: table(calibrated),
        friction: table(friction),
        faults: AddedFaults,
        findings: AddedFindings,
        damage: recording.damage,
    };
    let data = fields(py, &data)?;
    data.set_item("path", recording.path)?;
    data.set_item("faults", faults(py, &recording.faults)?)?;
    data.set_item("findings", findings(py, &recording.findings, "keyword")?)?;
    Ok(data.unbind())
}

/// What `tactid.calibrate` makes its result from.
#[derive(IntoPyObject)]
pub(crate) struct RunData {
    model: Py<ArmModel>,
    gain_prior: f64,
    recordings: Vec<Py<PyDict>>,
}

/// Calibrates an arm from logs and arrays: see :func:`tactid.calibrate`. `given` are its own
/// options.
///
/// The arrays of a recording are a mapping of ``time``, ``q``, ``effort`` and maybe ``qd``.
#[pyfunction]
#[pyo3(signature = (given, options, progress=None, robot=None))]
pub(crate) fn calibrate_arm(
    py: Python<'_>,
    given: &Bound<'_, PyDict>,
    options: &Bound<'_, PyDict>,
    progress: Option<Py<PyAny>>,
    robot: Option<&Bound<'_, PyAny>>,
) -> PyResult<RunData> {
    let plain = given.copy()?;
    let request = options::request(options)?;
    let robot = robot.map(read_robot).transpose()?;
    let [unloaded, loaded, held_out] = recordings(&plain, robot.as_ref(), &request)?;
    let calibration: CalibrationRequest = options::read(&plain, CalibrationRequest::OPTIONS)?;
    let payloads = calibration.payloads(loaded.len());
    let payloads = payloads.map_err(IntoPyErr::into_py_err)?;
    let of_robot = robot.as_ref().map(|robot| &robot.get().robot);
    let sources = CalibrationSources {
        unloaded: Given::sources(&unloaded, of_robot),
        loaded: Given::sources(&loaded, of_robot)
            .into_iter()
            .zip(payloads)
            .collect(),
        held_out: Given::sources(&held_out, of_robot),
        gain_std_dev: calibration.gain_std_dev,
    };
    let mut interruption = InterruptionCheck::new(progress);
    let result = detached(py, || {
        let observer =
            &mut |progress: tactid_recordings::Progress| interruption.check(progress.fraction);
        tactid_recordings::calibrate_arm(&sources, &request, observer)
    })?;
    let found = interruption.finish(py, result.map_err(IntoPyErr::into_py_err));
    let run = urdf_errors(py, &request, found)?;
    let recordings = run
        .recordings
        .into_iter()
        .map(|each| recording_data(py, each));
    Ok(RunData {
        gain_prior: run.gain_std_dev,
        recordings: recordings.collect::<PyResult<_>>()?,
        model: Py::new(py, ArmModel(Arc::new(run.arm)))?,
    })
}

/// Takes the recordings out of options: the unloaded ones, the loaded ones, and those that are held
/// out.
fn recordings(
    options: &Bound<'_, PyDict>,
    robot: Option<&Bound<'_, crate::dynamics::Manipulator>>,
    request: &Request,
) -> PyResult<[Vec<Given>; 3]> {
    let read = |role: &'static str| {
        let given = options::take(options, role)?;
        let each = given.map_or_else(|| Ok(Vec::new()), |given| sources(role, &given))?;
        let each = each.iter().enumerate();
        each.map(|(index, given)| {
            let name = format!("{role}[{index}]");
            Given::read(given, name, || dof_of(robot, request))
        })
        .collect::<PyResult<Vec<Given>>>()
    };
    let all = [read("unloaded")?, read("loaded")?, read("hold_out")?];
    let is_log = |given: &Given| matches!(given, Given::Log(_));
    if robot.is_some() && all.iter().flatten().all(is_log) {
        return Err(ArgumentError::new_err(
            "`robot` belongs to arrays, but all recordings are logs: give `urdf`",
        ));
    }
    Ok(all)
}

/// Returns the recordings of a role: the path of a log, arrays by their names, or a list of these.
fn sources<'py>(role: &'static str, given: &Bound<'py, PyAny>) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let is_list = given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>();
    let all: Vec<Bound<'py, PyAny>> = if is_list {
        given.extract()?
    } else {
        vec![given.clone()]
    };
    let is_source = |given: &Bound<'_, PyAny>| {
        given.extract::<PathBuf>().is_ok() || given.cast::<PyMapping>().is_ok()
    };
    if all.iter().all(is_source) {
        return Ok(all);
    }
    let expected = options::expected(Kind::Recordings);
    Err(options::unexpected(role, given, &expected))
}

/// The arrays that a recording must have.
const NEEDED: [&str; 3] = ["time", "q", "effort"];

/// Checks that arrays have all names that are needed, and no other than these and `qd`.
fn check_names(what: &str, arrays: &Bound<'_, PyMapping>) -> PyResult<()> {
    let wrong = |name: &str, has: &str| {
        let expected = "arrays are `time`, `q`, `effort` and, if measured, `qd`";
        Err(ArgumentError::new_err(format!(
            "`{what}` {has} `{name}`: {expected}"
        )))
    };
    for name in NEEDED {
        if !matches!(arrays.get_item(name), Ok(array) if !array.is_none()) {
            return wrong(name, "has no");
        }
    }
    for name in arrays.keys()? {
        let name = name.to_string();
        if name != "qd" && !NEEDED.contains(&&*name) {
            return wrong(&name, "has");
        }
    }
    Ok(())
}

/// A recording as it is given.
enum Given {
    Log(PathBuf),
    Arrays { name: String, joints: JointArrays },
}

impl Given {
    /// Reads the path of a log, or arrays, which errors call by their name.
    fn read(
        given: &Bound<'_, PyAny>,
        name: String,
        dof: impl FnOnce() -> PyResult<Option<usize>>,
    ) -> PyResult<Self> {
        if let Ok(path) = given.extract() {
            return Ok(Self::Log(path));
        }
        let read = || {
            check_names(&name, given.cast()?)?;
            let dof = dof()?.ok_or_else(|| {
                ArgumentError::new_err("arrays need the robot whose joints they are: give `robot`")
            })?;
            let [time, q, effort] = NEEDED.map(|name| given.get_item(name));
            let (time, q, effort, qd) = (time?, q?, effort?, given.get_item("qd").ok());
            JointArrays::read(NEEDED, [&time, &q, &effort], qd.as_ref(), dof)
        };
        match read() {
            Ok(joints) => Ok(Self::Arrays { name, joints }),
            Err(error) => Err(in_recording(&name, error)),
        }
    }

    fn sources<'a>(
        given: &'a [Self],
        robot: Option<&'a Manipulator>,
    ) -> Vec<CalibrationSource<'a>> {
        given.iter().map(|each| each.source(robot)).collect()
    }

    fn source<'a>(&'a self, robot: Option<&'a Manipulator>) -> CalibrationSource<'a> {
        match self {
            Self::Log(path) => CalibrationSource::Log(path.clone()),
            Self::Arrays { name, joints } => CalibrationSource::Arrays {
                name: name.clone(),
                arrays: joints.of_robot(robot),
            },
        }
    }
}
