//! What a user reads of the last window.

use tactid_dynamics::{InertialParameters, MassProperties};

use super::estimator::Recursive;
use crate::result::{self, is_physical};
use crate::solve::subspace::{Matrix, Vector};
use crate::solve::uncertainty::std_devs;

/// What the last window has left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Latest {
    /// The payload alone.
    pub(crate) body: MassProperties,
    pub(crate) is_physical: bool,
    /// With the gripper, for the joint-sensing method.
    pub(crate) composite: Option<MassProperties>,
    pub(crate) certainty: Certainty,
}

/// How sure least squares is of the payload.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Certainty {
    pub(crate) std_devs: [f64; 10],
    pub(crate) covariance: Matrix,
}

impl Latest {
    pub(crate) fn nothing() -> Self {
        let certainty = Certainty {
            std_devs: [f64::INFINITY; 10],
            covariance: Matrix::zeros(),
        };
        Self::new(body_of(&Vector::zeros()), None, certainty)
    }

    /// With the possible body that is near to what was found; `gripper` is what was found and is not of
    /// the payload.
    pub(crate) fn of_least_squares(
        found: &Recursive,
        possible: &Vector,
        gripper: Option<&InertialParameters>,
    ) -> Self {
        let covariance = found.covariance();
        let std_devs = covariance.map_or([f64::INFINITY; 10], |covariance| {
            std_devs(possible, &covariance, &found.null_space())
        });
        let certainty = Certainty {
            std_devs,
            covariance: covariance.unwrap_or_else(Matrix::zeros),
        };
        let composite = gripper.map(|_| body_of(found.parameters()));
        Self::new(body_of(possible), composite, certainty)
    }

    /// A nearer possible body.
    pub(crate) fn move_to(&mut self, possible: &Vector) {
        self.body = body_of(possible);
        self.is_physical = is_physical(&self.body);
    }

    fn new(body: MassProperties, composite: Option<MassProperties>, certainty: Certainty) -> Self {
        Self {
            is_physical: is_physical(&body),
            body,
            composite,
            certainty,
        }
    }
}

/// All zero where there is no mass.
fn body_of(parameters: &Vector) -> MassProperties {
    let body = InertialParameters::from_vector(*parameters).mass_properties();
    body.unwrap_or_else(|| result::body(&[0.0; 10]))
}
