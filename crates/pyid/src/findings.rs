//! Findings in Python: a kind, a dictionary of the numbers and names that belong to
//! it, and the words.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use pythonize::{depythonize, pythonize};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, SchemaGenerator};
use serde::Serialize;
use tactid_calibrate::{Contradiction, MotionShortage};
use tactid_dynamics::{Notice, Reader, Subject};
use tactid_recordings::{DataFault, Finding};

use crate::errors::ArgumentError;

/// Returns findings as instances of `tactid.Finding`, in the words for a reader.
pub(crate) fn findings<'py, N: Notice + Serialize>(
    py: Python<'py>,
    notices: &[N],
    style: &str,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let class = py.import("tactid._base.findings")?.getattr("Finding")?;
    let each = notices.iter();
    each.map(|notice| {
        let (kind, data) = finding_data(py, notice)?;
        class.call1((kind, data, style))
    })
    .collect()
}

fn finding_data<'py>(
    py: Python<'py>,
    notice: &impl Serialize,
) -> PyResult<(String, Bound<'py, PyDict>)> {
    let data = pythonize(py, notice)?.cast_into::<PyDict>()?;
    // A contradiction of a calibration is a finding by its assumption.
    let tag = if data.contains("kind")? {
        "kind"
    } else {
        "assumption"
    };
    let kind = data.as_any().get_item(tag)?.extract()?;
    data.del_item(tag)?;
    Ok((kind, data))
}

/// Reads a finding of any kind from its data.
fn read(kind: &str, data: &Bound<'_, PyMapping>) -> PyResult<Box<dyn Notice>> {
    let given = PyDict::new(data.py());
    given.update(data)?;
    given.set_item("kind", kind)?;
    let error = match depythonize::<Finding>(&given) {
        Ok(found) => return Ok(Box::new(found)),
        Err(error) => error,
    };
    if let Ok(found) = depythonize::<MotionShortage>(&given) {
        return Ok(Box::new(found));
    }
    given.set_item("assumption", kind)?;
    match depythonize::<Contradiction>(&given) {
        Ok(found) => Ok(Box::new(found)),
        Err(_) => Err(ArgumentError::new_err(format!(
            "there is no finding of the kind {kind} with these data: {error}"
        ))),
    }
}

/// Returns a finding in sentences, with options as its reader writes them.
///
/// Raises:
///     ArgumentError: There is no such finding.
#[pyfunction]
pub(crate) fn finding_words(
    kind: &str,
    data: &Bound<'_, PyMapping>,
    style: &str,
) -> PyResult<String> {
    let reader = match style {
        "command-line" => Reader::CommandLine,
        "online" => Reader::Online,
        _ => Reader::Python,
    };
    Ok(read(kind, data)?.words(reader))
}

/// Returns how grave a finding is, and what it is about.
///
/// Raises:
///     ArgumentError: There is no such finding.
#[pyfunction]
pub(crate) fn finding_grade(
    kind: &str,
    data: &Bound<'_, PyMapping>,
) -> PyResult<(&'static str, &'static str)> {
    let notice = read(kind, data)?;
    let subject = match notice.subject() {
        Subject::Measurements => "measurements",
        Subject::Assumption => "assumption",
        Subject::Result => "result",
        Subject::Consequence => "consequence",
    };
    Ok((notice.severity().name(), subject))
}

/// Returns a data fault in words, without a full stop.
///
/// Raises:
///     ArgumentError: There is no such fault.
#[pyfunction]
pub(crate) fn fault_words(data: &Bound<'_, PyDict>) -> PyResult<String> {
    let fault: DataFault =
        depythonize(data).map_err(|error| ArgumentError::new_err(error.to_string()))?;
    Ok(fault.to_string())
}

/// Returns a probability as a table shows it: a tiny one is an upper limit.
#[pyfunction]
pub(crate) fn probability(p_value: f64) -> String {
    tactid_batch::probability(p_value)
}

/// Returns how far recordings are from each other, such that the probability can be followed;
/// `of_noise` is infinite or None where the noise is known.
#[pyfunction]
pub(crate) fn distance_of_runs(
    chi_square: f64,
    degrees_of_freedom: f64,
    of_noise: Option<f64>,
    p_value: f64,
) -> String {
    let of_noise = of_noise.unwrap_or(f64::INFINITY);
    tactid_batch::distance_of_runs(chi_square, degrees_of_freedom, of_noise, p_value)
}

/// Returns the JSON schemas of findings, of those of a calibration (contradictions and shortages)
/// and of faults, as JSON.
#[pyfunction]
pub(crate) fn finding_schemas() -> [String; 4] {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let settings = settings.with(|settings| settings.inline_subschemas = true);
    let generator = settings.into_generator();
    [
        schema::<Finding>(&generator),
        schema::<Contradiction>(&generator),
        schema::<MotionShortage>(&generator),
        schema::<DataFault>(&generator),
    ]
}

fn schema<T: JsonSchema>(generator: &SchemaGenerator) -> String {
    generator
        .clone()
        .into_root_schema_for::<T>()
        .as_value()
        .to_string()
}
