//! The covariance of parameters whose noise need not be white, from the scatter of scores.

use nalgebra::{Cholesky, SMatrix, SVector, SymmetricEigen};

use super::SETTINGS;
use super::spline::order;

type Parameters = SVector<f64, 10>;
type Matrix = SMatrix<f64, 10, 10>;

/// Returns the number of bins over which splines correlate scores.
fn spanned() -> usize {
    order() * SETTINGS.bins_of_interval as usize
}

/// What the scores of the bins of all segments say of the noise of the parameters.
#[derive(Default)]
pub(super) struct Scatter {
    /// Covariance of the sum of scores that are correlated over the bins that splines span (Newey
    /// and West 1987).
    meat: Matrix,
    /// Numbers of bins, of rows, and of unknowns.
    bins: f64,
    rows: f64,
    unknowns: f64,
}

impl Scatter {
    /// Adds the scores of the bins of a segment with so many rows each and so many unknowns.
    pub(super) fn add(&mut self, scores: &[Parameters], rows: usize, unknowns: usize) {
        for (k, score) in scores.iter().enumerate() {
            self.meat += score * score.transpose();
            for lag in 1..=spanned().min(k) {
                let weight = 1.0 - lag as f64 / (spanned() + 1) as f64;
                let product = score * scores[k - lag].transpose() * weight;
                self.meat += product + product.transpose();
            }
        }
        self.bins += scores.len() as f64;
        self.rows += (scores.len() * rows) as f64;
        self.unknowns += unknowns as f64;
    }

    /// Number of bins.
    pub(super) fn bins(&self) -> f64 {
        self.bins
    }

    /// Returns the covariance of the parameters that is at least as large as that of white noise in
    /// every direction, and the mean ratio of both, one or more. `None` where the given one is not
    /// positive definite.
    ///
    /// Residuals are smaller than the noise by what the unknowns explain, and the sum of scores is
    /// zero, which takes `b - b² / 3` of a meat with a bandwidth of the fraction `b` of the bins
    /// (Kiefer and Vogelsang 2005). Of the scatter in ten directions the mean is ten times as
    /// well known as each, so directions count as far as their degrees of freedom, `1.5 / b`, go.
    pub(super) fn covariance(&self, of_white_noise: &Matrix) -> Option<(Matrix, f64)> {
        let bandwidth = ((spanned() + 1) as f64 / self.bins).min(1.0);
        let left = 1.0 - bandwidth + bandwidth.powi(2) / 3.0;
        let fraction = (self.rows - self.unknowns) / self.rows;
        let meat = self.meat / (left * fraction);
        let mean = (meat * of_white_noise).trace() / 10.0;
        let sandwich = of_white_noise * meat * of_white_noise;
        let freedom = 1.5 / bandwidth;
        let weight = freedom / (freedom + 10.0);
        let shrunk = sandwich * weight + of_white_noise * (mean * (1.0 - weight));
        Some((larger(of_white_noise, &shrunk)?, mean.max(1.0)))
    }
}

/// Returns the covariance that is at least as large as both of two in every direction: in the
/// directions in which both are diagonal, the larger variance. `None` where the first is not
/// positive definite.
fn larger(this: &Matrix, other: &Matrix) -> Option<Matrix> {
    let units = this.diagonal().map(f64::sqrt);
    let in_units = |matrix: &Matrix| {
        let scaled = Matrix::from_fn(|i, j| matrix[(i, j)] / (units[i] * units[j]));
        (scaled + scaled.transpose()) * 0.5
    };
    let root = Cholesky::new(in_units(this))?.unpack();
    let half = root.solve_lower_triangular(&in_units(other))?;
    let ratios = SymmetricEigen::new(root.solve_lower_triangular(&half.transpose())?);
    let axes = SMatrix::from_diagonal(&units) * root * ratios.eigenvectors;
    let variances = SMatrix::from_diagonal(&ratios.eigenvalues.map(|ratio| ratio.max(1.0)));
    Some(axes * variances * axes.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The larger of two covariances has the larger variance direction by direction, also where the
    /// directions are not those of the parameters.
    #[test]
    fn the_larger_covariance_is_that_of_each_direction() {
        let turn = Matrix::from_fn(|i, j| {
            f64::from(u8::from(i == j)) + 0.3 * ((3 * i + 7 * j) as f64).sin()
        });
        let of = |variances: fn(usize) -> f64| {
            let diagonal = Parameters::from_fn(|k, _| variances(k));
            turn * SMatrix::from_diagonal(&diagonal) * turn.transpose()
        };
        let this = of(|k| 1e-3 * (k + 1) as f64);
        let other = of(|k| 1e-3 * (10 - k) as f64);
        let expected = of(|k| 1e-3 * f64::max((k + 1) as f64, (10 - k) as f64));
        for (this, other) in [(&this, &other), (&other, &this)] {
            let found = larger(this, other).unwrap();
            assert!((found - expected).amax() < 1e-12 * expected.amax());
        }
    }
}
