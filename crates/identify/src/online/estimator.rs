//! Least squares online: windows in, parameters out, with their uncertainty.

use tactid_nlms::{ChangeDetector, ChangeSettings, SettingError};

use super::running_noise::RunningNoise;
use super::sums::{Innovation, Prediction, Sums, Window};
use crate::equations::Channels;
use crate::equations::Equation;
use crate::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};
use crate::solve::information::Information;
use crate::solve::offsets::Centering;
use crate::solve::subspace::{Matrix, NullSpace, Vector};
use crate::solve::weights::{rare_distance, robust_weight, wilson_hilferty};

/// The first windows are kept. When there are so many, and at each doubling, their residuals tell the
/// noise, and all are taken in anew with its weights.
const FEWEST: usize = 8;
/// The last time. As many windows after the estimate began, they are judged by it.
const REHEARSED: usize = 32;

/// Windows that say less of the parameters than this part of a typical one are of a robot at rest.
const REST: f64 = 0.02;

/// An alarm so few windows after the estimate began may also be that the noise is larger than was known.
const PROBATION: usize = 100;

/// What lasts is judged by means over [ten windows](running), which are alike for 19.
const SLOW_ALARM: ChangeSettings = ChangeSettings {
    correlation_rows: 19.0,
    shift: 3.0,
    ..ALARM
};

/// The alarm takes at least four windows, more than a single bump disturbs: each adds at most
/// `(4 · 3.5 - 8) / 1.15` to a sum that must reach `ln(3e8 / 1.15)`. Two deviations more than the noise was
/// known to have are let pass: noise may grow with the motion.
const ALARM: ChangeSettings = ChangeSettings {
    rows_between_false_alarms: 1e8,
    correlation_rows: PRODUCT_CORRELATION,
    shift: 4.0,
    growth: 6.0,
    clip: 3.5,
};

/// What is left to do of the last window, in this order.
#[derive(Clone, Copy, Debug)]
enum Stage {
    /// Into the sums, with its weight, and with its share in what is learnt of the noise, if it has one.
    Take(f64, Option<f64>),
    UpdateSquareRoot(Option<f64>),
    Follow(f64),
    Solve,
    Spread,
}

/// Weighted least squares, recursive, without the bias that noise in the motion makes.
///
/// Rows are weighted by the noise that their own innovations show, whitened across channels. The
/// triangle of all rows gives the least-squares solution to rounding; what the motion's noise adds to
/// it is taken off as the differences show it, as in [`BatchIdentifier`](crate::BatchIdentifier). A window that is rare
/// pulls no harder than others; several in a row say that the payload has changed, and the estimate
/// begins anew. Nothing is allocated after construction.
///
/// A window is judged at once; what follows from it is computed [in stages](Self::proceed), one a sample,
/// so that no sample takes much longer than others.
#[derive(Clone, Debug)]
pub(crate) struct Recursive {
    stage: Option<Stage>,
    sums: Sums,
    noise: RunningNoise,
    /// The first windows.
    kept: Vec<Equation>,
    /// Of channels that may be off by a constant, and the last window without it.
    centering: Centering,
    centred: Equation,
    windows: usize,
    detector: ChangeDetector,
    slow_detector: ChangeDetector,
    /// Windows since the estimate began, or began anew.
    since_start: usize,
    /// The last one, whitened as far as it was needed.
    window: Window,
    prediction: Prediction,
    parameters: Vector,
    information: Information,
    covariance: Matrix,
}

impl Recursive {
    pub(crate) fn new(channels: &Channels) -> Result<Self, SettingError> {
        let count = channels.count();
        Ok(Self {
            stage: None,
            sums: Sums::new(count),
            noise: RunningNoise::new(channels),
            kept: vec![Equation::new(count); REHEARSED],
            centering: Centering::new(channels.offsets),
            centred: Equation::new(count),
            windows: 0,
            detector: ChangeDetector::new(ALARM)?,
            slow_detector: ChangeDetector::new(SLOW_ALARM)?,
            since_start: 0,
            window: Window::new(count),
            prediction: Prediction::new(count),
            parameters: Vector::zeros(),
            information: Information::none(),
            covariance: Matrix::zeros(),
        })
    }

    /// Judges a window; true where it shows that the payload is another, and the estimate begins anew.
    /// What is known with it comes with the last [stage](Self::proceed).
    pub(crate) fn update(&mut self, equation: &Equation) -> bool {
        while self.proceed() {}
        if !self.centering.is_needed() {
            return self.take_in(equation);
        }
        if self.centering.is_empty() {
            self.centering.add(&equation.rows, 1.0);
            return false;
        }
        let mut centred = std::mem::replace(&mut self.centred, Equation::new(0));
        centred.copy_from(equation);
        self.centering.centre(&mut centred.rows, 1.0);
        let changed = self.take_in(&centred);
        self.centred = centred;
        match self.stage {
            _ if changed => self.centering.reset(),
            Some(Stage::Take(weight, _)) => self.centering.add(&equation.rows, weight),
            _ => self.centering.add(&equation.rows, 1.0),
        }
        changed
    }

    /// A window that is off by nothing.
    fn take_in(&mut self, equation: &Equation) -> bool {
        if let Some(place) = self.kept.get_mut(self.windows) {
            place.copy_from(equation);
        }
        self.windows += 1;
        self.since_start += 1;
        let stage = if self.windows < FEWEST {
            self.noise.begin(&self.kept[..self.windows]);
            self.window.copy_from(equation);
            self.noise.whiten(&mut self.window.rows);
            Some(Stage::Take(1.0, None))
        } else if self.windows <= REHEARSED && self.windows.is_power_of_two() {
            self.rehearse();
            Some(Stage::Solve)
        } else {
            self.judge(equation)
        };
        self.stage = stage.or(Some(Stage::Solve));
        stage.is_none()
    }

    /// Does the next stage; false where it was the last.
    pub(crate) fn proceed(&mut self) -> bool {
        self.stage = self.stage.and_then(|stage| match stage {
            Stage::Take(weight, share) => {
                self.noise.whiten(&mut self.window.differences);
                self.sums.take(&self.window, weight, &self.noise);
                Some(Stage::UpdateSquareRoot(share))
            }
            Stage::UpdateSquareRoot(share) => {
                self.sums.update_square_root();
                Some(share.map_or(Stage::Solve, Stage::Follow))
            }
            Stage::Follow(share) => {
                self.noise.follow(&self.prediction, share);
                Some(Stage::Solve)
            }
            Stage::Solve => {
                (self.parameters, self.information) = self.sums.solve();
                Some(Stage::Spread)
            }
            Stage::Spread => {
                let scores = self.sums.scores() * (self.noise.inflation() * self.noise.lasting());
                self.covariance = self.information.sandwich(&scores);
                None
            }
        });
        self.stage.is_some()
    }

    /// In the order of [`InertialParameters`](tactid_dynamics::InertialParameters).
    pub(crate) fn parameters(&self) -> &Vector {
        &self.parameters
    }

    /// Of the parameters, in the directions that are known; `None` before the noise is.
    pub(crate) fn covariance(&self) -> Option<Matrix> {
        (self.windows >= FEWEST).then_some(self.covariance)
    }

    /// What the first six channels are off by, where they may be, in their units.
    pub(crate) fn offsets(&self) -> Option<[f64; 6]> {
        self.centering.offsets(&self.parameters)
    }

    /// The inverse of the covariance for white noise, with next to nothing in unknown directions.
    pub(crate) fn information(&self) -> Matrix {
        self.information.matrix() / NOISE_CORRELATION
    }

    /// The unobservable directions.
    pub(crate) fn null_space(&self) -> NullSpace {
        self.information.null_space(self.sums.scales())
    }

    /// Learns the noise from all windows that were kept, and takes them in with its weights.
    fn rehearse(&mut self) {
        let kept = &self.kept[..self.windows];
        let (window, prediction) = (&mut self.window, &mut self.prediction);
        self.noise.learn(kept, &self.parameters, window, prediction);
        self.sums.begin_anew();
        for equation in kept {
            self.window.copy_from(equation);
            self.noise.whiten(&mut self.window.rows);
            self.noise.whiten(&mut self.window.differences);
            self.sums.take(&self.window, 1.0, &self.noise);
            self.sums.update_square_root();
        }
    }

    /// How a window is to be taken in; not at all where the payload is another.
    fn judge(&mut self, equation: &Equation) -> Option<Stage> {
        self.window.copy_from(equation);
        self.noise.whiten(&mut self.window.rows);
        self.prediction.predict(&self.window.rows, &self.parameters);
        let innovation =
            self.sums
                .innovation(&self.window.rows, &self.prediction, &self.covariance);
        // Else a window says more of the parameters than they of it.
        let is_known = innovation.leverage < 1.0;
        // At rest, errors of the model do not show: it says nothing of the noise in motion.
        let moves = innovation.leverage > REST * self.typical_leverage();
        let is_settled = self.since_start > REHEARSED;
        if is_known && is_settled && self.is_alarming(&innovation) {
            self.begin_anew();
            return None;
        }
        self.noise.measure(equation, &self.parameters);
        let weight = robust_weight(innovation.distance, rare_distance(self.window.rows.len()));
        let used = if is_settled { weight } else { 1.0 };
        let share = weight / (1.0 + innovation.leverage);
        Some(Stage::Take(used, (is_known && moves).then_some(share)))
    }

    /// Of the windows since the estimate began: ten parameters are shared among all rows.
    fn typical_leverage(&self) -> f64 {
        10.0 * NOISE_CORRELATION / (self.since_start * self.window.rows.len()) as f64
    }

    /// Another payload, unless the noise has grown.
    fn begin_anew(&mut self) {
        if self.since_start < PROBATION {
            self.noise.grow();
        }
        self.sums.begin_anew();
        self.detector.restart();
        self.slow_detector.restart();
        self.since_start = 0;
    }

    /// Whether the windows up to this one say that something has changed.
    fn is_alarming(&mut self, innovation: &Innovation) -> bool {
        let channels = self.window.rows.len();
        let (mean, std_dev) = wilson_hilferty(channels);
        // Less than was expected is no sign of another payload.
        let score = |distance: f64| {
            let part = distance / (channels as f64 * self.noise.inflation());
            ((part.cbrt() - mean) / std_dev).max(0.0)
        };
        let sudden = self.detector.update(score(innovation.beyond_model));
        let slow = self.slow_detector.update(score(self.noise.slow_distance()));
        sudden.or(slow).is_some()
    }
}
