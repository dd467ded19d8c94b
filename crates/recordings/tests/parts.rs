//! Parts of recordings: what lies outside of a part is neither read nor counted.

use std::fs;
use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::common::{Experiment, Instant, TOOL};
use crate::recorded_arrays::carried;
use crate::recorded_log::Recording;
use tactid_dynamics::BaseKind;
use tactid_logs::Ranges;
use tactid_recordings::{
    DataFault, FaultKind, Finding, Identification, OffsetChoice, RecordingError, Request,
    identify_log, identify_ranges,
};

/// Time between two samples, s.
const STEP_S: f64 = 5e-3;

/// Returns the samples of an arm on a fixed base.
fn moving(duration_s: f64) -> Vec<Instant> {
    let base = BaseKind::Fixed;
    let experiment = Experiment {
        base,
        gravity: base.default_gravity(),
        step_s: STEP_S,
        duration_s,
        ..Experiment::default()
    };
    experiment.run()
}

/// Writes the log of some samples.
fn logged(
    instants: &[Instant],
    change: impl Fn(&mut Recording<'_>),
) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut recording = Recording::of(instants);
    recording.odometry = false;
    change(&mut recording);
    recording.write(&path);
    (folder, path)
}

/// The request for a part, of which nothing else is chosen from the recording.
fn part(begin_s: f64, end_s: f64) -> Request {
    Request {
        tip: Some(TOOL.to_owned()),
        begin_s: Some(begin_s),
        end_s: Some(end_s),
        cutoff_hz: Some(5.0),
        delay_s: Some(0.0),
        wrench_offset: Some(OffsetChoice::No),
        ..Request::default()
    }
}

fn identify(path: &Path, request: &Request) -> Result<Identification, RecordingError> {
    let found = identify_log(path, request, &mut |_| ControlFlow::Continue(()))?;
    Ok(found.into_least_squares().unwrap())
}

/// Returns whether a stream was reported to begin later or to end earlier than others.
fn has_unequal_ends(found: &Identification) -> bool {
    let is_of_ends = |finding: &Finding| {
        matches!(
            finding,
            Finding::LateStart { .. } | Finding::EarlyEnd { .. }
        )
    };
    found.recording.findings.iter().any(is_of_ends)
}

/// Faults of messages, and streams that end early, count where they lie in the part.
#[test]
fn a_log_has_the_faults_of_its_part() {
    let mut instants = moving(8.0);
    for time_s in [0.7, 4.0, 7.0] {
        instants[(time_s / STEP_S) as usize].wrenches[0].force.x = f64::NAN;
    }
    instants.retain(|at| !(1.0..1.5).contains(&at.time_s) && !(6.5..6.8).contains(&at.time_s));
    let late_ns = 1_800_000_011_000_000_000;
    let (_folder, path) = logged(&instants, |r| r.logged_late_ns = Some(late_ns));
    let whole = identify(&path, &part(-1.0, 20.0)).unwrap();
    let kinds: Vec<_> = whole.recording.faults.iter().map(|f| &f.kind).collect();
    for kind in [FaultKind::Gap, FaultKind::NotFinite, FaultKind::NoStamp] {
        assert!(kinds.contains(&&kind), "{kinds:?}");
    }
    assert!(has_unequal_ends(&whole));
    let found = identify(&path, &part(2.0, 6.6)).unwrap();
    let expected = DataFault {
        topic: "/finger_0/wrench".to_owned(),
        kind: FaultKind::NotFinite,
        count: 1,
        first_s: 4.0,
    };
    assert_eq!(found.recording.faults, [expected]);
    assert!(!has_unequal_ends(&found));
}

/// Faults of samples count where they lie in the part.
#[test]
fn arrays_have_the_faults_of_their_part() {
    let mut recording = carried();
    for (k, time_s) in recording.times_s.iter_mut().enumerate() {
        *time_s += if k < 100 { 0.0 } else { 0.5 } + if k < 1700 { 0.0 } else { 0.5 };
    }
    for k in [50, 1000, 1900] {
        recording.wrenches[6 * k] = f64::NAN;
    }
    let request = Request {
        tip: None,
        ..part(1.0, 4.0)
    };
    let faults = recording.identify(&request).unwrap().recording.faults;
    let counted: Vec<_> = faults.iter().map(|f| (&*f.topic, f.count)).collect();
    assert_eq!(counted, [("wrench", 1)], "{faults:?}");
}

/// A part that lies outside of the recording is an error of the option, with the recording's length.
#[test]
fn a_part_outside_of_the_recording_is_named() {
    let (_folder, path) = logged(&moving(3.0), |_| {});
    let arrays = carried();
    for (begin_s, end_s, option) in [
        (1.8e9, 1.8e9 + 2.0, "begin_s"),
        (4.5, 5.0, "begin_s"),
        (-3.0, -1.0, "end_s"),
    ] {
        let request = part(begin_s, end_s);
        let of_log = identify(&path, &request).unwrap_err();
        let request = Request {
            tip: None,
            ..request
        };
        let of_arrays = arrays.identify(&request).unwrap_err();
        for (error, length) in [(of_log, "3.0 s"), (of_arrays, "4.0 s")] {
            let text = error.to_string();
            assert_eq!(error.option(), Some(option), "{text}");
            assert!(text.contains(&format!("is {length} long")), "{text}");
        }
    }
}

/// The bytes of a log, of which those that are read are counted.
#[derive(Clone, Debug)]
struct Counted {
    bytes: Arc<[u8]>,
    read: Arc<AtomicU64>,
}

impl Ranges for Counted {
    fn length(&mut self) -> io::Result<u64> {
        Ok(self.bytes.len() as u64)
    }

    fn read_range(&mut self, at_byte: u64, length: u64) -> io::Result<Vec<u8>> {
        let end = (at_byte + length).min(self.bytes.len() as u64);
        self.read.fetch_add(end - at_byte, Ordering::Relaxed);
        Ok(self.bytes[at_byte as usize..end as usize].to_vec())
    }
}

/// Asserts that the values of a part up to the end of a log are those of its samples alone.
fn assert_is_alone(found: &Identification, instants: &[Instant], begin_s: f64) {
    let mut inside = instants.to_vec();
    inside.retain(|at| at.time_s >= begin_s - 1e-9);
    let (_folder, path) = logged(&inside, |_| {});
    let alone = identify(&path, &part(-1.0, 1e3)).unwrap();
    assert_eq!(found.estimate.windows, alone.estimate.windows);
    for (a, b) in found.estimate.values().iter().zip(alone.estimate.values()) {
        assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{a} {b}");
    }
}

/// The times of a part are those of the stamps, also where simulated time runs at another rate than
/// the clock of logging.
#[test]
fn a_part_of_simulated_time_is_found() {
    let instants = moving(200.0);
    let (_folder, path) = logged(&instants, |r| r.logged_rate = 0.5);
    let found = identify(&path, &part(190.0, 200.0)).unwrap();
    assert_is_alone(&found, &instants, 190.0);
}

/// A part near the end of a long log is read from a minute before it on, gives what its samples
/// alone give, and the observer is called while the messages before it are passed over.
#[test]
fn a_part_is_read_from_its_time_on() {
    const LENGTH_S: f64 = 200.0;
    const BEGIN_S: f64 = 190.0;
    let instants = moving(LENGTH_S);
    let (_folder, path) = logged(&instants, |_| {});
    let log = Counted {
        bytes: fs::read(&path).unwrap().into(),
        read: Arc::default(),
    };
    let mut calls = 0;
    let mut count = |_| {
        calls += 1;
        ControlFlow::Continue(())
    };
    let request = part(BEGIN_S, LENGTH_S);
    let found = identify_ranges(&path, &log, &request, &mut count).unwrap();
    let found = found.into_least_squares().unwrap();
    assert_is_alone(&found, &instants, BEGIN_S);
    // The plan and the run read the last 70 s each.
    let fraction = log.read.load(Ordering::Relaxed) as f64 / log.bytes.len() as f64;
    assert!((0.5..0.9).contains(&fraction), "{fraction}");
    // Messages of 70 s on three topics, 4096 at a time, by both.
    let batches = (2.0 * 3.0 * 70.0 / STEP_S / 4096.0) as u32;
    assert!(calls >= batches, "{calls} calls");
}
