//! What the identifier reports between two updates.

use tactid_dynamics::MassProperties;

use super::least_squares::OnlineLeastSquares;
use crate::KnownBodies;
use crate::result::{is_physical, values_of_body};
use crate::solve::consistency::ProjectionTracker;
use crate::solve::subspace::{Matrix, Vector};
use crate::solve::uncertainty::{ValueStdDevs, std_devs, widened};
use crate::solve::{Described, body_of};

/// The reported estimate: body, uncertainty and physical consistency.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Readout {
    /// The payload alone.
    pub(crate) body: MassProperties,
    /// Whether a body with these parameters can exist.
    pub(crate) is_physical: bool,
    /// Gripper and payload as one body, for the joint-sensing method.
    pub(crate) composite: Option<MassProperties>,
    pub(crate) uncertainty: Uncertainty,
    /// What the standard deviations say of the body: it changes with them, and not at each sample.
    pub(crate) described: Described,
}

/// Uncertainty of the reported body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Uncertainty {
    /// Standard deviations of the ten values that are reported, and whether the motion excites
    /// each.
    pub(crate) of_values: ValueStdDevs,
    /// The ten values of the least-squares estimate while the reported body is far from its
    /// projection onto consistent parameters; afterwards those of the reported body.
    estimate: [f64; 10],
    /// Standard deviations of `estimate` to first order.
    linear: [f64; 10],
    /// Covariance of the linear parameters; `None` before the noise is known.
    pub(crate) covariance: Option<Matrix>,
}

impl Readout {
    /// Returns the report before any window: every value is unknown.
    pub(crate) fn unknown() -> Self {
        let uncertainty = Uncertainty {
            of_values: ValueStdDevs::UNKNOWN,
            estimate: [0.0; 10],
            linear: [f64::INFINITY; 10],
            covariance: None,
        };
        Self::new(body_of(&Vector::zeros()), None, uncertainty)
    }

    /// Returns the report of an estimate with the projection onto consistent parameters. `known` is
    /// the part of the estimated body that is not the payload, and `has_gripper` whether links of
    /// the robot are in it.
    pub(crate) fn of_estimate(
        estimator: &OnlineLeastSquares,
        projection: &ProjectionTracker,
        known: &KnownBodies,
        has_gripper: bool,
    ) -> Self {
        let reported = projection.parameters();
        let estimate = match !projection.is_far() {
            true => reported,
            false => estimator.parameters() - known.parameters,
        };
        let covariance = estimator.covariance();
        let covariance = covariance.map(|covariance| covariance + known.covariance);
        let linear = covariance.map_or(ValueStdDevs::UNKNOWN, |covariance| {
            std_devs(&estimate, &covariance, &estimator.null_space())
        });
        let estimate = values_of_body(&body_of(&estimate));
        let body = body_of(&reported);
        let uncertainty = Uncertainty {
            of_values: ValueStdDevs {
                std_devs: widened(&estimate, &values_of_body(&body), &linear.std_devs),
                ..linear
            },
            estimate,
            linear: linear.std_devs,
            covariance,
        };
        let composite = has_gripper.then(|| body_of(estimator.parameters()));
        Self::new(body, composite, uncertainty)
    }

    /// Replaces the body by the present projection of the same estimate.
    pub(crate) fn set_projection(&mut self, projection: &ProjectionTracker) {
        self.body = body_of(&projection.parameters());
        self.is_physical = is_physical(&self.body);
        if projection.is_far() {
            let reported = values_of_body(&self.body);
            let uncertainty = &mut self.uncertainty;
            uncertainty.of_values.std_devs =
                widened(&uncertainty.estimate, &reported, &uncertainty.linear);
        }
        self.described = Described::new(self.body, &self.uncertainty.of_values, None);
    }

    fn new(
        body: MassProperties,
        composite: Option<MassProperties>,
        uncertainty: Uncertainty,
    ) -> Self {
        Self {
            is_physical: is_physical(&body),
            described: Described::new(body, &uncertainty.of_values, None),
            body,
            composite,
            uncertainty,
        }
    }
}
