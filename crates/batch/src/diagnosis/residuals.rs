//! How much smaller the residuals of another fit are.

use nalgebra::{DMatrix, DVector};
use tactid_identify::equations::Equation;

use crate::fit::Fit;

/// Residuals smaller than this fraction of the load are errors of filters and interpolation.
const SMALL: f64 = 1e-4;

/// Returns the ratio of the determinants of the residuals' covariance over the first `channels`
/// channels: that of `other` to that of `fit`, with the robust weights of `other`. Infinite where
/// the variances of `other` are larger than those of `fit` in the mean over the channels: in a
/// posture that is held, a load that no parameter explains is constant, and the determinant of
/// constant residuals is small however large they are.
///
/// The determinant shows an improvement in one direction of the channels as well as in all of them,
/// and a rigid transform of the channels does not change the ratio.
pub(crate) fn determinant_ratio(
    equations: &[Equation],
    fit: &Fit,
    other: &Fit,
    channels: usize,
) -> f64 {
    let loads = loads(equations, &other.weights, channels);
    let [fit, other] = [fit, other].map(|of| covariance(equations, of, &other.weights, &loads));
    let growth = other.diagonal().component_div(&fit.diagonal());
    if growth.mean() > 1.0 {
        return f64::INFINITY;
    }
    other.determinant() / fit.determinant()
}

/// Returns the root of the weighted sum of squares of the first `channels` channels.
fn loads(equations: &[Equation], weights: &[f64], channels: usize) -> DVector<f64> {
    let mut squares = DVector::repeat(channels, f64::MIN_POSITIVE);
    for (equation, weight) in equations.iter().zip(weights) {
        for (square, row) in squares.iter_mut().zip(&equation.rows) {
            *square += weight * row.target.powi(2);
        }
    }
    squares.map(f64::sqrt)
}

/// Returns the covariance of the residuals, each in units of its channel's load, with a lower limit
/// of [`SMALL`].
fn covariance(
    equations: &[Equation],
    fit: &Fit,
    weights: &[f64],
    loads: &DVector<f64>,
) -> DMatrix<f64> {
    let channels = loads.len();
    let mut covariance = DMatrix::from_diagonal_element(channels, channels, SMALL * SMALL);
    let mut residuals = DVector::zeros(channels);
    for (equation, weight) in equations.iter().zip(weights) {
        for (channel, residual) in residuals.iter_mut().enumerate() {
            *residual = fit.residual(equation, channel) / loads[channel];
        }
        covariance.ger(*weight, &residuals, &residuals, 1.0);
    }
    covariance
}
