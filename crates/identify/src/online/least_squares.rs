//! Online least squares: windows in, parameters and their covariance out.

use nalgebra::Vector6;
use tactid_nlms::{ChangeDetector, ChangeSettings, SettingError};

use super::accumulated_rows::AccumulatedRows;
use super::innovation::{Innovation, Prediction, WhitenedWindow};
use super::noise_tracker::{INITIAL_WINDOWS, NoiseTracker};
use super::stage::Stage;
use crate::equations::Channels;
use crate::equations::Equation;
use crate::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};
use crate::solve::information::Information;
use crate::solve::offsets::Centering;
use crate::solve::subspace::{Matrix, NullSpace, Vector};
use crate::solve::uncertainty::students_widening;
use crate::solve::weights::{rare_distance, robust_weight, wilson_hilferty};

/// Number of windows from which the noise is estimated for the first time: 48 rows of a wrench, for ten
/// parameters and the noise of six channels.
const MIN_WINDOWS: usize = 8;

/// Leverage of a window relative to the mean since the estimate began below which the robot counts as at rest.
const REST_LEVERAGE: f64 = 0.02;

/// Number of windows since the estimate began, 3 s at a cutoff of 10 Hz, within which an alarm may also mean that
/// the noise is larger than estimated.
const TRIAL_WINDOWS: usize = 100;

/// Settings of the detector of sudden changes, whose input is the score of each window.
///
/// A false alarm is expected once in 1e8 windows, 36 days at a cutoff of 10 Hz. An alarm needs at least four
/// windows, more than one bump disturbs: each adds at most `(4 · 3.5 - 8) / 1.15` to a sum that must reach
/// `ln(3e8 / 1.15)`. Scores below two standard deviations add nothing, because noise may grow with the motion.
const SUDDEN_CHANGE: ChangeSettings = ChangeSettings {
    rows_between_false_alarms: 1e8,
    correlation_rows: PRODUCT_CORRELATION,
    shift: 4.0,
    growth: 6.0,
    clip: 3.5,
};

/// Settings of the detector of changes below the noise of a window, whose input is the score of the slow means of
/// the residuals: exponential means with a gain of 0.1, which are correlated over `(1 + 0.9) / (1 - 0.9)` windows.
const SLOW_CHANGE: ChangeSettings = ChangeSettings {
    correlation_rows: 19.0,
    shift: 3.0,
    ..SUDDEN_CHANGE
};

/// What a new window means for the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Assessment {
    /// The window updates the estimate, beginning with this stage.
    Accepted(Stage),
    /// The window shows a payload change. It is not used, all earlier ones are discarded, and the update begins
    /// with [`Stage::Solve`].
    PayloadChanged,
}

/// Weights of the most recent window in its update.
#[derive(Clone, Copy, Debug)]
struct WindowWeights {
    /// Robust weight of the rows in the estimate of the parameters.
    rows: f64,
    /// Weight of the residuals in the estimate of the noise; `None` where they show nothing of it.
    noise: Option<f64>,
}

impl WindowWeights {
    /// Weights of a window from which the noise is not updated.
    const ROWS_ONLY: Self = Self {
        rows: 1.0,
        noise: None,
    };
}

/// Weighted least squares, window by window, with errors-in-variables bias correction.
///
/// Rows are weighted by the noise that their innovations show, and whitened across channels. The triangular factor
/// of all rows gives the least-squares solution to rounding. The bias from noise in the motion is corrected as the
/// half-differences show it, as in [`BatchIdentifier`](crate::BatchIdentifier). A window with a rare innovation has a
/// lower robust weight; several in a row show a payload change, after which the estimate starts again. Nothing is
/// allocated after construction.
///
/// [`assess`](Self::assess) decides about a new window at once. Its update follows in the [stages](Stage) of
/// estimation, each a method here, which [`StagedUpdate`](super::staged_update::StagedUpdate) calls in order.
#[derive(Clone, Debug)]
pub(crate) struct OnlineLeastSquares {
    rows: AccumulatedRows,
    noise: NoiseTracker,
    /// The first windows, from which the noise is estimated at first.
    initial: Vec<Equation>,
    /// Elimination of the constant offsets of channels.
    centering: Centering,
    /// Buffer for a window without the offsets.
    centred: Equation,
    /// Number of windows.
    windows: usize,
    sudden_change: ChangeDetector,
    slow_change: ChangeDetector,
    /// Number of windows since the first one or the last payload change.
    windows_since_start: usize,
    /// The most recent window. Its differences are whitened when they are needed.
    window: WhitenedWindow,
    prediction: Prediction,
    weights: WindowWeights,
    parameters: Vector,
    information: Information,
    /// Sandwich covariance in observable directions.
    sandwich: Matrix,
    /// Covariance that is reported: wider than the sandwich.
    covariance: Matrix,
}

impl OnlineLeastSquares {
    /// Creates an estimator that has seen no window.
    ///
    /// # Errors
    /// Returns [`SettingError`] if a setting of the change detectors is out of range.
    pub(crate) fn new(channels: &Channels) -> Result<Self, SettingError> {
        let count = channels.count();
        Ok(Self {
            rows: AccumulatedRows::new(count),
            noise: NoiseTracker::new(channels),
            initial: vec![Equation::new(count); INITIAL_WINDOWS],
            centering: Centering::new(channels.offsets),
            centred: Equation::new(count),
            windows: 0,
            sudden_change: ChangeDetector::new(SUDDEN_CHANGE)?,
            slow_change: ChangeDetector::new(SLOW_CHANGE)?,
            windows_since_start: 0,
            window: WhitenedWindow::new(count),
            prediction: Prediction::new(count),
            weights: WindowWeights::ROWS_ONLY,
            parameters: Vector::zeros(),
            information: Information::none(),
            sandwich: Matrix::zeros(),
            covariance: Matrix::zeros(),
        })
    }

    /// Decides how a new window updates the estimate, or that it shows a payload change. The stages of the
    /// previous window must be complete.
    pub(crate) fn assess(&mut self, equation: &Equation) -> Assessment {
        // A sensor that has not started yet reports zeros, which are information on neither payload nor noise.
        if self.windows == 0 && equation.rows.iter().all(|row| row.target == 0.0) {
            return Assessment::Accepted(Stage::ComputeCovariance);
        }
        if !self.centering.is_needed() {
            return self.assess_centred(equation);
        }
        if self.centering.is_empty() {
            self.centering.add(&equation.rows, 1.0);
            // The first window determines the offsets alone: the parameters stay as they are.
            return Assessment::Accepted(Stage::ComputeCovariance);
        }
        let mut centred = std::mem::replace(&mut self.centred, Equation::new(0));
        centred.copy_from(equation);
        self.centering.centre(&mut centred.rows, 1.0);
        let assessment = self.assess_centred(&centred);
        self.centred = centred;
        match assessment {
            Assessment::PayloadChanged => self.centering.reset(),
            Assessment::Accepted(_) => self.centering.add(&equation.rows, self.weights.rows),
        }
        assessment
    }

    /// Assesses a window whose channels have no offset.
    fn assess_centred(&mut self, equation: &Equation) -> Assessment {
        if let Some(place) = self.initial.get_mut(self.windows) {
            place.copy_from(equation);
        }
        self.windows += 1;
        self.windows_since_start += 1;
        if self.windows < MIN_WINDOWS {
            self.noise
                .set_to_measurements(&self.initial[..self.windows]);
            self.window.copy_from(equation);
            self.noise.whiten(&mut self.window.rows);
            self.weights = WindowWeights::ROWS_ONLY;
            Assessment::Accepted(Stage::AddRows)
        } else if self.windows <= INITIAL_WINDOWS && self.windows.is_power_of_two() {
            self.estimate_noise();
            self.weights = WindowWeights::ROWS_ONLY;
            Assessment::Accepted(Stage::Solve)
        } else {
            self.compare_with_prediction(equation)
        }
    }

    /// Estimates the noise from the residuals of the initial windows so far, and adds all of them again with
    /// weights of this noise.
    fn estimate_noise(&mut self) {
        let initial = &self.initial[..self.windows];
        let (window, prediction) = (&mut self.window, &mut self.prediction);
        let parameters = self.rows.best_fit();
        self.noise
            .estimate(initial, &parameters, window, prediction);
        self.rows.restart();
        for equation in initial {
            self.window.copy_from(equation);
            self.noise.whiten(&mut self.window.rows);
            self.noise.whiten(&mut self.window.differences);
            self.rows.add(&self.window, 1.0, &self.noise);
            self.rows.update_square_root();
        }
    }

    /// Sets the weights of a window by its innovation, or detects a payload change.
    fn compare_with_prediction(&mut self, equation: &Equation) -> Assessment {
        self.window.copy_from(equation);
        self.noise.whiten(&mut self.window.rows);
        self.prediction.predict(&self.window.rows, &self.parameters);
        let innovation = self
            .rows
            .innovation(&self.window.rows, &self.prediction, &self.sandwich);
        // Otherwise the parameters are less certain than the noise, and innovations show little of a change.
        let is_predictable = innovation.leverage < 1.0;
        // At rest, errors of the model do not show: the residuals are no sign of the noise in motion.
        let is_moving = innovation.leverage > REST_LEVERAGE * self.mean_leverage();
        let is_settled = self.windows_since_start > INITIAL_WINDOWS;
        if is_predictable && is_settled && self.detects_change(&innovation) {
            self.restart();
            return Assessment::PayloadChanged;
        }
        self.noise.set_residuals(equation, &self.parameters);
        let robust = robust_weight(innovation.distance, rare_distance(self.window.rows.len()));
        let noise = robust / (1.0 + innovation.leverage);
        self.weights = WindowWeights {
            rows: if is_settled { robust } else { 1.0 },
            noise: (is_predictable && is_moving).then_some(noise),
        };
        Assessment::Accepted(Stage::AddRows)
    }

    /// Mean leverage of the rows since the estimate began, if all ten parameters are observable: leverages sum to
    /// the number of parameters.
    fn mean_leverage(&self) -> f64 {
        10.0 * NOISE_CORRELATION / (self.windows_since_start * self.window.rows.len()) as f64
    }

    /// Returns whether the innovations up to this one show a payload change, sudden or below the noise of a window.
    fn detects_change(&mut self, innovation: &Innovation) -> bool {
        let channels = self.window.rows.len();
        let (mean, std_dev) = wilson_hilferty(channels);
        // The transformation of Wilson and Hilferty to a standard normal variable. Innovations that are smaller
        // than expected are no sign of a payload change.
        let score = |distance: f64| {
            let ratio = distance / (channels as f64 * self.noise.inflation());
            ((ratio.cbrt() - mean) / std_dev).max(0.0)
        };
        let sudden = self
            .sudden_change
            .update(score(innovation.distance_beyond_model));
        let slow = self.slow_change.update(score(self.noise.slow_distance()));
        sudden || slow
    }

    /// Discards all windows after a payload change, and keeps the noise. Soon after a start, the noise may have
    /// been underestimated instead, and is increased.
    fn restart(&mut self) {
        if self.windows_since_start < TRIAL_WINDOWS {
            self.noise.increase();
        }
        self.rows.restart_at(&self.parameters);
        self.sudden_change.restart();
        self.slow_change.restart();
        self.windows_since_start = 0;
    }

    /// Whether the most recent window updates the noise.
    pub(crate) fn shows_noise(&self) -> bool {
        self.weights.noise.is_some()
    }

    /// Runs [`Stage::AddRows`].
    pub(crate) fn add_rows(&mut self) {
        self.noise.whiten(&mut self.window.differences);
        self.rows.add(&self.window, self.weights.rows, &self.noise);
    }

    /// Runs [`Stage::UpdateSquareRoot`].
    pub(crate) fn update_square_root(&mut self) {
        self.rows.update_square_root();
    }

    /// Runs [`Stage::UpdateNoise`].
    pub(crate) fn update_noise(&mut self) {
        if let Some(weight) = self.weights.noise {
            self.noise.update(&self.prediction, weight);
        }
    }

    /// Runs [`Stage::Solve`].
    pub(crate) fn solve(&mut self) {
        (self.parameters, self.information) = self.rows.solve();
    }

    /// Runs [`Stage::ComputeCovariance`].
    pub(crate) fn compute_covariance(&mut self) {
        let factor = self.noise.inflation() * self.noise.lasting_error_factor();
        let scores = self.rows.score_covariance() * factor;
        self.sandwich = self.information.sandwich(&scores);
        let widening = students_widening(self.noise.degrees_of_freedom());
        self.covariance = self.sandwich * widening.powi(2);
        if !self.information.is_complete() {
            let prior = self.rows.plausible_std_devs();
            for (k, direction) in self.information.unobservable() {
                let variance = prior[k].powi(2);
                self.covariance.ger(variance, &direction, &direction, 1.0);
            }
        }
    }

    /// Returns the parameters in the order of [`InertialParameters`](tactid_dynamics::InertialParameters).
    pub(crate) fn parameters(&self) -> &Vector {
        &self.parameters
    }

    /// Returns the covariance of the parameters; `None` before the noise has been estimated.
    ///
    /// It is larger than the sandwich covariance by what the uncertainty of the noise itself adds. In unobservable
    /// directions it has the [plausible size](Information::unobservable) of the parameters.
    pub(crate) fn covariance(&self) -> Option<Matrix> {
        (self.windows >= MIN_WINDOWS).then_some(self.covariance)
    }

    /// Returns the constant offsets of the first six channels, in their units; `None` where they are not among the
    /// unknowns, or before any window.
    pub(crate) fn offsets(&self) -> Option<Vector6<f64>> {
        self.centering.offsets(&self.parameters)
    }

    /// Returns the inverse of the covariance for white noise. In unobservable directions it is that of the plausible
    /// size of the parameters.
    pub(crate) fn information(&self) -> Matrix {
        let std_devs = self.rows.plausible_std_devs();
        let prior = std_devs.map(|std_dev| NOISE_CORRELATION / std_dev.powi(2));
        self.information.matrix(&prior) / NOISE_CORRELATION
    }

    /// Returns the unobservable directions of the parameters.
    pub(crate) fn null_space(&self) -> NullSpace {
        self.information.null_space(self.rows.scales())
    }
}
