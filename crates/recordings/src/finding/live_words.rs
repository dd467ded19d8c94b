//! Findings of a live session and of a compensation in words.

use tactid_dynamics::Reader;
use tactid_dynamics::words::{listed, percent};

use super::Finding;

impl Finding {
    /// Says what was noticed of topics while they are read, and of contacts; nothing for other
    /// findings.
    pub(super) fn of_contacts_and_topics(&self, reader: Reader) -> String {
        match self {
            Self::TopicSilent { topic, silent_s } => format!(
                "{topic} has had no message for {silent_s:.1} s: its publisher has ended, or its \
                 messages do not arrive."
            ),
            Self::TopicsNotUsed { topics } => format!(
                "{} came after the identification began and {} not used; {} and {} name the \
                 topics to use.",
                listed(topics),
                if topics.len() == 1 { "is" } else { "are" },
                reader.option("wrench_topic"),
                reader.option("joint_topic"),
            ),
            Self::LiveRestarted { count } => format!(
                "The identification has started again {}, because messages no longer gave samples: \
                 a clock has jumped, or the joints have other names.",
                if *count == 1 {
                    "once".to_owned()
                } else {
                    format!("{count} times")
                }
            ),
            Self::ContactThroughout { fraction } => format!(
                "The wrench of the contact is beyond four standard deviations in {} of the \
                 samples: unless something touched the payload nearly all the time, it is another \
                 one than the given payload, or the zero or the sign of the sensor is another.",
                percent(*fraction)
            ),
            _ => String::new(),
        }
    }
}
