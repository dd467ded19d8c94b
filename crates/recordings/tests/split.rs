//! Recordings that are cut where the payload changes.

use std::ops::ControlFlow;

use crate::common::{Experiment, TOOL, payload};
use crate::recorded_log::Recording;
use tactid_dynamics::{BaseKind, MassProperties};
use tactid_recordings::{GravityChoice, RecordingError, Request, Segment, WrenchIs, split_log};

/// Time at which the payload changes, s.
const CHANGE_S: f64 = 3.0;

/// An arm on a fixed base, of which the payload becomes half as heavy.
fn experiment() -> Experiment {
    let base = BaseKind::Fixed;
    let other = MassProperties {
        mass_kg: 50.0,
        ..payload()
    };
    Experiment {
        base,
        gravity: base.default_gravity(),
        step_s: 5e-3,
        duration_s: 2.0 * CHANGE_S,
        swap: Some((CHANGE_S, other)),
        ..Experiment::default()
    }
}

fn split(experiment: &Experiment, request: Request) -> Result<Vec<Segment>, RecordingError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let instants = experiment.run();
    let recording = Recording {
        odometry: false,
        ..Recording::of(&instants)
    };
    recording.write(&path);
    let request = Request {
        tip: Some(TOOL.to_owned()),
        ..request
    };
    split_log(&path, &request, &mut |_| ControlFlow::Continue(()))
}

/// A log is cut when its payload changes, and has times of the whole at its ends.
#[test]
fn a_log_is_cut_where_the_payload_changes() {
    let segments = split(&experiment(), Request::default()).unwrap();
    let times: Vec<f64> = segments.iter().flat_map(|s| [s.begin_s, s.end_s]).collect();
    let expected = [0.0, CHANGE_S, CHANGE_S, 2.0 * CHANGE_S];
    assert_eq!(times.len(), expected.len(), "{times:?}");
    for (time_s, expected_s) in times.iter().zip(expected) {
        assert!((time_s - expected_s).abs() < 0.1, "{times:?}");
    }
}

/// What only a whole recording with one payload shows is refused, and not ignored.
#[test]
fn unknowns_of_a_whole_recording_are_refused() {
    let gravity = Request {
        gravity: Some(GravityChoice::Unknown),
        ..Request::default()
    };
    let weight = Request {
        wrench_is: Some(WrenchIs::WithoutWeight),
        ..Request::default()
    };
    for (request, option) in [(gravity, "gravity"), (weight, "wrench_is")] {
        let error = split(&experiment(), request).unwrap_err();
        assert_eq!(error.option(), Some(option), "{error}");
    }
}

/// A recording without a segment says why it has none.
#[test]
fn a_recording_without_a_segment_says_why() {
    let at_rest = Experiment {
        moving: Vec::new(),
        ..experiment()
    };
    let short = Experiment {
        duration_s: 1.2,
        ..experiment()
    };
    let gaps = Request {
        max_gap_s: Some(1e-3),
        ..Request::default()
    };
    for (experiment, request, words) in [
        (at_rest, Request::default(), "while the arm rests"),
        (short, Request::default(), "1.5 s"),
        (experiment(), gaps, "the longest time that is bridged"),
    ] {
        match split(&experiment, request) {
            Err(error) => assert!(error.to_string().contains(words), "{error}"),
            Ok(segments) => panic!("{segments:?}"),
        }
    }
}
