//! Options that are proposed for topics with the names that drivers give them.

use tactid_dynamics::Manipulator;
use tactid_logs::{LogReader, Topic};

use crate::defaults::Options;
use crate::{Finding, Request};

/// A topic that is recognized by its name.
struct Known {
    /// Ends of the name, in lower case.
    ends: &'static [&'static str],
    /// End of the name of a joint that the robot has, where drivers of other robots give the same
    /// name to a topic.
    joint: Option<&'static str>,
    content: &'static str,
    option: &'static str,
    value: Value,
}

/// Value of the option that reads a topic rightly.
enum Value {
    Fixed(&'static str),
    /// The base of the robot.
    Base,
    /// The link of this name, if the robot has it.
    Link(&'static str),
    /// The topic with another end of its name, if the log has it.
    Sibling(&'static str),
}

impl Known {
    /// Returns what stands before the end of the name of a topic that is recognized: whole parts of
    /// the name. Names of columns may end in `_`.
    fn start_of<'a>(&self, topic: &'a str, robot: &Manipulator) -> Option<&'a str> {
        let lower = topic.to_lowercase();
        let name = lower.trim_end_matches('_');
        let end = self.ends.iter().find(|end| {
            let before = name.strip_suffix(**end);
            before.is_some_and(|before| before.is_empty() || before.ends_with('/'))
        })?;
        let has_joint = |end: &str| robot.joint_names().iter().any(|name| name.ends_with(end));
        let is_recognized = self.joint.is_none_or(has_joint);
        is_recognized.then(|| topic.get(..name.len() - end.len()))?
    }

    /// Returns whether a request chooses the option itself, or the option has no effect.
    fn is_settled(&self, request: &Request, options: &Options) -> bool {
        match self.option {
            // That of the frame of the messages, too, where it does not move with the tool.
            "wrench_axes" => options.equations.wrench_axes.is_some(),
            "wrench_is" => request.wrench_is.is_some(),
            "efforts_are" => request.efforts_are.is_some() || !options.method().uses_effort(),
            _ => request.wrench_topic.is_some(),
        }
    }
}

/// Returns whether a finding is the proposal that the weight of a configured payload was
/// subtracted.
pub(crate) fn proposes_weight(finding: &Finding) -> bool {
    matches!(finding, Finding::TopicRecognized { value, .. } if value == WITHOUT_WEIGHT)
}

/// Proposes options for the topics that are read and that are those of known drivers, unless the
/// request settles them.
pub(super) fn recognized(
    log: &LogReader,
    topics: &[String],
    robot: &Manipulator,
    request: &Request,
    options: &Options,
) -> Vec<Finding> {
    let proposal = |topic: &String| {
        let mut known = KNOWN.iter();
        let (known, start) =
            known.find_map(|known| Some((known, known.start_of(topic, robot)?)))?;
        let value = match known.value {
            Value::Fixed(value) => value.to_owned(),
            Value::Link(name) => robot.frame(name).ok().map(|_| name.to_owned())?,
            Value::Base => robot.frame_name(robot.base_frame()).to_owned(),
            Value::Sibling(other) => {
                let value = format!("{start}{other}");
                log.topic(&value).filter(|found: &&Topic| found.count > 0)?;
                value
            }
        };
        (!known.is_settled(request, options)).then(|| Finding::TopicRecognized {
            topic: topic.clone(),
            content: known.content.into(),
            option: known.option.into(),
            value,
        })
    };
    topics.iter().filter_map(proposal).collect()
}

const WITHOUT_WEIGHT: &str = "without-weight";
const UR_WRENCH: &str = "a wrench from which UR's controller subtracts the weight of the payload that is configured there";
const FRANKA_WRENCH: &str =
    "Franka's estimate, from which the forces of the load that is configured there are subtracted";

/// What known drivers publish that needs an option; `docs/how-to/drivers.md` has the sources.
const KNOWN: &[Known] = &[
    Known {
        ends: &["force_torque_sensor_broadcaster/wrench"],
        joint: Some("shoulder_pan_joint"),
        content: UR_WRENCH,
        option: "wrench_is",
        value: Value::Fixed(WITHOUT_WEIGHT),
    },
    Known {
        ends: &["actual_tcp_force"],
        joint: None,
        content: "UR's wrench along the axes of the base, about the configured TCP",
        option: "wrench_axes",
        value: Value::Link("base"),
    },
    Known {
        ends: &[
            "external_wrench_in_stiffness_frame",
            "franka_state_controller/f_ext",
            "k_f_ext_hat_k",
        ],
        joint: None,
        content: FRANKA_WRENCH,
        option: "wrench_is",
        value: Value::Fixed("contact"),
    },
    Known {
        ends: &["external_wrench_in_base_frame", "o_f_ext_hat_k"],
        joint: None,
        content: "Franka's estimate, along the axes of the base and about the origin of its stiffness frame",
        option: "wrench_axes",
        value: Value::Base,
    },
    Known {
        ends: &["external_joint_torques", "tau_ext_hat_filtered"],
        joint: None,
        content: "Franka's estimate of torques without those of the arm itself",
        option: "efforts_are",
        value: Value::Fixed("external"),
    },
    Known {
        ends: &["external_torque", "external_torques", "getexternaltorque"],
        joint: None,
        content: "torques without those of the arm and of the configured tool, as KUKA's external torques",
        option: "efforts_are",
        value: Value::Fixed("external"),
    },
    Known {
        ends: &["tool_external_wrench"],
        joint: None,
        content: "Kinova's estimate from the joint torques, without the forces of arm and configured tool",
        option: "wrench_is",
        value: Value::Fixed("contact"),
    },
    Known {
        ends: &["uf_ftsensor_ext_states"],
        joint: None,
        content: "xArm's wrench without the load that its controller knows",
        option: "wrench_topic",
        value: Value::Sibling("uf_ftsensor_raw_states"),
    },
    Known {
        ends: &["actual_ejt", "get_external_torque"],
        joint: None,
        content: "Doosan's torques without those of the arm",
        option: "efforts_are",
        value: Value::Fixed("external"),
    },
    Known {
        ends: &["get_tool_force"],
        joint: None,
        content: "Doosan's wrench along the axes of the reference coordinates",
        option: "wrench_axes",
        value: Value::Base,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The page has a row for each end of a name that is recognized, with the option that is
    /// proposed.
    #[test]
    fn the_page_has_what_is_recognized() {
        let page = include_str!("../../../../docs/how-to/drivers.md").to_lowercase();
        let rows: Vec<&str> = page.lines().filter(|line| line.starts_with('|')).collect();
        for known in KNOWN {
            let flag = format!("--{}", known.option.replace('_', "-"));
            let has = |end: &&str| {
                let mut rows = rows.iter();
                rows.any(|row| row.contains(*end) && row.contains(&flag))
            };
            assert!(known.ends.iter().any(has), "{:?} {flag}", known.ends);
        }
    }
}
