//! Estimates that contradict the bounds that are given for the payload.

use nalgebra::SMatrix;
use tactid_dynamics::InertialParameters;

use super::prior::{Prior, Vector};

/// Standard deviations by which an estimate must be beyond a bound: with a dozen plans of four
/// bounds each, noise alone does so less than once in ten thousand runs.
const SIGNIFICANT: f64 = 5.0;

/// Fraction of a bound by which an estimate must be beyond it as well. Systematic errors of a sound
/// recording are smaller, and plans leave twice as much of each limit.
const TOLERANCE: f64 = 0.02;

/// Step of the numerical derivatives, as a fraction of the standard deviation of each parameter.
const DERIVATIVE_STEP: f64 = 1e-2;

/// One of the four bounds of a [`Prior`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PriorBound {
    /// Least mass, kg.
    LeastMass,
    /// Largest mass, kg.
    LargestMass,
    /// Largest distance of the centre of mass from the origin of the tool frame, m.
    CenterOfMass,
    /// Largest half diagonal of the box, m: of a box of constant density with the same sum of the
    /// three moments of inertia.
    HalfDiagonal,
}

impl PriorBound {
    /// All bounds, in the order of the fields of [`Prior`].
    const ALL: [Self; 4] = [
        Self::LeastMass,
        Self::LargestMass,
        Self::CenterOfMass,
        Self::HalfDiagonal,
    ];

    /// Returns the bound's value in a prior, kg or m.
    fn of(self, prior: &Prior) -> f64 {
        match self {
            Self::LeastMass => prior.mass_kg.0,
            Self::LargestMass => prior.mass_kg.1,
            Self::CenterOfMass => prior.center_of_mass_m,
            Self::HalfDiagonal => prior.half_diagonal_m,
        }
    }

    /// Returns what the bound limits, of ten linear parameters, kg or m: NaN if no body has them.
    fn quantity(self, payload: &Vector) -> f64 {
        let body = InertialParameters::from_vector(*payload).mass_properties();
        body.map_or(f64::NAN, |body| match self {
            Self::LeastMass | Self::LargestMass => body.mass_kg,
            Self::CenterOfMass => body.center_of_mass.norm(),
            // The moments of a box of half sides x, y, z have the sum 2/3 m (x² + y² + z²).
            Self::HalfDiagonal => (1.5 * body.inertia.trace() / body.mass_kg).sqrt(),
        })
    }

    /// Returns by how much a value is beyond the bound: negative within it.
    fn excess(self, value: f64, bound: f64) -> f64 {
        match self {
            Self::LeastMass => bound - value,
            _ => value - bound,
        }
    }
}

/// An estimate that lies significantly beyond a bound of the prior, so that the bound is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PriorContradiction {
    /// The bound.
    pub bound: PriorBound,
    /// Value of the bound in the prior, kg or m.
    pub bound_value: f64,
    /// Estimate of what it bounds, kg or m.
    pub estimate: f64,
    /// Standard deviation of that estimate, kg or m.
    pub std_dev: f64,
}

impl Prior {
    /// Returns the bounds that an estimate contradicts: those that it exceeds by more than five
    /// standard deviations and by more than 2 %. `covariance` refers to the ten linear parameters.
    #[must_use]
    pub fn contradictions(
        &self,
        estimate: &InertialParameters,
        covariance: &SMatrix<f64, 10, 10>,
    ) -> Vec<PriorContradiction> {
        let parameters = estimate.as_vector();
        let found = PriorBound::ALL.into_iter().filter_map(|bound| {
            let contradiction = PriorContradiction {
                bound,
                bound_value: bound.of(self),
                estimate: bound.quantity(parameters),
                std_dev: std_dev(bound, parameters, covariance),
            };
            let excess = bound.excess(contradiction.estimate, contradiction.bound_value);
            // A standard deviation that is NaN contradicts nothing.
            let is_significant = excess > SIGNIFICANT * contradiction.std_dev;
            (is_significant && excess > TOLERANCE * bound.of(self)).then_some(contradiction)
        });
        found.collect()
    }
}

/// Returns the standard deviation of what a bound limits, by linear propagation of the covariance.
/// It is NaN where a step of the derivatives leaves the bodies with a positive mass and inertia.
fn std_dev(bound: PriorBound, parameters: &Vector, covariance: &SMatrix<f64, 10, 10>) -> f64 {
    let gradient = Vector::from_fn(|k, _| {
        let step = DERIVATIVE_STEP * covariance[(k, k)].sqrt();
        let at = |side: f64| bound.quantity(&(parameters + Vector::ith(k, side * step)));
        (at(1.0) - at(-1.0)) / (2.0 * step)
    });
    (gradient.transpose() * covariance * gradient)[0].sqrt()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    use tactid_dynamics::MassProperties;

    use super::*;

    const PRIOR: Prior = Prior {
        mass_kg: (5.0, 20.0),
        center_of_mass_m: 0.5,
        half_diagonal_m: 0.6,
    };

    /// Returns a cube with the given half diagonal.
    fn cube(mass_kg: f64, center_m: f64, half_diagonal_m: f64) -> InertialParameters {
        let moment = 2.0 / 9.0 * mass_kg * half_diagonal_m.powi(2);
        let body = MassProperties {
            mass_kg,
            center_of_mass: Vector3::new(0.6, 0.0, 0.8) * center_m,
            inertia: Matrix3::from_diagonal_element(moment),
        };
        body.into()
    }

    /// Returns the bounds that an estimate with ten equal standard deviations contradicts.
    fn contradicted(payload: &InertialParameters, std_dev: f64) -> Vec<PriorBound> {
        let covariance = SMatrix::identity() * std_dev.powi(2);
        let found = PRIOR.contradictions(payload, &covariance);
        found.into_iter().map(|found| found.bound).collect()
    }

    #[test]
    fn each_bound_is_checked() {
        for (payload, expected) in [
            (cube(10.0, 0.4, 0.5), vec![]),
            (cube(20.0, 0.5, 0.6), vec![]),
            (cube(20.2, 0.505, 0.605), vec![]),
            (cube(3.0, 0.4, 0.5), vec![PriorBound::LeastMass]),
            (cube(25.0, 0.4, 0.5), vec![PriorBound::LargestMass]),
            (cube(10.0, 0.55, 0.5), vec![PriorBound::CenterOfMass]),
            (cube(10.0, 0.0, 0.7), vec![PriorBound::HalfDiagonal]),
            (
                cube(25.0, 0.7, 0.9),
                vec![
                    PriorBound::LargestMass,
                    PriorBound::CenterOfMass,
                    PriorBound::HalfDiagonal,
                ],
            ),
        ] {
            assert_eq!(contradicted(&payload, 1e-3), expected, "{payload:?}");
        }
    }

    /// An uncertain estimate contradicts nothing.
    #[test]
    fn noise_is_no_contradiction() {
        let heavy = cube(25.0, 0.4, 0.5);
        assert_eq!(contradicted(&heavy, 0.9), [PriorBound::LargestMass]);
        assert!(contradicted(&heavy, 1.1).is_empty());
        // The half diagonal's standard deviation is NaN where a difference step leaves no body.
        assert!(contradicted(&cube(10.0, 0.0, 0.7), 50.0).is_empty());
    }

    /// The centre of mass at 0.55 m is (0.33, 0, 0.44) m: its distance has the derivative -d/m with
    /// the mass and u/m with m c.
    #[test]
    fn the_standard_deviation_is_that_of_the_distance() {
        let covariance = SMatrix::identity() * 1e-6;
        let found = PRIOR.contradictions(&cube(10.0, 0.55, 0.5), &covariance);
        let expected = 1e-4 * (1.0f64 + 0.55 * 0.55).sqrt();
        assert!(
            (found[0].std_dev / expected - 1.0).abs() < 1e-6,
            "{found:?}"
        );
        assert!((found[0].estimate - 0.55).abs() < 1e-12);
    }
}
