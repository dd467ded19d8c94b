//! Whether the motion is estimated together with the payload.

use nalgebra::{SMatrix, SVector};
use schemars::JsonSchema;
use serde::Serialize;

use super::SETTINGS;
use super::bins::SampleBins;
use super::estimate::Problem;
use crate::diagnosis::FAR_BETTER;
use crate::equations::Model;

/// How the motion that is measured entered an estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MotionEstimate {
    /// Motion and payload were estimated at once, from all measurements: splines of degree five for
    /// the joints and the base.
    WithPayload,
    /// The motion was smoothed before, sample by sample: the base is fixed or has no joints, the
    /// velocities of the joints are not measured, the mass is known, there are more unknowns than
    /// the payload, or a part of the recording is unlike the rest.
    #[default]
    Smoothed,
    /// The motion was smoothed before, because the recording is longer than 100 s: both take time in
    /// proportion to its length, and windows take far less.
    TooLong,
    /// The motion was smoothed before, because it has frequencies that splines do not follow.
    TooFast,
    /// The motion was smoothed before, because splines and payload leave more of the measurements
    /// than their noise: the model has errors.
    Unexplained,
    /// The motion was smoothed before, because its noise is so small that the result is at least as
    /// precise.
    Exact,
}

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
    if bins.are_too_many() {
        return (MotionEstimate::TooLong, None);
    }
    let Some(mut problem) = Problem::new(bins, model, start) else {
        return (MotionEstimate::Smoothed, None);
    };
    if problem.unfollowed * FAR_BETTER > 1.0 {
        return (MotionEstimate::TooFast, None);
    }
    let first = problem.pass();
    let Some(first) = first.filter(|pass| is_smaller(&pass.inverse, covariance)) else {
        return (MotionEstimate::Exact, None);
    };
    let Some(found) = problem.solve(first) else {
        return (MotionEstimate::Unexplained, None);
    };
    if found
        .residual_ratios
        .iter()
        .any(|ratio| *ratio > SETTINGS.explained)
    {
        return (MotionEstimate::Unexplained, None);
    }
    let larger = if found.scatter > 1.0 {
        found.sandwich
    } else {
        found.of_white_noise
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

/// Returns whether the variances of the parameters in one covariance are smaller than in another,
/// in the geometric mean over the ten.
fn is_smaller(this: &SMatrix<f64, 10, 10>, other: &SMatrix<f64, 10, 10>) -> bool {
    let ratios = this
        .diagonal()
        .zip_map(&other.diagonal(), |this, other| (this / other).ln());
    ratios.sum() < 0.0
}
