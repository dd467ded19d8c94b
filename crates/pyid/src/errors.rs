//! From each crate's error to the Python exception of its kind.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use tactid_calibrate::CalibrateError;
use tactid_identify::IdentifyError;
use tactid_nlms::SettingError;
use tactid_recordings::RecordingError;

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
/// Returns `InternalError` if the work panics, which is a fault of tactid. PyO3 would raise
/// `PanicException`, which `except Exception` does not catch. The panic hook prints the place.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> PyResult<T> {
    // Safe to resume: state is dropped or belongs to a solver whose memory stays valid.
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let what = text.or_else(|| panic.downcast_ref::<&str>().copied());
        let what = what.unwrap_or("unknown");
        InternalError::new_err(format!("internal error: {what}; please report it"))
    })
}

/// An error of a crate, which becomes the Python exception of its kind.
pub(crate) trait IntoPyErr: Sized + Display {
    /// Returns the exception with the message of an error that contains this one, or its own.
    fn with_message(self, message: String) -> PyErr;

    /// Returns the exception.
    fn into_py_err(self) -> PyErr {
        let message = self.to_string();
        self.with_message(message)
    }
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

/// Puts the name of a recording in front of the message of its error; an exception that is not ours
/// stays as it is.
pub(crate) fn in_recording(name: &str, error: PyErr) -> PyErr {
    Python::attach(|py| {
        let value = error.value(py);
        let message = value
            .getattr("message")
            .and_then(|message| message.extract::<String>());
        if let Ok(message) = message {
            let _ = value.setattr("message", format!("{name}: {message}"));
        }
    });
    error
}

impl IntoPyErr for tactid_dynamics::ModelError {
    fn with_message(self, message: String) -> PyErr {
        ModelError::new_err(message)
    }
}

impl IntoPyErr for tactid_dynamics::StateError {
    fn with_message(self, message: String) -> PyErr {
        ArgumentError::new_err(message)
    }
}

impl IntoPyErr for SettingError {
    fn with_message(self, message: String) -> PyErr {
        option_error(message, self.name)
    }
}

impl IntoPyErr for tactid_logs::LogError {
    fn with_message(self, message: String) -> PyErr {
        LogError::new_err(match self {
            Self::Memory { .. } => format!(
                "{message}; `tactid.set_log_memory` allows more, and so does `tactid --log-memory` before the command"
            ),
            _ => message,
        })
    }
}

impl IntoPyErr for IdentifyError {
    fn with_message(self, message: String) -> PyErr {
        let option = self.option();
        match self {
            Self::Model(error) => error.with_message(message),
            Self::State(_) | Self::Option { .. } | Self::Wrenches { .. } | Self::NoPose => {
                ArgumentError::new_err((message, option))
            }
            Self::Method(_) | Self::TooLittle(_) => IdentificationError::new_err((message, option)),
        }
    }
}

impl IntoPyErr for CalibrateError {
    fn with_message(self, message: String) -> PyErr {
        match self {
            Self::Identify(error) => error.with_message(message),
            _ => CalibrationError::new_err(message),
        }
    }
}

impl IntoPyErr for RecordingError {
    fn with_message(self, message: String) -> PyErr {
        let option = self.option();
        match self {
            Self::Identify(error) => error.with_message(message),
            Self::Calibrate(error) => error.with_message(message),
            Self::Log(error) => error.with_message(message),
            Self::InRecording { source, .. } | Self::DamagedEarly { source, .. } => {
                source.with_message(message)
            }
            Self::UnloadedLog(_) => LogError::new_err((message, option)),
            Self::Option { .. } | Self::Arrays(_) | Self::Together(_) => {
                ArgumentError::new_err((message, option))
            }
            Self::Data { .. } | Self::Interrupted => {
                IdentificationError::new_err((message, option))
            }
            Self::NoOverlap { faults, .. } => {
                match Python::attach(|py| crate::faults::faults(py, &faults)) {
                    Ok(faults) => IdentificationError::new_err((message, option, faults)),
                    Err(error) => error,
                }
            }
            Self::Tip(_) => ModelError::new_err((message, option)),
            Self::Calibration { .. } => CalibrationError::new_err((message, option)),
        }
    }
}

impl IntoPyErr for tactid_excitation::ExcitationError {
    fn into_py_err(self) -> PyErr {
        let message = self.by_option();
        self.with_message(message)
    }

    fn with_message(self, message: String) -> PyErr {
        let option = self.option();
        match self {
            Self::Identify(error) => error.with_message(message),
            Self::NoVelocityLimit { .. } => ModelError::new_err(message),
            Self::Value { .. } | Self::Option { .. } => ArgumentError::new_err((message, option)),
            _ => ExcitationError::new_err((message, option)),
        }
    }
}

impl IntoPyErr for tactid_sim::SimError {
    fn with_message(self, message: String) -> PyErr {
        match self {
            Self::Log(error) => error.with_message(message),
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
