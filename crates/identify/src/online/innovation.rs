//! An averaging window in units of its noise, its prediction by the estimate, and its innovation.

use crate::equations::Equation;
use crate::solve::subspace::Vector;

/// Regressor and target of one channel, in units of the noise of its window once they are whitened.
pub(crate) type WhitenedRow = (Vector, f64);

/// The rows of one averaging window, one for each channel, to be brought to units of their noise.
#[derive(Clone, Debug)]
pub(crate) struct WhitenedWindow {
    /// Mean rows over the window.
    pub(crate) rows: Vec<WhitenedRow>,
    /// Half-differences between every second instant and the others: noise alone, with the variance
    /// of the noise in `rows`.
    pub(crate) differences: Vec<WhitenedRow>,
}

impl WhitenedWindow {
    /// Creates a window of so many channels whose rows are zero.
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            rows: vec![(Vector::zeros(), 0.0); channels],
            differences: vec![(Vector::zeros(), 0.0); channels],
        }
    }

    /// Copies the rows of an equation, in the units of the channels, without allocation.
    pub(crate) fn copy_from(&mut self, equation: &Equation) {
        for (place, row) in self.rows.iter_mut().zip(&equation.rows) {
            *place = (row.regressor, row.target);
        }
        for (place, row) in self.differences.iter_mut().zip(&equation.differences) {
            *place = (row.regressor, row.target);
        }
    }
}

/// What parameters predict for the rows of one window, in the units of the rows.
#[derive(Clone, Debug)]
pub(crate) struct Prediction {
    /// Target less prediction of each channel.
    pub(crate) residuals: Vec<f64>,
    /// Mean square of the predictions over the channels.
    pub(crate) load: f64,
}

impl Prediction {
    /// Creates a prediction of zero for so many channels.
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            residuals: vec![0.0; channels],
            load: 0.0,
        }
    }

    /// Replaces the prediction by that of some parameters for some rows, without allocation.
    pub(crate) fn predict(&mut self, rows: &[WhitenedRow], parameters: &Vector) {
        self.load = 0.0;
        for (residual, (regressor, target)) in self.residuals.iter_mut().zip(rows) {
            let predicted = regressor.dot(parameters);
            *residual = target - predicted;
            self.load += predicted * predicted / rows.len() as f64;
        }
    }
}

/// Innovation of one window: its difference from what earlier windows predict, compared with its
/// covariance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Innovation {
    /// Squared Mahalanobis distance: sum over the channels of the squared innovation over its
    /// variance, which is that of the noise and of the parameters.
    pub(crate) distance: f64,
    /// Squared Mahalanobis distance where the variance includes that of the [model
    /// error](crate::checks::MODEL_ERROR), too.
    pub(crate) distance_beyond_model: f64,
    /// Variance of the prediction over that of the noise, the mean over the channels.
    pub(crate) leverage: f64,
}
