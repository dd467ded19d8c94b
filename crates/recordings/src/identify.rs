//! Identification from a log or from arrays.

use std::path::Path;

use tactid_logs::{LogReader, Ranges};

use crate::arrays::ArrayRecording;
use crate::calibration::{identify_calibrated_arrays, identify_calibrated_log};
use crate::log::LogRecording;
use crate::paper_identification::PaperRun;
use crate::parallel::in_parallel;
use crate::plan::Plan;
use crate::progress::{open_log, open_ranges};
use crate::readings::contradicted_reading;
use crate::recording::Recording;
use crate::run::Run;
use crate::same_log::same_log;
use crate::{Arrays, EstimatorKind, Identification, Identified, Observer, RecordingError, Request};

/// Identifies the payload from a log: the folder of a rosbag2 bag, or an `.mcap` or `.db3` file.
///
/// Topics are found by type, unless the request names them. Several topics of wrenches are summed
/// without being named only where they are those of fingers, see [`Request::wrench_topic`]. The
/// motion is that of the joints of a URDF (from the request or the log), on a base that odometry
/// measures if there is any; or, without joints, that of the sensor itself by odometry (and by its
/// measured accelerations, if these explain the wrenches better) or by an inertial unit. Times are
/// those of the headers, or those of logging where stamps are zero.
///
/// Memory is bounded, whatever the length of the log. The observer is called several times a
/// second.
///
/// # Errors
/// Returns [`RecordingError::Log`] if the log cannot be opened, [`RecordingError::Identify`] if a
/// value of the request is out of range, [`RecordingError::Option`] if it does not fit the log or
/// the other values, [`RecordingError::NoOverlap`] if the streams share no time,
/// [`RecordingError::Interrupted`] if the observer stops the work before there is enough for an
/// estimate, and [`RecordingError::Data`] or [`RecordingError::Tip`] if the log lacks what the
/// method needs or contradicts its own URDF.
///
/// Too little data are [`RecordingError::Data`] where it is known why: most stamps are far from the
/// times of logging, most times do not increase, gaps leave no stretch for a window, or samples
/// come too seldom for the cutoff. Otherwise they are
/// [`TooLittle`](tactid_identify::IdentifyError::TooLittle) in [`RecordingError::Identify`]. Of a
/// log that is damaged, each is in [`RecordingError::DamagedEarly`].
///
/// Messages that cannot be used are no error, but are counted in
/// [`faults`](crate::RecordingReport::faults); a log that ends early is used up to its end, see
/// [`damage`](crate::RecordingReport::damage). If the observer stops the reading, what was read so
/// far is identified, unless it is too little.
pub fn identify_log(
    path: &Path,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Identified, RecordingError> {
    identify_opened(|observer| open_log(path, observer), request, observer)
}

/// Identifies the payload from an MCAP log whose bytes are read by ranges, such as an object in a
/// store, as [`identify_log`] does from a file. Errors name the log by `path`.
///
/// # Errors
/// Returns the errors of [`identify_log`].
pub fn identify_ranges(
    path: &Path,
    ranges: &(impl Ranges + Clone + Sync + 'static),
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Identified, RecordingError> {
    let open = |observer: &mut Observer<'_>| open_ranges(path, ranges, observer);
    identify_opened(open, request, observer)
}

fn identify_opened(
    open: impl FnOnce(&mut Observer<'_>) -> Result<LogReader, RecordingError>,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Identified, RecordingError> {
    request.check()?;
    let shape = request.read_shape()?;
    let found = match &request.calibration {
        Some(calibration) => identify_calibrated_log(open, request, calibration, observer)?,
        None => {
            let recording = LogRecording::opened(open(observer)?, request, observer)?;
            identify(&recording, request, observer)?
        }
    };
    found.with_shape(shape.as_ref())
}

/// Identifies one payload from several logs, each on its own and with the same request, for
/// [`combine`](crate::combine).
///
/// Each log has its own topics, cutoff, delay and findings, and the prior knowledge of the request.
/// An unloaded reference is that of all logs, and must have the motion of each. As many logs are
/// identified at once as there are cores, so that memory is that of one log for each core and of
/// the results. The observer is called on this thread with the fraction of all logs. Where it stops
/// the reading, the logs that follow the first one that was stopped are left out;
/// [`RecordingError::Interrupted`] is returned if too little of that one was read.
///
/// # Errors
/// Returns [`RecordingError::InRecording`] with the error of the first log that cannot be
/// identified, as [`identify_log`] lists them, [`RecordingError::Identify`] for an option that no
/// recording could use, [`RecordingError::Option`] for the paper's filter, which cannot weight
/// several logs, and [`RecordingError::Together`] if two paths are the same log: its noise would
/// count as agreement. A copy of a log gives the same result, which [`combine`](crate::combine)
/// refuses.
pub fn identify_logs<P: AsRef<Path>>(
    paths: &[P],
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Vec<Identification>, RecordingError> {
    if let Some((first, second)) = same_log(paths) {
        let both = [first, second].map(|index| paths[index].as_ref());
        return Err(RecordingError::same_recording(
            both,
            "its noise would count as agreement",
        ));
    }
    request.check()?;
    if request.estimator == Some(EstimatorKind::Nlms) {
        return Err(not_by_the_filter());
    }
    let paths: Vec<&Path> = paths.iter().map(AsRef::as_ref).collect();
    let identify_one = |index: usize, observer: &mut Observer<'_>| {
        let run = identify_log(paths[index], request, observer);
        let run = run.map_err(|error| error.in_recording(paths[index]))?;
        let run = run.into_least_squares();
        run.ok_or_else(not_by_the_filter)
    };
    let is_last = |run: &Identification| run.recording.interrupted;
    in_parallel(paths.len(), observer, identify_one, is_last)
}

/// Returns the error of several recordings that the paper's filter is to identify.
fn not_by_the_filter() -> RecordingError {
    RecordingError::Option {
        option: "estimator",
        what: "`estimator` must be least squares for several recordings, because the paper's filter estimates no uncertainty by \
                 which they could be weighted"
            .into(),
    }
}

/// Identifies the payload from arrays, with the checks and the defaults of [`identify_log`].
///
/// The observer is called every 4096 samples. Where it stops the reading, what was read so far is
/// identified, unless it is too little.
///
/// # Errors
/// Returns [`RecordingError::Option`] if the request asks for what only a log has or does not fit
/// the robot, [`RecordingError::Arrays`] if the arrays do not fit each other, the robot or the
/// method, [`RecordingError::Tip`] if the robot does not have the end-effector frame,
/// [`RecordingError::Data`] if the unloaded reference does not fit, [`RecordingError::Identify`] if
/// a value of the request is out of range, [`RecordingError::NoOverlap`] if no sample has all
/// values, and the errors of too little data that [`identify_log`] lists.
///
/// Values that are not finite and times that do not increase are no error, but are counted in
/// [`faults`](crate::RecordingReport::faults) under the name of the array.
pub fn identify_arrays(
    arrays: &Arrays<'_>,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Identified, RecordingError> {
    request.check()?;
    let shape = request.read_shape()?;
    let found = match &request.calibration {
        Some(calibration) => identify_calibrated_arrays(arrays, request, calibration, observer)?,
        None => identify(&ArrayRecording::new(arrays, request)?, request, observer)?,
    };
    found.with_shape(shape.as_ref())
}

fn identify(
    recording: &impl Recording,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Identified, RecordingError> {
    let plan = Plan::new(recording, request, observer)?;
    match plan.estimator {
        EstimatorKind::LeastSquares => {
            let mut batch = plan.batch_identifier()?;
            let run = Run::new(recording, &plan, &mut batch, observer)?;
            let mut found = Identification::new(plan.clone(), run, &batch)?;
            if found.motion_is_contradicted() {
                found.remove_causes();
            } else if found.follows_from_reading() {
                let left = found.left_by_cause();
                let reading = contradicted_reading(recording, &plan, left, observer)?;
                found.replace_consequences(reading);
            }
            Ok(Identified::LeastSquares(Box::new(found)))
        }
        EstimatorKind::Nlms => {
            let mut filter = PaperRun::new(&plan)?;
            let run = Run::new(recording, &plan, &mut filter, observer)?;
            Ok(Identified::Paper(Box::new(filter.finish(plan, run)?)))
        }
    }
}
