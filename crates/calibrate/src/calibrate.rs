//! Calibration of an arm from recordings.

use std::ops::ControlFlow;

use tactid_dynamics::words::three_digits;
use tactid_identify::IdentifyError;

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
use super::similar_robot::doubtful_links;
use crate::CalibrateError;

/// Fewest windows of a calibration: 3 s at 2 Hz.
const MIN_WINDOWS: usize = 20;

/// Most repetitions of a calibration with gains far from the given ones, with efforts times the
/// gains of the one before, and the ratio of gains of two repetitions below which they are found.
/// The noise of a fit with gains far off is so large that its gains stay near the given ones:
/// currents in mA of an arm like a UR10 take six repetitions.
const REPETITIONS: usize = 10;
const FOUND_RATIO: f64 = 1.05;

/// Calibrates an arm from recordings, each without payload (`None`) or with a partly known one.
///
/// Cost: some seconds for an hour of recordings, and up to eleven times as long, with a copy of the
/// recordings, where gains differ so much from the given ones that they are an error, which has the
/// gains that fit. The noise is chosen on at most 2000 windows.
///
/// # Errors
/// Returns [`IdentifyError::TooLittle`] if the recordings have fewer than twenty windows in all,
/// [`IdentifyError::Option`] if a setting or a known payload is out of range,
/// [`CalibrateError::Robot`] if the recordings are of different robots or have other cutoffs or
/// gravity than the settings, [`CalibrateError::GainsUnexpected`] if gains differ from the given
/// ones by more than five standard deviations and 10 %, and [`CalibrateError::Data`] if no joint
/// moves, the efforts of a joint are constant while it moves or have the opposite sign, the efforts
/// lag or lead the motion by more than an eighth of a window, gains come out negative, or numbers
/// are too large to be solved for.
pub fn calibrate(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
) -> Result<CalibrationResult, CalibrateError> {
    calibrate_interruptibly(recordings, settings, &mut || ControlFlow::Continue(()))
}

/// Calibrates an arm as [`calibrate()`] does. Several times a second, `check` may stop the work.
///
/// # Errors
/// Returns [`CalibrateError::Interrupted`] where `check` returns [`ControlFlow::Break`], and the
/// errors of [`calibrate()`].
pub fn calibrate_interruptibly(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
    check: &mut InterruptionCheck<'_>,
) -> Result<CalibrationResult, CalibrateError> {
    settings.check()?;
    check_recordings(recordings, settings)?;
    for (recording, payload) in recordings {
        recording.check_efforts(payload.as_ref())?;
    }
    let (mut error, gains) = match calibrate_once(recordings, settings, check) {
        Err(error) => match unexpected_gains(&error).map(<[f64]>::to_vec) {
            Some(gains) => (error, gains),
            None => return Err(error),
        },
        result => return result,
    };
    let found = fitting_gains(recordings, settings, gains, check)?;
    let joints = recordings[0].0.joint_names();
    if let CalibrateError::GainsUnexpected {
        joint, gain, gains, ..
    } = &mut error
    {
        let logs: f64 = found.iter().map(|gain| gain.ln()).sum();
        let mean = (logs / found.len() as f64).exp();
        let of_joint = |joint| {
            joints
                .iter()
                .position(|name| name == joint)
                .map(|k| found[k])
        };
        *gain = joint.as_ref().and_then(of_joint).unwrap_or(mean);
        *gains = found;
    }
    Err(error)
}

/// Returns the gains that an error proposes, if it is about gains.
fn unexpected_gains(error: &CalibrateError) -> Option<&[f64]> {
    match error {
        CalibrateError::GainsUnexpected { gains, .. } => Some(gains),
        _ => None,
    }
}

/// Repeats a calibration with efforts times `gains`, which it improves, and returns those that fit.
fn fitting_gains(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
    mut gains: Vec<f64>,
    check: &mut InterruptionCheck<'_>,
) -> Result<Vec<f64>, CalibrateError> {
    for _ in 0..REPETITIONS {
        let recordings = recordings.iter();
        let scaled: Vec<_> = recordings
            .map(|(recording, payload)| (recording.with_gains(&gains), *payload))
            .collect();
        let factors: Vec<f64> = match calibrate_once(&scaled, settings, check) {
            Ok(result) => result
                .report
                .joints
                .iter()
                .map(|joint| joint.gain)
                .collect(),
            Err(CalibrateError::Interrupted) => return Err(CalibrateError::Interrupted),
            Err(error) => match unexpected_gains(&error) {
                Some(factors) => factors.to_vec(),
                // The gains of the repetition before are the best there are.
                None => break,
            },
        };
        let pairs = gains.iter_mut().zip(&factors);
        pairs.for_each(|(gain, factor)| *gain *= factor);
        if factors
            .iter()
            .all(|factor| factor.ln().abs() < FOUND_RATIO.ln())
        {
            break;
        }
    }
    Ok(gains)
}

/// Calibrates an arm once, from recordings that can calibrate it.
fn calibrate_once(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
    check: &mut InterruptionCheck<'_>,
) -> Result<CalibrationResult, CalibrateError> {
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
    // Other wrong assumptions bend the links.
    if report.contradictions.is_empty() {
        let recordings: Vec<_> = given.iter().map(|(recording, _)| *recording).collect();
        let doubtful = doubtful_links(&recordings, &best, &report.links)?;
        report.contradictions.extend(doubtful);
    }
    Ok(CalibrationResult {
        calibration: best.calibration(&given[0].0.arm)?,
        report,
    })
}

/// Checks that recordings can be combined, are long enough, and show a motion.
fn check_recordings(
    recordings: &[(EffortRecording, Option<KnownPayload>)],
    settings: &CalibrationSettings,
) -> Result<(), CalibrateError> {
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
        return Err(IdentifyError::too_few_windows(windows, window_s).into());
    }
    if max_velocity < MOVES {
        return Err(CalibrateError::Data(format!(
            "no joint moves in the recordings (the fastest reaches {} rad/s or m/s): record a motion of all joints in both \
             directions",
            three_digits(max_velocity)
        )));
    }
    Ok(())
}
