//! Interruption of a calibration by its caller.

use std::ops::ControlFlow;

use crate::CalibrateError;

/// Callback that stops a calibration by returning [`ControlFlow::Break`].
pub type InterruptionCheck<'a> = dyn FnMut() -> ControlFlow<()> + 'a;

/// Returns an error if the caller interrupts the work.
pub(crate) fn check_interruption(check: &mut InterruptionCheck<'_>) -> Result<(), CalibrateError> {
    match check() {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(CalibrateError::Interrupted),
    }
}
