//! A live session: the messages of a log, one by one.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::common::{Experiment, Instant, Noise, TOOL, identifier};
use crate::recorded_log::Recording;
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand::rngs::SmallRng;
use tactid_dynamics::{BaseKind, MassProperties};
use tactid_identify::{BaseState, ContactState, EquationSettings, HALF_WIDTH_95, Sample};
use tactid_logs::{LogReader, RawMessage};
use tactid_recordings::{
    DataFault, FaultKind, Finding, GivenTool, GravityChoice, LiveSession, LiveSettings,
    OffsetChoice, RecordingError, Request, identify_log,
};

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// Plans are made at once, so that results do not depend on the machine.
const SETTINGS: LiveSettings = LiveSettings {
    first_s: 2.0,
    in_background: false,
    contact_frame: None,
};

fn experiment(duration_s: f64) -> Experiment {
    Experiment {
        base: BaseKind::Fixed,
        gravity: GRAVITY,
        step_s: 4e-3,
        duration_s,
        ..Experiment::default()
    }
}

/// Returns noisy instants, and the messages of their log in the order of the times of logging.
fn recorded(
    duration_s: f64,
    change: impl Fn(&mut Recording<'_>),
) -> (tempfile::TempDir, Vec<Instant>, Vec<RawMessage>) {
    let (mut random, noise) = (SmallRng::seed_from_u64(7), Noise::fraction(1e-4));
    let exact = experiment(duration_s).run();
    let instants: Vec<_> = exact.iter().map(|at| noise.on(at, &mut random)).collect();
    logged(instants, change)
}

/// Returns instants, and the messages of their log in the order of the times of logging.
fn logged(
    instants: Vec<Instant>,
    change: impl Fn(&mut Recording<'_>),
) -> (tempfile::TempDir, Vec<Instant>, Vec<RawMessage>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut recording = Recording::of(&instants);
    recording.odometry = false;
    change(&mut recording);
    recording.write(&path);
    let log = LogReader::open(&path).unwrap();
    let messages = log.messages().collect::<Result<_, _>>().unwrap();
    (folder, instants, messages)
}

fn request() -> Request {
    Request {
        tip: Some(TOOL.to_owned()),
        ..Request::default()
    }
}

/// The request of the online identifier: nothing is chosen from the messages.
fn given() -> Request {
    let online = EquationSettings::default();
    Request {
        cutoff_hz: Some(online.cutoff_hz),
        max_gap_s: Some(online.max_gap_s),
        delay_s: Some(0.0),
        wrench_offset: Some(OffsetChoice::No),
        ..request()
    }
}

fn push(session: &mut LiveSession, message: &RawMessage, later_ns: u64) {
    let (topic, data) = (&message.topic, message.data().to_vec());
    let received_ns = message.log_time_ns + later_ns;
    session
        .push(&topic.name, &topic.type_name, data, received_ns)
        .unwrap();
}

fn live(request: Request, messages: &[RawMessage]) -> LiveSession {
    let mut session = LiveSession::new(request, SETTINGS).unwrap();
    messages.iter().for_each(|m| push(&mut session, m, 0));
    session.finish().unwrap();
    session
}

fn assert_close(a: &[f64], b: &[f64], tolerance: f64) {
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= tolerance * (1.0 + b.abs()), "{a} {b}");
    }
}

/// Messages give what their samples give, those of the beginning included.
#[test]
fn messages_give_what_their_samples_give() {
    let (_folder, instants, messages) = recorded(6.0, |_| {});
    let session = live(given(), &messages);
    let settings = EquationSettings {
        gravity: Some(GRAVITY),
        ..EquationSettings::default()
    };
    let mut by_hand = identifier(&experiment(1.0), &settings);
    for instant in &instants {
        // Times in whole nanoseconds: windows end at them.
        let time_s = (instant.time_s * 1e9).round() * 1e-9;
        let sample = Sample {
            time_s,
            base: BaseState::fixed(),
            ..instant.sample()
        };
        by_hand.push(&sample).unwrap();
    }
    by_hand.finish();
    let (found, expected) = (session.estimate().unwrap(), by_hand.estimate());
    assert_eq!(found.windows, expected.windows);
    assert_eq!(session.status().samples, instants.len() as u64);
    assert_close(&found.values(), &expected.values(), 1e-9);
    assert_close(&found.std_devs, &expected.std_devs, 1e-9);
}

/// What is left open is chosen as for a recording, but for the zero of the sensor, which is an
/// unknown, and the estimate is within the interval of that of the recording.
#[test]
fn a_session_chooses_what_a_recording_chooses() {
    let (folder, _, messages) = recorded(8.0, |_| {});
    let session = live(request(), &messages);
    let path = folder.path().join("run.mcap");
    let with_offset = Request {
        wrench_offset: Some(OffsetChoice::Yes),
        ..request()
    };
    let offline = identify_log(&path, &with_offset, &mut |_| ControlFlow::Continue(()));
    let offline = offline.unwrap().into_least_squares().unwrap();
    let (status, estimate) = (session.status(), session.estimate().unwrap());
    assert_eq!(status.topics, offline.recording.setup.topics);
    assert_eq!(status.cutoff_hz, offline.fit.cutoff_hz);
    let values = offline.estimate.values();
    for (k, value) in estimate.values().into_iter().enumerate() {
        let half_width = HALF_WIDTH_95 * offline.estimate.std_devs[k];
        assert!((value - values[k]).abs() < half_width, "{k} {value}");
    }
}

/// A session waits for what it needs, and says what that is.
#[test]
fn a_session_waits_for_what_is_missing() {
    let (_folder, _, messages) = recorded(4.0, |_| {});
    let mut session = LiveSession::new(request(), SETTINGS).unwrap();
    let is_joints = |message: &&RawMessage| message.topic.name == "/joint_states";
    let without = messages.iter().filter(|message| !is_joints(message));
    without.for_each(|message| push(&mut session, message, 0));
    let problem = session.status().problem.unwrap();
    assert!(problem.contains("neither joint states"), "{problem}");
    assert!(session.estimate().is_none());
    let later_ns = 5_000_000_000;
    messages
        .iter()
        .for_each(|m| push(&mut session, m, later_ns));
    assert!(session.status().problem.is_none());
    assert!(session.estimate().is_some());
}

/// A topic that ends, and one that comes later, are reported; without the joints nothing starts
/// again.
#[test]
fn topics_that_end_or_come_later_are_reported() {
    let (_folder, _, messages) = recorded(4.0, |_| {});
    let mut session = live(given(), &messages);
    let last_ns = messages.last().unwrap().log_time_ns;
    let before = session.snapshot(last_ns).findings();
    session.announce("/wrist/wrench", "geometry_msgs/msg/WrenchStamped");
    let findings = session.snapshot(last_ns + 2_000_000_000).findings();
    let silent = |topic: &str| Finding::TopicSilent {
        topic: topic.to_owned(),
        silent_s: 2.0,
    };
    let (noticed, rest) = findings.split_at(4);
    assert_eq!(rest, before);
    assert_eq!(
        noticed,
        [
            silent("/joint_states"),
            silent("/finger_0/wrench"),
            silent("/finger_1/wrench"),
            Finding::TopicsNotUsed {
                topics: vec!["/wrist/wrench".to_owned()]
            }
        ]
    );
}

/// Stamps that jump by more than a minute are not used; the session starts again, and identifies
/// the same payload.
#[test]
fn a_session_starts_again_after_a_jump_of_the_clock() {
    let (_folder, _, messages) = recorded(4.0, |_| {});
    let mut session = live(given(), &messages);
    let before = session.estimate().unwrap();
    let samples = session.status().samples;
    // The same stamps come two minutes later.
    let jump_ns = 120_000_000_000;
    messages.iter().for_each(|m| push(&mut session, m, jump_ns));
    session.finish().unwrap();
    let status = session.status();
    assert_eq!((status.restarts, status.problem), (1, None));
    assert!(status.samples < samples);
    let after = session.estimate().unwrap();
    let mass_kg = after.body.mass_kg - before.body.mass_kg;
    assert!(mass_kg.abs() < 6.0 * after.std_devs[0], "{mass_kg}");
    let restarted = Finding::LiveRestarted { count: 1 };
    assert!(session.snapshot(0).findings().contains(&restarted));
}

/// A gap of the joints is a gap, and nothing starts again once they return.
#[test]
fn a_publisher_that_returns_goes_on() {
    let (_folder, _, messages) = recorded(6.0, |_| {});
    let mut session = LiveSession::new(given(), SETTINGS).unwrap();
    let first_ns = messages.last().unwrap().log_time_ns - 6_000_000_000;
    for message in &messages {
        let at_s = message.log_time_ns.saturating_sub(first_ns) as f64 * 1e-9;
        if message.topic.name != "/joint_states" || !(3.0..5.0).contains(&at_s) {
            push(&mut session, message, 0);
        }
    }
    let (status, estimate) = (session.status(), session.estimate().unwrap());
    assert_eq!((status.restarts, status.problem), (0, None));
    assert_eq!((estimate.gaps, status.samples), (1, 1001));
}

/// Joints with other names are counted, and an option that has no meaning is refused.
#[test]
fn what_cannot_be_used_is_named() {
    let (_folder, _, messages) = recorded(3.0, |_| {});
    let (_other, _, others) = recorded(0.2, |recording| recording.joint_names.truncate(6));
    let mut session = live(given(), &messages);
    let joints = others.iter().filter(|m| m.topic.name == "/joint_states");
    joints.for_each(|message| push(&mut session, message, 3_000_000_000));
    let snapshot = session.snapshot(0);
    let is_partial = |fault: &DataFault| fault.kind == FaultKind::PartialJoints;
    let fault = snapshot.faults().iter().find(|fault| is_partial(fault));
    assert_eq!(fault.unwrap().count, 51);

    let refused = Request {
        known_mass_kg: Some(1.0),
        ..request()
    };
    let Err(RecordingError::Option { option, .. }) = LiveSession::new(refused, SETTINGS) else {
        panic!("accepted")
    };
    assert_eq!(option, "known_mass_kg");
    let unknown = Request {
        gravity: Some(GravityChoice::Unknown),
        ..request()
    };
    let error = LiveSession::new(unknown, SETTINGS).err().unwrap();
    assert_eq!(
        error.to_string(),
        "`gravity`: only a whole recording shows the direction of gravity: identify it from a recording first, and give \
         the gravity that it shows"
    );
}

/// A known tool is subtracted from the load, and its uncertainty is part of that of the payload.
#[test]
fn a_known_tool_is_subtracted() {
    let (_folder, _, messages) = recorded(4.0, |_| {});
    let without = live(given(), &messages).estimate().unwrap();
    let tool = MassProperties {
        mass_kg: 0.8,
        center_of_mass: Vector3::new(0.0, 0.01, 0.05),
        inertia: Matrix3::identity() * 1e-3,
    };
    let with = Request {
        known_tool: Some(GivenTool::from(tool)),
        known_tool_std_dev: Some(0.1),
        ..given()
    };
    let found = live(with, &messages).estimate().unwrap();
    let subtracted_kg = without.body.mass_kg - found.body.mass_kg;
    assert!(
        (subtracted_kg - 0.8).abs() < found.std_devs[0],
        "{subtracted_kg}"
    );
    let expected = without.std_devs[0].hypot(0.08);
    assert!((found.std_devs[0] - expected).abs() < 1e-9);
}

/// The wrench of a contact is zero within its uncertainty where nothing touches the payload. A tare
/// needs an offset that is an unknown.
#[test]
fn a_session_measures_contacts() {
    let (_folder, _, messages) = recorded(4.0, |_| {});
    let mut session = live(given(), &messages);
    let contact = session.contact_wrench().unwrap();
    assert_eq!(contact.frame, TOOL);
    let latency_s = (session.status().last_ns - contact.time_ns) as f64 * 1e-9;
    assert!((latency_s - contact.latency_s).abs() < 1e-6, "{latency_s}");
    assert!((0.01..0.06).contains(&latency_s), "{latency_s}");
    let std_devs = contact.wrench.std_devs();
    for (value, std_dev) in contact.wrench.wrench.force.iter().zip(std_devs) {
        assert!(
            value.abs() < 6.0 * std_dev && std_dev < 0.5,
            "{value} {std_dev}"
        );
    }
    assert_eq!(
        session.tare().err().unwrap().option(),
        Some("wrench_offset")
    );
    let mut offset = live(
        Request {
            wrench_offset: Some(OffsetChoice::Yes),
            ..given()
        },
        &messages,
    );
    let mass_kg = offset.estimate().unwrap().body.mass_kg;
    offset.hold_payload(true).unwrap();
    let held = offset.tare().err().unwrap().to_string();
    assert!(held.contains("is held"), "{held}");
    offset.hold_payload(false).unwrap();
    offset.tare().unwrap();
    assert!((offset.estimate().unwrap().body.mass_kg - mass_kg).abs() < 1e-6);
    offset.reset();
    assert!(offset.tare().is_err() && offset.contact_wrench().is_none());
}

/// A push of 40 N that lasts until the end is a contact, and no payload change, where the payload is
/// held; nothing is then learnt, and no zero is set.
#[test]
fn a_long_contact_of_a_held_payload_is_no_change() {
    let (_folder, mut instants, _) = recorded(5.0, |_| {});
    for instant in &mut instants[800..] {
        instant.wrenches[0].force.z += 40.0;
    }
    let (_folder, _, messages) = logged(instants, |_| {});
    let (before, during) = messages.split_at(messages.len() * 3 / 5);
    for is_held in [false, true] {
        let mut session = LiveSession::new(given(), SETTINGS).unwrap();
        assert!(session.hold_payload(true).is_err(), "nothing is known yet");
        before.iter().for_each(|m| push(&mut session, m, 0));
        let windows = session.estimate().unwrap().windows;
        session.hold_payload(is_held).unwrap();
        during.iter().for_each(|m| push(&mut session, m, 0));
        session.finish().unwrap();
        assert_eq!(session.status().is_payload_held, is_held);
        assert_eq!(session.payload_changes() == 0, is_held);
        if !is_held {
            continue;
        }
        let contact = session.contact_wrench().unwrap().wrench;
        let (force, std_devs) = (contact.wrench.force.norm(), contact.std_devs());
        assert!(
            (force - 40.0).abs() < 1.0 && std_devs[0] < 1.0,
            "{contact:?}"
        );
        assert_eq!(contact.state, ContactState::Settled);
        assert_eq!(session.estimate().unwrap().windows, windows);
        session.hold_payload(false).unwrap();
        assert!(!session.is_payload_held());
    }
}

/// A plan that another thread ends after the last message is used. A contact frame that the robot
/// does not have, or that moves relative to the tip, is named by its option.
#[test]
fn a_plan_ends_after_the_last_message() {
    let (_folder, _, messages) = recorded(2.2, |_| {});
    let planned = |contact_frame: &str| {
        let settings = LiveSettings {
            in_background: true,
            contact_frame: Some(contact_frame.to_owned()),
            ..SETTINGS
        };
        let mut session = LiveSession::new(given(), settings).unwrap();
        messages.iter().for_each(|m| push(&mut session, m, 0));
        let until = std::time::Instant::now() + Duration::from_secs(60);
        while !session.status().is_running && session.status().problem.is_none() {
            assert!(std::time::Instant::now() < until, "no plan");
            session.proceed().unwrap();
        }
        session
    };
    assert!(planned(TOOL).contact_wrench().is_some());
    for (frame, expected) in [
        ("fingertip", "`contact_frame`: "),
        (
            "base_link",
            "`contact_frame`: the link `base_link` moves relative to the tip",
        ),
    ] {
        let problem = planned(frame).status().problem.unwrap();
        assert!(problem.starts_with(expected), "{problem}");
    }
}
