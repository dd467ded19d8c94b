//! Whether the motion is estimated together with the payload.

use nalgebra::{SMatrix, SVector};
use tactid_identify::equations::Model;

use super::bins::SampleBins;
use super::dynamics::Dynamics;
use super::estimate::{Estimate, Pass, Problem, Residuals};
use super::{MotionEstimate, SETTINGS};

/// Estimates motion and parameters at once, starting with the parameters and the covariance of an
/// estimate after smoothing, and chooses between both.
pub(crate) fn choose(
    bins: &SampleBins,
    model: &Model,
    smoothed: (&SVector<f64, 10>, &SMatrix<f64, 10, 10>),
) -> (MotionEstimate, Option<Estimate>) {
    let (start, covariance) = smoothed;
    if let Some(reason) = bins.unsuited() {
        return (reason, None);
    }
    let sections = bins.sections();
    let count: usize = sections.iter().flatten().map(|bins| bins.len()).sum();
    let mut dynamics = Dynamics::new(model.clone(), bins.layout());
    let mut found = Vec::new();
    for section in &sections {
        let mut problem = match Problem::new(section, &mut dynamics, start) {
            Ok(problem) => problem,
            // Some other may be longer.
            Err(MotionEstimate::TooFew) => continue,
            Err(reason) => return (reason, None),
        };
        let bins: usize = section.iter().map(|bins| bins.len()).sum();
        let fraction = bins as f64 / count as f64;
        let first = problem.pass();
        let is_better = |pass: &Pass| is_smaller(&(pass.inverse * fraction), covariance);
        let Some(first) = first.filter(is_better) else {
            return (MotionEstimate::Exact, None);
        };
        let last = problem.converge(first);
        match last.and_then(|last| problem.estimate(&last, Residuals::default())) {
            Some(estimate) if estimate.residual_ratio <= SETTINGS.explained => found.push(estimate),
            _ => return (MotionEstimate::Unexplained, None),
        }
    }
    let Some(found) = Estimate::of_all(found) else {
        return (MotionEstimate::TooFew, None);
    };
    if !is_smaller(&found.covariance, covariance) {
        return (MotionEstimate::Exact, None);
    }
    (MotionEstimate::WithPayload, Some(found))
}

/// Returns whether the variances of the parameters in one covariance are smaller than in another,
/// in the geometric mean over the ten.
pub(super) fn is_smaller(this: &SMatrix<f64, 10, 10>, other: &SMatrix<f64, 10, 10>) -> bool {
    let ratios = this
        .diagonal()
        .zip_map(&other.diagonal(), |this, other| (this / other).ln());
    ratios.sum() < 0.0
}
