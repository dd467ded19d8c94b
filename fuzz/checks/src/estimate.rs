//! What must hold for every estimate of a payload.

use nalgebra::{Matrix3, SymmetricEigen};
use tactid_dynamics::MassProperties;
use tactid_identify::{Observability, PayloadEstimate, values_of_body};
use tactid_recordings::Identified;

/// Tolerance of a body that can exist, as a fraction of its largest principal moment.
const TOLERANCE: f64 = 0.0101;

/// Asserts what must hold for the estimate of a recording.
///
/// # Panics
/// Panics if it does not hold.
pub(crate) fn assert_identified(found: &Identified) {
    match found {
        Identified::LeastSquares(found) => assert_estimate(&found.estimate),
        Identified::Paper(found) => assert_body(&found.estimate.body, found.estimate.is_physical),
    }
}

/// Asserts that the ten values are finite, that a body that is reported as physical can exist, that
/// standard deviations are not negative, and infinite for values without information alone, and
/// that the limits of each interval are in order.
///
/// # Panics
/// Panics if one of these does not hold.
pub(crate) fn assert_estimate(estimate: &PayloadEstimate) {
    let values = estimate.values();
    assert_body(&estimate.body, estimate.is_physical);
    let of_values = estimate.std_devs.into_iter().zip(estimate.observability);
    for ((std_dev, observability), value) in of_values.zip(values) {
        assert!(std_dev >= 0.0, "{std_dev} of {value}");
        let is_known = observability == Observability::Identifiable;
        assert!(
            std_dev.is_finite() || !is_known,
            "an identifiable value without a standard deviation"
        );
        assert!(
            std_dev.is_infinite() || observability != Observability::Unobservable,
            "{std_dev} of a value that is unobservable"
        );
    }
    for [lower, upper] in &estimate.intervals {
        assert!(lower <= upper, "{lower} to {upper}");
    }
}

/// Asserts that the ten values are finite, and that a body that is reported as physical can exist.
fn assert_body(body: &MassProperties, is_physical: bool) {
    let values = values_of_body(body);
    assert!(values.iter().all(|value| value.is_finite()), "{values:?}");
    if is_physical {
        assert_body_exists(body.mass_kg, &body.inertia);
    }
}

/// Asserts that mass and principal moments are those of a body.
fn assert_body_exists(mass_kg: f64, inertia: &Matrix3<f64>) {
    assert!(mass_kg >= 0.0, "{mass_kg} kg");
    let moments = SymmetricEigen::new(*inertia).eigenvalues;
    let (least, largest) = (moments.min(), moments.max());
    let slack = TOLERANCE * largest.abs();
    assert!(least >= -slack, "{moments}");
    assert!(moments.sum() - 2.0 * largest >= -slack, "{moments}");
}
