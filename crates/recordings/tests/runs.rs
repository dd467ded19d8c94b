//! Several logs, one payload.

use std::ops::ControlFlow;
use std::path::PathBuf;

use crate::common::{self, Experiment, Instant, Noise, TOOL};
use crate::recorded_log::Recording;
use rand::{SeedableRng, rngs::SmallRng};
use tactid_recordings::{
    EstimatorKind, Identification, Method, Progress, RecordingError, Request, combine,
    identify_logs,
};

fn request() -> Request {
    Request {
        tip: Some(TOOL.to_owned()),
        method: Some(Method::Tactile),
        ..Request::default()
    }
}

/// Logs of the same motion, each with noise of its own.
fn recorded(folder: &tempfile::TempDir, count: u64, duration_s: f64) -> Vec<PathBuf> {
    let instants = Experiment {
        duration_s,
        ..Experiment::default()
    }
    .run();
    let written = (0..count).map(|seed| {
        let mut random = SmallRng::seed_from_u64(seed);
        let noisy = instants
            .iter()
            .map(|instant| Noise::fraction(1e-3).on(instant, &mut random));
        let noisy: Vec<Instant> = noisy.collect();
        let path = folder.path().join(format!("run{seed}.mcap"));
        Recording::of(&noisy).write(&path);
        path
    });
    written.collect()
}

fn identified(paths: &[PathBuf], request: &Request) -> Result<Vec<Identification>, RecordingError> {
    identify_logs(paths, request, &mut |_| ControlFlow::Continue(()))
}

/// Each log gives what it gives alone, and all together the payload with narrower intervals and the
/// sums of what is counted.
#[test]
fn several_logs_give_one_payload() {
    let folder = tempfile::tempdir().unwrap();
    let paths = recorded(&folder, 3, 2.0);
    let mut fractions = Vec::new();
    let mut observer = |progress: Progress| {
        fractions.push(progress.fraction);
        ControlFlow::Continue(())
    };
    let runs = identify_logs(&paths, &request(), &mut observer).unwrap();
    assert!(fractions.is_sorted() && *fractions.last().unwrap() > 0.9);
    let alone = identified(&paths[1..2], &request()).unwrap().remove(0);
    assert_eq!(alone.estimate, runs[1].estimate);
    let whole = combine(&runs).unwrap();
    assert!(whole.agreement.agree && whole.findings.is_empty());
    let freedom = whole.agreement.degrees_of_freedom;
    assert!((10.0..20.01).contains(&freedom), "{freedom}");
    assert_eq!(whole.estimate.windows, 3 * alone.estimate.windows);
    let (all, one) = (whole.estimate.std_devs, alone.estimate.std_devs);
    let payload = common::payload();
    // A value that differs by chance keeps its interval: all together are narrower.
    let ratio: f64 = (0..10).map(|k| (all[k] / one[k]).ln()).sum::<f64>() / 10.0;
    assert!(ratio.exp() < 0.9, "{all:?} {one:?}");
    let error = whole.estimate.body.mass_kg - payload.mass_kg;
    assert!(error.abs() < 3.0 * all[0], "{error} {}", all[0]);
}

/// An error names the log that it is about. No log may be given twice, also by another path.
#[test]
fn an_error_names_its_log() {
    let folder = tempfile::tempdir().unwrap();
    let mut paths = recorded(&folder, 1, 2.0);
    let broken = folder.path().join("broken.mcap");
    std::fs::write(&broken, b"this is no log").unwrap();
    paths.push(broken.clone());
    let error = identified(&paths, &request()).unwrap_err();
    let RecordingError::InRecording { path, .. } = &error else {
        panic!("{error}");
    };
    let named = path.display().to_string();
    assert!(path.ends_with("broken.mcap") && error.to_string().contains(&named));
    paths[1] = folder.path().join(".").join("run0.mcap");
    let error = identified(&paths, &request()).unwrap_err();
    assert!(matches!(error, RecordingError::Together(_)), "{error}");
}

/// Where the observer stops the reading, the logs that follow the first one that was stopped are
/// left out.
#[test]
fn an_interruption_leaves_out_the_logs_that_follow() {
    let folder = tempfile::tempdir().unwrap();
    let paths = recorded(&folder, 2, 10.0);
    let mut observer = |progress: Progress| {
        // At least 0.6 of each log has been read, because no fraction exceeds one: enough for an
        // estimate.
        if progress.fraction > 0.8 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let runs = identify_logs(&paths, &request(), &mut observer).unwrap();
    let (last, before) = runs.split_last().unwrap();
    assert!(last.recording.interrupted && before.iter().all(|run| !run.recording.interrupted));
}

/// Results that cannot be combined are errors that name the recording.
#[test]
fn results_that_do_not_fit_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let paths = recorded(&folder, 1, 2.0);
    let result = identified(&paths, &request()).unwrap().remove(0);
    let with = |change: &dyn Fn(&mut Identification)| {
        let mut other = result.clone();
        change(&mut other);
        combine(&[result.clone(), other]).unwrap_err()
    };
    let error = with(&|other| other.estimate.frame = "flange".into());
    assert_eq!(
        error.to_string(),
        "recording 2 has another frame than the first recording"
    );
    let error = combine(&[]).unwrap_err();
    assert_eq!(error.to_string(), "there is no recording to combine");
    let paper_request = Request {
        estimator: Some(EstimatorKind::Nlms),
        ..request()
    };
    // No recording is read for a combination that cannot be.
    let paths = [folder.path().join("none.mcap")];
    let error = identified(&paths, &paper_request).unwrap_err();
    assert!(matches!(
        error,
        RecordingError::Option {
            option: "estimator",
            ..
        }
    ));
}
