//! From each crate's error to the Python exception of its kind.

use pyo3::PyErr;

pyo3::import_exception!(tactid.errors, ArgumentError);
pyo3::import_exception!(tactid.errors, ModelError);
pyo3::import_exception!(tactid.errors, LogError);
pyo3::import_exception!(tactid.errors, ExperimentError);
pyo3::import_exception!(tactid.errors, SimulationError);
pyo3::import_exception!(tactid.errors, IdentificationError);

/// Says which Python exception an error of a crate is.
pub(crate) trait IntoPyErr {
    fn into_py_err(self) -> PyErr;
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

impl IntoPyErr for tactid_nlms::SettingError {
    fn into_py_err(self) -> PyErr {
        ArgumentError::new_err(self.to_string())
    }
}

impl IntoPyErr for tactid_logs::LogError {
    fn into_py_err(self) -> PyErr {
        LogError::new_err(self.to_string())
    }
}

impl IntoPyErr for tactid_identify::IdentifyError {
    fn into_py_err(self) -> PyErr {
        use tactid_identify::IdentifyError as Error;
        match self {
            Error::Model(error) => error.into_py_err(),
            Error::State(error) => error.into_py_err(),
            Error::Setting(error) => error.into_py_err(),
            Error::Log(error) => error.into_py_err(),
            Error::Value { .. } | Error::Box { .. } | Error::WrenchCount { .. } => {
                ArgumentError::new_err(self.to_string())
            }
            _ => IdentificationError::new_err(self.to_string()),
        }
    }
}

impl IntoPyErr for tactid_sim::SimError {
    fn into_py_err(self) -> PyErr {
        use tactid_sim::SimError as Error;
        match self {
            Error::Log(error) => error.into_py_err(),
            Error::File { .. }
            | Error::Syntax(_)
            | Error::Value { .. }
            | Error::Model(_)
            | Error::Robot(_) => ExperimentError::new_err(self.to_string()),
            _ => SimulationError::new_err(self.to_string()),
        }
    }
}
