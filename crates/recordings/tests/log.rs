//! Identification from a log, through `tactid-logs` alone.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::common::{
    Experiment, Instant, SENSORS, TOOL, errors_percent, identifier, worst_percent,
};
use crate::recorded_log::Recording;
use tactid_identify::{EquationSettings, values_of_body};
use tactid_logs::LogReader;
use tactid_logs::messages::InertiaStamped;
use tactid_recordings::{
    Clock, EstimatorKind, Finding, Identification, Identified, Method, PaperFilter, PaperSettings,
    RecordingError, Request, identify_log, write_estimates,
};

fn identified(path: &Path, request: &Request) -> Result<Identified, RecordingError> {
    identify_log(path, request, &mut |_| ControlFlow::Continue(()))
}

fn identify(path: &Path, request: &Request) -> Result<Identification, RecordingError> {
    identified(path, request).map(|found| found.into_least_squares().unwrap())
}

/// Windows and values of either estimator.
fn windows_and_values(found: &Identified) -> (u64, [f64; 10]) {
    match found {
        Identified::LeastSquares(found) => (found.estimate.windows, found.estimate.values()),
        Identified::Paper(found) => (found.estimate.windows, values_of_body(&found.estimate.body)),
    }
}

/// Both estimators, with the filter of the online identifier and no delay.
fn requests() -> [Request; 2] {
    [paper(), least_squares()]
}

fn paper() -> Request {
    Request {
        tip: Some(TOOL.to_owned()),
        method: Some(Method::Tactile),
        ..Request::paper()
    }
}

fn least_squares() -> Request {
    let online = EquationSettings::default();
    Request {
        estimator: None,
        cutoff_hz: Some(online.cutoff_hz),
        max_gap_s: Some(online.max_gap_s),
        delay_s: Some(0.0),
        ..paper()
    }
}

fn recorded(change: impl FnOnce(&mut Recording<'_>)) -> (tempfile::TempDir, PathBuf, Vec<Instant>) {
    let instants = Experiment {
        duration_s: 2.0,
        ..Experiment::default()
    }
    .run();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut recording = Recording::of(&instants);
    change(&mut recording);
    recording.write(&path);
    (folder, path, instants)
}

/// A log gives the estimate of its samples pushed by hand, but for the rounding of the base's twist
/// into its own frame and back.
#[test]
fn a_log_gives_what_its_samples_give() {
    let (_folder, path, instants) = recorded(|_| {});
    for request in requests() {
        let from_log = windows_and_values(&identified(&path, &request).unwrap());
        let by_hand = pushed_by_hand(&instants, request.estimator);
        assert_eq!(from_log.0, by_hand.0);
        for (a, b) in from_log.1.iter().zip(by_hand.1) {
            assert!((a - b).abs() < 2e-7 * (1.0 + b.abs()), "{a} {b}");
        }
    }
}

/// The number of windows and the ten values of an online estimator from the samples themselves.
fn pushed_by_hand(instants: &[Instant], estimator: Option<EstimatorKind>) -> (u64, [f64; 10]) {
    let (experiment, settings) = (Experiment::default(), EquationSettings::default());
    if estimator.is_none() {
        let mut online = identifier(&experiment, &settings);
        for instant in instants {
            online.push(&instant.sample()).unwrap();
        }
        let estimate = online.estimate();
        return (estimate.windows, estimate.values());
    }
    let mut filter = paper_filter(&experiment, &settings);
    for _ in 0..PaperSettings::default().epochs {
        filter.rewind();
        for instant in instants {
            filter.push(&instant.sample()).unwrap();
        }
    }
    let estimate = filter.estimate();
    (estimate.windows, values_of_body(&estimate.body))
}

/// The paper's filter with the paper's settings.
fn paper_filter(experiment: &Experiment, settings: &EquationSettings) -> PaperFilter {
    let robot = experiment.robot();
    PaperFilter::new(&robot, TOOL, &SENSORS, settings, PaperSettings::default()).unwrap()
}

/// The history ends at the end of the log with the latest estimate.
#[test]
fn the_history_is_the_estimate_over_time() {
    let (_folder, path, _) = recorded(|_| {});
    let result = identify(&path, &least_squares()).unwrap();
    let last = result.history.last().unwrap();
    assert!((last.time_s - 1.95).abs() < 0.05, "{}", last.time_s);
    assert!((result.recording.duration_s - 2.0).abs() < 1e-9);
    assert_eq!(result.history.len(), 62);
    assert!(last.std_devs.iter().all(|std_dev| *std_dev < 0.01));
    assert!((last.values[0] - 100.0).abs() < 0.01);
    for (last, of_result) in last.std_devs.iter().zip(result.estimate.std_devs) {
        assert!((last / of_result - 1.0).abs() < 1e-9, "{last} {of_result}");
    }
    assert!(!result.recording.interrupted && result.recording.damage.is_empty());
}

/// Stamps of zero fall back on the log's time.
#[test]
fn log_time_replaces_a_missing_stamp() {
    let (_folder, path, _) = recorded(|recording| recording.stamps = false);
    let result = identify(&path, &least_squares()).unwrap();
    assert!(worst_percent(&result.estimate.body) < 1e-2);
    assert_eq!(result.recording.clock, Clock::LogTimes);
    assert!(result.recording.findings.contains(&Finding::NoStamps));
}

/// A log that was cut is used up to the cut, which is reported.
#[test]
fn a_cut_log_is_used_up_to_the_cut() {
    let (_folder, path, _) = recorded(|_| {});
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let result = identify(&path, &least_squares()).unwrap();
    assert!(
        result.recording.duration_s > 0.2 && result.recording.duration_s < 2.0,
        "{}",
        result.recording.duration_s
    );
    assert_eq!(result.recording.damage.len(), 1);
}

/// A message that a recorder logged at the end of time, or messages in pairs, change neither the
/// cutoff nor the result.
#[test]
fn times_of_logging_change_no_default() {
    let request = Request {
        cutoff_hz: None,
        max_gap_s: None,
        ..least_squares()
    };
    let (_folder, path, _) = recorded(|_| {});
    let expected = identify(&path, &request).unwrap();
    let late: fn(&mut Recording<'_>) = |recording| recording.logged_late_ns = Some(i64::MAX as u64);
    let in_pairs: fn(&mut Recording<'_>) = |recording| recording.in_pairs = true;
    for change in [late, in_pairs] {
        let (_folder, path, _) = recorded(change);
        let result = identify(&path, &request).unwrap();
        assert!((result.recording.cutoff_hz / expected.recording.cutoff_hz - 1.0).abs() < 1e-2);
        assert!((result.recording.max_gap_s / expected.recording.max_gap_s - 1.0).abs() < 1e-2);
        assert!(worst_percent(&result.estimate.body) < 1e-2);
    }
}

/// A log that was cut before there is enough for an estimate is refused with the cut.
#[test]
fn a_log_cut_too_early_names_the_cut() {
    let (_folder, path, _) = recorded(|_| {});
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 20]).unwrap();
    let error = identify(&path, &least_squares()).unwrap_err().to_string();
    assert!(error.contains("too few windows"), "{error}");
    assert!(error.contains(" is damaged at byte "), "{error}");
}

/// The observer can interrupt the reading; what was read until then is identified.
#[test]
fn the_observer_can_stop() {
    let (_folder, path, _) = recorded(|_| {});
    for request in requests() {
        let mut reports = 0;
        let result = identify_log(&path, &request, &mut |progress| {
            assert!((0.0..=1.0).contains(&progress.fraction));
            reports += u32::from(progress.fraction > 0.0);
            if reports == 2 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        let result = result.unwrap();
        assert!(result.recording().interrupted && windows_and_values(&result).0 > 0);
        let result = identify_log(&path, &request, &mut |_| ControlFlow::Break(()));
        assert!(matches!(result, Err(RecordingError::Interrupted)));
    }
}

/// What the log lacks, or has twice, is reported by topic and type.
#[test]
fn a_log_that_lacks_something_says_what() {
    type Change = fn(&mut Recording<'_>);
    let cases: [(&str, Change); 8] = [
        (
            "record its joint states, or make the joint fixed in the URDF; `rename_joints` renames joints of the log",
            |r| {
                r.joint_names.pop();
            },
        ),
        ("no robot description: give a URDF", |r| {
            r.description = None
        }),
        ("not a URDF", |r| r.description = Some("<robot")),
        (
            "the frame `finger_left_link` of /finger_0/wrench is neither a link nor fixed to one",
            |r| r.joint_topics = &[],
        ),
        (
            "several topics of joint states of the same joints: /a, /b; choose one",
            |r| r.joint_topics = &["/a", "/b"],
        ),
        ("no wrench (type geometry_msgs/msg/WrenchStamped)", |r| {
            r.sensors = &[]
        }),
        ("the frame `thumb` of /finger_1/wrench is neither", |r| {
            r.sensors = &["finger_left_link", "thumb"]
        }),
        (
            "joint `finger_right_joint` of the URDF is needed, but is not in the log",
            |r| {
                r.joint_names.pop();
            },
        ),
    ];
    for (expected, change) in cases {
        let (_folder, path, _) = recorded(change);
        let error = identified(&path, &paper()).unwrap_err().to_string();
        assert!(
            error.contains(expected),
            "expected `{expected}`, got `{error}`"
        );
    }
    let (_folder, path, _) = recorded(|r| r.odometry = false);
    let request = Request {
        method: Some(Method::JointSensing),
        ..paper()
    };
    let error = identify(&path, &request).unwrap_err().to_string();
    assert!(
        error.contains("no motion of the base (type nav_msgs/msg/Odometry)"),
        "{error}"
    );
}

/// The wrenches of several topics are summed where each is of another finger. Others must be named,
/// because they may be of one load twice, or of several loads: of two links of the arm, of one
/// link, of a link and the tip.
#[test]
fn wrenches_that_are_not_of_fingers_must_be_named() {
    let unrelated: [&'static [&'static str]; 4] = [
        &["finger_left_link", "forearm_link"],
        &["finger_left_link", "gripper_link"],
        &["tool0", "finger_left_link"],
        &["finger_left_link", "finger_left_link"],
    ];
    for sensors in unrelated {
        let (_folder, path, _) = recorded(|recording| recording.sensors = sensors);
        let error = identify(&path, &least_squares()).unwrap_err();
        let named = format!(
            "topics of wrenches: /finger_0/wrench in `{}`, /finger_1/wrench in `{}`; they are summed where each is of \
             another finger, a link that joints beyond `{TOOL}` move",
            sensors[0], sensors[1]
        );
        assert!(error.to_string().contains(&named), "{error}");
        assert_eq!(error.option(), Some("wrench_topic"));
        let mut request = least_squares();
        let fingers = ["/finger_0/wrench", "/finger_1/wrench"];
        request.wrench_topic = Some(fingers.map(str::to_owned).to_vec());
        assert!(identify(&path, &request).is_ok(), "{sensors:?}");
    }
}

/// A path without a log is an error that names it.
#[test]
fn no_log_no_panic() {
    let error = identified(Path::new("/nonexistent/run.mcap"), &paper()).unwrap_err();
    assert!(
        error.to_string().contains("/nonexistent/run.mcap"),
        "{error}"
    );
}

/// Interrupted before there is enough for a fit, there is no result.
#[test]
fn interrupted_early_nothing_is_known() {
    let (_folder, path, _) = recorded(|_| {});
    for request in requests() {
        let result = identify_log(&path, &request, &mut |progress| {
            if progress.fraction > 0.0 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        assert!(matches!(result, Err(RecordingError::Interrupted)));
    }
}

/// The error of a requested topic that the log does not have names the topic and the request's
/// field.
#[test]
fn a_requested_topic_that_is_missing_is_named() {
    let (_folder, path, _) = recorded(|_| {});
    let mut request = least_squares();
    request.wrench_topic = Some(vec!["/no_such_topic".to_owned()]);
    match identify(&path, &request) {
        Err(RecordingError::Option { option, what }) => {
            assert_eq!(option, "wrench_topic");
            assert!(
                what.starts_with("the log has no topic /no_such_topic of type"),
                "{what}"
            );
        }
        other => panic!("{other:?}"),
    }
}

/// The paper's filter knows neither masses nor boxes.
#[test]
fn the_papers_filter_rejects_a_known_mass() {
    let (_folder, path, _) = recorded(|_| {});
    let request = Request {
        known_mass_kg: Some(100.0),
        known_mass_std_dev_kg: Some(0.1),
        ..paper()
    };
    let error = identify(&path, &request).unwrap_err().to_string();
    assert!(
        error.contains("a known mass needs least squares"),
        "{error}"
    );
}

/// Without any option, a log is identified by the defaults: least squares on the wrenches in
/// `tool0`.
#[test]
fn the_defaults_identify_a_log() {
    let (_folder, path, _) = recorded(|_| {});
    let result = identify(&path, &Request::default()).unwrap();
    assert_eq!(result.recording.method, Method::Tactile);
    assert_eq!(result.recording.estimator, EstimatorKind::LeastSquares);
    assert_eq!(&*result.estimate.frame, TOOL);
    assert!((result.recording.max_gap_s - 5e-3).abs() < 1e-9);
    assert_eq!(result.recording.clock, Clock::Stamps);
    assert_eq!(result.recording.start_ns, 1_800_000_000_000_000_000);
    let worst = errors_percent(&result.estimate.body);
    assert!(worst.iter().all(|error| error.abs() < 1e-2), "{worst:?}");
    assert!(
        result.recording.faults.is_empty(),
        "{:?}",
        result.recording.faults
    );
    let sum = |finding: &Finding| matches!(finding, Finding::WrenchesSummed { topics } if topics.len() == 2);
    assert!(
        result.recording.findings.iter().any(sum),
        "{:?}",
        result.recording.findings
    );
    let (values, std_devs) = (result.estimate.values(), result.estimate.std_devs);
    let forecast = result.forecast.unwrap();
    assert_eq!(forecast.remaining_s(&values, &std_devs, 10.0), [0.0; 10]);
}

/// The estimates over time come back from the log that they are written to.
#[test]
fn estimates_are_written_as_a_log() {
    let (folder, path, _) = recorded(|_| {});
    let result = identify(&path, &least_squares()).unwrap();
    let written = folder.path().join("estimates.mcap");
    let points = &result.history;
    let (frame, start_ns) = (&result.estimate.frame, result.recording.start_ns);
    let given = points
        .iter()
        .map(|p| (p.time_s, p.values, Some(p.std_devs)));
    write_estimates(&written, frame, start_ns, given).unwrap();
    let log = LogReader::open(&written).unwrap();
    let messages: Vec<_> = log.messages_on(["/tactid/payload"]).unwrap().collect();
    assert_eq!(messages.len(), points.len());
    let last = messages[messages.len() - 1].as_ref().unwrap();
    let stamped: InertiaStamped = last.decode().unwrap();
    assert_eq!(stamped.header.frame_id, TOOL);
    assert_eq!(stamped.inertia.m, points[points.len() - 1].values[0]);
    let end_ns = result.recording.start_ns + (points[points.len() - 1].time_s * 1e9).round() as i64;
    assert_eq!(stamped.header.stamp.as_ns(), end_ns);
    let widths = log.messages_on(["/tactid/payload_half_width_95"]).unwrap();
    assert_eq!(widths.count(), points.len());
}

/// An unloaded recording is for the effort method only, and another one than the loaded one.
#[test]
fn an_unloaded_recording_needs_the_effort_method() {
    let (folder, path, _) = recorded(|_| {});
    let request = Request {
        unloaded: Some(path.clone()),
        ..least_squares()
    };
    let error = identify(&path, &request).unwrap_err();
    assert_eq!(error.option(), Some("method"), "{error}");
    let request = Request {
        method: Some(Method::Effort),
        ..request
    };
    let error = identify(&path, &request).unwrap_err();
    assert!(error.to_string().contains("is given twice"), "{error}");
    let copy = folder.path().join("copy.mcap");
    std::fs::copy(&path, &copy).unwrap();
    let request = Request {
        unloaded: Some(copy),
        ..request
    };
    let error = identify(&path, &request).unwrap_err();
    let same = "are the same recording, which is given twice";
    assert!(error.to_string().contains(same), "{error}");
}
