//! What is known of the payload while it is identified, and for which payloads limits must hold.

use nalgebra::SymmetricEigen;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use tactid_dynamics::InertialParameters;

use super::prior::{Matrix, Prior, Vector};

/// Standard deviations from the mean to the ends of the confidence region along its axes.
const REACH: f64 = 3.0;

/// Axes of the confidence region along which limits are planned for: those along which the load is
/// the most uncertain.
const AXES: usize = 3;

/// Steps on the way from a payload to the mean, of which the first that can exist is used.
const STEPS: u32 = 10;

/// Lever at which moments count as forces, m, for the size of a load: about the lever of a payload
/// behind a gripper.
const LEVER_M: f64 = 0.3;

/// Mean and covariance of the ten linear parameters of the payload.
#[derive(Clone, Debug)]
pub(super) struct Belief {
    pub(super) mean: Vector,
    covariance: Matrix,
    pub(super) information: Matrix,
    /// Whether samples are part of it.
    pub(super) is_measured: bool,
}

/// Returns the inverse of a covariance or information with entries of very different magnitudes.
fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let scaling = Matrix::from_diagonal(&matrix.diagonal().map(|x| x.sqrt().recip()));
    let factor = (scaling * matrix * scaling).cholesky()?;
    Some(scaling * factor.inverse() * scaling)
}

impl Belief {
    /// Creates the belief of a prior. `None` for a covariance that is not positive definite.
    pub(super) fn of_prior(prior: &Prior) -> Option<Self> {
        let (mean, covariance) = prior.moments();
        Some(Self {
            mean,
            covariance,
            information: inverse(&covariance)?,
            is_measured: false,
        })
    }

    /// Returns the belief after an estimate; `None` if its covariance is not positive definite.
    pub(super) fn with(&self, estimate: &Vector, covariance: &Matrix) -> Option<Self> {
        let measured = inverse(covariance)?;
        let information = self.information + measured;
        let both = inverse(&information)?;
        let mean = both * (self.information * self.mean + measured * estimate);
        Some(Self {
            mean: self.pulled_in(&mean, |payload| {
                InertialParameters::from_vector(*payload).is_physical()
            }),
            covariance: both,
            information,
            is_measured: true,
        })
    }

    /// Returns the mean and payloads at the ends of the confidence region that the prior contains.
    pub(super) fn payloads(&self, prior: &Prior) -> Vec<Vector> {
        let mut payloads = vec![self.mean];
        if !self.is_measured {
            let samples = prior.samples();
            payloads.extend(samples.iter().map(|payload| *payload.as_vector()));
            return payloads;
        }
        // Forces of an acceleration of 1 m/s² or 1 rad/s², and moments of it over the lever.
        let sizes = Vector::from_fn(|k, _| if k == 0 { 1.0 } else { 1.0 / LEVER_M });
        let scaling = Matrix::from_diagonal(&sizes);
        let axes = SymmetricEigen::new(scaling * self.covariance * scaling);
        let mut order: Vec<usize> = (0..10).collect();
        order.sort_by(|&a, &b| axes.eigenvalues[b].total_cmp(&axes.eigenvalues[a]));
        for &axis in order.iter().take(AXES) {
            let std_dev = axes.eigenvalues[axis].max(0.0).sqrt();
            let end = axes.eigenvectors.column(axis) * (REACH * std_dev);
            for side in [-1.0, 1.0] {
                let payload = self.mean + end.component_div(&sizes) * side;
                payloads.push(self.pulled_in(&payload, |payload| prior.contains(payload)));
            }
        }
        payloads
    }

    /// Draws a payload.
    pub(super) fn draw(&self, prior: &Prior, random: &mut StdRng) -> Vector {
        if !self.is_measured {
            return prior.draw(random);
        }
        let Some(factor) = self.covariance.cholesky() else {
            return self.mean;
        };
        let normal = Vector::from_fn(|_, _| StandardNormal.sample(random));
        let payload = self.mean + factor.l() * normal;
        self.pulled_in(&payload, |payload| prior.contains(payload))
    }

    /// Returns a payload, or one on the way to the mean that can exist.
    fn pulled_in(&self, payload: &Vector, exists: impl Fn(&Vector) -> bool) -> Vector {
        let difference = payload - self.mean;
        let on_the_way = |step| self.mean + difference * (f64::from(step) / f64::from(STEPS));
        let first = (1..=STEPS).rev().map(on_the_way).find(exists);
        first.unwrap_or(self.mean)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    const PRIOR: Prior = Prior {
        mass_kg: (5.0, 150.0),
        center_of_mass_m: 0.5,
        half_diagonal_m: 0.8,
    };

    /// An estimate far more precise than the prior is the mean, and one that is far less precise
    /// changes nothing.
    #[test]
    fn information_adds_up() {
        let of_prior = Belief::of_prior(&PRIOR).unwrap();
        let estimate = *PRIOR.samples()[1].as_vector() * 0.7;
        let precise = of_prior
            .with(&estimate, &(of_prior.covariance * 1e-8))
            .unwrap();
        assert!((precise.mean - estimate).norm() < 1e-5 * estimate.norm());
        let vague = of_prior
            .with(&estimate, &(of_prior.covariance * 1e8))
            .unwrap();
        assert!((vague.mean - of_prior.mean).norm() < 1e-5 * of_prior.mean.norm());
        let equal = of_prior.with(&estimate, &of_prior.covariance).unwrap();
        let middle = (estimate + of_prior.mean) * 0.5;
        assert!((equal.mean - middle).norm() < 1e-9 * middle.norm());
        assert!(
            (equal.covariance - of_prior.covariance * 0.5).norm()
                < 1e-9 * of_prior.covariance.norm()
        );
        assert!(of_prior.with(&estimate, &-of_prior.covariance).is_none());
    }

    /// Payloads of the confidence region can exist, as far from the mean as its covariance says.
    #[test]
    fn payloads_are_in_the_confidence_region() {
        let of_prior = Belief::of_prior(&PRIOR).unwrap();
        let estimate = *PRIOR.samples()[1].as_vector() * 0.7;
        let mut random = StdRng::seed_from_u64(2);
        for size in [1e-6, 1e-2, 1.0] {
            let belief = of_prior
                .with(&estimate, &(of_prior.covariance * size))
                .unwrap();
            let distance = |payload: &Vector| {
                let off = payload - belief.mean;
                (off.transpose() * belief.information * off)[0].sqrt()
            };
            let payloads = belief.payloads(&PRIOR);
            assert_eq!(payloads.len(), 1 + 2 * AXES);
            // Where nothing on the way from the mean is within the prior, the mean stays.
            let exists = |payload: &Vector| *payload == belief.mean || PRIOR.contains(payload);
            assert!(payloads[1..].iter().all(exists));
            assert!(
                payloads
                    .iter()
                    .all(|payload| distance(payload) < REACH + 1e-6)
            );
            if size == 1e-6 {
                assert!(payloads.iter().all(|payload| PRIOR.contains(payload)));
                let at_ends = payloads[1..]
                    .iter()
                    .filter(|payload| distance(payload) > REACH - 1e-3);
                assert!(at_ends.count() >= AXES);
            }
            for _ in 0..50 {
                assert!(exists(&belief.draw(&PRIOR, &mut random)));
            }
        }
    }
}
