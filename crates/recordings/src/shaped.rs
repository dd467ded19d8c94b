//! Results with what the shape of the payload says.

use tactid_batch::{LinearEstimate, PriorKnowledge};
use tactid_dynamics::InertialParameters;
use tactid_identify::PayloadEstimate;
use tactid_shapes::ShapePrior;

use crate::combine::combine_estimates;
use crate::known_shape::GivenShape;
use crate::{Combination, Finding, Identification, Identified, NotUsedBecause, RecordingError};

impl Identified {
    /// Returns the result with what a shape says, where there is one.
    ///
    /// # Errors
    /// Returns the errors of [`combine_estimates`].
    pub(crate) fn with_shape(mut self, shape: Option<&GivenShape>) -> Result<Self, RecordingError> {
        if let (Self::LeastSquares(found), Some(shape)) = (&mut self, shape) {
            found.add_shape(shape, 1.0)?;
        }
        Ok(self)
    }
}

impl Identification {
    /// Adds what a shape says to a result. The standard deviations of what the recording says are
    /// multiplied by `widening`.
    ///
    /// # Errors
    /// Returns the errors of [`combine_estimates`].
    pub(crate) fn add_shape(
        &mut self,
        shape: &GivenShape,
        widening: f64,
    ) -> Result<(), RecordingError> {
        let linear = LinearEstimate {
            covariance: self.linear.covariance * widening.powi(2),
            ..self.linear.clone()
        };
        let prior = PriorKnowledge {
            known_mass: self.known_mass,
            bounding_box: self.bounding_box,
        };
        let frame = self.estimate.frame.clone();
        let with = |shape: &ShapePrior, prior: &PriorKnowledge| {
            combine_estimates(&frame, std::slice::from_ref(&linear), prior, Some(shape))
        };
        let combined = with(&shape.prior(), &prior)?;
        let Some(fit) = &combined.shape else {
            return Ok(());
        };
        if fit.is_contradicted() {
            let measured = PriorKnowledge {
                known_mass: None,
                ..prior
            };
            let without_mass = with(&shape.prior(), &measured)?.shape;
            let is_of_mass = without_mass.is_some_and(|other| other.is_used);
            let mut best: Option<(f64, f64)> = None;
            for (unit_m, shape) in shape.in_other_units() {
                let other = with(&shape, &prior)?.shape.filter(|other| other.is_used);
                let p_value = other.map_or(0.0, |other| other.p_value);
                if p_value > best.map_or(0.0, |best| best.1) {
                    best = Some((unit_m, p_value));
                }
            }
            self.recording.findings.push(Finding::ShapeContradicted {
                p_value: fit.p_value,
                scale: best.map(|best| best.0),
                is_of_mass,
            });
        } else if !fit.is_used {
            let finding = NotUsedBecause::MassUnknown.of("shape");
            self.recording.findings.push(finding);
        }
        self.take(combined);
        Ok(())
    }

    /// Takes the estimate of a combination that uses the shape.
    fn take(&mut self, combined: Combination) {
        if combined.shape.as_ref().is_some_and(|fit| fit.is_used) {
            let (old, new) = (&self.estimate, combined.estimate);
            // What is held besides the payload is the same.
            let composite = old.composite.and_then(|whole| {
                let rest = InertialParameters::from(whole) - InertialParameters::from(old.body);
                (rest + InertialParameters::from(new.body)).mass_properties()
            });
            self.estimate = PayloadEstimate {
                composite,
                windows: old.windows,
                rejected: old.rejected,
                gaps: old.gaps,
                ..new
            };
            self.principal_moments = combined.principal_moments;
            self.forecast = None;
        }
        self.shape = combined.shape;
    }
}
