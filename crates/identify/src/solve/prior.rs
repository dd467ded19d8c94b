//! What is known of the payload besides the recording.

use nalgebra::{SVector, Vector3, Vector4};
use tactid_dynamics::InertialParameters;

use crate::IdentifyError;
use crate::equations::window::NOISE_CORRELATION;

/// A mass that is said to be exact is so to this part of itself: better than any scale, and far from
/// what doubles round.
const EXACT: f64 = 1e-9;

/// A mass that was weighed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownMass {
    /// Of the payload, kg.
    pub mass_kg: f64,
    /// Standard deviation of the weighing, kg; 0 for an exact mass.
    pub std_dev_kg: f64,
}

impl KnownMass {
    /// # Errors
    /// Where the mass is not positive, or its deviation is negative or not finite.
    pub(crate) fn check(&self) -> Result<(), IdentifyError> {
        let value = |name, given, expected| {
            Err(IdentifyError::Value {
                name,
                given,
                expected,
            })
        };
        if !(self.mass_kg > 0.0 && self.mass_kg.is_finite()) {
            return value("known_mass", self.mass_kg, "a positive number of kg");
        }
        if !(self.std_dev_kg >= 0.0 && self.std_dev_kg.is_finite()) {
            let name = "known_mass_std_dev";
            return value(name, self.std_dev_kg, "zero or a positive number of kg");
        }
        Ok(())
    }

    /// That of the payload together with a body of so many kg, which may be negative.
    pub(crate) fn with(self, mass_kg: f64) -> Self {
        Self {
            mass_kg: self.mass_kg + mass_kg,
            std_dev_kg: self.std_dev_kg.max(EXACT * self.mass_kg),
        }
    }

    /// The weight of a row that says this mass, among rows of windows in units of their noise, 1/kg²:
    /// neighbouring windows share samples, and count for more than they tell.
    pub(crate) fn information(&self) -> f64 {
        NOISE_CORRELATION / self.std_dev_kg.powi(2)
    }
}

/// A box, along the axes of the tool frame, that holds the whole payload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingBox {
    /// The corner with the least coordinates, m.
    pub min: Vector3<f64>,
    /// The corner with the largest, m.
    pub max: Vector3<f64>,
}

impl BoundingBox {
    /// # Errors
    /// Where a corner is not finite, or the box has no room.
    pub(crate) fn check(&self) -> Result<(), IdentifyError> {
        for (axis, (min, max)) in self.min.iter().zip(&self.max).enumerate() {
            if !(min < max && (max - min).is_finite()) {
                return Err(IdentifyError::Box {
                    axis: ["x", "y", "z"][axis],
                    min: *min,
                    max: *max,
                });
            }
        }
        Ok(())
    }

    /// What is not negative for a body inside, as rows in its ten parameters: the mean over the mass of
    /// the product of its distances from any two faces, kg m².
    ///
    /// For opposite faces these are the box's counterpart of the bounding ellipsoid of Wensing, Kim and
    /// Slotine (2018, doi 10.1109/LRA.2017.2729659), and hold the centre of mass inside; with those of
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

    /// A uniform solid of this mass that fills the box.
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

    fn least(body: &InertialParameters) -> f64 {
        let bounds = BOX.bounds();
        let slacks = bounds.iter().map(|bound| bound.dot(body.as_vector()));
        slacks.fold(f64::INFINITY, f64::min)
    }

    fn point(mass_kg: f64, at: Vector3<f64>) -> InertialParameters {
        let cross = tactid_dynamics::cross(&at);
        InertialParameters::from_moments(mass_kg, &(mass_kg * at), &(-mass_kg * cross * cross))
    }

    /// Whatever masses are in the box, no bound is broken; a point outside breaks one.
    #[test]
    fn every_body_in_the_box_keeps_the_bounds() {
        let mut random = SmallRng::seed_from_u64(1);
        let mut draw = |spread: f64| {
            let part = Vector3::from_fn(|_, _| random.random_range(0.0..1.0));
            let middle = 0.5 * (BOX.min + BOX.max);
            middle + spread * (BOX.min + part.component_mul(&(BOX.max - BOX.min)) - middle)
        };
        for count in 1..200 {
            let body = (0..count % 7 + 1).map(|_| point(1.0, draw(1.0))).sum();
            assert!(least(&body) > -1e-15, "{body:?}");
            let at = draw(3.0);
            let inside = (0..3).all(|k| (BOX.min[k]..BOX.max[k]).contains(&at[k]));
            assert_eq!(least(&point(1.0, at)) >= 0.0, inside, "{at}");
        }
    }

    /// The filled box has a cuboid's inertia, and room at every bound.
    #[test]
    fn a_filled_box_is_a_cuboid() {
        let body = BOX.filled(12.0);
        let properties = body.mass_properties().unwrap();
        assert!((properties.center_of_mass - Vector3::new(0.1, 0.3, 0.0)).norm() < 1e-15);
        let moments = Vector3::new(0.04 + 0.36, 0.16 + 0.36, 0.16 + 0.04);
        let error = properties.inertia - Matrix3::from_diagonal(&moments);
        assert!(error.norm() < 1e-12, "{error}");
        assert!(least(&body) > 0.01);
    }
}
