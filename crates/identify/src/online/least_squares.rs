//! Online least squares: windows in, parameters and their covariance out.

use tactid_nlms::SettingError;

use super::changes::{Changes, is_evident, score};
use super::explanations::{Explanations, Verdict};
use super::innovation::{Prediction, WhitenedWindow};
use super::noise_tracker::{INITIAL_WINDOWS, MIN_WINDOWS};
use super::stage::Stage;
use super::trusted::{JointEstimate, State, Trusted};
use crate::equations::window::NOISE_CORRELATION;
use crate::equations::{Channels, Equation};
use crate::solve::information::Information;
use crate::solve::offsets::WrenchNoise;
use crate::solve::subspace::{Matrix, NullSpace, Vector};
use crate::solve::uncertainty::students_widening;
use crate::solve::weights::{rare_distance, robust_weight};

/// Leverage of a window relative to the mean since the estimate began below which the robot counts
/// as at rest.
const REST_LEVERAGE: f64 = 0.02;

/// What a new window means for the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Assessment {
    /// The window updates the estimate, beginning with this stage.
    Accepted(Stage),
    /// The window shows a payload change. It is not used, all earlier ones are discarded, and the
    /// update begins with [`Stage::Solve`].
    PayloadChanged,
    /// The windows since a payload change contradict any payload, and fewer than 32 had shown one:
    /// otherwise as [`PayloadChanged`](Self::PayloadChanged).
    Contradicted,
    /// Windows up to this one show the payload before the last change again, whose estimate
    /// continues. The update begins with [`Stage::Solve`].
    PayloadReturned,
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
/// Rows are weighted by the noise that their innovations show, and whitened across channels. The
/// triangular factor of all rows gives the least-squares solution to rounding. The bias from noise
/// in the motion is corrected as the half-differences show it, as in `BatchIdentifier`. A window
/// with a rare innovation has a lower robust weight; several in a row show a payload change, after
/// which the estimate starts again. Nothing is allocated after construction.
///
/// [`assess`](Self::assess) decides about a new window at once. Its update follows in the
/// [stages](Stage) of estimation, each a method here, which
/// [`StagedUpdate`](super::staged_update::StagedUpdate) calls in order.
#[derive(Clone, Debug)]
pub(crate) struct OnlineLeastSquares {
    pub(super) state: State,
    /// The estimate as of the last window that nothing contradicted.
    pub(super) trusted: Trusted,
    /// Number of times that the estimate started again since the last window with a trusted
    /// estimate: after a payload change, and where no payload explained the windows since.
    pub(super) alarms: usize,
    /// What explains the windows since the estimate last started again.
    pub(super) explanations: Explanations,
    pub(super) verdict: Verdict,
    /// Whether the last window contradicts the present estimate.
    pub(super) is_contradicted: bool,
    /// The first windows, from which the noise is estimated at first.
    initial: Vec<Equation>,
    /// Buffer for a window without the offsets.
    centred: Equation,
    /// Number of windows.
    pub(super) windows: usize,
    pub(super) changes: Changes,
    /// The most recent window. Its differences are whitened when they are needed.
    window: WhitenedWindow,
    prediction: Prediction,
    weights: WindowWeights,
    information: Information,
    /// Sandwich covariance in observable directions.
    sandwich: Matrix,
    /// Covariance that is reported: wider than the sandwich.
    pub(super) covariance: Matrix,
}

impl OnlineLeastSquares {
    /// Creates an estimator that has seen no window.
    ///
    /// # Errors
    /// Returns [`SettingError`] if a setting of the change detectors is out of range.
    pub(crate) fn new(channels: &Channels) -> Result<Self, SettingError> {
        let count = channels.count();
        Ok(Self {
            state: State::new(channels),
            trusted: Trusted::new(channels),
            alarms: 0,
            is_contradicted: false,
            explanations: Explanations::new(count),
            verdict: Verdict::Payload,
            initial: vec![Equation::new(count); INITIAL_WINDOWS],
            centred: Equation::new(count),
            windows: 0,
            changes: Changes::new()?,
            window: WhitenedWindow::new(count),
            prediction: Prediction::new(count),
            weights: WindowWeights::ROWS_ONLY,
            information: Information::none(),
            sandwich: Matrix::zeros(),
            covariance: Matrix::zeros(),
        })
    }

    /// Decides how a new window updates the estimate, or that it shows a payload change. The stages
    /// of the previous window must be complete.
    pub(crate) fn assess(&mut self, equation: &Equation) -> Assessment {
        // A sensor that has not started yet reports zeros, which are information on neither payload
        // nor noise.
        if self.windows == 0 && equation.rows.iter().all(|row| row.target == 0.0) {
            return Assessment::Accepted(Stage::ComputeCovariance);
        }
        if let Some(assessment) = self.doubt(equation) {
            return assessment;
        }
        let mut centred = std::mem::replace(&mut self.centred, Equation::new(0));
        let assessment = self.assess_with(equation, &mut centred);
        self.centred = centred;
        if matches!(assessment, Assessment::Accepted(_)) {
            self.trust_unless_contradicted();
        }
        assessment
    }

    /// Assesses a window with a buffer for the window without offsets.
    fn assess_with(&mut self, equation: &Equation, centred: &mut Equation) -> Assessment {
        if !self.state.centering.is_needed() {
            return self.assess_centred(equation);
        }
        if self.state.centering.needs_first_window() {
            self.state.centering.add(&equation.rows, 1.0);
            // The first window determines the offsets alone: the parameters stay as they are.
            return Assessment::Accepted(Stage::ComputeCovariance);
        }
        centred.clone_from(equation);
        self.state.centering.centre(&mut centred.rows, 1.0);
        let assessment = self.assess_centred(centred);
        if assessment != Assessment::PayloadChanged {
            let weight = self.weights.rows;
            self.state.centering.add(&equation.rows, weight);
        }
        assessment
    }

    /// Whether the noise is known, and enough windows since the last payload change, so that
    /// changes are detected.
    pub(crate) fn detects_changes(&self) -> bool {
        self.state.windows_since_start > INITIAL_WINDOWS
    }

    /// Assesses a window whose channels have no offset.
    fn assess_centred(&mut self, equation: &Equation) -> Assessment {
        if let Some(place) = self.initial.get_mut(self.windows) {
            place.clone_from(equation);
        }
        self.windows += 1;
        self.state.windows_since_start += 1;
        if self.windows < MIN_WINDOWS {
            self.state
                .noise
                .set_to_measurements(&self.initial[..self.windows]);
            self.window.copy_from(equation);
            self.state.noise.whiten(&mut self.window.rows);
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

    /// Estimates the noise from the residuals of the initial windows so far, and adds all of them
    /// again with weights of this noise.
    fn estimate_noise(&mut self) {
        let initial = &self.initial[..self.windows];
        let (window, prediction) = (&mut self.window, &mut self.prediction);
        let parameters = self.state.rows.best_fit();
        self.state
            .noise
            .estimate(initial, &parameters, window, prediction);
        self.state.rows.restart();
        for equation in initial {
            self.window.copy_from(equation);
            self.state.noise.whiten(&mut self.window.rows);
            self.state.noise.whiten(&mut self.window.differences);
            self.state.rows.add(&self.window, 1.0, &self.state.noise);
            self.state.rows.update_square_root();
        }
    }

    /// Sets the weights of a window by its innovation, or detects a payload change.
    fn compare_with_prediction(&mut self, equation: &Equation) -> Assessment {
        self.window.copy_from(equation);
        self.state.noise.whiten(&mut self.window.rows);
        self.prediction
            .predict(&self.window.rows, &self.state.parameters);
        let innovation =
            self.state
                .rows
                .innovation(&self.window.rows, &self.prediction, &self.sandwich);
        // Otherwise the parameters are less certain than the noise, and innovations show little of
        // a change.
        let is_predictable = innovation.leverage < 1.0;
        // At rest, errors of the model do not show: the residuals are no sign of the noise in
        // motion.
        let is_moving = innovation.leverage > REST_LEVERAGE * self.mean_leverage();
        let detects_changes = self.detects_changes();
        let channels = self.window.rows.len();
        let sudden = score(
            innovation.distance_beyond_model,
            channels,
            &self.state.noise,
        );
        let slow = self.state.noise.slow_distance();
        let slow = score(slow, channels, &self.state.noise);
        self.compare_block();
        let residuals = self.prediction.residuals.iter();
        self.state.block_squares += residuals.map(|each| each * each).sum::<f64>();
        let slow = slow.max(self.state.block_score);
        self.is_contradicted = is_predictable && is_evident(sudden);
        if is_predictable && detects_changes && self.changes.detects(sudden, slow) {
            return self.restart();
        }
        self.state
            .noise
            .set_residuals(equation, &self.state.parameters);
        let robust = robust_weight(innovation.distance, rare_distance(self.window.rows.len()));
        let noise = robust / (1.0 + innovation.leverage);
        let shows_noise = is_predictable && is_moving && (self.alarms == 0 || !self.knows_noise());
        self.weights = WindowWeights {
            rows: if detects_changes { robust } else { 1.0 },
            noise: shows_noise.then_some(noise),
        };
        Assessment::Accepted(Stage::AddRows)
    }

    /// Begins another block of as many windows as the noise is estimated from at first, where one
    /// has ended, and sets the score of what the estimate of all windows leaves of that one.
    fn compare_block(&mut self) {
        let before = self.state.windows_since_start - 1;
        if !before.is_multiple_of(INITIAL_WINDOWS) {
            return;
        }
        let now = self.state.rows.sums();
        let earlier = std::mem::replace(&mut self.state.earlier, now);
        let squares = std::mem::take(&mut self.state.block_squares);
        self.state.block_score = 0.0;
        // Until a second block ends, the estimate is that of the first one.
        let is_tested = before > INITIAL_WINDOWS && self.information.is_complete();
        if !is_tested || self.trusted.estimate().is_none() {
            return;
        }
        // A change also adds to the noise.
        let noise = &self.trusted.state().noise;
        let (parameters, factor) = (&self.state.parameters, noise.lasting_error_factor());
        let Some(distance) = now.distance_since(&earlier, parameters, factor) else {
            return;
        };
        // Noise that has grown with the motion shows in the rest of the residuals, too.
        let rows = (INITIAL_WINDOWS * self.window.rows.len()) as f64;
        let growth = ((squares - distance) / rows).max(1.0);
        self.state.block_score = score(distance / growth, parameters.len(), noise);
    }

    /// Mean leverage of the rows since the estimate began, if all ten parameters are observable:
    /// leverages sum to the number of parameters.
    fn mean_leverage(&self) -> f64 {
        10.0 * NOISE_CORRELATION / (self.state.windows_since_start * self.window.rows.len()) as f64
    }

    /// Whether the most recent window updates the noise.
    pub(crate) fn shows_noise(&self) -> bool {
        self.weights.noise.is_some()
    }

    /// Runs [`Stage::AddRows`].
    pub(crate) fn add_rows(&mut self) {
        self.state.noise.whiten(&mut self.window.differences);
        self.state
            .rows
            .add(&self.window, self.weights.rows, &self.state.noise);
    }

    /// Runs [`Stage::UpdateSquareRoot`].
    pub(crate) fn update_square_root(&mut self) {
        self.state.rows.update_square_root();
    }

    /// Runs [`Stage::UpdateNoise`].
    pub(crate) fn update_noise(&mut self) {
        if let Some(weight) = self.weights.noise {
            self.state.noise.update(&self.prediction, weight);
        }
    }

    /// Runs [`Stage::Solve`].
    pub(crate) fn solve(&mut self) {
        let noise = self.state.noise.of_wrench();
        let offsets = noise.and_then(|noise| self.state.centering.offset_rows(&noise));
        (self.state.parameters, self.information) = self.state.rows.solve(offsets);
    }

    /// Runs [`Stage::ComputeCovariance`].
    pub(crate) fn compute_covariance(&mut self) {
        let scores = self.state.rows.score_covariance(self.score_factor());
        self.sandwich = self.information.sandwich(&scores);
        let widening = students_widening(self.state.noise.degrees_of_freedom());
        self.covariance = self.sandwich * widening.powi(2);
        if !self.information.is_complete() {
            let prior = self.state.rows.plausible_std_devs();
            for (k, direction) in self.information.unobservable() {
                let variance = prior[k].powi(2);
                self.covariance.ger(variance, &direction, &direction, 1.0);
            }
        }
    }

    /// Variance of the residuals of rows in units of the noise of a window.
    pub(super) fn score_factor(&self) -> f64 {
        self.state.noise.inflation() * self.state.noise.lasting_error_factor()
    }

    /// Returns the parameters in the order of
    /// [`InertialParameters`](tactid_dynamics::InertialParameters).
    pub(crate) fn parameters(&self) -> &Vector {
        &self.state.parameters
    }

    /// Returns the covariance of the parameters; `None` before the noise has been estimated, and
    /// while no payload explains the windows since a payload change.
    ///
    /// It is larger than the sandwich covariance by what the uncertainty of the noise itself adds.
    /// In unobservable directions it has the [plausible size](Information::unobservable) of the
    /// parameters.
    pub(crate) fn covariance(&self) -> Option<Matrix> {
        (self.windows >= MIN_WINDOWS && self.is_known()).then_some(self.covariance)
    }

    /// Returns the parameters with the constant offsets of the first six channels, in their units,
    /// where these are unknowns.
    pub(crate) fn joint_estimate(&self) -> JointEstimate {
        JointEstimate::of(&self.state, self.covariance, &self.information)
    }

    /// The estimate as of the last window that nothing contradicted; `None` before the first.
    pub(crate) fn trusted(&self) -> Option<&JointEstimate> {
        self.trusted.estimate()
    }

    /// Noise of the wrench in one window; `None` without wrenches.
    pub(crate) fn wrench_noise(&self) -> Option<WrenchNoise> {
        self.state.noise.of_wrench()
    }

    /// Weight of the residuals of the most recent window in the estimate of the noise; zero where
    /// they show nothing of it.
    pub(crate) fn noise_weight(&self) -> f64 {
        self.weights.noise.unwrap_or(0.0)
    }

    /// Whether nothing contradicts the present estimate, and changes of the payload are detected.
    pub(crate) fn is_settled(&self) -> bool {
        self.detects_changes() && self.verdict == Verdict::Payload && !self.changes.has_evidence()
    }

    /// Returns the inverse of the covariance for white noise. In unobservable directions it is that
    /// of the plausible size of the parameters.
    pub(crate) fn information(&self) -> Matrix {
        let std_devs = self.state.rows.plausible_std_devs();
        let prior = std_devs.map(|std_dev| NOISE_CORRELATION / std_dev.powi(2));
        self.information.matrix(&prior) / NOISE_CORRELATION
    }

    /// Returns the unobservable directions of the parameters.
    pub(crate) fn null_space(&self) -> NullSpace {
        self.information.null_space(self.state.rows.scales())
    }
}
