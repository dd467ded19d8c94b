//! One payload from several recordings. The package's `identify` and `combine` call these.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tactid_identify::{Finding, LinearEstimate, PriorKnowledge};

use crate::errors::{ArgumentError, IntoPyErr, detached};
use crate::findings::finding_data;
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
/// Args:
///     frame: Name of the frame of all estimates.
///     names: Name of each recording.
///     linear: The fields of the :class:`tactid.LinearEstimate` of each recording.
///     known_mass: The fields of the :class:`tactid.KnownMass` of all, or None.
///     bounding_box: The fields of the :class:`tactid.BoundingBox` of all, or None.
///
/// Raises:
///     ArgumentError: There is no recording, a shape does not fit, a matrix is not positive semidefinite, or what is known is
///         out of range.
#[pyfunction]
pub(crate) fn combine<'py>(
    py: Python<'py>,
    frame: &str,
    names: Vec<String>,
    linear: &Bound<'py, PyAny>,
    known_mass: &Bound<'py, PyAny>,
    bounding_box: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let refused = |error: pythonize::PythonizeError| ArgumentError::new_err(error.to_string());
    let runs: Vec<LinearEstimate> = pythonize::depythonize(linear).map_err(refused)?;
    let settings = PriorKnowledge {
        known_mass: pythonize::depythonize(known_mass).map_err(refused)?,
        bounding_box: pythonize::depythonize(bounding_box).map_err(refused)?,
    };
    let found = detached(py, || {
        tactid_recordings::combine_estimates(frame, &runs, &settings)
    })?;
    let found = found.map_err(IntoPyErr::into_py_err)?;
    let data = fields(py, &found)?;
    let findings = found.findings.into_iter().map(|finding| match finding {
        Finding::RunsDisagree(found) => Finding::RunsDisagree(found.with_names(names.clone())),
        other => other,
    });
    let findings = findings.map(|finding| finding_data(py, &finding));
    data.set_item("findings", findings.collect::<PyResult<Vec<_>>>()?)?;
    Ok(data)
}
