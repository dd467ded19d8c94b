//! What a user reads of the last window.

use tactid_dynamics::{InertialParameters, MassProperties};

use super::estimator::Recursive;
use crate::result::{self, is_physical, values};
use crate::solve::consistency::ProjectionTracker;
use crate::solve::subspace::{Matrix, Vector};
use crate::solve::uncertainty::{std_devs, widened};

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
    /// The values at which standard deviations are known, and these: those of the estimate while the
    /// reported body is far from the nearest consistent one, else those of the body.
    estimate: [f64; 10],
    linear: [f64; 10],
    pub(crate) covariance: Matrix,
}

impl Latest {
    pub(crate) fn nothing() -> Self {
        let certainty = Certainty {
            std_devs: [f64::INFINITY; 10],
            estimate: [0.0; 10],
            linear: [f64::INFINITY; 10],
            covariance: Matrix::zeros(),
        };
        Self::new(body_of(&Vector::zeros()), None, certainty)
    }

    /// With the possible body that is near to what was found; `gripper` is what was found and is not of
    /// the payload.
    pub(crate) fn of_least_squares(
        found: &Recursive,
        possible: &ProjectionTracker,
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
            std_devs(&estimate, &covariance, &found.null_space())
        });
        let estimate = values(&body_of(&estimate));
        let body = body_of(&reported);
        let certainty = Certainty {
            std_devs: widened(&estimate, &values(&body), &linear),
            estimate,
            linear,
            covariance: covariance.unwrap_or_else(Matrix::zeros),
        };
        let composite = gripper.map(|_| body_of(found.parameters()));
        Self::new(body, composite, certainty)
    }

    /// Reports a consistent body that is nearer to the estimate.
    pub(crate) fn move_to(&mut self, possible: &ProjectionTracker) {
        self.body = body_of(&possible.parameters());
        self.is_physical = is_physical(&self.body);
        if possible.is_far() {
            let reported = values(&self.body);
            let certainty = &mut self.certainty;
            certainty.std_devs = widened(&certainty.estimate, &reported, &certainty.linear);
        }
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
