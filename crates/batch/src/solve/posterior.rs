//! From a posterior of the linear parameters to what a user reads.

use tactid_dynamics::{InertialParameters, MassProperties};
use tactid_identify::solve::{
    Matrix, NullSpace, Vector, body_of, estimate, std_devs, value_jacobian,
};
use tactid_identify::{KnownBodies, KnownMass, PayloadEstimate, is_physical};

use super::PrincipalMoments;
use crate::prior::PriorKnowledge;

/// What a solver knows of the linear parameters of a payload.
#[derive(Clone, Copy, Debug)]
pub struct Posterior<'a> {
    /// Parameters of the payload, which are physically consistent where its mass is positive.
    pub parameters: Vector,
    /// Covariance of the parameters. What it contains in unobservable directions does not count.
    pub covariance: Matrix,
    /// The unobservable directions.
    pub null_space: &'a NullSpace,
    /// Factors on the standard deviations of the [ten values](tactid_identify::VALUE_NAMES), for what is
    /// uncertain beyond the covariance; 1 where nothing is.
    pub factors: [f64; 10],
}

/// What a user reads of a posterior.
#[derive(Clone, Debug)]
pub struct Report {
    /// The payload with its uncertainty. It counts no windows, samples or gaps.
    pub estimate: PayloadEstimate,
    /// Principal moments of inertia of the payload; `None` where its mass is zero.
    pub principal_moments: Option<PrincipalMoments>,
}

impl<'a> Posterior<'a> {
    /// Returns the payload in a load that contains the `known` bodies besides: the `nearest`
    /// consistent payload, with the factor on the standard deviations that makes its distance
    /// plausible. The load has these parameters with their covariance, and its known mass, if any
    /// ([`KnownBodies::mass_of_load`]), does not become less certain than its weighing.
    #[must_use]
    pub fn of_load(
        (parameters, covariance, known_mass): (&Vector, &Matrix, Option<KnownMass>),
        known: &KnownBodies,
        nearest: (Vector, f64),
        null_space: &'a NullSpace,
    ) -> Self {
        let (_, covariance) = known.payload(parameters, covariance, known_mass);
        let weighing = known_mass.map(|mass| known.mass_of_payload(mass));
        Self {
            parameters: nearest.0,
            covariance: widened(&covariance, nearest.1, weighing),
            null_space,
            factors: [1.0; 10],
        }
    }

    /// Returns the body of the payload and the `known` bodies together.
    pub(crate) fn composite(&self, known: &KnownBodies) -> Option<MassProperties> {
        InertialParameters::from_vector(self.parameters + known.parameters).mass_properties()
    }

    /// Returns the payload in `frame`, given what is known of it beforehand.
    ///
    /// A factor does not make a known mass less certain than the covariance or its weighing does,
    /// and an exact mass that is kept has the standard deviation zero.
    #[must_use]
    pub fn report(&self, frame: &str, prior: &PriorKnowledge) -> Report {
        let of_values = std_devs(&self.parameters, &self.covariance, self.null_space);
        let mut widened = of_values;
        for (std_dev, factor) in widened.std_devs.iter_mut().zip(self.factors) {
            *std_dev *= factor;
        }
        if let Some(mass) = prior.known_mass {
            let is_exact = mass.std_dev_kg == 0.0 && mass.agrees_with(self.parameters[0], 0.0);
            let largest_kg = mass.std_dev_kg.max(of_values.std_devs[0]);
            widened.std_devs[0] = if is_exact {
                0.0
            } else {
                widened.std_devs[0].min(largest_kg)
            };
        }
        // The moments depend on all entries of the inertia.
        let of_inertia = self.factors[4..].iter().fold(1.0, |a, b| f64::max(a, *b));
        let covariance = self.covariance * of_inertia.powi(2);
        let body = body_of(&self.parameters);
        let bounding_box = prior.bounding_box.as_ref();
        Report {
            estimate: PayloadEstimate {
                covariance: Some(self.widened_covariance().data.0),
                ..estimate(
                    frame.into(),
                    body,
                    is_physical(&body),
                    &widened,
                    bounding_box,
                )
            },
            principal_moments: PrincipalMoments::with_std_devs(
                &self.parameters,
                &covariance,
                self.null_space,
            ),
        }
    }

    /// Returns the covariance of the parameters with the factors on the standard deviations of the
    /// ten values.
    fn widened_covariance(&self) -> Matrix {
        let slopes = value_jacobian(&self.parameters);
        let inverse = slopes.and_then(|slopes| Some((slopes, slopes.try_inverse()?)));
        let Some((slopes, inverse)) = inverse.filter(|_| self.factors != [1.0; 10]) else {
            return self.covariance;
        };
        let wide = inverse * Matrix::from_diagonal(&self.factors.into()) * slopes;
        wide * self.covariance * wide.transpose()
    }
}

/// Returns the covariance of linear parameters with standard deviations that are larger by a
/// factor. That of a known mass does not grow beyond that of its weighing.
fn widened(covariance: &Matrix, factor: f64, known_mass: Option<KnownMass>) -> Matrix {
    let mut wide = covariance * (factor * factor);
    if let Some(mass) = known_mass {
        let largest = mass.std_dev_kg.powi(2).max(covariance[(0, 0)]);
        let ratio = (largest / wide[(0, 0)].max(f64::MIN_POSITIVE)).min(1.0);
        wide.row_mut(0).scale_mut(ratio.sqrt());
        wide.column_mut(0).scale_mut(ratio.sqrt());
    }
    wide
}
