//! What a user reads of the last window.

use tactid_dynamics::{InertialParameters, MassProperties};

use crate::estimate::{self, values, without};
use crate::information::{Matrix, Vector};
use crate::physical::Follower;
use crate::recursive::Recursive;
use crate::uncertainty::{deviations, widened};

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
    /// The values at which deviations are known, and these: those of the estimate while the reported body is
    /// far from the nearest consistent one, else those of the body.
    estimate: [f64; 10],
    linear: [f64; 10],
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
        possible: &Follower,
        gripper: Option<&InertialParameters>,
    ) -> Self {
        let reported = possible.parameters();
        let estimate = match gripper {
            _ if !possible.is_far() => reported,
            Some(gripper) => found.parameters() - gripper.as_vector(),
            None => *found.parameters(),
        };
        let covariance = found.covariance();
        let linear = covariance.map_or([f64::INFINITY; 10], |covariance| {
            let (scales, unknown) = found.unknown();
            deviations(&estimate, &covariance, &scales, unknown)
        });
        let estimate = values(&body_of(&estimate));
        let body = body_of(&reported);
        let certainty = Certainty {
            deviations: widened(&estimate, &values(&body), &linear),
            estimate,
            linear,
            covariance: covariance.unwrap_or_else(Matrix::zeros),
        };
        let composite = gripper.map(|_| body_of(found.parameters()));
        Self::new(body, composite, Some(certainty))
    }

    /// Reports a consistent body that is nearer to the estimate.
    pub(crate) fn move_to(&mut self, possible: &Follower) {
        self.body = body_of(&possible.parameters());
        self.is_physical = is_physical(&self.body);
        if let Some(certainty) = self.certainty.as_mut().filter(|_| possible.is_far()) {
            let reported = values(&self.body);
            certainty.deviations = widened(&certainty.estimate, &reported, &certainty.linear);
        }
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
