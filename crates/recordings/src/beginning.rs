//! The beginning of a recording, which identifies it.

use std::hash::{DefaultHasher, Hash, Hasher};

use crate::alignment::Event;

/// Number of events that identify a recording: some seconds, in which no two recordings of noisy sensors are the same.
const IDENTIFYING: usize = 500;

/// Returns a number that identifies the first events of a recording.
pub(crate) fn identifying(events: &[Event]) -> String {
    let mut hasher = DefaultHasher::new();
    for event in events.iter().take(IDENTIFYING) {
        format!("{event:?}").hash(&mut hasher);
    }
    format!("{:016x}", hasher.finish())
}
