//! Prior knowledge of the payload: its mass, and a box that contains it.

use nalgebra::{SVector, Vector3, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::InertialParameters;

use crate::{IdentifyError, serial};

/// Relative standard deviation of a mass that is given as exact: better than any scale, and far
/// from the rounding of double precision.
const EXACT: f64 = 1e-9;

/// Masses that can be known, kg: far beyond any payload, and far within the numbers whose products
/// are finite.
const MASSES_KG: std::ops::RangeInclusive<f64> = 1e-12..=1e12;

/// Relative difference up to which an estimated mass is the exact known one: far above the rounding
/// of a fit and of its projection, far below the error of a scale.
const SAME_MASS: f64 = 1e-6;

/// The payload's mass, known from a scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct KnownMass {
    /// Mass of the payload, kg.
    pub mass_kg: f64,
    /// Standard deviation of the weighing, kg; 0 for an exact mass.
    pub std_dev_kg: f64,
}

impl KnownMass {
    /// Checks that the values are in range.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] if the mass is not from 1e-12 to 1e12 kg, or its standard
    /// deviation is negative or more than 1e12 kg.
    pub fn check(&self) -> Result<(), IdentifyError> {
        if !MASSES_KG.contains(&self.mass_kg) {
            let expected = "a positive number of kg, from 1e-12 to 1e12";
            return Err(IdentifyError::out_of_range(
                "known_mass_kg",
                self.mass_kg,
                expected,
            ));
        }
        if !(0.0..=*MASSES_KG.end()).contains(&self.std_dev_kg) {
            let expected = "zero or a positive number of kg, up to 1e12";
            return Err(IdentifyError::out_of_range(
                "known_mass_std_dev_kg",
                self.std_dev_kg,
                expected,
            ));
        }
        Ok(())
    }

    /// Returns the mass of the payload together with a body of so many kg, which may be negative.
    #[must_use]
    pub fn with(self, mass_kg: f64) -> Self {
        Self {
            mass_kg: self.mass_kg + mass_kg,
            std_dev_kg: self.std_dev_kg.max(EXACT * self.mass_kg),
        }
    }

    /// Returns whether an estimate of the payload's mass, kg, is within so many standard deviations
    /// of the known mass. An estimate that differs by rounding is the exact mass.
    #[must_use]
    pub fn agrees_with(&self, estimated_kg: f64, std_devs: f64) -> bool {
        let tolerance_kg = (std_devs * self.std_dev_kg).max(SAME_MASS * self.mass_kg);
        (estimated_kg - self.mass_kg).abs() <= tolerance_kg
    }
}

/// A box along the axes of the tool frame that contains the whole payload.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoundingBox {
    /// Corner with the smallest coordinates, m.
    #[serde(with = "serial::vector")]
    #[schemars(with = "[f64; 3]")]
    pub min: Vector3<f64>,
    /// Corner with the largest coordinates, m.
    #[serde(with = "serial::vector")]
    #[schemars(with = "[f64; 3]")]
    pub max: Vector3<f64>,
}

impl BoundingBox {
    /// Checks that the box, which the setting `option` gives, has a volume.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] if a corner is not finite, or a side is not positive.
    pub fn check(&self, option: &'static str) -> Result<(), IdentifyError> {
        for (axis, (min, max)) in self.min.iter().zip(&self.max).enumerate() {
            if !(min < max && (max - min).is_finite()) {
                let axis = ["x", "y", "z"][axis];
                return Err(IdentifyError::Option {
                    option,
                    what: format!(
                        "the box goes from {min} to {max} m along {axis}: its upper end must be larger than its lower end"
                    ),
                });
            }
        }
        Ok(())
    }

    /// Returns rows whose products with the ten parameters are not negative for a body inside the
    /// box: integrals over the mass of the product of the distances from any two faces, kg m².
    ///
    /// For opposite faces these are the box's counterpart of the bounding ellipsoid of Wensing, Kim
    /// and Slotine (2018, doi 10.1109/LRA.2017.2729659), and keep the centre of mass inside. For
    /// neighbouring faces they are products of bounds as in Anstreicher and Burer (2010,
    /// Mathematical Programming 124).
    pub(crate) fn bounds(&self) -> [SVector<f64, 10>; 15] {
        let face = |k: usize| {
            let axis = k / 2;
            let mut plane = Vector4::zeros();
            (plane[axis], plane[3]) = if k.is_multiple_of(2) {
                (1.0, -self.min[axis])
            } else {
                (-1.0, self.max[axis])
            };
            plane
        };
        let mut bounds = [SVector::zeros(); 15];
        let pairs = (0..6).flat_map(|a| (0..a).map(move |b| (a, b)));
        for (bound, (a, b)) in bounds.iter_mut().zip(pairs) {
            *bound = SVector::from_fn(|k, _| {
                let unit = InertialParameters::from_vector(SVector::ith(k, 1.0));
                face(a).dot(&(unit.pseudo_inertia() * face(b)))
            });
        }
        bounds
    }

    /// Returns a uniform solid of this mass that fills the box.
    pub(crate) fn filled(&self, mass_kg: f64) -> InertialParameters {
        let center = 0.5 * (self.min + self.max);
        let size = self.max - self.min;
        let mut pseudo = nalgebra::Matrix4::zeros();
        for axis in 0..3 {
            pseudo[(axis, axis)] = size[axis].powi(2) / 12.0;
        }
        let point = center.push(1.0);
        InertialParameters::from_pseudo_inertia(&(mass_kg * (pseudo + point * point.transpose())))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    const BOX: BoundingBox = BoundingBox {
        min: Vector3::new(-0.1, 0.2, -0.3),
        max: Vector3::new(0.3, 0.4, 0.3),
    };

    fn smallest_slack(body: &InertialParameters) -> f64 {
        let bounds = BOX.bounds();
        let slacks = bounds.iter().map(|bound| bound.dot(body.as_vector()));
        slacks.fold(f64::INFINITY, f64::min)
    }

    fn point(mass_kg: f64, at: Vector3<f64>) -> InertialParameters {
        let cross = tactid_dynamics::cross(&at);
        InertialParameters::from_moments(mass_kg, &(mass_kg * at), &(-mass_kg * cross * cross))
    }

    /// Random masses in the box violate no bound, and a point mass outside violates one.
    #[test]
    fn every_body_in_the_box_satisfies_the_bounds() {
        let mut random = SmallRng::seed_from_u64(1);
        let mut draw = |spread: f64| {
            let fractions = Vector3::from_fn(|_, _| random.random_range(0.0..1.0));
            let middle = 0.5 * (BOX.min + BOX.max);
            middle + spread * (BOX.min + fractions.component_mul(&(BOX.max - BOX.min)) - middle)
        };
        for count in 1..200 {
            let body = (0..count % 7 + 1).map(|_| point(1.0, draw(1.0))).sum();
            assert!(smallest_slack(&body) > -1e-15, "{body:?}");
            let at = draw(3.0);
            let inside = (0..3).all(|k| (BOX.min[k]..BOX.max[k]).contains(&at[k]));
            assert_eq!(smallest_slack(&point(1.0, at)) >= 0.0, inside, "{at}");
        }
    }

    /// The filled box has the inertia of a cuboid, and satisfies every bound with slack.
    #[test]
    fn a_filled_box_is_a_cuboid() {
        let body = BOX.filled(12.0);
        let properties = body.mass_properties().unwrap();
        assert!((properties.center_of_mass - Vector3::new(0.1, 0.3, 0.0)).norm() < 1e-15);
        let moments = Vector3::new(0.04 + 0.36, 0.16 + 0.36, 0.16 + 0.04);
        let error = properties.inertia - Matrix3::from_diagonal(&moments);
        assert!(error.norm() < 1e-12, "{error}");
        assert!(smallest_slack(&body) > 0.01);
    }
}
