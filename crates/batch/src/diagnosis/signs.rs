//! Signs of gravity and of the load, and the mass of the known bodies.

use nalgebra::Vector3;
use tactid_identify::Method;
use tactid_identify::equations::{Channels, Equation};

use super::residuals::determinant_ratio;
use super::{CONTRADICTION, FAR_BETTER, SIGNIFICANT};
use crate::finding::Finding;
use crate::fit::{Fit, FitOptions, least_squares};

/// Returns findings about the signs of gravity and load, and about the mass of the known bodies
/// with its standard deviation, `known_bodies_kg`, then the load that is `unexplained`. `gravity`
/// is the configured one, m/s².
pub(super) fn sign_findings(
    equations: &[Equation],
    given: &Fit,
    channels: &Channels,
    gravity: &Vector3<f64>,
    known_bodies_kg: (f64, f64),
    method: Method,
    unexplained: Option<Finding>,
) -> Vec<Finding> {
    let has_gravity = gravity.norm() > 0.0;
    let better = has_gravity.then(|| better_gravity(equations, given, channels));
    let mass = (given.parameters[0], given.mass_std_dev_kg());
    let Some((scale, residual_ratio, other)) = better.flatten() else {
        let of_mass = mass_findings(mass, known_bodies_kg, method, has_gravity);
        let is_empty = matches!(of_mass, Some(Finding::NothingHeld { .. }));
        let of_mass = of_mass.filter(|_| !(is_empty && unexplained.is_some()));
        return of_mass.into_iter().chain(unexplained).collect();
    };
    let contradicted = Finding::GravityContradicted {
        better: (gravity * scale + Vector3::zeros()).into(),
        residual_ratio,
        method,
    };
    let is_negative = other.parameters[0] < 0.0 && mass.1.is_finite();
    let negative = is_negative.then_some(Finding::NegativeMass {
        method,
        or_gravity: false,
    });
    std::iter::once(contradicted).chain(negative).collect()
}

/// Returns what the masses of the whole load and of the known bodies, with their standard
/// deviations, say: nothing is held beyond the known bodies, the load has the wrong sign, or the
/// known bodies are too heavy. `or_gravity` is whether gravity may have the wrong sign as well.
pub(crate) fn mass_findings(
    (mass_kg, std_dev_kg): (f64, f64),
    (known_bodies_kg, known_std_dev_kg): (f64, f64),
    method: Method,
    or_gravity: bool,
) -> Option<Finding> {
    let negative = (mass_kg < 0.0 && std_dev_kg.is_finite())
        .then_some(Finding::NegativeMass { method, or_gravity });
    let of_payload_kg = std_dev_kg.hypot(known_std_dev_kg);
    nothing_held(mass_kg - known_bodies_kg, of_payload_kg)
        .or(negative)
        .or_else(|| too_heavy(mass_kg, of_payload_kg, known_bodies_kg))
}

/// Reports a mass beyond the known bodies that is zero within its uncertainty.
pub fn nothing_held(mass_kg: f64, std_dev_kg: f64) -> Option<Finding> {
    let is_zero = mass_kg.abs() <= SIGNIFICANT * std_dev_kg && std_dev_kg.is_finite();
    is_zero.then_some(Finding::NothingHeld {
        mass_kg,
        std_dev_kg,
    })
}

/// Reports known bodies that weigh more than the load by more than the uncertainty of the
/// difference, `std_dev_kg`.
fn too_heavy(load_kg: f64, std_dev_kg: f64, known_bodies_kg: f64) -> Option<Finding> {
    let is_significant = known_bodies_kg - load_kg > CONTRADICTION * std_dev_kg;
    (load_kg < known_bodies_kg && is_significant).then_some(Finding::KnownBodiesTooHeavy {
        known_bodies_kg,
        load_kg,
    })
}

/// Returns the scale of gravity that explains the data far better than the configured one, with the
/// ratio of the residuals (their geometric mean over the directions of the channels) and the fit.
fn better_gravity(
    equations: &[Equation],
    given: &Fit,
    channels: &Channels,
) -> Option<(f64, f64, Fit)> {
    // Residuals of a wrong model can be correlated so closely that whitening by them leaves only
    // rounding errors.
    let uncorrelated = Fit {
        noise: given.noise.without_correlation(),
        ..given.clone()
    };
    let fits = [0.0, -1.0].into_iter().filter_map(|gravity_scale| {
        let options = FitOptions {
            gravity_scale,
            weights_of: Some(&uncorrelated),
            covariance: false,
            ..FitOptions::new(channels)
        };
        let other = least_squares::fit(equations, options)?;
        let ratio = determinant_ratio(equations, given, &other, channels.count());
        Some((gravity_scale, ratio, other))
    });
    let (scale, ratio, other) = fits.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let residual_ratio = ratio.powf(0.5 / channels.count() as f64);
    (ratio < FAR_BETTER).then_some((scale, residual_ratio, other))
}
