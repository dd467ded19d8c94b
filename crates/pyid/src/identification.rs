//! Results as Python's `tactid._results.records` has them.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use tactid_recordings::{Forecast, Identified, RecordingReport};

use crate::errors::ArgumentError;
use crate::faults::faults;
use crate::findings::findings;
use crate::record::fields;

/// Returns the fields of `tactid.Identification`, or of `tactid.PaperIdentification`.
pub(crate) fn identified(py: Python<'_>, found: &Identified) -> PyResult<Py<PyDict>> {
    match found {
        Identified::LeastSquares(found) => identification(py, found, &found.recording),
        Identified::Paper(found) => identification(py, found, &found.recording),
    }
}

/// Returns the fields of a result, of which the report on the recording is a part.
pub(crate) fn identification(
    py: Python<'_>,
    found: &impl Serialize,
    recording: &RecordingReport,
) -> PyResult<Py<PyDict>> {
    let data = fields(py, found)?;
    data.set_item("findings", findings(py, &recording.findings, "keyword")?)?;
    data.set_item("faults", faults(py, &recording.faults)?)?;
    Ok(data.unbind())
}

/// Returns the time until half of each 95 % interval is small enough, s: 0 where it is so already,
/// infinite where the motion does not determine the value.
///
/// Args: forecast: The fields of a :class:`tactid.Forecast`; None where there is none, and all
/// times are NaN. values: The ten values. std_devs: Their standard deviations. within: The target
/// as a fraction of the largest value of its kind.
///
/// Raises:
///     ArgumentError: ``within`` is not positive.
#[pyfunction]
pub(crate) fn remaining(
    forecast: Option<&Bound<'_, PyAny>>,
    values: [f64; 10],
    std_devs: [f64; 10],
    within: f64,
) -> PyResult<[f64; 10]> {
    if within.is_nan() || within <= 0.0 {
        return Err(ArgumentError::new_err(format!(
            "`within` is {within}: expected a positive fraction, such as 0.01"
        )));
    }
    let Some(forecast) = forecast else {
        return Ok([f64::NAN; 10]);
    };
    let forecast: Forecast = pythonize::depythonize(forecast)?;
    Ok(forecast.remaining_s(&values, &std_devs, within))
}
