//! One payload from several recordings. The package's `identify` and `combine` call these.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tactid_recordings::CombinedRun;

use crate::errors::{ArgumentError, IntoPyErr, detached};
use crate::findings::findings;
use crate::identification::identification;
use crate::identify::{run, urdf_errors};
use crate::options;
use crate::record::fields;

/// Identifies the payload from each of several logs: see :func:`tactid.identify`.
#[pyfunction]
#[pyo3(signature = (logs, options, progress=None))]
pub(crate) fn identify_logs(
    py: Python<'_>,
    logs: Vec<PathBuf>,
    options: &Bound<'_, PyDict>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Py<PyDict>>> {
    let request = options::log_request(options)?;
    let result = run(py, progress, |observer| {
        tactid_recordings::identify_logs(&logs, &request, observer)
    });
    let found = urdf_errors(py, &request, result)?;
    let runs = found.iter();
    runs.map(|run| identification(py, run, &run.recording))
        .collect()
}

/// Combines the estimates of several recordings: see :func:`tactid.combine`.
///
/// Args: runs: What each recording contributes: its ``name``, its ``linear``, ``known_mass`` and
/// ``bounding_box``, and of its estimate ``frame``, ``windows``, ``rejected`` and ``gaps``.
///
/// Raises: ArgumentError: There is no recording, the recordings do not belong together, a shape
/// does not fit, a matrix is not positive semidefinite, or what is known is out of range.
#[pyfunction]
pub(crate) fn combine<'py>(
    py: Python<'py>,
    runs: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let runs: Vec<CombinedRun> =
        pythonize::depythonize(runs).map_err(|error| ArgumentError::new_err(error.to_string()))?;
    let found = detached(py, || tactid_recordings::combine_runs(&runs))?;
    let found = found.map_err(IntoPyErr::into_py_err)?;
    let data = fields(py, &found)?;
    data.set_item("findings", findings(py, &found.findings, "keyword")?)?;
    Ok(data)
}
