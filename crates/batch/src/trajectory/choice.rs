//! Whether the motion is estimated together with the payload.

use nalgebra::{SMatrix, SVector};
use tactid_identify::equations::Model;

use super::MotionEstimate;
use super::bins::SampleBins;
use super::dynamics::Dynamics;
use super::estimate::{Estimate, Problem, Residuals};

/// Estimates motion and parameters at once, starting with the parameters and the covariance of an
/// estimate after smoothing.
///
/// # Errors
/// Returns why that estimate is the better one.
pub(crate) fn choose(
    bins: &SampleBins,
    model: &Model,
    smoothed: (&SVector<f64, 10>, &SMatrix<f64, 10, 10>),
) -> Result<Estimate, MotionEstimate> {
    let (start, covariance) = smoothed;
    if let Some(reason) = bins.unsuited() {
        return Err(reason);
    }
    let mut dynamics = Dynamics::new(model.clone(), bins.layout());
    let mut problem = Problem::new(bins.stretches(), &mut dynamics, start)?;
    let first = problem.pass();
    let first = first.filter(|pass| is_smaller(&pass.inverse, covariance));
    let first = first.ok_or(MotionEstimate::Exact)?;
    let last = problem.converge(first);
    let found = last.and_then(|last| problem.estimate(&last, Residuals::default()));
    let found = found.filter(Estimate::is_explained);
    let found = found.ok_or(MotionEstimate::Unexplained)?;
    let is_better = is_smaller(&found.covariance, covariance);
    is_better.then_some(found).ok_or(MotionEstimate::Exact)
}

/// Returns whether the variances of the parameters in one covariance are smaller than in another,
/// in the geometric mean over the ten.
pub(super) fn is_smaller(this: &SMatrix<f64, 10, 10>, other: &SMatrix<f64, 10, 10>) -> bool {
    let ratios = this
        .diagonal()
        .zip_map(&other.diagonal(), |this, other| (this / other).ln());
    ratios.sum() < 0.0
}
