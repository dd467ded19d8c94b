//! One payload from the results of several recordings.

use tactid_identify::PriorKnowledge;

use crate::combine::{Combination, combine_estimates};
use crate::{Identification, RecordingError};

/// Combines the results of several recordings of one payload, of logs or arrays, which were identified with the same request:
/// see [`combine_estimates`] for the weights, the verdict and the intervals.
///
/// The numbers of windows, rejected samples and gaps of the estimate are the sums over the recordings. A known mass and a bounding
/// box count once.
///
/// # Errors
/// Returns [`RecordingError::NotTheSame`] if the results have different frames, known masses or bounding boxes,
/// and [`RecordingError::Identify`] if there is no result.
pub fn combine(results: &[Identification]) -> Result<Combination, RecordingError> {
    let runs: Vec<_> = results.iter().map(|result| result.linear.clone()).collect();
    let first = results.first();
    for (run, result) in results.iter().enumerate() {
        let same = |what, is_same: fn(&Identification, &Identification) -> bool| match first {
            Some(first) if !is_same(first, result) => Err(RecordingError::NotTheSame { what, run }),
            _ => Ok(()),
        };
        same("frame", |a, b| a.estimate.frame == b.estimate.frame)?;
        same("known mass", |a, b| a.known_mass == b.known_mass)?;
        same("bounding box", |a, b| a.bounding_box == b.bounding_box)?;
    }
    let settings = PriorKnowledge {
        known_mass: first.and_then(|first| first.known_mass),
        bounding_box: first.and_then(|first| first.bounding_box),
    };
    let frame = first.map_or("", |first| &*first.estimate.frame);
    let mut combination = combine_estimates(frame, &runs, &settings)?;
    let estimate = &mut combination.estimate;
    for result in results {
        estimate.windows += result.estimate.windows;
        estimate.rejected += result.estimate.rejected;
        estimate.gaps += result.estimate.gaps;
    }
    Ok(combination)
}
