//! Delays that the wrenches of a log seem to have, and that are not corrected.

use std::ops::ControlFlow;

use crate::common::Experiment;
use crate::recorded_log::Recording;
use tactid_recordings::{Finding, Identification, Request, identify_log};

fn experiment() -> Experiment {
    Experiment {
        duration_s: 2.0,
        ..Experiment::default()
    }
}

fn identify(recording: &Recording<'_>) -> Identification {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    recording.write(&path);
    let observer = &mut |_| ControlFlow::Continue(());
    let found = identify_log(&path, &Request::default(), observer).unwrap();
    found.into_least_squares().unwrap()
}

/// Wrenches in the order of another time fit no motion. A long delay that fits by chance is reported
/// and not corrected.
#[test]
fn a_doubtful_delay_is_reported_and_not_corrected() {
    let mut instants = experiment().run();
    let reversed: Vec<_> = instants
        .iter()
        .rev()
        .map(|each| each.wrenches.clone())
        .collect();
    for (instant, wrenches) in instants.iter_mut().zip(reversed) {
        instant.wrenches = wrenches;
    }
    let result = identify(&Recording::of(&instants));
    let is_doubtful = |finding: &Finding| matches!(finding, Finding::DelayDoubtful { .. });
    let findings = &result.recording.findings;
    assert!(findings.iter().any(is_doubtful), "{findings:?}");
    assert_eq!(result.estimated_delay, None);
    assert_eq!(result.recording.delay_s, 0.0);
}

/// The wrench of one finger of two is a constant offset, and fits no delay.
#[test]
fn the_grip_of_one_finger_is_no_delay() {
    let instants = experiment().run();
    let mut recording = Recording::of(&instants);
    recording.sensors = &["finger_left_link"];
    let result = identify(&recording);
    assert_eq!(
        (result.estimated_delay, result.recording.delay_s),
        (None, 0.0)
    );
    assert!(!result.estimate.identifiable().contains(&true));
}
