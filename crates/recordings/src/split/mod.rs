//! Several payloads in one recording: where it is cut.
//!
//! The equations of the wrenches of the whole recording are cut into segments, in each of which one
//! body and one offset of the sensor explain them ([`changes`]); windows that no body explains, as
//! while a gripper closes or sets a body down, are between segments.

mod changes;
mod sums;

use std::path::Path;

use tactid_identify::equations::window::{self, length_s, stride_s};
use tactid_identify::{EquationStream, Method, Sample};
use tactid_logs::{LogReader, Ranges};

use crate::log::LogRecording;
use crate::plan::Plan;
use crate::progress::{open_log, open_ranges};
use crate::run::{Receiver, Run};
use crate::shortage::check_windows;
use crate::{Observer, RecordingError, Request};
use changes::{Windows, segments};

/// Cutoff with which changes are found, Hz: a window then has a tenth of a second.
const CUTOFF_HZ: f64 = 10.0;

/// Number of samples of the slowest stream that a window has at least.
const LEAST_SAMPLES: f64 = 12.0;

/// A part of a recording in which one body is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Time from which on the body is held, a [`Request::begin_s`], s.
    pub begin_s: f64,
    /// Time until which it is held, a [`Request::end_s`], s.
    pub end_s: f64,
}

/// Returns the parts of a log in which the wrenches are those of one body each, in order: where the
/// payload changes, one ends and another one begins. What no body explains for more than a moment,
/// such as the contact while something is grasped, is between them.
///
/// A body is held for one and a half seconds at least. A wrench that is constant while the arm
/// rests, and is not that of the body before or after, may be a contact and makes no segment.
///
/// # Errors
/// Returns [`RecordingError::Data`] if there is no such part, [`RecordingError::Identify`] for
/// unknowns that need a whole recording (a direction of gravity, or a weight that was subtracted),
/// and the errors of [`identify_log`](crate::identify_log).
pub fn split_log(
    path: &Path,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Vec<Segment>, RecordingError> {
    split_opened(open_log(path, observer)?, request, observer)
}

/// Returns the parts of a log that is read by ranges, as [`split_log`] does.
///
/// # Errors
/// Returns the errors of [`split_log`].
pub fn split_ranges(
    path: &Path,
    ranges: &(impl Ranges + Clone + Sync + 'static),
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Vec<Segment>, RecordingError> {
    split_opened(open_ranges(path, ranges, observer)?, request, observer)
}

fn split_opened(
    log: LogReader,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Vec<Segment>, RecordingError> {
    request.check()?;
    request.equation_settings(Method::Tactile).check_known()?;
    let request = Request {
        method: Some(Method::Tactile),
        unloaded: None,
        calibration: None,
        ..request.clone()
    };
    let recording = LogRecording::opened(log, &request, observer)?;
    let mut plan = Plan::new(&recording, &request, observer)?;
    let highest_hz = window::cutoff_hz(LEAST_SAMPLES * plan.period_s);
    let equations = &mut plan.equations;
    equations.cutoff_hz = request.cutoff_hz.unwrap_or(CUTOFF_HZ.min(highest_hz));
    let cutoff_hz = equations.cutoff_hz;
    let (robot, sensors) = (&plan.sources.robot, plan.sensors());
    let stream = EquationStream::new(robot, &plan.tip, &sensors, &plan.equations)?;
    let mut splitter = Splitter {
        stream,
        windows: Windows::default(),
    };
    let run = Run::new(&recording, &plan, &mut splitter, observer)?;
    if run.interrupted {
        return Err(RecordingError::Interrupted);
    }
    let windows = splitter.windows;
    check_windows(windows.times_s.len() as u64, &splitter.stream, &plan, &run)?;
    let found = segments(&windows, stride_s(cutoff_hz))?;
    let of_windows = |(first, last): (usize, usize)| {
        // The first and the last window of a recording are used whole; others, but for their
        // tails, lie in the segment.
        let reach_s = |is_outermost| match is_outermost {
            true => 0.5 * length_s(cutoff_hz),
            false => 0.5 * stride_s(cutoff_hz),
        };
        let is_last = last + 1 == windows.times_s.len();
        Segment {
            begin_s: windows.times_s[first] - reach_s(first == 0),
            end_s: windows.times_s[last] + reach_s(is_last),
        }
    };
    Ok(found.into_iter().map(of_windows).collect())
}

/// Collects the equations of a recording.
struct Splitter {
    stream: EquationStream,
    windows: Windows,
}

impl Receiver for Splitter {
    fn push(&mut self, sample: &Sample<'_>) -> Result<(), RecordingError> {
        if let (_, Some(equation)) = self.stream.push(sample)? {
            self.windows.push(equation);
        }
        Ok(())
    }
}
