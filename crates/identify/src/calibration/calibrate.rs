//! Calibration of an arm from recordings.

use std::ops::ControlFlow;

use super::arm::PLAIN;
use super::contradiction::contradiction;
use super::fit::{MOVES, fit};
use super::interruption::InterruptionCheck;
use super::payload::KnownPayload;
use super::plausibility::{check_gains, improbable_gain};
use super::recording::{EffortRecording, check_settings};
use super::reference::reference_fit;
use super::report::{CalibrationResult, report};
use super::settings::CalibrationSettings;
use crate::IdentifyError;

/// Fewest windows of a calibration: 3 s at 2 Hz.
const MIN_WINDOWS: usize = 20;

/// Calibrates an arm from recordings, each without payload (`None`) or with a payload of which something is known.
///
/// Cost: some seconds for an hour of recordings. The noise is chosen on at most 2000 windows.
///
/// # Errors
/// Returns [`IdentifyError::TooFewWindows`] if the recordings have fewer than twenty windows in all,
/// [`IdentifyError::NoMotion`] if no joint moves, [`IdentifyError::NoEfforts`] if all efforts are constant,
/// [`IdentifyError::EffortConstant`] or [`IdentifyError::EffortReversed`] if those of one joint are constant while it moves
/// or have the opposite sign, [`IdentifyError::GainUnexpected`] or [`IdentifyError::GainsUnexpected`] if gains differ
/// from the given ones by more than five standard deviations and 10 %, [`IdentifyError::EffortDelay`] if the efforts lag
/// or lead the motion by more than an eighth of a window,
/// [`IdentifyError::CalibrationRobot`] or [`IdentifyError::CalibrationMismatch`] if the recordings are of different robots
/// or have other cutoffs or gravity than the settings, [`IdentifyError::Value`] if a setting or a known payload is out of
/// range, [`IdentifyError::GainsNotPositive`] if gains come out negative, and [`IdentifyError::CalibrationFailed`] if the numbers are
/// too large to be solved for.
pub fn calibrate(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
) -> Result<CalibrationResult, IdentifyError> {
    calibrate_interruptibly(recordings, settings, &mut || ControlFlow::Continue(()))
}

/// Calibrates an arm as [`calibrate()`] does, and calls `check` several times a second, which may stop the work.
///
/// # Errors
/// Returns [`IdentifyError::Interrupted`] where `check` returns [`ControlFlow::Break`], and the errors of [`calibrate()`].
pub fn calibrate_interruptibly(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
    check: &mut InterruptionCheck<'_>,
) -> Result<CalibrationResult, IdentifyError> {
    settings.check()?;
    check_recordings(recordings, settings)?;
    for (recording, payload) in recordings {
        recording.check_efforts(payload.as_ref())?;
    }
    let given: Vec<_> = recordings.iter().map(|(r, held)| (r, *held)).collect();
    let reference = reference_fit(&given)?;
    let plain = fit(&given, &reference, vec![PLAIN], settings, check)?;
    let curved = fit(&given, &reference, vec![0, 1, 2], settings, check)?;
    let best = if curved.log_evidence > plain.log_evidence {
        curved
    } else {
        plain
    };
    let mut report = report(&given, &best, settings)?;
    check_gains(&report.joints, settings.gain_std_dev)?;
    let improbable = improbable_gain(&report.joints, settings.gain_std_dev);
    let residuals = contradiction(&given, &best)?;
    report.contradictions = improbable.into_iter().chain(residuals).collect();
    Ok(CalibrationResult {
        calibration: best.calibration(&given[0].0.arm)?,
        report,
    })
}

/// Checks that recordings can be combined, are long enough, and show a motion.
fn check_recordings(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
) -> Result<(), IdentifyError> {
    let mut windows = 0;
    let mut max_velocity: f64 = 0.0;
    for (recording, payload) in recordings {
        payload.map_or(Ok(()), |payload| payload.check())?;
        recordings[0].0.check_same(recording)?;
        check_settings(
            (settings.cutoff_hz, recording.arm.cutoff_hz),
            (
                settings.gravity().as_slice(),
                recording.arm.gravity.as_slice(),
            ),
        )?;
        windows += recording.windows();
        for joint in 0..recording.arm.joints.len() {
            let [positive, negative] = recording.max_velocities(joint);
            max_velocity = max_velocity.max(positive).max(negative);
        }
    }
    if windows < MIN_WINDOWS {
        let window_s = recordings.first().map_or(0.0, |(r, _)| r.window_s());
        return Err(IdentifyError::TooFewWindows { windows, window_s });
    }
    if max_velocity < MOVES {
        return Err(IdentifyError::NoMotion { max_velocity });
    }
    Ok(())
}
