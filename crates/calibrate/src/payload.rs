//! What is known of the payload of a recording that calibrates an arm.

use nalgebra::{Matrix3, SVector, Vector3};
use tactid_dynamics::{InertialParameters, MassProperties};
use tactid_identify::IdentifyError;

/// What is known of the payload that an arm holds in a recording for its calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownPayload {
    /// Mass of all that is held beyond the robot's description, kg.
    pub mass_kg: f64,
    /// Standard deviation of the mass, kg; 0 for an exact mass.
    pub mass_std_dev_kg: f64,
    /// Centre of mass in the tool frame, m, to a millimetre. `None`: within 0.3 m of its origin.
    pub center_of_mass: Option<Vector3<f64>>,
    /// Inertia about the centre of mass, along the axes of the tool frame, kg m², to some percent.
    /// `None`: as of a body within some 0.3 m of the tool frame's origin. Used only together with
    /// `center_of_mass`.
    pub inertia: Option<Matrix3<f64>>,
}

impl KnownPayload {
    /// Returns a payload of which only the mass is known, kg, with its standard deviation, kg.
    #[must_use]
    pub fn of_mass(mass_kg: f64, mass_std_dev_kg: f64) -> Self {
        Self {
            mass_kg,
            mass_std_dev_kg,
            center_of_mass: None,
            inertia: None,
        }
    }

    /// Checks that the values are in range.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] with the name of a value that is out of range:
    /// `payload_mass_kg`, `payload_mass_std_dev_kg`, `payload_com` or `payload_inertia`. No body
    /// has an inertia that is not symmetric, or of which a principal moment exceeds the sum of the
    /// others.
    pub fn check(&self) -> Result<(), IdentifyError> {
        let out_of_range =
            |name, given, expected| Err(IdentifyError::out_of_range(name, given, expected));
        if !(self.mass_kg > 0.0 && self.mass_kg.is_finite()) {
            return out_of_range("payload_mass_kg", self.mass_kg, "a positive number of kg");
        }
        if !(self.mass_std_dev_kg >= 0.0 && self.mass_std_dev_kg.is_finite()) {
            let name = "payload_mass_std_dev_kg";
            return out_of_range(
                name,
                self.mass_std_dev_kg,
                "zero or a positive number of kg",
            );
        }
        let not_finite = |entries: &[f64]| entries.iter().copied().find(|x| !x.is_finite());
        let center = self
            .center_of_mass
            .as_ref()
            .map_or(&[][..], |c| c.as_slice());
        if let Some(given) = not_finite(center) {
            return out_of_range("payload_com", given, "finite");
        }
        let inertia = self.inertia.as_ref().map_or(&[][..], |i| i.as_slice());
        if let Some(given) = not_finite(inertia) {
            return out_of_range("payload_inertia", given, "finite");
        }
        match self.inertia {
            Some(inertia) if !self.is_possible(inertia) => Err(IdentifyError::Option {
                option: "payload_inertia",
                what: "`payload_inertia` is that of no body: it must be symmetric, with no principal moment above the sum \
                       of the others"
                    .to_owned(),
            }),
            _ => Ok(()),
        }
    }

    /// Whether a body can have an inertia about its centre of mass, but for rounded numbers.
    fn is_possible(&self, inertia: Matrix3<f64>) -> bool {
        let is_symmetric = (inertia - inertia.transpose()).amax() <= SYMMETRY * inertia.amax();
        let body = InertialParameters::from(MassProperties {
            mass_kg: self.mass_kg,
            center_of_mass: Vector3::zeros(),
            inertia,
        });
        is_symmetric && body.is_physical_within(POSSIBLE)
    }

    /// Returns the linear parameters that are most likely, of a body at the tool frame's origin
    /// where the centre of mass is unknown.
    pub(crate) fn parameters(&self) -> InertialParameters {
        InertialParameters::from(MassProperties {
            mass_kg: self.mass_kg,
            center_of_mass: self.center_of_mass.unwrap_or_default(),
            inertia: self.center_of_mass.and(self.inertia).unwrap_or_default(),
        })
    }

    /// Standard deviation of the mass, kg; positive.
    fn mass_std_dev(&self) -> f64 {
        self.mass_std_dev_kg.max(EXACT * self.mass_kg)
    }

    /// Returns the precision of the mass relative to its value.
    pub(crate) fn mass_precision(&self) -> f64 {
        (self.mass_kg / self.mass_std_dev()).powi(2)
    }

    /// Returns what is known as rows for the ten linear parameters.
    pub(crate) fn rows(&self) -> Vec<PayloadRow> {
        let expected = self.parameters();
        let expected = expected.as_vector();
        let mass = PayloadRow {
            gradient: SVector::ith(0, 1.0),
            target: self.mass_kg,
            std_dev: self.mass_std_dev(),
        };
        let moment_std_dev = match self.center_of_mass {
            Some(_) => self.mass_kg * CENTER_STD_DEV_M,
            None => self.mass_kg * PAYLOAD_SIZE_M,
        };
        let inertia_std_dev = match (self.center_of_mass, self.inertia) {
            (Some(_), Some(inertia)) => INERTIA_STD_DEV * inertia.trace().abs(),
            _ => self.mass_kg * PAYLOAD_SIZE_M * PAYLOAD_SIZE_M,
        };
        // Moments and inertia about the tool frame follow the mass, which may be uncertain.
        let of_entry = |k: usize, std_dev: f64| {
            let mut gradient = SVector::ith(k, 1.0);
            gradient[0] = -expected[k] / self.mass_kg;
            PayloadRow {
                gradient,
                target: 0.0,
                std_dev: std_dev.max(EXACT * self.mass_kg),
            }
        };
        let moments = (1..4).map(|k| of_entry(k, moment_std_dev));
        let inertia = (4..10).map(|k| of_entry(k, inertia_std_dev));
        std::iter::once(mass)
            .chain(moments)
            .chain(inertia)
            .collect()
    }
}

/// Difference of entries of an inertia that must be the same, a fraction of the largest, as in
/// printed numbers.
const SYMMETRY: f64 = 1e-6;

/// Fraction by which a principal moment may exceed the sum of the others, as in an estimate.
const POSSIBLE: f64 = 0.01;

/// Relative standard deviation of a mass that is given as exact: better than any scale.
const EXACT: f64 = 1e-6;

/// Standard deviation of a known centre of mass, m.
const CENTER_STD_DEV_M: f64 = 1e-3;

/// Standard deviation of a known inertia, a fraction of its trace.
const INERTIA_STD_DEV: f64 = 0.02;

/// Distance from the tool frame within which a payload of known mass alone is expected, m.
const PAYLOAD_SIZE_M: f64 = 0.3;

/// A measurement of a linear combination of the ten parameters of a payload.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PayloadRow {
    pub(crate) gradient: SVector<f64, 10>,
    pub(crate) target: f64,
    pub(crate) std_dev: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected parameters satisfy all rows, also with another mass at the same place; a centre
    /// of mass that is off by its standard deviation is off by one in its row.
    #[test]
    fn rows_follow_the_mass() {
        let known = KnownPayload {
            mass_kg: 2.0,
            mass_std_dev_kg: 0.1,
            center_of_mass: Some(Vector3::new(0.1, -0.2, 0.3)),
            inertia: Some(Matrix3::from_diagonal(&Vector3::new(0.02, 0.03, 0.04))),
        };
        known.check().unwrap();
        let expected = *known.parameters().as_vector();
        let rows = known.rows();
        assert_eq!(rows.len(), 10);
        for row in &rows {
            assert!((row.gradient.dot(&expected) - row.target).abs() < 1e-15);
        }
        for row in &rows[1..] {
            assert!((row.gradient.dot(&(1.1 * expected)) - row.target).abs() < 1e-15);
        }
        let mut moved = expected;
        moved[2] += 2.0 * 0.001;
        assert!((rows[2].gradient.dot(&moved) / rows[2].std_dev - 1.0).abs() < 1e-9);
        let exact = KnownPayload::of_mass(2.0, 0.0);
        assert!(exact.rows().iter().all(|row| row.std_dev > 0.0));
    }

    /// Values that no body has are errors with their names.
    #[test]
    fn values_out_of_range_are_named() {
        let good = KnownPayload::of_mass(1.0, 0.0);
        let cases = [
            (
                "payload_mass_kg",
                KnownPayload {
                    mass_kg: -1.0,
                    ..good
                },
            ),
            (
                "payload_mass_std_dev_kg",
                KnownPayload {
                    mass_std_dev_kg: f64::NAN,
                    ..good
                },
            ),
            (
                "payload_com",
                KnownPayload {
                    center_of_mass: Some(Vector3::repeat(f64::NAN)),
                    ..good
                },
            ),
            (
                "payload_inertia",
                KnownPayload {
                    inertia: Some(Matrix3::repeat(f64::INFINITY)),
                    ..good
                },
            ),
        ];
        for (name, payload) in cases {
            let error = payload.check().unwrap_err().to_string();
            assert!(error.starts_with(&format!("`{name}` is ")), "{error}");
        }
    }

    /// An inertia that is not symmetric, or has a moment above the sum of the others, is refused.
    #[test]
    fn an_inertia_of_no_body_is_refused() {
        let with = |inertia| KnownPayload {
            center_of_mass: Some(Vector3::new(0.0, 0.1, 0.0)),
            inertia: Some(inertia),
            ..KnownPayload::of_mass(2.0, 0.0)
        };
        let plate = Matrix3::from_diagonal(&Vector3::new(0.01, 0.02, 0.01));
        with(plate).check().unwrap();
        let (mut rounded, mut skew) = (plate, plate);
        rounded[(0, 1)] = 1e-9;
        skew[(0, 1)] = 1e-3;
        with(rounded).check().unwrap();
        let long = Matrix3::from_diagonal(&Vector3::new(0.01, 0.03, 0.01));
        for inertia in [skew, long, -plate] {
            let error = with(inertia).check().unwrap_err();
            assert!(error.to_string().contains("that of no body"), "{error}");
        }
    }
}
