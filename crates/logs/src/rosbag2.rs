//! Metadata that rosbag2 adds to MCAP: quality of service of channels and a description of the bag.

use std::fmt::Write;

/// Durability of a topic: whether late subscribers receive earlier messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Durability {
    /// Late subscribers receive later messages only, as for measurements.
    Volatile,
    /// Late subscribers also receive the last message, as of `/robot_description`, `/tf_static`.
    TransientLocal,
}

/// Version of the metadata of rosbag2 in ROS 2 Jazzy, the first with policies as words.
const METADATA_VERSION: u32 = 9;

/// Seconds and nanoseconds of `RMW_DURATION_INFINITE`.
const INFINITE: (u64, u64) = (9_223_372_036, 854_775_807);

impl Durability {
    fn as_str(self) -> &'static str {
        match self {
            Self::Volatile => "volatile",
            Self::TransientLocal => "transient_local",
        }
    }

    /// Returns the durability that `offered_qos_profiles` state, in words or as numbers.
    pub(crate) fn of_profiles(profiles: &str) -> Self {
        let is_kept = ["durability: transient_local", "durability: 1\n"];
        if is_kept.iter().any(|words| profiles.contains(words)) {
            Self::TransientLocal
        } else {
            Self::Volatile
        }
    }

    /// Returns the `offered_qos_profiles` of a channel with one reliable publisher. Its history is
    /// unknown, as in every recording, because publishers do not announce it.
    pub(crate) fn offered_qos_profiles(self) -> String {
        let (sec, nsec) = INFINITE;
        let duration = |name: &str| format!("  {name}:\n    sec: {sec}\n    nsec: {nsec}\n");
        format!(
            "- history: unknown\n  depth: 0\n  reliability: reliable\n  durability: {}\n{}{}  \
             liveliness: automatic\n{}  avoid_ros_namespace_conventions: false",
            self.as_str(),
            duration("deadline"),
            duration("lifespan"),
            duration("liveliness_lease_duration"),
        )
    }
}

/// A topic in the description of a bag.
pub(crate) struct TopicDescription {
    pub(crate) name: String,
    pub(crate) type_name: String,
    pub(crate) encoding: String,
    pub(crate) durability: Durability,
    pub(crate) count: u32,
}

/// File name in the description of a log. rosbag2 replaces it by the name of the file that it
/// opens, so that the content of a log does not depend on its name.
pub(crate) const ANY_NAME: &str = "log.mcap";

/// Description of a bag of one file.
pub(crate) struct BagDescription<'a> {
    /// First and last log time, ns; zero for an empty log.
    pub(crate) times_ns: (u64, u64),
    pub(crate) topics: &'a [TopicDescription],
}

impl BagDescription<'_> {
    /// Returns the content of `metadata.yaml` for a file of this name.
    pub(crate) fn file(&self, name: &str) -> String {
        let lines = self.serialized(name).replace('\n', "\n  ");
        format!("rosbag2_bagfile_information:\n  {lines}\n")
    }

    /// Returns the value of `serialized_metadata` in the `rosbag2` record, which is YAML, for a
    /// file of this name.
    pub(crate) fn serialized(&self, file: &str) -> String {
        let (start, end) = self.times_ns;
        let (duration, count) = (end - start, self.message_count());
        let topics: String = self.topics.iter().map(describe).collect();
        let mut yaml = format!("version: {METADATA_VERSION}\nstorage_identifier: mcap\n");
        // Writing to a string cannot fail.
        let _ = write!(
            yaml,
            "duration:\n  nanoseconds: {duration}\n\
             starting_time:\n  nanoseconds_since_epoch: {start}\n\
             message_count: {count}\n\
             topics_with_message_count:{}\n{topics}\
             compression_format: \"\"\ncompression_mode: \"\"\n\
             relative_file_paths:\n  - {file}\n\
             files:\n  - path: {file}\n    \
             starting_time:\n      nanoseconds_since_epoch: {start}\n    \
             duration:\n      nanoseconds: {duration}\n    \
             message_count: {count}\n\
             custom_data: ~\nros_distro: jazzy",
            if topics.is_empty() { " []" } else { "" },
        );
        yaml
    }

    fn message_count(&self) -> u64 {
        self.topics.iter().map(|topic| u64::from(topic.count)).sum()
    }
}

fn describe(topic: &TopicDescription) -> String {
    let qos = topic
        .durability
        .offered_qos_profiles()
        .replace('\n', "\n        ");
    format!(
        "  - topic_metadata:\n      name: {}\n      type: {}\n      \
         serialization_format: {}\n      offered_qos_profiles:\n        {qos}\n      \
         type_description_hash: \"\"\n    message_count: {}\n",
        topic.name, topic.type_name, topic.encoding, topic.count,
    )
}

/// Returns the reason why ROS 2 does not allow a topic name, or `None` if it is allowed.
pub(crate) fn invalid_topic(name: &str) -> Option<&'static str> {
    let Some(tokens) = name.strip_prefix('/') else {
        return Some("a topic's full name starts with \"/\"");
    };
    let starts_well =
        |token: &str| token.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    let fits = |token: &str| token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if tokens
        .split('/')
        .all(|token| starts_well(token) && fits(token))
    {
        None
    } else {
        Some(
            "the names between \"/\" consist of letters, digits and \"_\" and do not start with a digit",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topic_names_follow_ros() {
        for good in ["/tf", "/finger_left/wrench", "/a/_b/c2"] {
            assert_eq!(invalid_topic(good), None, "{good}");
        }
        for bad in [
            "", "/", "tf", "/a//b", "/a/", "/2a", "/a b", "/ä", "/a\n- x",
        ] {
            assert!(invalid_topic(bad).is_some(), "{bad:?}");
        }
    }
}
