//! Payloads identified from joint efforts with a calibration of the arm.

use tactid_calibrate::{CalibrateError, EffortRecording};
use tactid_logs::LogReader;

use super::record::Recorded;
use crate::ArmCalibration;
use crate::arrays::ArrayRecording;
use crate::identification::CalibratedFit;
use crate::log::LogRecording;
use crate::recording::Recording;
use crate::request_checks::{ARRAYS, does_not_apply};
use crate::{
    Arrays, Finding, Identification, Identified, Observer, Progress, RecordingError, Request,
    UnloadedArrays,
};

/// Identifies the payload from a log. The unloaded log of the request updates the calibration.
///
/// # Errors
/// Returns [`RecordingError::InRecording`] if the unloaded log cannot be used, and the errors of an
/// identification by the effort method, of [`Request::check_calibration`] and of the calibration.
pub(crate) fn identify_calibrated_log(
    open: impl FnOnce(&mut Observer<'_>) -> Result<LogReader, RecordingError>,
    request: &Request,
    calibration: &ArmCalibration,
    observer: &mut Observer<'_>,
) -> Result<Identified, RecordingError> {
    let efforts = request_with(request, calibration)?;
    let unloaded = match &request.unloaded {
        Some(unloaded) => {
            let read = LogRecording::open(unloaded, &efforts, observer);
            let windows =
                read.and_then(|log| unloaded_windows(&log, &efforts, calibration, observer));
            Some(windows.map_err(|error| error.in_recording(unloaded))?)
        }
        None => None,
    };
    let log = open(observer).and_then(|log| LogRecording::opened(log, &efforts, observer));
    let log = log.map_err(|error| of_the_tool(error, request, calibration))?;
    identify(&log, &efforts, calibration, unloaded, observer)
}

/// Identifies the payload from arrays. Their unloaded reference updates the calibration.
///
/// # Errors
/// Returns the errors of an identification by the effort method, of [`Request::check_calibration`]
/// and of the calibration.
pub(crate) fn identify_calibrated_arrays(
    arrays: &Arrays<'_>,
    request: &Request,
    calibration: &ArmCalibration,
    observer: &mut Observer<'_>,
) -> Result<Identified, RecordingError> {
    if request.unloaded.is_some() {
        return Err(does_not_apply("unloaded", ARRAYS));
    }
    let efforts = request_with(request, calibration)?;
    let unloaded = match &arrays.unloaded {
        Some(reference) => {
            let samples = ArrayRecording::new(&alone(reference, arrays), &efforts)?;
            Some(unloaded_windows(&samples, &efforts, calibration, observer)?)
        }
        None => None,
    };
    let loaded = Arrays {
        unloaded: None,
        ..*arrays
    };
    let samples = ArrayRecording::new(&loaded, &efforts)?;
    identify(&samples, &efforts, calibration, unloaded, observer)
}

/// Returns the request of a recording for a calibration, whose tool is the tip unless the request
/// names one.
fn request_with(
    request: &Request,
    calibration: &ArmCalibration,
) -> Result<Request, RecordingError> {
    request.check_calibration()?;
    let tool = calibration.model.tool.clone();
    Ok(Request {
        tip: Some(request.tip.clone().unwrap_or(tool)),
        ..request.for_efforts(&calibration.settings())
    })
}

/// Returns the error that the calibration is of another robot where this has no link of the name of
/// the calibration's tool.
fn of_the_tool(
    error: RecordingError,
    request: &Request,
    calibration: &ArmCalibration,
) -> RecordingError {
    match error {
        RecordingError::Tip(_) if request.tip.is_none() => {
            CalibrateError::other_robot("tool", &calibration.model.tool, "").into()
        }
        other => other,
    }
}

/// Returns an unloaded reference as a recording of its own, of the robot of the loaded arrays.
fn alone<'a>(reference: &UnloadedArrays<'a>, loaded: &Arrays<'a>) -> Arrays<'a> {
    Arrays {
        robot: loaded.robot,
        time: reference.time,
        q: reference.q,
        effort: reference.effort,
        ..Arrays::default()
    }
}

/// Reads an unloaded recording, without progress.
fn unloaded_windows(
    recording: &impl Recording,
    request: &Request,
    calibration: &ArmCalibration,
    observer: &mut Observer<'_>,
) -> Result<EffortRecording, RecordingError> {
    check(recording, request, calibration)?;
    let mut interrupted = false;
    let mut silent = |_| {
        let flow = observer(Progress { fraction: 0.0 });
        interrupted |= flow.is_break();
        flow
    };
    let recorded = Recorded::new(recording, request, &calibration.settings(), &mut silent)?;
    if interrupted {
        return Err(RecordingError::Interrupted);
    }
    calibration.report.check_unloaded(&recorded.windows)?;
    Ok(recorded.windows)
}

fn identify(
    recording: &impl Recording,
    request: &Request,
    calibration: &ArmCalibration,
    unloaded: Option<EffortRecording>,
    observer: &mut Observer<'_>,
) -> Result<Identified, RecordingError> {
    check(recording, request, calibration)?;
    let Recorded { plan, run, windows } =
        Recorded::new(recording, request, &calibration.settings(), observer)?;
    let joints = windows.joint_names().to_vec();
    let used = calibration.report.used(&windows);
    let settings = plan.batch_settings();
    let found = calibration
        .model
        .identify(&[windows], unloaded.as_slice(), &settings)?;
    let fit = CalibratedFit {
        joints,
        misfit: found.misfit,
        noise_fraction: found.noise_fraction,
        updated_by_unloaded: unloaded.is_some() && found.unloaded_left_out.is_none(),
        friction_change: found.friction_change,
        gain_change: found.gain_change,
    };
    let contradictions = calibration.report.contradictions.iter().cloned();
    let contradictions = contradictions.map(Finding::CalibrationContradicted);
    let moved = found.moved_zero.map(|zero| Finding::JointZeroMoved {
        joint: zero.joint,
        size: zero.size,
        std_dev: zero.std_dev,
    });
    let used = used.map(|used| Finding::RecordingCalibrated {
        is_loaded: used.is_loaded,
    });
    let left_out = found.unloaded_left_out;
    let left_out = left_out.map(|noise_ratio| Finding::UnloadedLeftOut { noise_ratio });
    let shortages = &calibration.report.shortages;
    let mut identified = Identification::of_calibrated(plan, run, found.result, fit, shortages);
    identified
        .recording
        .findings
        .extend(contradictions.chain(moved).chain(left_out).chain(used));
    Ok(Identified::LeastSquares(Box::new(identified)))
}

/// Checks that the calibration is of the robot of a recording.
fn check(
    recording: &impl Recording,
    request: &Request,
    calibration: &ArmCalibration,
) -> Result<(), RecordingError> {
    let tip = request.tip.as_deref().unwrap_or(&calibration.model.tool);
    Ok(calibration.model.check(&recording.sources().robot, tip)?)
}
