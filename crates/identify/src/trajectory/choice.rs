//! Whether the motion is estimated together with the payload.

use nalgebra::{Cholesky, SMatrix, SVector, SymmetricEigen};

use super::bins::SampleBins;
use super::estimate::Problem;
use super::{MotionEstimate, SETTINGS};
use crate::equations::Model;

/// Parameters that were estimated together with the motion.
#[derive(Clone, Debug)]
pub(crate) struct TrajectoryFit {
    pub(crate) parameters: SVector<f64, 10>,
    /// The larger of the covariance for white noise and of the one from the scatter of scores.
    pub(crate) covariance: SMatrix<f64, 10, 10>,
    /// Covariance in whose metric the parameters are projected onto consistent ones: for white noise
    /// as large as the scatter of the scores.
    pub(crate) metric: SMatrix<f64, 10, 10>,
    /// Covariance of the parameters for white noise.
    pub(crate) of_white_noise: SMatrix<f64, 10, 10>,
}

/// Estimates motion and parameters at once, starting with the parameters and the covariance of an
/// estimate after smoothing, and chooses between both.
pub(crate) fn choose(
    bins: &SampleBins,
    model: &Model,
    smoothed: (&SVector<f64, 10>, &SMatrix<f64, 10, 10>),
) -> (MotionEstimate, Option<TrajectoryFit>) {
    let (start, covariance) = smoothed;
    if let Some(reason) = bins.unsuited() {
        return (reason, None);
    }
    let mut problem = match Problem::new(bins, model, start) {
        Ok(problem) => problem,
        Err(reason) => return (reason, None),
    };
    let first = problem.pass();
    let Some(first) = first.filter(|pass| is_smaller(&pass.inverse, covariance)) else {
        return (MotionEstimate::Exact, None);
    };
    let Some(found) = problem.solve(first) else {
        return (MotionEstimate::Unexplained, None);
    };
    if found.residual_ratio > SETTINGS.explained {
        return (MotionEstimate::Unexplained, None);
    }
    let Some(larger) = larger(&found.of_white_noise, &found.sandwich) else {
        return (MotionEstimate::Unexplained, None);
    };
    if !is_smaller(&larger, covariance) {
        return (MotionEstimate::Exact, None);
    }
    let fit = TrajectoryFit {
        parameters: found.parameters,
        covariance: larger,
        metric: found.of_white_noise * found.scatter.max(1.0),
        of_white_noise: found.of_white_noise,
    };
    (MotionEstimate::WithPayload, Some(fit))
}

/// Returns the covariance that is at least as large as both of two in every direction: in the
/// directions in which both are diagonal, the larger variance. `None` where the first is not
/// positive definite.
fn larger(
    this: &SMatrix<f64, 10, 10>,
    other: &SMatrix<f64, 10, 10>,
) -> Option<SMatrix<f64, 10, 10>> {
    let units = this.diagonal().map(f64::sqrt);
    let in_units = |matrix: &SMatrix<f64, 10, 10>| {
        let scaled = SMatrix::<f64, 10, 10>::from_fn(|i, j| matrix[(i, j)] / (units[i] * units[j]));
        (scaled + scaled.transpose()) * 0.5
    };
    let root = Cholesky::new(in_units(this))?.unpack();
    let half = root.solve_lower_triangular(&in_units(other))?;
    let ratios = SymmetricEigen::new(root.solve_lower_triangular(&half.transpose())?);
    let axes = SMatrix::from_diagonal(&units) * root * ratios.eigenvectors;
    let variances = SMatrix::from_diagonal(&ratios.eigenvalues.map(|ratio| ratio.max(1.0)));
    Some(axes * variances * axes.transpose())
}

/// Returns whether the variances of the parameters in one covariance are smaller than in another,
/// in the geometric mean over the ten.
fn is_smaller(this: &SMatrix<f64, 10, 10>, other: &SMatrix<f64, 10, 10>) -> bool {
    let ratios = this
        .diagonal()
        .zip_map(&other.diagonal(), |this, other| (this / other).ln());
    ratios.sum() < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The larger of two covariances is the sum of both less what is the same, direction by
    /// direction, also where the directions are not those of the parameters.
    #[test]
    fn the_larger_covariance_is_that_of_each_direction() {
        let turn = SMatrix::<f64, 10, 10>::from_fn(|i, j| {
            f64::from(u8::from(i == j)) + 0.3 * ((3 * i + 7 * j) as f64).sin()
        });
        let of = |variances: fn(usize) -> f64| {
            let diagonal = SVector::<f64, 10>::from_fn(|k, _| variances(k));
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
