//! One payload from several recordings. The package's `identify` and `combine` call these.

use std::path::PathBuf;

use nalgebra::{Dyn, OMatrix, SMatrix, SVector, U10};
use pyo3::prelude::*;
use tactid_identify::{Agreement, Combination, CombineSettings, LinearEstimate, SharedErrors};

use crate::arrays::{Array, Series, array, common_length};
use crate::errors::{IntoPyErr, detached};
use crate::finding_data::FindingData;
use crate::findings::data_finding;
use crate::identification::{EstimateData, IdentificationData, MomentsData};
use crate::identify::{run, urdf_errors};
use crate::options;

/// `tactid.combination.RunDistance`.
#[derive(IntoPyObject)]
struct DistanceData {
    chi_square: f64,
    degrees_of_freedom: f64,
    p_value: f64,
    others_agree: bool,
}

/// `tactid.combination.Agreement`.
#[derive(IntoPyObject)]
struct AgreementData {
    agree: bool,
    chi_square: f64,
    degrees_of_freedom: f64,
    noise_degrees_of_freedom: f64,
    p_value: f64,
    value_p_values: Array,
    between_runs: Array,
    runs: Vec<DistanceData>,
}

/// What `tactid.combination.Combination` has besides its recordings.
#[derive(IntoPyObject)]
pub(crate) struct CombinationData {
    estimate: EstimateData,
    principal_moments: MomentsData,
    agreement: AgreementData,
    findings: Vec<FindingData>,
}

impl CombinationData {
    fn new(py: Python<'_>, found: &Combination) -> PyResult<Self> {
        let findings = found.findings.iter();
        let findings = findings.map(|finding| data_finding(py, finding, false));
        Ok(Self {
            estimate: EstimateData::new(py, &found.estimate)?,
            principal_moments: MomentsData::new(py, found.principal_moments)?,
            agreement: agreement_data(py, &found.agreement, found.between_runs)?,
            findings: findings.collect::<PyResult<_>>()?,
        })
    }
}

/// Reads a `tactid.identification.LinearEstimate`.
fn linear_estimate(given: &Bound<'_, PyAny>) -> PyResult<LinearEstimate> {
    let item =
        |name: &'static str, shape: &[usize]| Series::read_item(&given.getattr(name)?, name, shape);
    let square = |name| -> PyResult<SMatrix<f64, 10, 10>> {
        let read = item(name, &[10, 10])?;
        Ok(SMatrix::from_row_slice(read.single()?))
    };
    let parameters = item("parameters", &[10])?;
    let name = "shared_changes";
    let changes = Series::read(&given.getattr(name)?, name, &[10])?;
    let count = common_length(&[&changes])?.unwrap_or(1);
    Ok(LinearEstimate {
        parameters: SVector::from_column_slice(parameters.single()?),
        information: square("information")?,
        covariance: square("covariance")?,
        shared: SharedErrors {
            unknowns: given.getattr("shared_unknowns")?.extract()?,
            changes: OMatrix::<f64, U10, Dyn>::from_fn(count, |k, of| changes.at(of)[k]),
        },
        degrees_of_freedom: given.getattr("degrees_of_freedom")?.extract()?,
    })
}

fn agreement_data(
    py: Python<'_>,
    found: &Agreement,
    between_runs: [f64; 10],
) -> PyResult<AgreementData> {
    let distances = found.runs.iter().map(|run| DistanceData {
        chi_square: run.chi_square,
        degrees_of_freedom: run.degrees_of_freedom,
        p_value: run.p_value,
        others_agree: run.others_agree,
    });
    Ok(AgreementData {
        agree: found.agree,
        chi_square: found.chi_square,
        degrees_of_freedom: found.degrees_of_freedom,
        noise_degrees_of_freedom: found.noise_degrees_of_freedom,
        p_value: found.p_value,
        value_p_values: array(py, found.value_p_values.to_vec(), &[10])?,
        between_runs: array(py, between_runs.to_vec(), &[10])?,
        runs: distances.collect(),
    })
}

/// Identifies the payload from each of several logs: see :func:`tactid.identify`.
#[pyfunction]
#[pyo3(signature = (logs, options, progress=None))]
pub(crate) fn identify_logs(
    py: Python<'_>,
    logs: Vec<PathBuf>,
    options: &Bound<'_, PyAny>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<IdentificationData>> {
    let request = options::log_request(options)?;
    let result = run(py, progress, |observer| {
        tactid_recordings::identify_logs(&logs, &request, observer)
    });
    let found = urdf_errors(py, &request, result)?;
    let found = found.into_iter();
    found.map(|run| IdentificationData::new(py, run)).collect()
}

/// Combines the estimates of several recordings: see :func:`tactid.combine`.
///
/// Args:
///     frame: Name of the frame of all estimates.
///     linear: The :class:`tactid.LinearEstimate` of each recording.
///     options: An object with the options `known_mass`, `known_mass_std_dev` and `bounding_box`.
///
/// Raises:
///     ArgumentError: There is no recording, a matrix is not positive semidefinite, or an option is out of range.
#[pyfunction]
pub(crate) fn combine(
    py: Python<'_>,
    frame: &str,
    linear: Vec<Bound<'_, PyAny>>,
    options: &Bound<'_, PyAny>,
) -> PyResult<CombinationData> {
    let runs = linear.iter().map(linear_estimate);
    let runs: Vec<LinearEstimate> = runs.collect::<PyResult<_>>()?;
    let request = options::request(options)?;
    let settings = CombineSettings {
        known_mass: request.known_mass,
        bounding_box: request.bounding_box,
    };
    let found = detached(py, || tactid_identify::combine(frame, &runs, &settings))?;
    CombinationData::new(py, &found.map_err(IntoPyErr::into_py_err)?)
}
