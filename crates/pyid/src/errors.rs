//! From each crate's error to the Python exception of its kind.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use tactid_identify::{IdentifyError, digits, three_digits};
use tactid_nlms::SettingError;
use tactid_recordings::RecordingError;

use crate::faults::fault_data;

pyo3::import_exception!(tactid._base.errors, TactidError);
pyo3::import_exception!(tactid._base.errors, ArgumentError);
pyo3::import_exception!(tactid._base.errors, ModelError);
pyo3::import_exception!(tactid._base.errors, LogError);
pyo3::import_exception!(tactid._base.errors, ExperimentError);
pyo3::import_exception!(tactid._base.errors, SimulationError);
pyo3::import_exception!(tactid._base.errors, ExcitationError);
pyo3::import_exception!(tactid._base.errors, IdentificationError);
pyo3::import_exception!(tactid._base.errors, CalibrationError);
pyo3::import_exception!(tactid._base.errors, InternalError);

/// Runs a computation with the interpreter released.
///
/// # Errors
/// Returns the error of [`guarded`].
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| guarded(work))
}

/// Runs a computation, and turns a panic into an error.
///
/// # Errors
/// Returns `InternalError` if the work panics, which is a fault of tactid. PyO3 would raise `PanicException`, which `except
/// Exception` does not catch. The panic hook prints the place.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> PyResult<T> {
    // Safe to resume: state is dropped or belongs to a solver whose memory stays valid.
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let what = text.or_else(|| panic.downcast_ref::<&str>().copied());
        let what = what.unwrap_or("unknown");
        InternalError::new_err(format!("internal error: {what}; please report it"))
    })
}

/// Converts an error of a crate into the Python exception of its kind.
pub(crate) trait IntoPyErr {
    fn into_py_err(self) -> PyErr;
}

/// An argument error that the option `name` causes.
pub(crate) fn option_error(message: String, name: &'static str) -> PyErr {
    ArgumentError::new_err((message, name))
}

/// Adds the option that causes an error, if there is one.
pub(crate) fn with_option<T>(result: PyResult<T>, name: &'static str) -> PyResult<T> {
    result.inspect_err(|error| {
        Python::attach(|py| {
            let value = error.value(py);
            // An exception that takes no attribute is still raised, without the option.
            if value.is_instance_of::<PyException>() {
                let _ = value.setattr("option", name);
            }
        });
    })
}

/// Returns whether an error is that of a model, and of no other option than the URDF.
pub(crate) fn urdf_is_at_fault(py: Python<'_>, error: &PyErr) -> PyResult<bool> {
    Ok(error.is_instance_of::<ModelError>(py) && error.value(py).getattr("option")?.is_none())
}

/// Puts the path of a recording in front of the message of its error, unless the message has it.
pub(crate) fn in_recording(path: &Path, error: PyErr) -> PyErr {
    let path = path.display().to_string();
    reworded(error, |message| {
        if message.contains(&path) {
            message
        } else {
            format!("{path}: {message}")
        }
    })
}

/// Changes the message of an error; an exception that is not ours stays as it is.
fn reworded(error: PyErr, reword: impl FnOnce(String) -> String) -> PyErr {
    Python::attach(|py| {
        let value = error.value(py);
        let message = value
            .getattr("message")
            .and_then(|message| message.extract::<String>());
        if let Ok(message) = message {
            let _ = value.setattr("message", reword(message));
        }
    });
    error
}

impl IntoPyErr for tactid_dynamics::ModelError {
    fn into_py_err(self) -> PyErr {
        ModelError::new_err(self.to_string())
    }
}

impl IntoPyErr for tactid_dynamics::StateError {
    fn into_py_err(self) -> PyErr {
        ArgumentError::new_err(self.to_string())
    }
}

impl IntoPyErr for SettingError {
    fn into_py_err(self) -> PyErr {
        ArgumentError::new_err(setting_message(&self))
    }
}

impl IntoPyErr for tactid_logs::LogError {
    fn into_py_err(self) -> PyErr {
        let message = match &self {
            Self::Memory { .. } => format!(
                "{self}; `tactid.set_log_memory` allows more, and so does `tactid --log-memory` before the command"
            ),
            _ => self.to_string(),
        };
        LogError::new_err(message)
    }
}

/// Returns the error of a setting of an estimator.
fn setting_error(error: SettingError) -> PyErr {
    match error {
        SettingError::Alpha(_) => option_error(setting_message(&error), "alpha"),
        SettingError::Beta(_) => option_error(setting_message(&error), "beta"),
        // No option sets these: the identification does not use LMS, and detects changes by constants.
        SettingError::Step(_)
        | SettingError::RowsBetweenFalseAlarms(_)
        | SettingError::CorrelationRows(_)
        | SettingError::Shift(_)
        | SettingError::Growth(_)
        | SettingError::Clip(_) => error.into_py_err(),
    }
}

impl IntoPyErr for IdentifyError {
    fn into_py_err(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::Model(error) => error.into_py_err(),
            Self::State(error) => error.into_py_err(),
            Self::Setting(error) => setting_error(error),
            Self::Value {
                name,
                given,
                expected,
            } => value_error(name, given, expected),
            Self::NoiseCount {
                name,
                given,
                of,
                expected,
            } => {
                let each = format!("give one for all, or one for each of the {expected} {of}");
                option_error(format!("`{name}` has {given} entries: {each}"), name)
            }
            Self::Box { name, .. } => option_error(message, name),
            Self::ImpossibleTool => body_error(&message, "known_tool"),
            Self::PayloadInertia => body_error(&message, "payload_inertia"),
            Self::PriorNeedsLeastSquares(_) | Self::NeedsLeastSquares(_) => {
                option_error(pointing_to(&message, "estimator"), "estimator")
            }
            Self::WrenchCount { .. }
            | Self::NoRuns
            | Self::SameRunTwice { .. }
            | Self::Information { .. } => ArgumentError::new_err(message),
            Self::NoWrench | Self::FixedBase | Self::NoMasses { .. } => {
                identification_error(&message, Some("method"))
            }
            Self::TooFewWindows { .. } | Self::TooFewSamples { .. } => {
                identification_error(&message, Some("cutoff_hz"))
            }
            Self::NoEfforts
            | Self::Interrupted
            | Self::EffortReversed { .. }
            | Self::GainUnexpected { .. }
            | Self::GainsUnexpected { .. }
            | Self::UnloadedHolds { .. }
            | Self::UnloadedDiffers
            | Self::UnloadedCalibrated
            | Self::EffortConstant { .. }
            | Self::GainsNotPositive { .. }
            | Self::EffortSignChanged { .. }
            | Self::EffortDelay { .. }
            | Self::CalibrationBase(_)
            | Self::NoMotion { .. }
            | Self::CalibrationRobot { .. }
            | Self::CalibrationLink { .. }
            | Self::RecordingLink { .. }
            | Self::CalibrationMismatch { .. }
            | Self::CalibrationFailed
            | Self::CalibrationData { .. } => CalibrationError::new_err(message),
        }
    }
}

impl IntoPyErr for RecordingError {
    fn into_py_err(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::Identify(error) => error.into_py_err(),
            Self::Log(error) => error.into_py_err(),
            Self::SameRecording { .. } | Self::NotTheSame { .. } => ArgumentError::new_err(message),
            Self::UnloadedLog(_) => LogError::new_err((message, "unloaded")),
            Self::NoSuchTopic { kind, .. } => option_error(message, kind.option()),
            Self::EffortGains { .. } => option_error(message, "effort_gain"),
            Self::NotForArrays(name) => {
                option_error(format!("`{name}` does not apply to arrays"), name)
            }
            Self::NoSamples => ArgumentError::new_err(message),
            Self::UnknownTip { .. } => {
                let name = "tip";
                ModelError::new_err((pointing_to(&message, name), name))
            }
            Self::RobotTwice => {
                ArgumentError::new_err("`robot` and `urdf` are both given: give one of them")
            }
            Self::BaseIsFixed { name } => ArgumentError::new_err(format!(
                "`{name}` is about a base that moves, but that of the robot is fixed: read the robot with \
                 base=\"floating\"; for a fixed base that is tilted, give `gravity` in the axes of the base"
            )),
            Self::ArrayLength {
                name,
                given,
                expected,
            } => ArgumentError::new_err(format!(
                "`{}` has {given} entries, but must have {expected}",
                array_keyword(name)
            )),
            Self::MissingArray { name, reason } => {
                ArgumentError::new_err(format!("`{name}` is missing: {reason}"))
            }
            Self::SensorFrameNorm(norm) => sensor_frame_norm(norm),
            Self::SensorFrameForSeveral(_) => option_error(message, "sensor_frame"),
            // The recording or the topic that the option names is at fault.
            Self::OtherMotion { .. } | Self::NoSharedMotion | Self::SeveralUnloadedTopics(_) => {
                IdentificationError::new_err((message, "unloaded"))
            }
            Self::ImuFrame { .. } => IdentificationError::new_err((message, "imu_topic")),
            Self::NoOverlap { faults, .. } => match Python::attach(|py| fault_data(py, &faults)) {
                Ok(faults) => IdentificationError::new_err((message, None::<&str>, faults)),
                Err(error) => error,
            },
            other => several_or_calibration_error(other, message),
        }
    }
}

/// Returns how Python writes the name of an array, which may be one of an unloaded reference.
fn array_keyword(name: &str) -> String {
    match name.split_once('.') {
        Some((reference, array)) => format!("{reference}[\"{array}\"]"),
        None => name.to_owned(),
    }
}

/// An error of a number that is out of range.
fn value_error(name: &'static str, given: f64, expected: &str) -> PyErr {
    let given = digits(given);
    option_error(format!("`{name}` is {given}, but must be {expected}"), name)
}

/// An error of a body that cannot exist, which an option gives and the message names.
fn body_error(message: &str, name: &'static str) -> PyErr {
    option_error(message.replacen(name, &format!("`{name}`"), 1), name)
}

/// An error of a rotation of a sensor's frame that is none.
fn sensor_frame_norm(norm: f64) -> PyErr {
    let name = "sensor_frame";
    let norm = three_digits(norm);
    option_error(
        format!(
            "the quaternion (qx, qy, qz, qw) of `{name}` has the norm {norm}, but must have the norm 1"
        ),
        name,
    )
}

/// An error of one of several recordings, of a calibration, or of an identification.
fn several_or_calibration_error(error: RecordingError, message: String) -> PyErr {
    match error {
        RecordingError::InRecording { path, source } => in_recording(&path, source.into_py_err()),
        RecordingError::DamagedEarly { source, damage } => {
            reworded(source.into_py_err(), |message| {
                format!("{message}; the log is damaged: {damage}")
            })
        }
        RecordingError::OptionConflict { name, .. } => option_error(message, name),
        RecordingError::NothingToCalibrate => option_error(message, "unloaded"),
        RecordingError::RenamedJoint { .. } | RecordingError::RenamedTwice { .. } => {
            option_error(message, "rename_joints")
        }
        RecordingError::NotWithCalibration { name } => option_error(message, name),
        RecordingError::EffortGainsUnexpected { .. } => {
            let name = "effort_gain";
            let message = message.replacen(
                "effort gains must be given first:",
                &format!("gains must be given first: `{name}`"),
                1,
            );
            CalibrationError::new_err((message, name))
        }
        RecordingError::CalibrationIo { .. }
        | RecordingError::CalibrationText(_)
        | RecordingError::CalibrationFile { .. } => CalibrationError::new_err(message),
        other => identification_error(&message, remedy(&other)),
    }
}

/// The option that resolves an error of a recording; `None` where there is none.
fn remedy(error: &RecordingError) -> Option<&'static str> {
    match error {
        RecordingError::UnloadedNeedsEffort => Some("method"),
        RecordingError::MissingJoint { .. } => Some("rename_joints"),
        RecordingError::TooManyGaps { .. } => Some("max_gap_s"),
        RecordingError::RareSamples { unit: None, .. } => Some("cutoff_hz"),
        RecordingError::SeveralTopics { kind, .. } => Some(kind.option()),
        RecordingError::UnrelatedWrenches { .. } => Some("wrench_topic"),
        RecordingError::UnknownFrame { topic: Some(_), .. } => Some("sensor_frame"),
        RecordingError::UnknownFrame { topic: None, .. } => Some("tip"),
        RecordingError::NoUrdf(_) => Some("urdf"),
        _ => None,
    }
}

/// An error of an identification, whose message names the option that resolves it.
fn identification_error(message: &str, option: Option<&'static str>) -> PyErr {
    match option {
        Some(name) => IdentificationError::new_err((pointing_to(message, name), name)),
        None => IdentificationError::new_err(message.to_owned()),
    }
}

/// Adds to a message what the option does that resolves the error.
fn pointing_to(message: &str, option: &'static str) -> String {
    let does = match option {
        "cutoff_hz" => "sets the cutoff",
        "estimator" => "chooses the estimator",
        "max_gap_s" => "sets the longest time that is bridged",
        "method" => "chooses the method",
        "rename_joints" => "renames joints of the log",
        "sensor_frame" => "places the sensor",
        "tip" => "names the end-effector frame",
        "urdf" => "names its file",
        _ => "names the topic",
    };
    format!("{message}; `{option}` {does}")
}

impl IntoPyErr for tactid_sim::SimError {
    fn into_py_err(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::Log(error) => error.into_py_err(),
            Self::File { .. }
            | Self::InFile { .. }
            | Self::Syntax(_)
            | Self::Value { .. }
            | Self::Motion { .. }
            | Self::Model(_)
            | Self::Robot(_) => ExperimentError::new_err(message),
            Self::Command { .. } => ArgumentError::new_err(message),
            Self::Grasp(_)
            | Self::Bound { .. }
            | Self::Lost { .. }
            | Self::Diverged { .. }
            | Self::Planning(_)
            | Self::Aborted { .. } => SimulationError::new_err(message),
        }
    }
}

/// A setting of an estimator that is out of its range: the error's text, which begins with the setting's name,
/// with this name as code.
fn setting_message(error: &SettingError) -> String {
    let text = error.to_string();
    match text.split_once(' ') {
        Some((name, rest)) => format!("`{name}` {rest}"),
        None => text,
    }
}
