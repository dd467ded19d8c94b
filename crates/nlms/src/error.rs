//! The error type of the crate.

use thiserror::Error;

/// A setting lies outside the range in which its estimator or detector works.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("`{name}` is {given}, but must lie in {expected}")]
pub struct SettingError {
    /// Name of the argument or field.
    pub name: &'static str,
    /// Its value, in the unit of the setting.
    pub given: f64,
    /// The interval in which it must lie.
    pub expected: &'static str,
}

/// Returns an error unless the setting is `valid`. Comparisons with NaN are false, so NaN is
/// refused.
pub(crate) fn ensure(
    valid: bool,
    name: &'static str,
    given: f64,
    expected: &'static str,
) -> Result<(), SettingError> {
    let error = SettingError {
        name,
        given,
        expected,
    };
    if valid { Ok(()) } else { Err(error) }
}
