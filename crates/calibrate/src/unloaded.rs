//! Which unloaded recordings update a calibration.

use tactid_identify::solve::HALF_WIDTH_95;

use super::posterior::Posterior;
use super::recording::EffortRecording;
use crate::CalibrateError;

/// Unloaded recordings hold a payload if its mass is more than this number of standard deviations,
/// and the mean squares of the residuals without it are more than this multiple of those with it.
const HELD_STD_DEVS: f64 = 5.0;
const HELD_MISFIT: f64 = 2.0;

/// Unloaded recordings are left out if the mean squares of the residuals with them are more than
/// this multiple of those without them. On six simulated arms like a UR10, with friction that
/// differs by 2 % between the recordings, this multiple is two to five, and the mass is as exact
/// with the unloaded recording as without it; with 5 %, it is fifteen to twenty-five, the intervals
/// of the mass are twice as wide and their errors four times as large.
const LEFT_OUT_MISFIT: f64 = 6.0;

/// A calibration that unloaded recordings have updated, where they fit the loaded ones.
pub(super) struct Update<'a> {
    /// Payload of the loaded recordings, without a known mass.
    pub(super) free: Posterior,
    /// The unloaded recordings that are used.
    pub(super) unloaded: &'a [EffortRecording],
    /// Noise that the efforts would have with the unloaded recordings, relative to that without
    /// them, where they are left out.
    pub(super) left_out: Option<f64>,
}

/// Checks that unloaded recordings hold nothing, and leaves them out where the arm is not in the
/// state in which it was in the loaded ones. A payload or a change of the arm between the
/// recordings makes the residuals of both large. `together` is the solution of all recordings with
/// nothing in the unloaded ones; `alone` solves for the payload of some recordings, and is called
/// only where that solution leaves much unexplained.
///
/// # Errors
/// Returns [`CalibrateError::UnloadedHolds`] where a payload in the unloaded recordings explains
/// far more than a change of the arm does, and the errors of `alone`.
pub(super) fn update<'a>(
    together: Posterior,
    loaded: &'a [EffortRecording],
    unloaded: &'a [EffortRecording],
    alone: impl Fn(&'a [EffortRecording]) -> Result<Posterior, CalibrateError>,
) -> Result<Update<'a>, CalibrateError> {
    let misfit = largest_misfit(&together);
    let used = |free| Update {
        free,
        unloaded,
        left_out: None,
    };
    if unloaded.is_empty() || misfit <= HELD_MISFIT {
        return Ok(used(together));
    }
    let of_loaded = alone(loaded)?;
    let worse = misfit / largest_misfit(&of_loaded);
    if worse <= HELD_MISFIT {
        return Ok(used(together));
    }
    let held = alone(unloaded)?;
    let (mass_kg, std_dev_kg) = (held.parameters[0], held.mass_std_dev());
    if mass_kg > HELD_STD_DEVS * std_dev_kg && misfit > HELD_MISFIT * largest_misfit(&held) {
        return Err(CalibrateError::UnloadedHolds {
            mass_kg,
            half_width_kg: HALF_WIDTH_95 * std_dev_kg,
        });
    }
    Ok(if worse > LEFT_OUT_MISFIT {
        Update {
            free: of_loaded,
            unloaded: &[],
            left_out: Some(worse.sqrt()),
        }
    } else {
        used(together)
    })
}

/// Returns the largest mean square of a joint's whitened residual, at least the mean square of the
/// calibration's noise.
fn largest_misfit(of: &Posterior) -> f64 {
    of.misfit.iter().copied().fold(1.0, f64::max)
}
