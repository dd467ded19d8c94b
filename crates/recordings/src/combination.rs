//! One payload from the results of several recordings.

use serde::Deserialize;
use tactid_batch::{Finding as Data, LinearEstimate, PriorKnowledge};
use tactid_identify::{BoundingBox, KnownMass};

use crate::combine::{Combination, combine_estimates};
use crate::{Finding, Identification, RecordingError, ShapePrior};

/// What the result of one recording contributes to a combination: fields of its [`Identification`]
/// and of the estimate in it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CombinedRun {
    /// Name of the recording in errors and findings.
    pub name: String,
    /// What the recording says about the linear parameters.
    pub linear: LinearEstimate,
    /// Mass of the payload as it was given.
    pub known_mass: Option<KnownMass>,
    /// Box around the payload as it was given.
    pub bounding_box: Option<BoundingBox>,
    /// What the shape of the payload says, where one was given.
    pub shape: Option<ShapePrior>,
    /// Frame of the estimate.
    pub frame: String,
    /// Number that identifies its first messages; empty where it is not known.
    pub beginning: String,
    /// Number of its windows.
    pub windows: u64,
    /// Number of samples that were rejected.
    pub rejected: u64,
    /// Number of gaps between samples.
    pub gaps: u64,
}

/// Combines the results of several recordings of one payload, which were identified with the same
/// request, as [`combine_runs`] does; errors and findings call them `recording 1` and so on.
///
/// # Errors
/// Returns the errors of [`combine_runs`].
pub fn combine(results: &[Identification]) -> Result<Combination, RecordingError> {
    let run = |(index, result): (usize, &Identification)| CombinedRun {
        name: format!("recording {}", index + 1),
        linear: result.linear.clone(),
        known_mass: result.known_mass,
        bounding_box: result.bounding_box,
        shape: result.shape.as_ref().map(|fit| fit.prior),
        frame: result.estimate.frame.to_string(),
        beginning: result.recording.setup.beginning.clone(),
        windows: result.estimate.windows,
        rejected: result.estimate.rejected,
        gaps: result.estimate.gaps,
    };
    let runs: Vec<CombinedRun> = results.iter().enumerate().map(run).collect();
    combine_runs(&runs)
}

/// Combines what several recordings of one payload, logs or arrays, contribute: see
/// [`combine_estimates`] for the weights, the verdict and the intervals.
///
/// The numbers of windows, rejected samples and gaps of the estimate are the sums over the
/// recordings. A known mass, a bounding box and a shape count once.
///
/// # Errors
/// Returns [`RecordingError::Together`] if there is no recording, the recordings have different
/// frames, known masses, bounding boxes or shapes, or two of them begin with the same measurements.
pub fn combine_runs(runs: &[CombinedRun]) -> Result<Combination, RecordingError> {
    let estimates: Vec<_> = runs.iter().map(|run| run.linear.clone()).collect();
    let first = runs.first();
    for (run, first) in runs.iter().zip(first.into_iter().cycle()) {
        let same = [
            ("frame", run.frame == first.frame),
            ("known mass", run.known_mass == first.known_mass),
            ("bounding box", run.bounding_box == first.bounding_box),
            ("shape", run.shape == first.shape),
        ];
        if let Some((what, _)) = same.into_iter().find(|(_, is_same)| !is_same) {
            return Err(RecordingError::Together(format!(
                "{} has another {what} than the first recording",
                run.name
            )));
        }
    }
    let prior = PriorKnowledge {
        known_mass: first.and_then(|first| first.known_mass),
        bounding_box: first.and_then(|first| first.bounding_box),
    };
    let frame = first.map_or("", |first| &first.frame);
    let shape = first.and_then(|first| first.shape.as_ref());
    let mut combination = combine_estimates(frame, &estimates, &prior, shape)?;
    check_apart(runs)?;
    for run in runs {
        combination.estimate.windows += run.windows;
        combination.estimate.rejected += run.rejected;
        combination.estimate.gaps += run.gaps;
    }
    for finding in &mut combination.findings {
        if let Finding::Data(Data::RunsDisagree(found)) = finding {
            let names = runs.iter().map(|run| run.name.clone());
            *found = found.clone().with_names(names.collect());
        }
    }
    Ok(combination)
}

/// Checks that no recording is a copy or the beginning of another one.
fn check_apart(runs: &[CombinedRun]) -> Result<(), RecordingError> {
    for (k, run) in runs.iter().enumerate() {
        let mut before = runs[..k].iter();
        let same = before.find(|other| other.beginning == run.beginning);
        if let Some(other) = same.filter(|_| !run.beginning.is_empty()) {
            return Err(RecordingError::Together(format!(
                "{} and {} begin with the same measurements: one is a copy or a part of the other, and counts once",
                other.name, run.name
            )));
        }
    }
    Ok(())
}
