//! The keywords of Python for the names of Rust's settings and arrays.

use tactid_recordings::{DataFault, Identification, RecordingError, TopicKind};

/// Returns the option that sets a field of a Rust settings type: its name without the unit, or that of its topic.
pub(crate) fn option_of(field: &'static str) -> &'static str {
    let name = ["_s", "_hz", "_kg"]
        .iter()
        .find_map(|unit| field.strip_suffix(unit));
    keyword_of(name.unwrap_or(field))
}

/// Returns the option that chooses a topic.
pub(crate) fn topic_option(kind: TopicKind) -> &'static str {
    match kind {
        TopicKind::Joints => "joint_topic",
        TopicKind::Wrenches => "wrench_topic",
        TopicKind::Odometry => "odometry_topic",
        TopicKind::Imu => "imu_topic",
        TopicKind::Acceleration => "acceleration_topic",
    }
}

/// Returns the keyword of `tactid.identify` that gives a field of `Arrays`; other names stay.
pub(crate) fn keyword_of(field: &str) -> &str {
    match field {
        "times_s" => "time",
        "joint_position" => "q",
        "joint_velocity" => "qd",
        "joint_effort" => "effort",
        "wrenches" => "wrench",
        "poses" => "pose",
        "twists" => "twist",
        "accelerations" => "acceleration",
        "topics.joints" => "joint_topic",
        "topics.wrenches" => "wrench_topic",
        "topics.odometry" => "odometry_topic",
        "topics.imu" => "imu_topic",
        "topics.acceleration" => "acceleration_topic",
        other => other,
    }
}

/// Names the arrays of a result, or of an error, by their keywords.
pub(crate) fn name_arrays(
    result: Result<Identification, RecordingError>,
) -> Result<Identification, RecordingError> {
    let rename = |faults: &mut Vec<DataFault>| {
        for fault in faults {
            fault.topic = keyword_of(&fault.topic).to_owned();
        }
    };
    match result {
        Ok(mut found) => {
            rename(&mut found.faults);
            Ok(found)
        }
        Err(RecordingError::NoOverlap { topics, mut faults }) => {
            rename(&mut faults);
            let names: Vec<&str> = topics.split(", ").map(keyword_of).collect();
            Err(RecordingError::NoOverlap {
                topics: names.join(", "),
                faults,
            })
        }
        Err(other) => Err(other),
    }
}
