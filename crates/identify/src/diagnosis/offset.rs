//! A constant offset of the wrenches that explains the data better.

use super::SIGNIFICANT;
use super::residuals::determinant_ratio;
use crate::equations::{Channels, Equation, WRENCH};
use crate::fit::{CONVERGED_ENOUGH, Fit, FitOptions, least_squares};
use crate::result::WrenchOffset;

/// Squared Mahalanobis distance from zero from which a constant offset is reported. With six degrees of freedom, less
/// than one in 1e10 exceeds it by chance.
const SIGNIFICANT_OFFSET: f64 = 60.0;

/// An offset is reported where the determinant of the residuals' covariance is less than this fraction of that without
/// the offset: the standard deviation shrinks to 0.8 or less in the direction of the offset.
const CLEARLY_BETTER: f64 = 0.64;

/// Returns the fit with unknown offsets, where it explains the data clearly better than `given`, whose offsets were not
/// among the unknowns.
///
/// Both criteria are the same in every frame: a rigid transform of the channels changes neither the ratio of the
/// determinants nor the Mahalanobis distance.
pub(super) fn better_with_offset(
    equations: &[Equation],
    given: &Fit,
    channels: &Channels,
) -> Option<Fit> {
    let with_offsets = channels.clone().with_offsets(true);
    let options = FitOptions {
        start: Some(given),
        converged: CONVERGED_ENOUGH,
        covariance: false,
        ..FitOptions::new(&with_offsets)
    };
    let other = least_squares::fit(equations, options)?;
    if determinant_ratio(equations, given, &other, WRENCH) >= CLEARLY_BETTER {
        return None;
    }
    let other = least_squares::fit(equations, FitOptions::new(&with_offsets))?;
    let squared_distance = other
        .offsets?
        .squared_distance(&other.covariance, &other.null_space);
    let is_better = determinant_ratio(equations, given, &other, WRENCH) < CLEARLY_BETTER;
    (squared_distance >= SIGNIFICANT_OFFSET && is_better).then_some(other)
}

/// Returns whether a component of an offset differs from zero significantly: an offset without one is no use to anybody who
/// would subtract it, and short recordings have such offsets by chance.
pub(super) fn has_significant_component(offset: &WrenchOffset) -> bool {
    let std_devs = offset.std_devs.unwrap_or([0.0; 6]);
    let mut components = offset.values().into_iter().zip(std_devs);
    components.any(|(value, std_dev)| value.abs() > SIGNIFICANT * std_dev)
}

/// Returns the rms norm of the measured force without the offset of a fit, N, with the robust weights of the fit.
pub(super) fn load_force_rms(equations: &[Equation], fit: &Fit) -> f64 {
    let offset = fit
        .offsets
        .map_or([0.0; WRENCH], |found| found.values.into());
    let (mut squares, mut weights) = (0.0, 0.0);
    for (equation, weight) in equations.iter().zip(&fit.weights) {
        for (row, offset) in equation.rows.iter().zip(offset).take(3) {
            squares += weight * (row.target - offset).powi(2);
        }
        weights += weight;
    }
    (squares / weights.max(f64::MIN_POSITIVE)).sqrt()
}
