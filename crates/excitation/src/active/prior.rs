//! What is known of a payload before anything is measured.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use tactid_dynamics::{InertialParameters, MassProperties};

use crate::ExcitationError;
use crate::checks::{positive, value};

pub(super) type Vector = SVector<f64, 10>;
pub(super) type Matrix = SMatrix<f64, 10, 10>;

/// Payloads that are drawn for mean and covariance, and their seed.
const DRAWS: usize = 2000;
const SEED: u64 = 0;

/// Fraction by which an estimate may exceed the prior: noise does so for a payload at its limit.
const SLACK: f64 = 0.1;

/// Bounds on the mass and the size of a payload of which nothing else is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Least and largest mass, kg.
    pub mass_kg: (f64, f64),
    /// Largest distance of the centre of mass from the origin of the tool frame, m.
    pub center_of_mass_m: f64,
    /// Half of the diagonal of the largest box that the payload can be, m: the inertia about the
    /// centre of mass is at most the inertia of such a box of constant density, or of a plate or
    /// rod of it.
    pub half_diagonal_m: f64,
}

impl Prior {
    /// Checks that all numbers are positive and the masses in order.
    pub(super) fn check(&self) -> Result<(), ExcitationError> {
        let (least, most) = self.mass_kg;
        positive("prior.mass_kg.0", least)?;
        positive("prior.mass_kg.1", most)?;
        let expected = format!("at least {least}, the least mass");
        value("prior.mass_kg.1", most, most >= least, &expected)?;
        positive("prior.center_of_mass_m", self.center_of_mass_m)?;
        positive("prior.half_diagonal_m", self.half_diagonal_m)
    }

    /// Draws a payload.
    pub(super) fn draw(&self, random: &mut StdRng) -> Vector {
        let (least, most) = self.mass_kg;
        let mass_kg = least + (most - least) * random.random::<f64>();
        let mut in_ball = |radius: f64| {
            let normal = Vector3::from_fn(|_, _| StandardNormal.sample(random));
            normal.normalize() * radius * random.random::<f64>().cbrt()
        };
        let center = in_ball(self.center_of_mass_m);
        let half_sides = in_ball(self.half_diagonal_m);
        let turn = UnitQuaternion::from_scaled_axis(in_ball(PI));
        let body = cuboid(mass_kg, Vector3::zeros(), half_sides);
        let moved = Isometry3::from_parts(center.into(), turn);
        *body.expressed_in(&moved).as_vector()
    }

    /// Returns mean and covariance of the payloads.
    pub(super) fn moments(&self) -> (Vector, Matrix) {
        let mut random = StdRng::seed_from_u64(SEED);
        let draws: Vec<Vector> = (0..DRAWS).map(|_| self.draw(&mut random)).collect();
        let mean = draws.iter().sum::<Vector>() / DRAWS as f64;
        let squares = draws.iter().map(|draw| {
            let off = draw - mean;
            off * off.transpose()
        });
        (mean, squares.sum::<Matrix>() / DRAWS as f64)
    }

    /// Returns a sample of the payloads that load the robot most, by which a first plan is limited:
    /// rods of the largest mass and length along each axis of the tool frame, with their centres of
    /// mass at the largest distance along each axis, to both sides; and the lightest payload, a
    /// cube of half the largest size at the origin of the tool frame.
    ///
    /// The inertia of each box along the axes is a mean of the inertias of the three rods and of a
    /// point. Payloads with centres between the axes, or that are turned, are not among them.
    ///
    /// The numbers of the prior must be positive.
    #[must_use]
    pub fn samples(&self) -> Vec<InertialParameters> {
        let (least, most) = self.mass_kg;
        let cube = Vector3::repeat(0.5 * self.half_diagonal_m / 3f64.sqrt());
        let mut payloads = vec![cuboid(least, Vector3::zeros(), cube)];
        for (axis, side) in [0, 1, 2]
            .into_iter()
            .flat_map(|axis| [(axis, -1.0), (axis, 1.0)])
        {
            let center = Vector3::ith(axis, side * self.center_of_mass_m);
            let rod = |along| cuboid(most, center, Vector3::ith(along, self.half_diagonal_m));
            payloads.extend((0..3).map(rod));
        }
        payloads
    }

    /// Returns whether a payload can be one of the prior.
    pub(super) fn contains(&self, payload: &Vector) -> bool {
        let (least, most) = self.mass_kg;
        let body = InertialParameters::from_vector(*payload);
        let Some(properties) = body.mass_properties() else {
            return false;
        };
        let square = properties.inertia.trace() / (2.0 * properties.mass_kg);
        let largest = self.half_diagonal_m.powi(2) / 3.0;
        body.is_physical()
            && (least * (1.0 - SLACK)..=most * (1.0 + SLACK)).contains(&properties.mass_kg)
            && properties.center_of_mass.norm() <= self.center_of_mass_m * (1.0 + SLACK)
            && square <= largest * (1.0 + SLACK)
    }
}

/// Returns a box of constant density along the axes of the tool frame.
fn cuboid(
    mass_kg: f64,
    center_of_mass: Vector3<f64>,
    half_sides: Vector3<f64>,
) -> InertialParameters {
    let [x, y, z] = half_sides.component_mul(&half_sides).into();
    let moments = Vector3::new(y + z, x + z, x + y) * (mass_kg / 3.0);
    let body = MassProperties {
        mass_kg,
        center_of_mass,
        inertia: Matrix3::from_diagonal(&moments),
    };
    body.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRIOR: Prior = Prior {
        mass_kg: (5.0, 150.0),
        center_of_mass_m: 0.5,
        half_diagonal_m: 0.8,
    };

    /// The prior contains what is drawn from it and its samples, and nothing that is heavier,
    /// further away or larger.
    #[test]
    fn contains_its_own_payloads_only() {
        let mut random = StdRng::seed_from_u64(1);
        for _ in 0..500 {
            let payload = PRIOR.draw(&mut random);
            assert!(PRIOR.contains(&payload), "{payload}");
        }
        let samples = PRIOR.samples();
        assert!(
            samples
                .iter()
                .all(|payload| PRIOR.contains(payload.as_vector()))
        );
        let without = [
            Prior {
                mass_kg: (5.0, 100.0),
                ..PRIOR
            },
            Prior {
                center_of_mass_m: 0.3,
                ..PRIOR
            },
            Prior {
                half_diagonal_m: 0.5,
                ..PRIOR
            },
        ];
        for smaller in without {
            let heaviest = &samples[1..];
            assert!(
                heaviest
                    .iter()
                    .all(|payload| !smaller.contains(payload.as_vector()))
            );
        }
    }

    /// Mean and spread of the mass belong to equally likely masses.
    #[test]
    fn moments_are_those_of_the_draws() {
        let (mean, covariance) = PRIOR.moments();
        assert!((mean[0] - 77.5).abs() < 3.0, "{mean}");
        let std_dev = covariance[(0, 0)].sqrt();
        assert!((std_dev - 145.0 / 12f64.sqrt()).abs() < 2.0, "{std_dev}");
        assert!(covariance.cholesky().is_some());
    }

    #[test]
    fn bad_numbers_are_errors() {
        let cases = [
            (
                Prior {
                    mass_kg: (0.0, 1.0),
                    ..PRIOR
                },
                "`prior.mass_kg.0` is 0",
            ),
            (
                Prior {
                    mass_kg: (2.0, 1.0),
                    ..PRIOR
                },
                "`prior.mass_kg.1` is 1; expected at least 2",
            ),
            (
                Prior {
                    center_of_mass_m: f64::NAN,
                    ..PRIOR
                },
                "`prior.center_of_mass_m` is NaN",
            ),
            (
                Prior {
                    half_diagonal_m: -1.0,
                    ..PRIOR
                },
                "`prior.half_diagonal_m` is -1",
            ),
        ];
        for (prior, expected) in cases {
            let error = prior.check().unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
