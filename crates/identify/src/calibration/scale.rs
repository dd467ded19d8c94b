//! The scale of all torques, which no effort shows.
//!
//! Links and payloads times a factor, and inverse gains divided by it, give the same efforts. What decides the factor are the
//! masses of known payloads and what was known of the gains. The prior of the links must not: its distances from the
//! description shrink with the links, so that a fit which is free to choose the factor makes it too small. The fit
//! therefore holds the factor at the value that masses and gains give together, and its variance is added afterwards.

use nalgebra::DVector;

use super::layout::{Group, Layout};
use super::payload::KnownPayload;
use super::rows::Unknowns;

/// Standard deviation of the scale while it is held, far below that of any weight.
pub(crate) const FIXED_SCALE: f64 = 1e-4;

/// The scale of all torques as known payloads and gains give it.
#[derive(Clone, Debug)]
pub(crate) struct KnownScale {
    /// Derivatives of the scale with respect to the unknowns of the arm and of the payloads.
    pub(crate) gradient: DVector<f64>,
    /// Scale at unknowns that are zero, relative to the known one.
    offset: f64,
    /// Variance of the known scale.
    pub(crate) variance: f64,
}

impl KnownScale {
    /// Returns the mean of what masses and gains say, with their precisions as weights. The gains count as one, because
    /// their errors may be alike; `scales` are the standard deviations of the arm's unknowns before the calibration. Returns `None` where a gain or all masses are unknown: then there is
    /// nothing to hold.
    pub(crate) fn new(
        layout: &Layout,
        scales: &[f64],
        held: impl Iterator<Item = KnownPayload>,
    ) -> Option<Self> {
        let gains = layout.range(Group::InverseGain);
        let std_devs = &scales[gains.clone()];
        let masses: Vec<_> = held
            .map(|held| (held.mass_kg, held.mass_precision()))
            .collect();
        if masses.is_empty() || std_devs.contains(&0.0) {
            return None;
        }
        let of_gains = std_devs.iter().map(|s| s.powi(-2)).sum::<f64>() / std_devs.len() as f64;
        let precision = of_gains + masses.iter().map(|(_, precision)| precision).sum::<f64>();
        let arm = layout.len();
        let mut gradient = DVector::zeros(arm + 10 * masses.len());
        for k in gains.clone() {
            gradient[k] = -of_gains / precision / gains.len() as f64;
        }
        for (payload, (mass_kg, of_mass)) in masses.iter().enumerate() {
            gradient[arm + 10 * payload] = of_mass / precision / mass_kg;
        }
        Some(Self {
            gradient,
            offset: (2.0 * of_gains - precision) / precision,
            variance: 1.0 / precision,
        })
    }

    /// Returns the distance of the scale at some unknowns from the known one.
    pub(crate) fn value(&self, at: &Unknowns) -> f64 {
        let payloads = at.payloads.iter().flatten();
        let unknowns = at.arm.iter().chain(payloads);
        let products = unknowns.zip(&self.gradient).map(|(x, slope)| x * slope);
        self.offset + products.sum::<f64>()
    }
}

/// Returns the direction of links and inverse gains, in their units, that multiplies all torques by a factor and leaves the
/// efforts; `None` where a gain is known.
pub(crate) fn scale_direction(
    layout: &Layout,
    arm: &[f64],
    scales: &[f64],
) -> Option<DVector<f64>> {
    let gains = layout.range(Group::InverseGain);
    if scales[gains.clone()].contains(&0.0) {
        return None;
    }
    let links = layout.link_range();
    Some(DVector::from_fn(arm.len(), |k, _| {
        if links.contains(&k) {
            arm[k] / scales[k]
        } else if gains.contains(&k) {
            -arm[k] / scales[k]
        } else {
            0.0
        }
    }))
}
