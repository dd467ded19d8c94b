//! What is known of the payload of a recording that calibrates an arm.

use nalgebra::{Matrix3, Vector3};

use crate::IdentifyError;

/// What is known of the payload that an arm holds in a recording for its calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownPayload {
    /// Mass of all that is held beyond the robot's description, kg.
    pub mass_kg: f64,
    /// Standard deviation of the mass, kg; 0 for an exact mass.
    pub mass_std_dev_kg: f64,
    /// Centre of mass in the tool frame, m, to a millimetre. `None`: within some 0.3 m of the tool frame's origin.
    pub center_of_mass: Option<Vector3<f64>>,
    /// Inertia about the centre of mass, along the axes of the tool frame, kg m², to some percent. `None`: that of a body
    /// within some 0.3 m of the tool frame's origin. Used only together with `center_of_mass`.
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
    /// Returns [`IdentifyError::Value`] with the name of a value that is out of range: `payload_mass_kg`,
    /// `payload_mass_std_dev_kg`, `payload_center_of_mass` or `payload_inertia`.
    pub fn check(&self) -> Result<(), IdentifyError> {
        let out_of_range = |name, given, expected| {
            Err(IdentifyError::Value {
                name,
                given,
                expected,
            })
        };
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
            return out_of_range("payload_center_of_mass", given, "finite");
        }
        let inertia = self.inertia.as_ref().map_or(&[][..], |i| i.as_slice());
        if let Some(given) = not_finite(inertia) {
            return out_of_range("payload_inertia", given, "finite");
        }
        Ok(())
    }
}
