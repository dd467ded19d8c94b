//! What a user reads of the last window.

use tactid_dynamics::{InertialParameters, MassProperties};

use crate::estimate::{self, without};
use crate::information::{Matrix, Vector};
use crate::recursive::Recursive;
use crate::uncertainty::deviations;

/// By how much of its largest principal moment an estimate may miss the triangle inequality and still
/// count as possible: plates and rods lie on the border, and no estimate is exact.
const BORDER: f64 = 0.01;

/// What the last window has left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Latest {
    /// The payload alone.
    pub(crate) body: MassProperties,
    pub(crate) is_physical: bool,
    /// With the gripper, for the joint-sensing way.
    pub(crate) composite: Option<MassProperties>,
    /// Of least squares.
    pub(crate) certainty: Option<Certainty>,
}

/// How sure least squares is of the payload.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Certainty {
    pub(crate) deviations: [f64; 10],
    pub(crate) covariance: Matrix,
}

impl Latest {
    pub(crate) fn nothing() -> Self {
        Self::new(body_of(&Vector::zeros()), None, None)
    }

    pub(crate) fn of_filters(found: &MassProperties, gripper: Option<&InertialParameters>) -> Self {
        let payload = gripper.map_or(*found, |gripper| without(found, gripper));
        Self::new(payload, gripper.map(|_| *found), None)
    }

    /// With the possible body that is near to what was found; `gripper` is what was found and is not of
    /// the payload.
    pub(crate) fn of_least_squares(
        found: &Recursive,
        possible: &Vector,
        gripper: Option<&InertialParameters>,
    ) -> Self {
        let covariance = found.covariance();
        let deviations = covariance.map_or([f64::INFINITY; 10], |covariance| {
            let (scales, unknown) = found.unknown();
            deviations(possible, &covariance, &scales, unknown)
        });
        let certainty = Certainty {
            deviations,
            covariance: covariance.unwrap_or_else(Matrix::zeros),
        };
        let composite = gripper.map(|_| body_of(found.parameters()));
        Self::new(body_of(possible), composite, Some(certainty))
    }

    /// A nearer possible body.
    pub(crate) fn move_to(&mut self, possible: &Vector) {
        self.body = body_of(possible);
        self.is_physical = is_physical(&self.body);
    }

    fn new(
        body: MassProperties,
        composite: Option<MassProperties>,
        certainty: Option<Certainty>,
    ) -> Self {
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
    body.unwrap_or_else(|| estimate::body(&[0.0; 10]))
}

/// Whether a body can have these properties, within what an estimate may miss.
pub(crate) fn is_physical(body: &MassProperties) -> bool {
    InertialParameters::from(*body).is_physical_within(BORDER)
}
