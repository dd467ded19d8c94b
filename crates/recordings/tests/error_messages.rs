//! Errors of a recording say what to do.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::common;
use crate::recorded_arrays::{carried, recorded};
use crate::recorded_log;
use tactid_dynamics::{BaseKind, Manipulator};
use tactid_logs::messages::{Header, JointState, StringMsg, Time};
use tactid_logs::{Durability, LogWriter};
use tactid_recordings::{Method, RecordingError, Request, identify_log};

/// Streams that share no time are named with what to check, and so is one without numbers.
#[test]
fn streams_without_a_common_time_are_named_with_what_to_check() {
    let delayed = Request {
        delay_s: Some(8.0),
        ..Request::default()
    };
    let error = carried().identify(&delayed).unwrap_err();
    assert!(matches!(error, RecordingError::NoOverlap { .. }), "{error}");
    let advice = "recorded together, that the given delay of 8 s is in seconds, and that their stamps are those of one clock";
    assert!(error.to_string().ends_with(advice), "{error}");
    let mut recording = carried();
    recording.wrenches.fill(f64::NAN);
    let error = recording.identify(&Request::default()).unwrap_err();
    let cause = "2000 samples of `wrench` have a value that is not finite, and none could be used: leave out a sensor";
    assert!(error.to_string().starts_with(cause), "{error}");
}

/// A method that needs a floating base names the methods that do not.
#[test]
fn a_fixed_base_has_no_momentum_of_its_own() {
    let mut recording = recorded();
    recording.robot = Some(Manipulator::from_urdf(common::URDF, BaseKind::Fixed).unwrap());
    (recording.poses, recording.twists) = (Vec::new(), Vec::new());
    let request = Request {
        method: Some(Method::JointSensing),
        ..Request::default()
    };
    let error = recording.identify(&request).unwrap_err();
    let advice = "use the tactile or the effort method, or give the motion of the base if it is not fixed; `method` \
                  chooses the method";
    assert!(error.to_string().ends_with(advice), "{error}");
}

/// Writes a log of joints at rest, whose publishers have their own topics, with a topic for a
/// description without message.
fn write_joints(path: &Path, publishers: &[(&str, &[&str])]) {
    let mut log = LogWriter::create(path).unwrap();
    log.channel::<StringMsg>("/robot_description", Durability::TransientLocal)
        .unwrap();
    for (topic, joints) in publishers {
        let channel = log.channel(topic, Durability::Volatile).unwrap();
        for k in 1..200 {
            let message = JointState {
                header: Header {
                    stamp: Time::from_ns(k * 10_000_000),
                    frame_id: String::new(),
                },
                name: joints.iter().map(|&joint| joint.to_owned()).collect(),
                position: vec![0.0; joints.len()],
                velocity: vec![],
                effort: vec![0.0; joints.len()],
            };
            log.write(&channel, k * 10_000_000, &message).unwrap();
        }
    }
    log.finish().unwrap();
}

fn error(path: &Path, request: &Request) -> RecordingError {
    identify_log(path, request, &mut |_| ControlFlow::Continue(())).unwrap_err()
}

/// A topic without a message, and an unloaded recording of several publishers.
#[test]
fn logs_that_lack_something_are_recorded_once_more() {
    const ARM: [&str; 6] = [
        "joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6",
    ];
    const FINGERS: [&str; 2] = ["finger_left_joint", "finger_right_joint"];
    let folder = tempfile::tempdir().unwrap();
    let [empty, unloaded, loaded]: [PathBuf; 3] =
        ["empty", "unloaded", "loaded"].map(|name| folder.path().join(name));
    write_joints(&empty, &[("/joint_states", &ARM)]);
    let text = error(&empty, &Request::default()).to_string();
    let advice = "/robot_description is in the log, but has no message: record it once more, or use another topic";
    assert_eq!(text, advice);

    let instants = common::Experiment::default().run();
    recorded_log::Recording::of(&instants).write(&loaded);
    write_joints(&unloaded, &[("/arm", &ARM), ("/fingers", &FINGERS)]);
    let request = Request {
        method: Some(Method::Effort),
        unloaded: Some(unloaded),
        ..Request::default()
    };
    let error = error(&loaded, &request);
    let advice =
        "record the unloaded motion with one publisher of all joints; topics: /arm, /fingers";
    assert!(error.to_string().ends_with(advice), "{error}");
    assert_eq!(error.option(), Some("unloaded"));
}
