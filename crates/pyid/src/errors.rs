//! From each crate's error to the Python exception of its kind.

use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use tactid_identify::IdentifyError;
use tactid_nlms::SettingError;
use tactid_recordings::RecordingError;

use crate::faults::FaultData;
use crate::keywords::{keyword_of, option_of, topic_option};

pyo3::import_exception!(tactid.errors, TactidError);
pyo3::import_exception!(tactid.errors, ArgumentError);
pyo3::import_exception!(tactid.errors, ModelError);
pyo3::import_exception!(tactid.errors, LogError);
pyo3::import_exception!(tactid.errors, ExperimentError);
pyo3::import_exception!(tactid.errors, SimulationError);
pyo3::import_exception!(tactid.errors, IdentificationError);

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
        LogError::new_err(self.to_string())
    }
}

impl IntoPyErr for IdentifyError {
    fn into_py_err(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::Model(error) => error.into_py_err(),
            Self::State(error) => error.into_py_err(),
            Self::Setting(error) => match error {
                SettingError::Alpha(_) => option_error(setting_message(&error), "alpha"),
                SettingError::Beta(_) => option_error(setting_message(&error), "beta"),
                // No option sets these: the identification does not use LMS, and detects changes by constants.
                SettingError::Step(_)
                | SettingError::RowsBetweenFalseAlarms(_)
                | SettingError::CorrelationRows(_)
                | SettingError::Shift(_)
                | SettingError::Growth(_)
                | SettingError::Clip(_) => error.into_py_err(),
            },
            Self::Value {
                name,
                given,
                expected,
            } => {
                let name = option_of(name);
                option_error(format!("`{name}` is {given}, but must be {expected}"), name)
            }
            Self::NoiseCount {
                name,
                given,
                of,
                expected,
            } => {
                let name = option_of(name);
                let each = format!("give one for all, or one for each of the {expected} {of}");
                option_error(format!("`{name}` has {given} entries: {each}"), name)
            }
            Self::Box { .. } => option_error(message, "bounding_box"),
            Self::PriorNeedsLeastSquares(_) | Self::NeedsLeastSquares(_) => {
                option_error(message, "estimator")
            }
            Self::WrenchCount { .. } => ArgumentError::new_err(message),
            Self::NoWrench | Self::FixedBase | Self::NoMasses { .. } => {
                IdentificationError::new_err((message, "method"))
            }
            Self::TooFewWindows { .. } | Self::TooFewSamples { .. } => {
                IdentificationError::new_err((message, "cutoff"))
            }
        }
    }
}

impl IntoPyErr for RecordingError {
    fn into_py_err(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::Identify(error) => error.into_py_err(),
            Self::Log(error) => error.into_py_err(),
            Self::NoSuchTopic { kind, .. } => option_error(message, topic_option(kind)),
            Self::EffortGains { .. } => option_error(message, "effort_gain"),
            Self::UnloadedNeedsEffort => option_error(message, "unloaded"),
            Self::NotForArrays(name) => {
                let option = keyword_of(name);
                ArgumentError::new_err((message, option.to_owned()))
            }
            Self::NoSamples => ArgumentError::new_err("`time` is empty: there is no sample"),
            Self::UnknownTip { .. } => ModelError::new_err((message, "tip")),
            Self::RobotTwice => {
                ArgumentError::new_err("`robot` and `urdf` are both given: give one of them")
            }
            Self::BaseIsFixed { name } => ArgumentError::new_err(format!(
                "`{}` is about a base that moves, but that of the robot is fixed: read the robot with \
                 base=\"floating\"; for a fixed base that is tilted, give `gravity` in the axes of the base",
                keyword_of(name)
            )),
            Self::ArrayLength {
                name,
                given,
                expected,
            } => ArgumentError::new_err(format!(
                "`{}` has {given} entries, but must have {expected}",
                keyword_of(name)
            )),
            Self::MissingArray { name, reason } => {
                ArgumentError::new_err(format!("`{}` is missing: {reason}", keyword_of(name)))
            }
            Self::SensorFrameForSeveral(_) => option_error(message, "sensor_frame"),
            // Arrays have their times in this keyword, and a log has topics.
            Self::TimesNotIncreasing { .. } => {
                IdentificationError::new_err(message.replace("times_s", "`source`"))
            }
            Self::NoOverlap { faults, .. } => {
                let faults: Vec<FaultData> = faults.iter().map(FaultData::from).collect();
                IdentificationError::new_err((message, None::<&str>, faults))
            }
            other => IdentificationError::new_err((message, remedy(&other))),
        }
    }
}

/// The option that resolves an error of a recording; `None` where there is none.
fn remedy(error: &RecordingError) -> Option<&'static str> {
    match error {
        RecordingError::TooManyGaps { .. } => Some("max_gap"),
        RecordingError::RareSamples { unit: None, .. } => Some("cutoff"),
        RecordingError::SeveralTopics { kind, .. } => Some(topic_option(*kind)),
        RecordingError::UnrelatedWrenches { .. } => Some("wrench_topic"),
        RecordingError::UnknownFrame { topic: Some(_), .. } => Some("sensor_frame"),
        RecordingError::UnknownFrame { topic: None, .. } => Some("tip"),
        RecordingError::NoUrdf(_) => Some("urdf"),
        RecordingError::ImuFrame { .. } => Some("imu_topic"),
        RecordingError::OtherMotion { .. }
        | RecordingError::NoSharedMotion
        | RecordingError::SeveralUnloadedTopics(_) => Some("unloaded"),
        _ => None,
    }
}

impl IntoPyErr for tactid_sim::SimError {
    fn into_py_err(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::Log(error) => error.into_py_err(),
            Self::File { .. }
            | Self::Syntax(_)
            | Self::Value { .. }
            | Self::Model(_)
            | Self::Robot(_) => ExperimentError::new_err(message),
            Self::Command { .. } => ArgumentError::new_err(message),
            Self::Grasp(_) | Self::Bound { .. } | Self::Lost { .. } | Self::Diverged { .. } => {
                SimulationError::new_err(message)
            }
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
