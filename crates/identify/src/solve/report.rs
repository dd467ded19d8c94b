//! From values and their standard deviations to what a user reads: the only place where an estimate
//! is made.

use std::sync::Arc;

use tactid_dynamics::{InertialParameters, MassProperties};

use super::intervals::intervals;
use super::subspace::Vector;
use super::uncertainty::{ValueStdDevs, observability};
use crate::prior::BoundingBox;
use crate::result::{Observability, PayloadEstimate, body_of_values, values_of_body};

/// Returns the estimate of a body with these standard deviations of its ten values, in `frame`. It
/// counts no windows, samples or gaps.
pub fn estimate(
    frame: Arc<str>,
    body: MassProperties,
    is_physical: bool,
    of_values: &ValueStdDevs,
    bounding_box: Option<&BoundingBox>,
) -> PayloadEstimate {
    Described::new(body, of_values, bounding_box).estimate(frame, body, is_physical)
}

/// What the standard deviations of the ten values of a body say of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Described {
    observability: [Observability; 10],
    intervals: [[f64; 2]; 10],
    std_devs: [f64; 10],
}

impl Described {
    /// Returns what is reported of a body with these standard deviations.
    pub(crate) fn new(
        body: MassProperties,
        of_values: &ValueStdDevs,
        bounding_box: Option<&BoundingBox>,
    ) -> Self {
        let (values, std_devs) = (values_of_body(&body), of_values.std_devs);
        Self {
            observability: observability(&values, &std_devs, &of_values.observable),
            intervals: intervals(&values, &std_devs, bounding_box),
            std_devs,
        }
    }

    /// Returns the estimate of the body in `frame`. It counts no windows, samples or gaps. It is
    /// inlined, because each copy of an estimate moves 1.3 kB.
    #[inline(always)]
    pub(crate) fn estimate(
        &self,
        frame: Arc<str>,
        body: MassProperties,
        is_physical: bool,
    ) -> PayloadEstimate {
        PayloadEstimate {
            frame,
            body,
            composite: None,
            observability: self.observability,
            intervals: self.intervals,
            covariance: None,
            std_devs: self.std_devs,
            is_physical,
            windows: 0,
            payload_changes: 0,
            since_s: f64::NEG_INFINITY,
            rejected: 0,
            gaps: 0,
        }
    }
}

/// Returns the body with these linear parameters; all values are zero where the mass is.
pub fn body_of(parameters: &Vector) -> MassProperties {
    let properties = InertialParameters::from_vector(*parameters).mass_properties();
    properties.unwrap_or_else(|| body_of_values(&[0.0; 10]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::is_physical;

    /// Of a body that is the known one nothing remains, instead of the whole body.
    #[test]
    fn nothing_remains_of_a_body_without_itself() {
        let known = body_of_values(&[2.0, 0.1, 0.0, 0.2, 0.3, 0.0, 0.0, 0.3, 0.0, 0.3]);
        let known = InertialParameters::from(known);
        let rest = body_of((known - known).as_vector());
        assert_eq!(values_of_body(&rest), [0.0; 10]);
        assert!(!is_physical(&rest));
    }
}
