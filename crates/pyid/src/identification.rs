//! What a recording says, as Python reads it.

use std::path::PathBuf;

use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;
use tactid_identify::{Clock, FitReport, HistoryPoint, Offset};

use crate::arrays::output;
use crate::errors::{ArgumentError, IntoPyErr};
use crate::payload::PayloadEstimate;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// What :func:`identify` found in a log.
#[pyclass(module = "tactid", frozen)]
pub(crate) struct Identification(pub(crate) tactid_identify::Identification);

#[pymethods]
impl Identification {
    /// The payload.
    #[getter]
    fn estimate(&self) -> PayloadEstimate {
        PayloadEstimate(self.0.estimate)
    }

    /// The end-effector frame in which the payload is.
    #[getter]
    fn tool(&self) -> &str {
        &self.0.tool
    }

    /// ``"tactile"``, ``"effort"`` or ``"joint-sensing"``.
    #[getter]
    fn way(&self) -> &'static str {
        self.0.settings.way.name()
    }

    /// ``"nlms"`` or ``"rls"``.
    #[getter]
    fn estimator(&self) -> &'static str {
        self.0.settings.estimator.name()
    }

    /// The estimate is the mean over this last time, s; 0 where it is the latest value.
    #[getter]
    fn average(&self) -> f64 {
        self.0.settings.average_s
    }

    /// How often the log was presented to the estimator.
    #[getter]
    fn epochs(&self) -> u32 {
        self.0.settings.epochs
    }

    /// Where the filter of both sides of the equations has lost 3 dB, Hz.
    #[getter]
    fn cutoff(&self) -> f64 {
        let fit = self.0.fit.as_ref();
        fit.map_or(self.0.settings.cutoff_hz, |fit| fit.cutoff_hz)
    }

    /// Between two windows of the filter, s; NaN for the paper's filter.
    #[getter]
    fn stride(&self) -> f64 {
        self.0.fit.as_ref().map_or(f64::NAN, |fit| fit.stride_s)
    }

    /// Which presentation of the log each entry of ``history`` belongs to, from 0, (H,), unsigned integers.
    #[getter]
    fn history_epoch<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_iter(py, self.0.history.iter().map(|point| point.epoch))
    }

    /// Times of ``history`` on the recording's clock, (H,), s. They begin anew with each epoch.
    #[getter]
    fn history_time<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let times = self.0.history.iter().map(|point| point.time_s).collect();
        output(py, times, Some(self.0.history.len()), &[])
    }

    /// The estimate over time, not averaged, in the order of ``VALUE_NAMES``, (H, 10).
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let values = self.0.history.iter().flat_map(|point| point.values);
        output(py, values.collect(), Some(self.0.history.len()), &[10])
    }

    /// Standard deviations of ``history``, (H, 10), infinite where a value was not determined yet; NaN for the
    /// paper's filter.
    #[getter]
    fn history_deviation<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let deviations = |point: &HistoryPoint| point.deviations.unwrap_or([f64::NAN; 10]);
        let values = self.0.history.iter().flat_map(deviations).collect();
        output(py, values, Some(self.0.history.len()), &[10])
    }

    /// Standard deviation of each of the ten values; infinite where the motion did not determine it, NaN for the
    /// paper's filter, (10,).
    #[getter]
    fn deviation<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let deviations = self.0.estimate.deviations.unwrap_or([f64::NAN; 10]);
        output(py, deviations.to_vec(), None, &[10])
    }

    /// Principal moments of inertia about the centre of mass, ascending, (3,), kg m²; NaN where there are none.
    #[getter]
    fn principal_moments<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let moments = self.0.principal_moments.map(|found| found.moments);
        output(py, moments.unwrap_or([f64::NAN; 3]).to_vec(), None, &[3])
    }

    /// Their standard deviations, (3,), kg m²: infinite where the motion did not determine the whole inertia, NaN
    /// for the paper's filter. Moments that are nearer to each other than their noise share a deviation that holds
    /// the noise of all their axes, since noise drives equal moments apart.
    #[getter]
    fn principal_moment_deviation<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let deviations = self.0.principal_moments.and_then(|found| found.deviations);
        output(py, deviations.unwrap_or([f64::NAN; 3]).to_vec(), None, &[3])
    }

    /// How much longer the motion must go on, by its second half, until every value is known well enough.
    ///
    /// What the model has wrong (a sign, a frame, friction) is a bias, which no time takes away.
    ///
    /// Args:
    ///     within: Half of the 95 % interval that is wanted, as a part of the largest value of its kind (mass,
    ///         centre of mass, inertia): 0.01 for 1 %.
    ///
    /// Returns:
    ///     Time for each of ``VALUE_NAMES``, (10,), s: 0 where it is so already, infinite where the motion does not
    ///     determine the value, NaN for the paper's filter.
    ///
    /// Raises:
    ///     ArgumentError: ``within`` is not positive.
    #[pyo3(signature = (within=0.01))]
    fn remaining<'py>(&self, py: Python<'py>, within: f64) -> PyResult<Array<'py>> {
        if within.is_nan() || within <= 0.0 {
            return Err(ArgumentError::new_err(format!(
                "`within` is {within}: expected a positive part, such as 0.01"
            )));
        }
        let remaining = self.0.remaining_s(within).unwrap_or([f64::NAN; 10]);
        output(py, remaining.to_vec(), None, &[10])
    }

    /// The middle of each window on the recording's clock, (W,), s. Empty for the paper's filter, as is all that
    /// begins with ``fit``.
    #[getter]
    fn fit_time<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let times = self.fit(|fit| fit.times_s.clone());
        let count = times.len();
        output(py, times, Some(count), &[])
    }

    /// The load that was measured, filtered, (W, C), in the order of ``channels``.
    #[getter]
    fn fit_measured<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.by_channel(py, self.fit(|fit| fit.measured.clone()))
    }

    /// What the payload makes of the motion, (W, C).
    #[getter]
    fn fit_predicted<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.by_channel(py, self.fit(|fit| fit.predicted.clone()))
    }

    /// How much each window counts, (W, C): 1, or less for an outlier.
    #[getter]
    fn fit_weight<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let channels = self.channels().len();
        let weights = self.fit(|fit| fit.weights.clone()).into_iter();
        let spread = weights.flat_map(|weight| std::iter::repeat_n(weight, channels));
        self.by_channel(py, spread.collect())
    }

    /// Which windows the held-out check did not see, (W,).
    #[getter]
    fn fit_held_out<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_vec(py, self.fit(|fit| fit.held_out.clone()))
    }

    /// What was measured: the names of the C channels.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.fit(|fit| fit.channels.iter().map(|(name, _)| name.clone()).collect())
    }

    /// The channels' units.
    #[getter]
    fn channel_units(&self) -> Vec<&'static str> {
        self.fit(|fit| fit.channels.iter().map(|(_, unit)| *unit).collect())
    }

    /// Weighted rms of measured less predicted, (C,).
    #[getter]
    fn residual_rms<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let rms = self.fit(|fit| fit.residual_rms.clone());
        let count = rms.len();
        output(py, rms, Some(count), &[])
    }

    /// The same on the parts of the recording that another fit, on the rest alone, did not see, (C,).
    #[getter]
    fn held_out_rms<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let rms = self.fit(|fit| fit.held_out_rms.clone());
        let count = rms.len();
        output(py, rms, Some(count), &[])
    }

    /// What the wrenches are off by, where ``wrench_offset`` made that unknown: of the first six ``channels``, (6,);
    /// else empty.
    #[getter]
    fn offset<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.of_offsets(py, |offset| offset.value)
    }

    /// Standard deviations of ``offset``, (6,), or empty.
    #[getter]
    fn offset_deviation<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.of_offsets(py, |offset| offset.deviation)
    }

    /// How strongly directions of the ten linear parameters were excited, descending, 1 for the strongest, (10,).
    #[getter]
    fn excitation_values<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let strengths = self.fit(|fit| fit.strengths.clone());
        let count = strengths.len();
        output(py, strengths, Some(count), &[])
    }

    /// These directions, unit vectors in the linear parameters, each divided by its scale, (10, 10), a row each.
    #[getter]
    fn excitation_directions<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let directions = self.fit(|fit| fit.directions.clone());
        let count = directions.len();
        output(py, directions.into_flattened(), Some(count), &[10])
    }

    /// Writes the estimate over time as a log: ``geometry_msgs/msg/InertiaStamped`` on ``/tactid/payload``, and half
    /// the width of each value's 95 % interval on ``/tactid/payload_half_width_95``.
    ///
    /// Args:
    ///     path: The ``.mcap`` file to write.
    ///
    /// Raises:
    ///     LogError: It cannot be written.
    fn write_estimates(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| tactid_identify::write_estimates(&path, &self.0))
            .map_err(IntoPyErr::into_py_err)
    }

    /// What motion would make known what is not, a sentence each.
    #[getter]
    fn motion_advice(&self) -> Vec<String> {
        self.fit(|fit| fit.advice.clone())
    }

    /// Stamp of time zero, ns since the epoch.
    #[getter]
    fn start_ns(&self) -> i64 {
        self.0.start_ns
    }

    /// By how much later than the motion the wrenches were taken to be stamped, s.
    #[getter]
    fn delay(&self) -> f64 {
        self.0.delay_s
    }

    /// The delay as it was estimated, s; None where it was not.
    #[getter]
    fn delay_estimate(&self) -> Option<f64> {
        self.0.estimated_delay.map(|delay| delay.0)
    }

    /// Standard deviation of the estimated delay, s; None where it was not estimated.
    #[getter]
    fn delay_deviation(&self) -> Option<f64> {
        self.0.estimated_delay.map(|delay| delay.1)
    }

    /// The payload's mass as it was given, kg; None where it was not.
    #[getter]
    fn known_mass(&self) -> Option<f64> {
        self.0.known_mass.map(|mass| mass.mass_kg)
    }

    /// Its standard deviation, kg, 0 for an exact mass; None where no mass was given.
    #[getter]
    fn known_mass_deviation(&self) -> Option<f64> {
        self.0.known_mass.map(|mass| mass.deviation_kg)
    }

    /// Least and largest corner of the box that was given, in the tool frame, (2, 3), m; None where it was not.
    #[getter]
    fn bounding_box<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py>>> {
        let corners = self.0.bounding_box.map(|given| [given.min, given.max]);
        let told = corners.map(|both| both.iter().flatten().copied().collect());
        told.map(|corners| output(py, corners, None, &[2, 3]))
            .transpose()
    }

    /// ``"stamps"`` of the headers, or ``"log times"`` where there are none.
    #[getter]
    fn clock(&self) -> &'static str {
        match self.0.clock {
            Clock::Stamps => "stamps",
            Clock::LogTimes => "log times",
        }
    }

    /// What was wrong with messages: topic, what, how often, and when first, s.
    #[getter]
    fn dirt(&self) -> Vec<(String, String, u64, f64)> {
        let dirt = self.0.dirt.iter();
        dirt.map(|d| (d.topic.clone(), d.what.clone(), d.count, d.first_s))
            .collect()
    }

    /// What a reader must know of how the recording was read, a sentence each.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.0.remarks.clone()
    }

    /// Gravitational acceleration that was assumed, in world axes, (3,), m/s², pointing down.
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        output(py, self.0.gravity.as_slice().to_vec(), None, &[3])
    }

    /// From the first sample to the last, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration_s
    }

    /// Where the log could not be read further, and why, a line each; empty for a sound log.
    #[getter]
    fn damage(&self) -> Vec<String> {
        self.0.damage.clone()
    }
}

impl Identification {
    /// Something of the fit, or nothing of it for the paper's filter.
    fn fit<T: Default>(&self, of: impl Fn(&FitReport) -> T) -> T {
        self.0.fit.as_ref().map(of).unwrap_or_default()
    }

    fn of_offsets<'py>(&self, py: Python<'py>, of: fn(&Offset) -> f64) -> PyResult<Array<'py>> {
        let values = self.fit(|fit| fit.offsets.iter().map(of).collect::<Vec<_>>());
        let count = values.len();
        output(py, values, Some(count), &[])
    }

    fn by_channel<'py>(&self, py: Python<'py>, values: Vec<f64>) -> PyResult<Array<'py>> {
        let channels = self.channels().len();
        let windows = values.len() / channels.max(1);
        output(py, values, Some(windows), &[channels])
    }
}
