//! Known bodies that the measured load contains besides the payload, with their uncertainty.

use nalgebra::SymmetricEigen;
use tactid_dynamics::{InertialParameters, MassProperties};

use crate::fingerprint::fingerprint;
use crate::prior::KnownMass;
use crate::result::values_of_body;
use crate::solve::subspace::{Matrix, Vector};
use crate::solve::uncertainty::{largest_of_kind, value_jacobian};

/// A known body that the measured load contains besides the payload, such as a gripper or a tool
/// changer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownTool {
    /// Mass properties in the tool frame.
    pub body: MassProperties,
    /// Covariance of the linear parameters in the order of [`InertialParameters`]: zero where they
    /// are exact.
    pub covariance: Matrix,
}

/// An exact tool.
impl From<MassProperties> for KnownTool {
    fn from(body: MassProperties) -> Self {
        Self {
            body,
            covariance: Matrix::zeros(),
        }
    }
}

impl KnownTool {
    /// Returns a tool of positive mass whose [ten values](crate::VALUE_NAMES) have these
    /// independent standard deviations, in their units.
    #[must_use]
    pub fn with_std_devs(body: MassProperties, std_devs: &[f64; 10]) -> Self {
        let parameters = InertialParameters::from(body);
        let inverse =
            value_jacobian(parameters.as_vector()).and_then(|slopes| slopes.try_inverse());
        let root = inverse.unwrap_or_default() * Matrix::from_diagonal(&Vector::from(*std_devs));
        Self {
            body,
            covariance: root * root.transpose(),
        }
    }

    /// Returns a tool of positive mass whose values have a standard deviation that is this fraction
    /// of the largest value of their kind (mass, centre of mass, inertia).
    #[must_use]
    pub fn with_relative_std_dev(body: MassProperties, fraction: f64) -> Self {
        let largest = largest_of_kind(&values_of_body(&body));
        Self::with_std_devs(body, &largest.map(|value| fraction * value))
    }
}

/// The known bodies of a load together: the gripper of the robot's description, which is exact, and
/// a known tool.
#[derive(Clone, Copy, Debug)]
pub struct KnownBodies {
    /// Linear parameters in the tool frame.
    pub parameters: Vector,
    /// Covariance of the linear parameters.
    pub covariance: Matrix,
}

impl KnownBodies {
    /// Returns a gripper and a tool together, of which there may be none.
    #[must_use]
    pub fn new(gripper: Option<InertialParameters>, tool: Option<KnownTool>) -> Self {
        let tool_parameters = tool.map(|tool| InertialParameters::from(tool.body));
        let bodies = gripper.into_iter().chain(tool_parameters);
        Self {
            parameters: bodies.map(|body| *body.as_vector()).sum(),
            covariance: tool.map_or(Matrix::zeros(), |tool| tool.covariance),
        }
    }

    /// Returns the mass with its standard deviation, kg.
    #[must_use]
    pub fn mass_kg(&self) -> (f64, f64) {
        (self.parameters[0], self.covariance[(0, 0)].sqrt())
    }

    /// Returns the mass of the whole load, given that of the payload.
    #[must_use]
    pub fn mass_of_load(&self, payload: KnownMass) -> KnownMass {
        let (mass_kg, std_dev_kg) = self.mass_kg();
        let load = payload.with(mass_kg);
        KnownMass {
            std_dev_kg: load.std_dev_kg.hypot(std_dev_kg),
            ..load
        }
    }

    /// Returns parameters and covariance of the payload, given those of the whole load, which was
    /// identified with a known mass of the load, [`mass_of_load`](Self::mass_of_load), or without
    /// one.
    ///
    /// With a known mass `M` of the load, whose variance `s²` contains that of the known bodies,
    /// the load says something of these, too: their parameters `t` with covariance `T` become `t -
    /// T e (M - π₀) / s²` with covariance `T - T e eᵀ T / s²`, where `e` selects the mass and `π`
    /// are the parameters of the load. Without one, the known bodies are independent of the load.
    #[must_use]
    pub fn payload(
        &self,
        load: &Vector,
        covariance: &Matrix,
        mass_of_load: Option<KnownMass>,
    ) -> (Vector, Matrix) {
        let first: Vector = self.covariance.column(0).into();
        let (gain, difference) = match mass_of_load {
            Some(mass) => (first / mass.std_dev_kg.powi(2), mass.mass_kg - load[0]),
            None => (Vector::zeros(), 0.0),
        };
        let of_mass: Vector = covariance.column(0).into();
        let crossed = gain * of_mass.transpose();
        let of_load = covariance - crossed - crossed.transpose()
            + gain * gain.transpose() * covariance[(0, 0)];
        (
            load - self.parameters + gain * difference,
            of_load + self.covariance - gain * first.transpose(),
        )
    }

    /// Returns the known mass of the payload, given that of the whole load.
    #[must_use]
    pub fn mass_of_payload(&self, load: KnownMass) -> KnownMass {
        let variance = load.std_dev_kg.powi(2) - self.covariance[(0, 0)];
        KnownMass {
            mass_kg: load.mass_kg - self.parameters[0],
            std_dev_kg: variance.max(0.0).sqrt(),
        }
    }

    /// Returns the independent errors of one standard deviation that make up the covariance: the
    /// number of each, which is the same wherever the same tool is given, and the change of the
    /// parameters of the payload.
    pub fn errors(&self) -> impl Iterator<Item = (u64, Vector)> {
        let scales = self.covariance.diagonal().map(f64::sqrt);
        let units = scales.map(|scale| if scale > 0.0 { scale } else { 1.0 });
        let eigen =
            SymmetricEigen::new(self.covariance.component_div(&(units * units.transpose())));
        let number = fingerprint(self.covariance.iter().map(|entry| entry.to_bits()));
        (0..10).filter_map(move |k| {
            let variance = eigen.eigenvalues[k];
            let direction: Vector = eigen.eigenvectors.column(k).into();
            let change = -direction.component_mul(&units) * variance.max(0.0).sqrt();
            (variance > 0.0).then(|| (number.wrapping_add(k as u64), change))
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    const TOOL: MassProperties = MassProperties {
        mass_kg: 0.9,
        center_of_mass: Vector3::new(0.0, 0.01, 0.05),
        inertia: Matrix3::new(2e-3, 0.0, 0.0, 0.0, 2e-3, 0.0, 0.0, 0.0, 1e-3),
    };

    /// The standard deviations of the ten values are those that the tool was made with.
    #[test]
    fn a_tool_has_its_standard_deviations() {
        let tool = KnownTool::with_relative_std_dev(TOOL, 0.01);
        let slopes = value_jacobian(InertialParameters::from(TOOL).as_vector()).unwrap();
        let found = (slopes * tool.covariance * slopes.transpose()).diagonal();
        let expected = [9e-3, 5e-4, 5e-4, 5e-4, 2e-5, 2e-5, 2e-5, 2e-5, 2e-5, 2e-5];
        for (variance, std_dev) in found.iter().zip(expected) {
            assert!((variance.sqrt() / std_dev - 1.0).abs() < 1e-9);
        }
    }

    /// The errors of a tool make up its covariance, and have the same numbers wherever it is given.
    #[test]
    fn errors_make_up_the_covariance() {
        let known = KnownBodies::new(None, Some(KnownTool::with_relative_std_dev(TOOL, 0.02)));
        let sum: Matrix = known
            .errors()
            .map(|(_, change)| change * change.transpose())
            .sum();
        assert!((sum - known.covariance).norm() < 1e-12 * known.covariance.norm());
        let numbers =
            |known: KnownBodies| known.errors().map(|(number, _)| number).collect::<Vec<_>>();
        let other = KnownBodies::new(None, Some(KnownTool::with_relative_std_dev(TOOL, 0.01)));
        assert_eq!(numbers(known), numbers(known));
        assert_ne!(numbers(known), numbers(other));
    }

    /// Load, tool and the payload's weighing are three measurements of two bodies: the payload is
    /// that of their least squares.
    #[test]
    fn a_known_mass_also_corrects_the_tool() {
        let known = KnownBodies::new(None, Some(KnownTool::with_relative_std_dev(TOOL, 0.01)));
        let root = Matrix::from_fn(|i, j| {
            1e-3 * (((3 * i + 7 * j) % 10) as f64 - 4.0 + 20.0 * f64::from(i == j))
        });
        let of_data = root * root.transpose();
        let truth = Vector::from_fn(|k, _| 1.0 / (k + 1) as f64);
        let (payload_kg, std_dev_kg) = (0.25, 2e-3);
        let payload = KnownMass {
            mass_kg: payload_kg,
            std_dev_kg,
        };
        let mass = known.mass_of_load(payload);
        // The load with its known mass, as the fit has it.
        let gain = of_data.column(0) / (of_data[(0, 0)] + mass.std_dev_kg.powi(2));
        let load = truth + gain * (mass.mass_kg - truth[0]);
        let covariance = of_data - gain * of_data.row(0);
        let (found, of_found) = known.payload(&load, &covariance, Some(mass));
        // The difference of load and tool, then its weighing.
        let of_difference = of_data + known.covariance;
        let difference = truth - known.parameters;
        let gain = of_difference.column(0) / (of_difference[(0, 0)] + std_dev_kg.powi(2));
        let expected = difference + gain * (payload_kg - difference[0]);
        let of_expected = of_difference - gain * of_difference.row(0);
        assert!((found - expected).amax() < 1e-12, "{found} {expected}");
        assert!((of_found - of_expected).amax() < 1e-15);
        let back = known.mass_of_payload(mass);
        assert!((back.std_dev_kg / std_dev_kg - 1.0).abs() < 1e-9);
    }
}
