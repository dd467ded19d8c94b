//! The keywords of Python for the names of Rust's settings and arrays.

use tactid_recordings::{DataFault, Identification, RecordingError, TopicKind};

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

/// Returns the keyword of `tactid.identify` that gives a field of `Arrays`, `Request`, `Topics` or of another settings
/// type; other names stay.
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
        "unloaded.joint_position" => "unloaded[\"q\"]",
        "unloaded.joint_effort" => "unloaded[\"effort\"]",
        "topics.joints" => topic_option(TopicKind::Joints),
        "topics.wrenches" => topic_option(TopicKind::Wrenches),
        "topics.odometry" => topic_option(TopicKind::Odometry),
        "topics.imu" => topic_option(TopicKind::Imu),
        "topics.acceleration" => topic_option(TopicKind::Acceleration),
        "cutoff_hz" => "cutoff",
        "max_gap_s" => "max_gap",
        "delay_s" => "delay",
        "average_s" => "average",
        "known_mass_kg" => "known_mass",
        "known_mass_std_dev_kg" => "known_mass_std_dev",
        "joint_names" => "rename_joints",
        "payload_mass_kg" => "payload_mass",
        "payload_mass_std_dev_kg" => "payload_mass_std_dev",
        "payload_center_of_mass" => "payload_com",
        other => other,
    }
}

/// Names the arrays of a result, or of an error, by their keywords.
pub(crate) fn name_arrays(
    result: Result<Identification, RecordingError>,
) -> Result<Identification, RecordingError> {
    let mut found = result.map_err(name_arrays_of_error)?;
    name_arrays_of_faults(&mut found.faults);
    Ok(found)
}

/// Names the arrays of faults by their keywords; topics keep their names.
pub(crate) fn name_arrays_of_faults(faults: &mut [DataFault]) {
    for fault in faults {
        fault.topic = keyword_of(&fault.topic).to_owned();
    }
}

/// Names the arrays of an error by their keywords.
pub(crate) fn name_arrays_of_error(error: RecordingError) -> RecordingError {
    match error {
        RecordingError::NoOverlap {
            topics,
            delay_s,
            mut faults,
        } => {
            name_arrays_of_faults(&mut faults);
            let topics = topics.iter().map(|name| keyword_of(name).to_owned());
            RecordingError::NoOverlap {
                topics: topics.collect(),
                delay_s,
                faults,
            }
        }
        RecordingError::TimesNotIncreasing {
            name,
            unordered,
            used,
        } => RecordingError::TimesNotIncreasing {
            // The topic of a log stays as it is.
            name: match keyword_of(&name) {
                topic if topic == name => name,
                keyword => format!("`{keyword}`"),
            },
            unordered,
            used,
        },
        RecordingError::InRecording { path, source } => RecordingError::InRecording {
            path,
            source: Box::new(name_arrays_of_error(*source)),
        },
        other => other,
    }
}
