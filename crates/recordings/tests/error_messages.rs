//! Errors say what to do, in words of the Rust API.

use tactid_identify::IdentifyError;
use tactid_recordings::RecordingError;

fn named(name: &str) -> String {
    name.to_owned()
}

/// The message of an error that is about the recording ends with what would be right.
#[test]
fn errors_of_a_recording_say_what_to_do() {
    let cases = [
        (
            RecordingError::NoSharedMotion,
            "record the whole motion once more without the payload",
        ),
        (
            RecordingError::OtherMotion {
                joint: named("elbow"),
                unit: "rad",
                rms: 0.1,
                allowed: 0.02,
            },
            "repeat the commanded motion of the loaded recording without the payload",
        ),
        (
            RecordingError::SeveralUnloadedTopics(named("/a, /b")),
            "record the unloaded motion with one publisher of all joints; topics: /a, /b",
        ),
        (
            RecordingError::EmptyTopic(named("/wrench")),
            "record it once more, or use another topic",
        ),
        (
            RecordingError::MissingJoint {
                joint: named("elbow"),
                joints: named("shoulder"),
            },
            "record its joint states, or make the joint fixed in the URDF",
        ),
        (
            RecordingError::NoOverlap {
                topics: vec![named("/a"), named("/b")],
                delay_s: 8.0,
                faults: Vec::new(),
            },
            "recorded together, that the given delay of 8 s is in seconds, and that their stamps are those of one clock",
        ),
        (
            RecordingError::NoOverlap {
                topics: vec![named("/a"), named("/b")],
                delay_s: 0.0,
                faults: Vec::new(),
            },
            "/a, /b; check that they were recorded together, and that their stamps are those of one clock",
        ),
        (
            RecordingError::UnloadedNeedsEffort,
            "use this method, or leave the unloaded recording out",
        ),
        (
            IdentifyError::FixedBase.into(),
            "use the tactile or the effort method, or give the motion of the base if it is not fixed",
        ),
    ];
    for (error, advice) in cases {
        assert!(error.to_string().ends_with(advice), "{error}");
    }
}
