//! Progress of an identification, and its interruption by the user.

use std::ops::ControlFlow;
use std::path::Path;

use tactid_logs::{LogError, LogReader, Ranges};

use crate::RecordingError;

/// Progress of an identification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Fraction of the recording that has been read, over all presentations: 0 to 1.
    pub fraction: f64,
}

/// Callback that receives the progress several times a second, and interrupts the work by returning
/// [`ControlFlow::Break`].
pub type Observer<'a> = dyn FnMut(Progress) -> ControlFlow<()> + 'a;

/// Lets the observer interrupt the work that comes before the recording is read, which leaves no
/// result.
pub(crate) fn check_interruption(observer: &mut Observer<'_>) -> Result<(), RecordingError> {
    match observer(Progress { fraction: 0.0 }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(RecordingError::Interrupted),
    }
}

/// Opens a log, unless the observer interrupts it: a log without index is read to its end.
pub(crate) fn open_log(
    path: &Path,
    observer: &mut Observer<'_>,
) -> Result<LogReader, RecordingError> {
    let opened = LogReader::open_watched(path, &mut || observer(Progress { fraction: 0.0 }));
    opened.map_err(of_opening)
}

/// Opens an MCAP log by ranges, unless the observer interrupts it.
pub(crate) fn open_ranges(
    path: &Path,
    ranges: &(impl Ranges + Clone + Sync + 'static),
    observer: &mut Observer<'_>,
) -> Result<LogReader, RecordingError> {
    let mut watch = || observer(Progress { fraction: 0.0 });
    LogReader::of_ranges(path, ranges.clone(), &mut watch).map_err(of_opening)
}

fn of_opening(error: LogError) -> RecordingError {
    match error {
        LogError::Interrupted => RecordingError::Interrupted,
        error => error.into(),
    }
}

/// Returns an observer of one of several recordings, by its index, which reports the fraction of
/// all of them.
pub(crate) fn part_of<'a>(
    observer: &'a mut Observer<'_>,
    index: usize,
    count: usize,
) -> impl FnMut(Progress) -> ControlFlow<()> + 'a {
    move |progress| {
        let fraction = (index as f64 + progress.fraction) / count as f64;
        observer(Progress { fraction })
    }
}
