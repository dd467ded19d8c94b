//! Results as plain Python values: dictionaries by the names of the fields of the dataclasses in
//! `tactid.identification`, built once.

use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;
use tactid_identify::WrenchOffset;
use tactid_identify::calibration::ArmChange;
use tactid_recordings::{
    CalibratedFit, Clock, Delay, Estimator, FitReport, HistoryPoint, Identification, KnownMass,
    LinearEstimate, Observability, PaperSettings, PayloadEstimate, PrincipalMoments,
    SingularValues,
};

use crate::arrays::{Array, array, output};
use crate::errors::ArgumentError;
use crate::faults::FaultData;
use crate::finding_data::FindingData;
use crate::findings::finding_data;
use crate::inertia::MassProperties;
use crate::options::{LEAST_SQUARES, NLMS};

/// `tactid.payload.PayloadEstimate`.
#[derive(IntoPyObject)]
pub(crate) struct EstimateData {
    frame: String,
    values: Array,
    std_devs: Array,
    observability: Vec<&'static str>,
    intervals: Array,
    is_physical: bool,
    composite: Option<MassProperties>,
    windows: u64,
    payload_changes: u64,
    since: f64,
    rejected: u64,
    gaps: u64,
}

impl EstimateData {
    pub(crate) fn new(py: Python<'_>, estimate: &PayloadEstimate) -> PyResult<Self> {
        Ok(Self {
            frame: estimate.frame.to_string(),
            values: array(py, estimate.values().to_vec(), &[10])?,
            std_devs: array(py, std_devs(estimate.std_devs).to_vec(), &[10])?,
            observability: estimate.observability.map(observability_name).to_vec(),
            intervals: array(py, limits(estimate.intervals), &[10, 2])?,
            is_physical: estimate.is_physical,
            composite: estimate.composite.map(MassProperties),
            windows: estimate.windows,
            payload_changes: estimate.payload_changes,
            since: estimate.since_s,
            rejected: estimate.rejected,
            gaps: estimate.gaps,
        })
    }
}

/// Returns the name of an observability in Python and in JSON.
fn observability_name(observability: Observability) -> &'static str {
    match observability {
        Observability::Identifiable => "identifiable",
        Observability::Uncertain => "uncertain",
        Observability::Unobservable => "unobservable",
    }
}

/// Returns the limits of intervals row by row; NaN where there are none.
fn limits<const N: usize>(intervals: Option<[[f64; 2]; N]>) -> Vec<f64> {
    intervals.unwrap_or([[f64::NAN; 2]; N]).concat()
}

/// `tactid.identification.LinearEstimate`.
#[derive(IntoPyObject)]
struct LinearData {
    parameters: Array,
    information: Array,
    covariance: Array,
    shared_changes: Array,
    shared_unknowns: Vec<u64>,
    degrees_of_freedom: f64,
}

impl LinearData {
    fn new(py: Python<'_>, linear: &LinearEstimate) -> PyResult<Self> {
        Ok(Self {
            parameters: array(py, linear.parameters.as_slice().to_vec(), &[10])?,
            // Symmetric: the order of rows and columns does not matter.
            information: array(py, linear.information.as_slice().to_vec(), &[10, 10])?,
            covariance: array(py, linear.covariance.as_slice().to_vec(), &[10, 10])?,
            shared_changes: array(
                py,
                linear.shared.changes.as_slice().to_vec(),
                &[linear.shared.changes.ncols(), 10],
            )?,
            shared_unknowns: linear.shared.unknowns.clone(),
            degrees_of_freedom: linear.degrees_of_freedom,
        })
    }
}

/// `tactid.identification.SingularValues`.
#[derive(IntoPyObject)]
pub(crate) struct SingularValuesData {
    mass: Array,
    inertia: Array,
}

impl SingularValuesData {
    pub(crate) fn new(py: Python<'_>, values: &SingularValues) -> PyResult<Self> {
        Ok(Self {
            mass: array(py, values.mass.to_vec(), &[4])?,
            inertia: array(py, values.inertia.to_vec(), &[6])?,
        })
    }
}

/// `tactid.identification.WrenchOffset`.
#[derive(IntoPyObject)]
pub(crate) struct WrenchOffsetData {
    frame: String,
    values: Array,
    std_devs: Array,
}

impl WrenchOffsetData {
    pub(crate) fn new(py: Python<'_>, offset: &WrenchOffset) -> PyResult<Self> {
        let std_devs = offset.std_devs.unwrap_or([f64::NAN; 6]);
        Ok(Self {
            frame: offset.frame.to_string(),
            values: array(py, offset.values().to_vec(), &[6])?,
            std_devs: array(py, std_devs.to_vec(), &[6])?,
        })
    }
}

/// `tactid.identification.PrincipalMoments`.
#[derive(IntoPyObject)]
pub(crate) struct MomentsData {
    values: Array,
    std_devs: Array,
    intervals: Array,
}

impl MomentsData {
    pub(crate) fn new(py: Python<'_>, moments: Option<PrincipalMoments>) -> PyResult<Self> {
        let values = moments
            .as_ref()
            .map_or([f64::NAN; 3], |found| found.moments);
        let uncertain = std_devs(moments.and_then(|found| found.std_devs));
        Ok(Self {
            values: array(py, values.to_vec(), &[3])?,
            intervals: array(
                py,
                limits(moments.and_then(|found| found.intervals())),
                &[3, 2],
            )?,
            std_devs: array(py, uncertain.to_vec(), &[3])?,
        })
    }
}

#[derive(IntoPyObject)]
struct HistoryData {
    epoch: Py<PyArray1<u32>>,
    time: Array,
    values: Array,
    std_devs: Array,
}

#[derive(IntoPyObject)]
struct FitData {
    channels: Vec<(String, &'static str)>,
    time: Array,
    measured: Array,
    predicted: Array,
    weights: Array,
    held_out: Py<PyArray1<bool>>,
    residual_rms: Array,
    held_out_rms: Array,
    noise_fraction: Array,
    stride: f64,
    excitation: Array,
    excitation_directions: Array,
    wrench_offset: Option<WrenchOffsetData>,
}

#[derive(IntoPyObject)]
struct PaperData {
    alpha: f64,
    beta: f64,
    average: f64,
    epochs: u32,
}

/// `tactid.identification.CalibratedFit`.
#[derive(IntoPyObject)]
struct CalibratedData {
    joints: Vec<String>,
    misfit: Array,
    noise_fraction: Array,
    updated_by_unloaded: bool,
    friction_change: Option<Array>,
    gain_change: Option<Array>,
}

/// A number with its standard deviation.
#[derive(IntoPyObject)]
struct UncertainData {
    value: f64,
    std_dev: f64,
}

/// `tactid.identification.Identification`.
#[derive(IntoPyObject)]
pub(crate) struct IdentificationData {
    estimate: EstimateData,
    method: &'static str,
    estimator: &'static str,
    principal_moments: MomentsData,
    linear: Option<LinearData>,
    history: HistoryData,
    gravity: Array,
    cutoff: f64,
    max_gap: f64,
    duration: f64,
    delay: f64,
    estimated_delay: Option<UncertainData>,
    subtracts_unloaded: bool,
    calibrated: Option<CalibratedData>,
    known_mass: Option<UncertainData>,
    bounding_box: Option<Array>,
    clock: &'static str,
    start_ns: i64,
    fit: Option<FitData>,
    forecast: Option<Forecast>,
    singular_values: Option<SingularValuesData>,
    paper_settings: Option<PaperData>,
    faults: Vec<FaultData>,
    findings: Vec<FindingData>,
    interrupted: bool,
    damage: Vec<String>,
}

impl IdentificationData {
    pub(crate) fn new(py: Python<'_>, found: Identification) -> PyResult<Self> {
        let findings = found
            .findings
            .iter()
            .map(|finding| finding_data(py, finding, found.subtracts_unloaded));
        let (estimator, paper_settings) = match found.estimator {
            Estimator::LeastSquares => (LEAST_SQUARES, None),
            Estimator::Paper(settings) => (NLMS, Some(paper_data(&settings))),
        };
        let calibrated = found.calibrated.as_ref();
        let strengths = found.singular_values.as_ref();
        let corners = found.bounding_box.map(|given| [given.min, given.max]);
        let corners = corners.map(|both| both.iter().flatten().copied().collect());
        Ok(Self {
            estimate: EstimateData::new(py, &found.estimate)?,
            method: found.method.name(),
            estimator,
            principal_moments: MomentsData::new(py, found.principal_moments)?,
            linear: found
                .linear
                .as_ref()
                .map(|linear| LinearData::new(py, linear))
                .transpose()?,
            history: history_data(py, &found.history)?,
            gravity: array(py, found.gravity.as_slice().to_vec(), &[3])?,
            cutoff: found.cutoff_hz,
            max_gap: found.max_gap_s,
            duration: found.duration_s,
            delay: found.delay_s,
            estimated_delay: found.estimated_delay.map(delay_data),
            subtracts_unloaded: found.subtracts_unloaded,
            calibrated: calibrated.map(|fit| calibrated_data(py, fit)).transpose()?,
            known_mass: found.known_mass.map(mass_data),
            bounding_box: corners.map(|six| array(py, six, &[2, 3])).transpose()?,
            clock: match found.clock {
                Clock::Stamps => "stamps",
                Clock::LogTimes => "log times",
                Clock::Given => "given",
            },
            start_ns: found.start_ns,
            fit: found
                .fit
                .as_ref()
                .map(|fit| fit_data(py, fit))
                .transpose()?,
            singular_values: strengths
                .map(|s| SingularValuesData::new(py, s))
                .transpose()?,
            paper_settings,
            faults: found.faults.iter().map(FaultData::from).collect(),
            findings: findings.collect::<PyResult<_>>()?,
            interrupted: found.interrupted,
            damage: found.damage.clone(),
            forecast: Forecast::of(found),
        })
    }
}

/// How the ten values become known when the motion goes on as in the recording's second half.
#[pyclass(module = "tactid", frozen)]
pub(crate) struct Forecast {
    forecast: tactid_recordings::Forecast,
    values: [f64; 10],
    std_devs: [f64; 10],
}

impl Forecast {
    fn of(found: Identification) -> Option<Self> {
        Some(Self {
            values: found.estimate.values(),
            std_devs: found.estimate.std_devs?,
            forecast: found.forecast?,
        })
    }
}

#[pymethods]
impl Forecast {
    /// Returns the time until half of each 95 % interval is small enough, s, (10,): 0 where it is so already,
    /// infinite where the motion does not determine the value.
    ///
    /// Args:
    ///     within: The target as a fraction of the largest value of its kind.
    ///
    /// Raises:
    ///     ArgumentError: ``within`` is not positive.
    fn remaining<'py>(
        &self,
        py: Python<'py>,
        within: f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        if within.is_nan() || within <= 0.0 {
            return Err(ArgumentError::new_err(format!(
                "`within` is {within}: expected a positive fraction, such as 0.01"
            )));
        }
        let remaining = self
            .forecast
            .remaining_s(&self.values, &self.std_devs, within);
        output(py, remaining.to_vec(), None, &[10])
    }
}

/// Standard deviations; NaN for the paper's filter, which estimates none.
fn std_devs<const N: usize>(given: Option<[f64; N]>) -> [f64; N] {
    given.unwrap_or([f64::NAN; N])
}

fn history_data(py: Python<'_>, points: &[HistoryPoint]) -> PyResult<HistoryData> {
    let count = points.len();
    let values = points.iter().flat_map(|point| point.values);
    let uncertain = points.iter().flat_map(|point| std_devs(point.std_devs));
    Ok(HistoryData {
        epoch: PyArray1::from_iter(py, points.iter().map(|point| point.epoch)).unbind(),
        time: array(
            py,
            points.iter().map(|point| point.time_s).collect(),
            &[count],
        )?,
        values: array(py, values.collect(), &[count, 10])?,
        std_devs: array(py, uncertain.collect(), &[count, 10])?,
    })
}

fn fit_data(py: Python<'_>, fit: &FitReport) -> PyResult<FitData> {
    let (windows, channels) = (fit.times_s.len(), fit.channels.len());
    let by_channel = |values: Vec<f64>| array(py, values, &[windows, channels]);
    let weights = fit
        .weights
        .iter()
        .flat_map(|&w| std::iter::repeat_n(w, channels));
    let named = fit
        .channels
        .iter()
        .map(|channel| (channel.name.clone(), channel.unit));
    let directions = fit.directions.clone().into_flattened();
    let offset = fit.offset.as_ref();
    let offset = offset.map(|offset| WrenchOffsetData::new(py, offset));
    Ok(FitData {
        channels: named.collect(),
        time: array(py, fit.times_s.clone(), &[windows])?,
        measured: by_channel(fit.measured.clone())?,
        predicted: by_channel(fit.predicted.clone())?,
        weights: by_channel(weights.collect())?,
        held_out: PyArray1::from_slice(py, &fit.held_out).unbind(),
        residual_rms: array(py, fit.residual_rms.clone(), &[channels])?,
        held_out_rms: array(py, fit.held_out_rms.clone(), &[channels])?,
        noise_fraction: array(py, fit.noise_fraction.to_vec(), &[10])?,
        stride: fit.stride_s,
        excitation: array(py, fit.strengths.clone(), &[fit.strengths.len()])?,
        excitation_directions: array(py, directions, &[fit.directions.len(), 10])?,
        wrench_offset: offset.transpose()?,
    })
}

fn calibrated_data(py: Python<'_>, fit: &CalibratedFit) -> PyResult<CalibratedData> {
    let by_joint = |change: &Option<ArmChange>| {
        let change = change.as_ref();
        change
            .map(|change| array(py, change.by_joint.clone(), &[fit.joints.len()]))
            .transpose()
    };
    Ok(CalibratedData {
        friction_change: by_joint(&fit.friction_change)?,
        gain_change: by_joint(&fit.gain_change)?,
        joints: fit.joints.clone(),
        misfit: array(py, fit.misfit.clone(), &[fit.misfit.len()])?,
        noise_fraction: array(py, fit.noise_fraction.to_vec(), &[10])?,
        updated_by_unloaded: fit.updated_by_unloaded,
    })
}

fn paper_data(settings: &PaperSettings) -> PaperData {
    PaperData {
        alpha: settings.alpha,
        beta: settings.beta,
        average: settings.average_s,
        epochs: settings.epochs,
    }
}

fn delay_data(delay: Delay) -> UncertainData {
    UncertainData {
        value: delay.delay_s,
        std_dev: delay.std_dev_s,
    }
}

fn mass_data(mass: KnownMass) -> UncertainData {
    UncertainData {
        value: mass.mass_kg,
        std_dev: mass.std_dev_kg,
    }
}
