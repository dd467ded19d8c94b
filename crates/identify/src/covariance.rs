//! What noise does to a least-squares fit, where neighbouring rows have noise in common.
//!
//! Both give the covariance of the sum of all rows' scores (a score is a row times its residual), the
//! middle of the sandwich that is the parameters' covariance.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::fit::Entries;

/// A row in units of its noise, its columns scaled, times the root of its weight.
pub(crate) struct ScaledRow {
    pub(crate) entries: Entries,
    pub(crate) residual: f64,
    /// The row's part in the equation that the parameters solve: entries times residual, less what
    /// the motion's noise adds to them.
    pub(crate) score: Entries,
    pub(crate) weight: f64,
}

/// Windows that are further apart than this share no samples.
const FILTER_REACH: usize = 2;

/// The least variance of a direction, relative to that of windows without common samples.
const LEAST: f64 = 0.05;

/// From the scores themselves (Newey and West 1987, Econometrica 55, 703-708): holds whatever the
/// errors are, also those of the model, but is itself a rough estimate where windows are few.
pub(crate) fn of_scores(rows: &[ScaledRow], channels: usize, columns: usize) -> DMatrix<f64> {
    let score = |window: &[ScaledRow]| {
        DVector::from_fn(columns, |k, _| window.iter().map(|row| row.score[k]).sum())
    };
    let scores: Vec<DVector<f64>> = rows.chunks_exact(channels).map(score).collect();
    let count = scores.len();
    let reach = ((1.5 * (count as f64).cbrt()) as usize).clamp(3, count.max(4) - 1);
    let mut sum = DMatrix::<f64>::zeros(columns, columns);
    for lag in 0..=reach.min(count - 1) {
        let taper = 1.0 - lag as f64 / (reach + 1) as f64;
        let share = if lag == 0 { 0.5 * taper } else { taper };
        for (now, later) in scores.iter().zip(&scores[lag..]) {
            sum.ger(share, now, later, 1.0);
        }
    }
    &sum + sum.transpose()
}

/// From each channel's noise, taken to be stationary: its correlation between windows that share
/// samples comes from all residuals, so it is well known also where windows are few.
pub(crate) fn of_noise(rows: &[ScaledRow], channels: usize, columns: usize) -> DMatrix<f64> {
    let mut alone = DMatrix::<f64>::zeros(columns, columns);
    let mut shared = DMatrix::<f64>::zeros(columns, columns);
    let count = rows.len() / channels;
    for channel in 0..channels {
        let at = |window: usize| &rows[window * channels + channel];
        for lag in 0..=FILTER_REACH.min(count - 1) {
            let pairs = || (0..count - lag).map(|window| (at(window), at(window + lag)));
            let (mut products, mut weights) = (0.0, 0.0);
            for (now, later) in pairs() {
                products += now.residual * later.residual;
                weights += (now.weight * later.weight).sqrt();
            }
            let correlation = products / weights.max(f64::MIN_POSITIVE);
            let sum = if lag == 0 { &mut alone } else { &mut shared };
            for (now, later) in pairs() {
                for i in 0..columns {
                    for j in 0..columns {
                        sum[(i, j)] += correlation * now.entries[i] * later.entries[j];
                    }
                }
            }
        }
    }
    let whole = &alone + &shared + shared.transpose();
    at_least(LEAST, &alone, whole)
}

/// Estimated correlations may leave a direction no variance, or less than none: here each has at
/// least a part of what windows without common samples would leave it.
fn at_least(part: f64, alone: &DMatrix<f64>, whole: DMatrix<f64>) -> DMatrix<f64> {
    let Some(root) = alone.clone().cholesky().map(|cholesky| cholesky.unpack()) else {
        return whole;
    };
    // R⁻¹ W R⁻ᵀ, in which `alone` is the identity.
    let mut relative = whole;
    root.solve_lower_triangular_mut(&mut relative);
    let mut relative = relative.transpose();
    root.solve_lower_triangular_mut(&mut relative);
    let mut eigen = SymmetricEigen::new(relative);
    eigen.eigenvalues.apply(|value| *value = value.max(part));
    &root * eigen.recompose() * root.transpose()
}
