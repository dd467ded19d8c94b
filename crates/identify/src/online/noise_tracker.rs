//! The noise of the channels, tracked online.

use nalgebra::DMatrix;

use super::innovation::{Prediction, WhitenedRow, WhitenedWindow};
use super::residual_correlation::{
    ResidualCorrelation, SLOW_GAIN, WHITE_SLOW_SQUARE, correlation_of, mean_gain,
};
use crate::checks::MODEL_ERROR;
use crate::equations::Channels;
use crate::equations::Equation;
use crate::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};
use crate::solve::noise::Noise;
use crate::solve::offsets::WrenchNoise;
use crate::solve::subspace::Vector;

/// Number of windows that the estimate of the noise averages over at most, 15 s at a cutoff of 10
/// Hz. The relative error of an estimated standard deviation is then 3 %.
pub(crate) const MEMORY_WINDOWS: f64 = 500.0;

/// Factor on the variance after a false alarm of the change detectors: the standard deviation
/// doubles. Noise that has grown by no more since a payload change, with the motion or the load,
/// contradicts no payload.
pub(crate) const VARIANCE_GROWTH: f64 = 4.0;

/// Number of windows from which the noise is estimated all at once for the last time, after 1 s at
/// a cutoff of 10 Hz. Only an estimate from more windows than that assigns robust weights and
/// detects payload changes. A variance that has grown after a false alarm counts for so many, so
/// that new windows correct it soon.
pub(crate) const INITIAL_WINDOWS: usize = 32;

/// Number of windows from which the noise is estimated for the first time: 48 rows of a wrench, for
/// ten parameters and the noise of six channels. The payload after a change explains as many, and
/// so many in a row show that the payload before it is held again.
pub(crate) const MIN_WINDOWS: usize = 8;

/// Number of windows, 3 s at a cutoff of 10 Hz, within which an alarm may also mean that the noise
/// is larger than estimated, and a payload change be a contact.
pub(crate) const TRIAL_WINDOWS: usize = 100;

/// Number of windows that the correlation of all channels of a kind counts for in that of each of
/// them. After so many windows, the noise power of one channel at low frequencies is known to 40 %
/// only.
const SHARED_WINDOWS: f64 = 60.0;

/// Error of derivatives and of means over windows, relative to the measurements: the lower limit of
/// the noise.
const DISCRETIZATION_ERROR: f64 = 1e-6;

/// Tracks the noise of the channels: its covariance across the channels of one window, its
/// correlation between windows, and errors that last for many windows. Nothing is allocated after
/// construction.
#[derive(Clone, Debug)]
pub(crate) struct NoiseTracker {
    noise: Noise,
    /// Covariance of the residuals across the channels, in the channels' units. Only its lower
    /// triangle is used.
    covariance: DMatrix<f64>,
    /// Buffer for a copy of `covariance`.
    scratch: DMatrix<f64>,
    /// Residuals of the last window, in the channels' units.
    residuals: Vec<f64>,
    /// Number of windows that the noise is estimated from, at most [`MEMORY_WINDOWS`].
    windows: f64,
    /// Correlation of each channel's whitened residuals between windows.
    correlations: Vec<ResidualCorrelation>,
    /// Correlation of each channel's noise with that of the last window and of the one before it.
    shared: Vec<[f64; 2]>,
    /// Mean square of the slow means of the whitened residuals.
    slow_square: f64,
    /// Mean square of the whitened residuals.
    square: f64,
    /// Exponential mean of the mean square of the predictions.
    slow_load: f64,
}

impl NoiseTracker {
    /// Creates a tracker that knows no measurements.
    pub(crate) fn new(channels: &Channels) -> Self {
        let count = channels.count();
        Self {
            noise: Noise::from_targets(&[], channels, DISCRETIZATION_ERROR),
            covariance: DMatrix::zeros(count, count),
            scratch: DMatrix::zeros(count, count),
            residuals: vec![0.0; count],
            windows: 0.0,
            correlations: vec![ResidualCorrelation::WHITE; count],
            shared: vec![correlation_of(ResidualCorrelation::WHITE.products); count],
            slow_square: WHITE_SLOW_SQUARE,
            square: 1.0,
            slow_load: 0.0,
        }
    }

    /// Sets the noise to the size of the measurements, before there are residuals.
    pub(crate) fn set_to_measurements(&mut self, equations: &[Equation]) {
        self.noise.reset(equations);
        self.noise.set_zero_channels_to_unit();
    }

    /// Estimates the noise anew from the residuals of the windows that the parameters were
    /// estimated from.
    ///
    /// `window` and `prediction` are buffers.
    pub(crate) fn estimate(
        &mut self,
        equations: &[Equation],
        parameters: &Vector,
        window: &mut WhitenedWindow,
        prediction: &mut Prediction,
    ) {
        self.windows = equations.len() as f64;
        let independent = self.windows / NOISE_CORRELATION * self.residuals.len() as f64;
        // Ten parameters were estimated from the same rows.
        let freedom = (independent - 10.0).max(1.0);
        self.covariance.fill(0.0);
        for equation in equations {
            self.set_residuals(equation, parameters);
            self.add_products(independent / freedom / self.windows);
        }
        self.apply_covariance();
        self.correlations.fill(ResidualCorrelation::WHITE);
        (self.slow_square, self.square) = (WHITE_SLOW_SQUARE, 1.0);
        for (before, equation) in equations.iter().enumerate() {
            window.copy_from(equation);
            self.whiten(&mut window.rows);
            prediction.predict(&window.rows, parameters);
            self.update_correlations(prediction, 1.0, before as f64);
        }
    }

    /// Updates the noise with the window whose [residuals were set](Self::set_residuals) last, with
    /// its prediction and its weight.
    pub(crate) fn update(&mut self, prediction: &Prediction, weight: f64) {
        self.windows = (self.windows + 1.0).min(MEMORY_WINDOWS);
        self.update_correlations(prediction, weight, self.windows);
        let gain = self.windows.recip();
        self.covariance *= 1.0 - gain;
        self.add_products(gain * weight);
        self.apply_covariance();
    }

    /// Increases the variance of all channels by the factor [`VARIANCE_GROWTH`] and lets new
    /// windows correct it soon: the noise turned out larger than estimated.
    pub(crate) fn increase(&mut self) {
        self.covariance *= VARIANCE_GROWTH;
        self.windows = self.windows.min(INITIAL_WINDOWS as f64);
        self.apply_covariance();
    }

    /// Returns the correlation of a channel's noise with that of the last window and of the one
    /// before it.
    pub(crate) fn correlation(&self, channel: usize) -> [f64; 2] {
        self.shared[channel]
    }

    /// Returns the factor, at least one, on the covariance of the parameters for errors that last
    /// longer than the filter: the power of the slow means over that for white noise.
    pub(crate) fn lasting_error_factor(&self) -> f64 {
        (self.slow_square / (WHITE_SLOW_SQUARE * self.square)).max(1.0)
    }

    /// Returns the squared Mahalanobis distance of the slow means, whose variance includes that of
    /// the [model error](MODEL_ERROR).
    pub(crate) fn slow_distance(&self) -> f64 {
        let squares = self.correlations.iter().map(|of| of.slow_mean.powi(2));
        squares.sum::<f64>() / (self.slow_square + MODEL_ERROR * MODEL_ERROR * self.slow_load)
    }

    /// Returns the factor on variances for the uncertainty of the estimated correlations across
    /// channels.
    pub(crate) fn inflation(&self) -> f64 {
        self.noise
            .inflation(self.windows / PRODUCT_CORRELATION, 1.0)
    }

    /// Returns the degrees of freedom of a channel's variance: the number of independent windows
    /// that it is estimated from, less the channel's fraction of ten parameters.
    pub(crate) fn degrees_of_freedom(&self) -> f64 {
        self.windows / PRODUCT_CORRELATION - 10.0 / self.residuals.len() as f64
    }

    /// Returns the noise of a wrench, the first six channels, in one window; `None` where they are
    /// not a wrench.
    pub(crate) fn of_wrench(&self) -> Option<WrenchNoise> {
        Some(WrenchNoise {
            covariance: self.noise.wrench_covariance()?,
            factor: self.inflation() * self.lasting_error_factor(),
        })
    }

    /// Copies the noise of as many channels, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.noise.copy_from(&other.noise);
        self.covariance.copy_from(&other.covariance);
        self.windows = other.windows;
        self.correlations.copy_from_slice(&other.correlations);
        self.shared.copy_from_slice(&other.shared);
        (self.slow_square, self.square) = (other.slow_square, other.square);
        self.slow_load = other.slow_load;
    }

    /// Brings rows, one for each channel, to units of their noise and removes its correlation
    /// across channels.
    pub(crate) fn whiten(&self, rows: &mut [WhitenedRow]) {
        self.noise.whiten(rows);
    }

    /// Sets the residuals to those that some parameters leave of a window, in the channels' units.
    pub(crate) fn set_residuals(&mut self, equation: &Equation, parameters: &Vector) {
        for (residual, row) in self.residuals.iter_mut().zip(&equation.rows) {
            *residual = row.target - row.regressor.dot(parameters);
        }
    }

    /// Adds the products of the residuals to the covariance, with a weight.
    fn add_products(&mut self, weight: f64) {
        for (i, left) in self.residuals.iter().enumerate() {
            for (j, right) in self.residuals[..=i].iter().enumerate() {
                self.covariance[(i, j)] += weight * left * right;
            }
        }
    }

    /// Whitens with the present covariance from now on.
    fn apply_covariance(&mut self) {
        self.scratch.copy_from(&self.covariance);
        self.noise.set_covariance(&mut self.scratch, self.windows);
    }

    /// Updates the correlation between windows, the slow means and their mean squares with the
    /// whitened residuals of the next window.
    fn update_correlations(&mut self, prediction: &Prediction, weight: f64, windows_before: f64) {
        let gain = mean_gain(windows_before);
        let root = weight.sqrt();
        let (mut slow_square, mut square) = (0.0, 0.0);
        for (correlation, residual) in self.correlations.iter_mut().zip(&prediction.residuals) {
            correlation.update(root * residual, gain);
            slow_square += correlation.slow_mean * correlation.slow_mean;
            square += weight * residual * residual;
        }
        let channels = prediction.residuals.len() as f64;
        self.slow_square += gain * (slow_square / channels - self.slow_square);
        self.square += gain * (square / channels - self.square);
        self.slow_load += SLOW_GAIN * (prediction.load - self.slow_load);
        self.share_correlations(windows_before);
    }

    /// Combines the mean products of each channel with those of all channels of its kind, which
    /// count for [`SHARED_WINDOWS`].
    fn share_correlations(&mut self, windows: f64) {
        let own_fraction = windows / (windows + SHARED_WINDOWS);
        let mut first = 0;
        for &count in self.noise.kinds() {
            let channels = first..first + count;
            let mut mean = [0.0; 3];
            for channel in &self.correlations[channels.clone()] {
                for (mean, product) in mean.iter_mut().zip(channel.products) {
                    *mean += product / count as f64;
                }
            }
            for channel in channels {
                let own = self.correlations[channel].products;
                let combined = |k: usize| mean[k] + own_fraction * (own[k] - mean[k]);
                self.shared[channel] = correlation_of(std::array::from_fn(combined));
            }
            first += count;
        }
    }
}
