//! The error type of the crate.

use thiserror::Error;

/// A setting lies outside the range in which its estimator or detector works.
///
/// Each variant holds the value that was given, in the unit of the setting that it names.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum SettingError {
    /// The step size μ of [`Lms`](crate::Lms) is not positive and finite.
    #[error("step is {0}, but must lie in (0, inf)")]
    Step(f64),
    /// The step size α of [`Nlms`](crate::Nlms) violates the condition below (54).
    #[error("alpha is {0}, but must lie in (0, 2)")]
    Alpha(f64),
    /// The regularisation β of [`Nlms`](crate::Nlms) violates the condition below (54).
    #[error("beta is {0}, but must lie in (0, 1)")]
    Beta(f64),
    /// [`ChangeSettings::rows_between_false_alarms`](crate::ChangeSettings::rows_between_false_alarms)
    /// is not greater than one and finite.
    #[error("rows_between_false_alarms is {0}, but must lie in (1, inf)")]
    RowsBetweenFalseAlarms(f64),
    /// [`ChangeSettings::correlation_rows`](crate::ChangeSettings::correlation_rows) is less than
    /// one or not finite.
    #[error("correlation_rows is {0}, but must lie in [1, inf)")]
    CorrelationRows(f64),
    /// [`ChangeSettings::shift`](crate::ChangeSettings::shift) is not positive and finite.
    #[error("shift is {0}, but must lie in (0, inf)")]
    Shift(f64),
    /// [`ChangeSettings::growth`](crate::ChangeSettings::growth) is not greater than one and finite.
    #[error("growth is {0}, but must lie in (1, inf)")]
    Growth(f64),
    /// [`ChangeSettings::clip`](crate::ChangeSettings::clip) is not positive and finite.
    #[error("clip is {0}, but must lie in (0, inf)")]
    Clip(f64),
}

/// Returns `error` unless the setting is `valid`. Comparisons with NaN are false, so NaN is refused.
pub(crate) fn ensure(valid: bool, error: SettingError) -> Result<(), SettingError> {
    if valid { Ok(()) } else { Err(error) }
}
