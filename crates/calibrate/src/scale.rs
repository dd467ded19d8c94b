//! The common scale of all torques, which efforts alone do not determine.
//!
//! Links and payloads times a factor, and inverse gains divided by it, give the same efforts. What
//! decides the factor are the masses of known payloads and what was known of the gains. The prior
//! of the links must not: its distances from the description shrink with the links, so that a fit
//! which is free to choose the factor makes it too small. The fit therefore holds the factor at the
//! value that masses and gains give together, and its variance is added afterwards.

use nalgebra::DVector;

use super::layout::{Group, Layout};
use super::payload::KnownPayload;
use super::rows::Unknowns;

/// Standard deviation of the scale while it is held: far below the error of weighed masses. Masses
/// that are exact hold it themselves.
pub(crate) const HELD_SCALE_STD_DEV: f64 = 1e-4;

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
    /// Returns the precision-weighted mean of the scales that known masses and gains imply. The
    /// errors of the gains may be correlated, and so may the errors of the masses, which one
    /// balance has weighed: neither becomes more precise by their number. `scales` are the standard
    /// deviations of the arm's unknowns before the calibration. Returns `None` where a gain is
    /// known exactly, which fixes the scale, and without a mass.
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
        let weights: f64 = masses.iter().map(|(_, precision)| precision).sum();
        let roots: f64 = masses.iter().map(|(_, precision)| precision.sqrt()).sum();
        let of_masses = (weights / roots).powi(2);
        let precision = of_gains + of_masses;
        let arm = layout.len();
        let mut gradient = DVector::zeros(arm + 10 * masses.len());
        for k in gains.clone() {
            gradient[k] = -of_gains / precision / gains.len() as f64;
        }
        for (payload, (mass_kg, of_mass)) in masses.iter().enumerate() {
            gradient[arm + 10 * payload] = of_mass / weights * of_masses / precision / mass_kg;
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

/// Returns the direction of links and inverse gains, in their units, that multiplies all torques by
/// a factor and leaves the efforts; `None` where a gain is known.
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

#[cfg(test)]
mod tests {
    use super::*;
    use tactid_identify::solve::Vector;

    /// The scale of some known masses, kg with standard deviations, and of two gains known to 20 %.
    fn known(masses: &[(f64, f64)]) -> KnownScale {
        let layout = Layout {
            joints: 2,
            links: 1,
            widths: Vec::new(),
        };
        let mut scales = vec![1.0; layout.len()];
        scales[layout.range(Group::InverseGain)].fill(0.2);
        let held = masses
            .iter()
            .map(|(mass, std_dev)| KnownPayload::of_mass(*mass, *std_dev));
        KnownScale::new(&layout, &scales, held).unwrap()
    }

    /// A weight known to 5 % decides more than gains, and as much in four recordings as in one.
    #[test]
    fn one_balance_has_one_error() {
        let one = known(&[(4.0, 0.2)]);
        let expected = 1.0 / (0.2f64.powi(-2) + 0.05f64.powi(-2));
        assert!((one.variance - expected).abs() < 1e-15);
        let four = known(&[(4.0, 0.2); 4]);
        assert!((four.variance - expected).abs() < 1e-15);
        // What is known is the scale 1; masses and gains that are 1 % larger are 1 % from it.
        for (known, payloads) in [(one, 1), (four, 4)] {
            for factor in [1.0, 1.01] {
                let mut payload = Vector::zeros();
                payload[0] = 4.0 * factor;
                let at = Unknowns {
                    arm: vec![2.0 - factor; known.gradient.len() - 10 * payloads],
                    payloads: vec![payload; payloads],
                };
                assert!((known.value(&at) - (factor - 1.0)).abs() < 1e-12);
            }
        }
    }
}
