//! Signs, gravity and offsets that explain the data better than the given ones.

use nalgebra::Vector3;

use super::fit::{Fit, FitOptions};
use super::least_squares;
use crate::Method;
use crate::equations::{Channels, Equation};
use crate::finding::Finding;
use crate::solve::Offset;

/// Distance in standard deviations from which a contradiction is reported.
pub(crate) const CONTRADICTION: f64 = 5.0;

/// Another gravity is reported where it leaves less than this fraction of the residual.
const FAR_BETTER: f64 = 0.5;

/// A constant offset is reported where that of one channel is more than this many times its standard
/// deviation, and all offsets together leave less than [`CLEARLY_BETTER`] of the residual.
const SIGNIFICANT: f64 = 6.0;
/// Fraction of the residual that offsets must not leave to be reported.
const CLEARLY_BETTER: f64 = 0.8;

/// Returns the most significant offset of the wrenches, where offsets were not among the unknowns but
/// explain the data clearly better.
pub(crate) fn suspected_offset(
    equations: &[Equation],
    fit: &Fit,
    channels: &Channels,
) -> Option<Finding> {
    let with_offsets = channels.clone().with_offsets(true);
    let options = FitOptions {
        weights_of: Some(fit),
        known_mass: fit.known_mass,
        ..FitOptions::new(&with_offsets)
    };
    let other = least_squares::fit(equations, options)?;
    let size = |offset: &Offset| offset.value.abs() / offset.std_dev;
    let pairs = other.offsets.iter().zip(&channels.channels);
    let (largest, channel) = pairs.max_by(|a, b| size(a.0).total_cmp(&size(b.0)))?;
    let is_better = other.misfit < CLEARLY_BETTER * fit.misfit;
    (size(largest) > SIGNIFICANT && is_better).then(|| Finding::OffsetSuspected {
        channel: channel.clone(),
        offset: *largest,
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
