//! Checks of numbers that a caller gives.

use crate::ExcitationError;

/// Largest coordinate and size of a shape, m: beyond it, distances lose their digits.
pub const LARGEST_SIZE_M: f64 = 1e6;

/// Returns an error for a number that is not finite and positive.
pub(crate) fn positive(name: &str, given: f64) -> Result<(), ExcitationError> {
    let is_valid = given > 0.0 && given.is_finite();
    value(name, given, is_valid, "a finite number above zero")
}

/// Returns an error for a value that is out of range.
pub(crate) fn value(
    name: &str,
    given: f64,
    is_valid: bool,
    expected: &str,
) -> Result<(), ExcitationError> {
    if is_valid {
        return Ok(());
    }
    Err(ExcitationError::Value {
        name: name.to_owned(),
        given,
        expected: expected.to_owned(),
    })
}
