//! Signs, gravity and offsets that explain the data better than the given ones.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::fit::{Fit, FitOptions};
use super::least_squares;
use crate::Method;
use crate::equations::{Channels, Equation, OffsetFrame};
use crate::finding::Finding;

/// Distance in standard deviations from which a contradiction is reported.
pub(crate) const CONTRADICTION: f64 = 5.0;

/// Another gravity is reported where it leaves less than this fraction of the residual.
const FAR_BETTER: f64 = 0.5;

/// Squared Mahalanobis distance from zero from which a constant offset is reported. With six degrees of freedom, less
/// than one in 1e10 exceeds it by chance.
const SIGNIFICANT_OFFSET: f64 = 60.0;

/// An offset is reported where the determinant of the residuals' covariance is less than this fraction of that without
/// the offset: the standard deviation shrinks to 0.8 or less in the direction of the offset.
const CLEARLY_BETTER: f64 = 0.64;

/// Residuals smaller than this fraction of the load are errors of discretisation.
const SMALL: f64 = 1e-5;

/// Returns the offset of the wrenches, where offsets were not among the unknowns but explain the data clearly better.
///
/// Both criteria are the same in every frame: a rigid transform of the channels changes neither the ratio of the
/// determinants nor the Mahalanobis distance.
pub(crate) fn suspected_offset(
    equations: &[Equation],
    fit: &Fit,
    channels: &Channels,
    frame: &OffsetFrame,
) -> Option<Finding> {
    let with_offsets = channels.clone().with_offsets(true);
    let other = least_squares::fit(equations, FitOptions::new(&with_offsets))?;
    let squared_distance = other
        .offsets?
        .squared_distance(&other.covariance, &other.null_space);
    let volume = |fit: &Fit| residual_covariance(equations, fit, &other.weights).determinant();
    let is_better = volume(&other) < CLEARLY_BETTER * volume(fit);
    if squared_distance < SIGNIFICANT_OFFSET || !is_better {
        return None;
    }
    let offset = other.wrench_offset(frame)?;
    Some(Finding::OffsetSuspected { offset })
}

/// Returns the covariance of the residuals of the six channels of the wrench, each in units of its load.
fn residual_covariance(equations: &[Equation], fit: &Fit, weights: &[f64]) -> Matrix6<f64> {
    let (mut products, mut loads) = (Matrix6::zeros(), Vector6::repeat(f64::MIN_POSITIVE));
    let mut total = f64::MIN_POSITIVE;
    for (equation, weight) in equations.iter().zip(weights) {
        let rows = &equation.rows;
        let residual = Vector6::from_fn(|k, _| {
            rows[k].target - rows[k].regressor.dot(&fit.parameters) - fit.offset_of(k)
        });
        loads += Vector6::from_fn(|k, _| weight * rows[k].target.powi(2));
        products.ger(*weight, &residual, &residual, 1.0);
        total += weight;
    }
    let sizes = (loads / total).map(f64::sqrt);
    Matrix6::from_fn(|i, j| {
        let floor = if i == j { SMALL * SMALL } else { 0.0 };
        products[(i, j)] / (total * sizes[i] * sizes[j]) + floor
    })
}

/// Returns findings about the signs of gravity and load, and about the mass of the known bodies, `known_kg`.
/// `gravity` is the configured one, m/s².
pub(crate) fn suspected_signs(
    equations: &[Equation],
    fit: &Fit,
    channels: &Channels,
    gravity: &Vector3<f64>,
    known_kg: f64,
    method: Method,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut best_mass = fit.parameters[0];
    let has_gravity = gravity.norm() > 0.0;
    let better = if has_gravity {
        better_gravity(equations, fit, channels)
    } else {
        None
    };
    if let Some((scale, other)) = &better {
        best_mass = other.parameters[0];
        findings.push(Finding::GravityContradicted {
            better: gravity * *scale + Vector3::zeros(),
            residual_ratio: other.misfit / fit.misfit,
            method,
        });
    }
    if best_mass < 0.0 {
        findings.push(Finding::NegativeMass {
            method,
            or_gravity: has_gravity && better.is_none(),
        });
    } else if better.is_none() {
        findings.extend(too_heavy(fit, known_kg));
    }
    findings
}

/// Reports known bodies that weigh more than the load by more than its uncertainty.
fn too_heavy(fit: &Fit, known_kg: f64) -> Option<Finding> {
    let load_kg = fit.parameters[0];
    let is_significant = known_kg - load_kg > CONTRADICTION * fit.mass_std_dev_kg();
    (load_kg < known_kg && is_significant)
        .then_some(Finding::KnownBodiesTooHeavy { known_kg, load_kg })
}

/// Returns the scale of gravity that explains the data far better than the given one, and its fit.
fn better_gravity(equations: &[Equation], fit: &Fit, channels: &Channels) -> Option<(f64, Fit)> {
    let fits = [0.0, -1.0].into_iter().filter_map(|gravity_scale| {
        let options = FitOptions {
            gravity_scale,
            weights_of: Some(fit),
            covariance: false,
            ..FitOptions::new(channels)
        };
        Some((gravity_scale, least_squares::fit(equations, options)?))
    });
    let better = fits.filter(|(_, other)| other.misfit < FAR_BETTER * fit.misfit);
    better.min_by(|a, b| a.1.misfit.total_cmp(&b.1.misfit))
}
