//! Check that a recording without payload holds none.

use tactid_batch::BatchSettings;
use tactid_calibrate::{CalibrateError, Calibration, EffortComparison, EffortRecording};
use tactid_identify::{HALF_WIDTH_95, IdentifyError};

/// A recording holds a payload if its mass is more than this number of standard deviations, and the
/// mean square of the residuals of some joint without it is more than this multiple of that with
/// it.
const HELD_STD_DEVS: f64 = 5.0;
const HELD_RATIO: f64 = 4.0;

/// Checks that a recording holds nothing. `comparison` is that without payload.
///
/// # Errors
/// Returns [`CalibrateError::UnloadedHolds`] if a payload explains far more of the recording than a
/// change of the arm does, and the errors of [`Calibration::identify`] but for a recording that is
/// too short.
pub(super) fn check_empty(
    model: &Calibration,
    recording: &EffortRecording,
    comparison: &EffortComparison,
) -> Result<(), CalibrateError> {
    let settings = BatchSettings::default();
    let found = match model.identify(std::slice::from_ref(recording), &[], &settings) {
        Ok(found) => found,
        // What is too short for a payload is only compared.
        Err(CalibrateError::Identify(IdentifyError::TooLittle(_))) => return Ok(()),
        Err(error) => return Err(error),
    };
    let is_determined = found.result.estimate.std_devs[0].is_finite();
    let std_dev_kg = found.covariance[(0, 0)].sqrt();
    let mass_kg = found.parameters[0];
    let count = comparison.times_s.len() as f64;
    let joints = comparison.joints.len();
    let is_worse = |joint: usize| {
        let pairs = comparison.measured.iter().zip(&comparison.calibrated);
        let of_joint = pairs.skip(joint).step_by(joints);
        let squares: f64 = of_joint.map(|(a, b)| (a - b).powi(2)).sum();
        squares / count > HELD_RATIO * found.result.fit.residual_rms[joint].powi(2)
    };
    let is_significant = is_determined && mass_kg > HELD_STD_DEVS * std_dev_kg;
    if is_significant && (0..joints).any(is_worse) {
        return Err(CalibrateError::UnloadedHolds {
            mass_kg,
            half_width_kg: HALF_WIDTH_95 * std_dev_kg,
        });
    }
    Ok(())
}
