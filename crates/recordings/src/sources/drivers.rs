//! Topics that drivers publish under names of their own, with the option that reads them rightly.
//!
//! `docs/how-to/drivers.md` has the sources.

use tactid_dynamics::Manipulator;
use tactid_logs::{LogReader, Topic};

use crate::defaults::Options;
use crate::{EffortContent, Finding};

/// A topic of a driver.
struct KnownTopic {
    /// End of its name, in lower case.
    suffix: &'static str,
    content: &'static str,
    option: &'static str,
    value: Value,
}

/// Value of the option that reads a topic rightly.
enum Value {
    Fixed(&'static str),
    /// The base of the robot.
    Base,
    /// The topic with another end of its name, if the log has it.
    Sibling(&'static str),
}

const FRANKA_BASE: &str =
    "Franka's estimate, along the axes of the base and about the origin of its stiffness frame";
const FRANKA_TORQUES: &str = "Franka's estimate of torques without those of the arm itself";

const KNOWN: [KnownTopic; 5] = [
    KnownTopic {
        suffix: "external_wrench_in_base_frame",
        content: FRANKA_BASE,
        option: "wrench_axes",
        value: Value::Base,
    },
    KnownTopic {
        suffix: "o_f_ext_hat_k",
        content: FRANKA_BASE,
        option: "wrench_axes",
        value: Value::Base,
    },
    KnownTopic {
        suffix: "external_joint_torques",
        content: FRANKA_TORQUES,
        option: "efforts_are",
        value: Value::Fixed("external"),
    },
    KnownTopic {
        suffix: "tau_ext_hat_filtered",
        content: FRANKA_TORQUES,
        option: "efforts_are",
        value: Value::Fixed("external"),
    },
    KnownTopic {
        suffix: "uf_ftsensor_ext_states",
        content: "xArm's wrench without the load that its controller knows",
        option: "wrench_topic",
        value: Value::Sibling("uf_ftsensor_raw_states"),
    },
];

/// Proposes options for the topics that are read and that are those of known drivers, unless they are chosen already.
pub(super) fn recognized(
    log: &LogReader,
    topics: &[String],
    robot: &Manipulator,
    options: &Options,
) -> Vec<Finding> {
    let proposal = |topic: &String| {
        let lower = topic.to_lowercase();
        let known = KNOWN.iter().find(|known| lower.ends_with(known.suffix))?;
        let is_chosen = |value: &str| match known.option {
            "wrench_axes" => options.equations.wrench_axes.is_some(),
            "efforts_are" => options.equations.effort_content != EffortContent::Measured,
            _ => topics.iter().any(|topic| topic == value),
        };
        let value = match known.value {
            Value::Fixed(value) => value.to_owned(),
            Value::Base => robot.frame_name(robot.base_frame()).to_owned(),
            Value::Sibling(end) => {
                let value = format!("{}{end}", &topic[..topic.len() - known.suffix.len()]);
                log.topic(&value).filter(|found: &&Topic| found.count > 0)?;
                value
            }
        };
        (!is_chosen(&value)).then(|| Finding::TopicRecognized {
            topic: topic.clone(),
            content: known.content.into(),
            option: known.option.into(),
            value,
        })
    };
    topics.iter().filter_map(proposal).collect()
}
