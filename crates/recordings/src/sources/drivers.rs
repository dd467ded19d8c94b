//! What drivers publish: the table of the documentation, and the options that are proposed for topics with
//! the names that drivers give them.

use tactid_dynamics::Manipulator;
use tactid_logs::{LogReader, Topic};

use crate::defaults::Options;
use crate::{Finding, Request};

/// A topic or a field of a driver.
struct Driver {
    /// Row of the table in `docs/how-to/drivers.md`, in Markdown: driver, topic or field, what it is, options.
    cells: [&'static str; 4],
    /// How it is recognized, and what is proposed; `None` where nothing need be given.
    known: Option<Known>,
}

/// A topic that is recognized by its name.
struct Known {
    /// Ends of the name, in lower case.
    ends: &'static [&'static str],
    /// End of the name of a joint that the robot has, where drivers of other robots give the same name to a topic.
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
    /// Returns the end of the name of a topic that is recognized. Names of columns may end in `_`.
    fn end_of(&self, topic: &str, robot: &Manipulator) -> Option<&'static str> {
        let lower = topic.to_lowercase();
        let name = lower.trim_end_matches('_');
        let end = self.ends.iter().find(|end| {
            let before = name.strip_suffix(**end);
            before.is_some_and(|before| !before.ends_with(char::is_alphanumeric))
        })?;
        let has_joint = |end: &str| robot.joint_names().iter().any(|name| name.ends_with(end));
        self.joint.is_none_or(has_joint).then_some(*end)
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

/// Proposes options for the topics that are read and that are those of known drivers, unless the request settles them.
pub(super) fn recognized(
    log: &LogReader,
    topics: &[String],
    robot: &Manipulator,
    request: &Request,
    options: &Options,
) -> Vec<Finding> {
    let proposal = |topic: &String| {
        let mut known = DRIVERS.iter().filter_map(|driver| driver.known.as_ref());
        let (known, end) = known.find_map(|known| Some((known, known.end_of(topic, robot)?)))?;
        let value = match known.value {
            Value::Fixed(value) => value.to_owned(),
            Value::Link(name) => robot.frame(name).ok().map(|_| name.to_owned())?,
            Value::Base => robot.frame_name(robot.base_frame()).to_owned(),
            Value::Sibling(other) => {
                let value = format!("{}{other}", &topic[..topic.len() - end.len()]);
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

/// Returns the table of `docs/how-to/drivers.md`: what drivers publish, and the options that read it.
#[must_use]
pub fn driver_table() -> String {
    let head = ["driver", "topic or field", "what it is", "options"];
    let rows = DRIVERS.iter().map(|driver| driver.cells);
    let rows = [head, ["---"; 4]].into_iter().chain(rows);
    rows.map(|cells| format!("| {} |\n", cells.join(" | ")))
        .collect()
}

const UR_WRENCH: &str = "a wrench from which UR's controller subtracts the weight of the payload that is configured there";
const FRANKA_WRENCH: &str =
    "Franka's estimate, from which the forces of the load that is configured there are subtracted";

/// All drivers; `docs/how-to/drivers.md` has the sources.
#[rustfmt::skip]
const DRIVERS: &[Driver] = &[
    Driver {
        cells: [
            r"UR, `ur_robot_driver`",
            r"`/force_torque_sensor_broadcaster/wrench`",
            r"`actual_TCP_force` turned to the frame `tool0_controller` or `tool0`, [zeroed, and without the configured payload][ur-wrench]; the controller [zeroes it when a program starts][ur-zero]",
            r"[`--wrench-is without-weight`, with `--configured-payload`](offsets.md), unless none is configured; an offset is found by itself",
        ],
        known: Some(Known {
            ends: &["force_torque_sensor_broadcaster/wrench"],
            joint: Some("shoulder_pan_joint"),
            content: UR_WRENCH,
            option: "wrench_is",
            value: Value::Fixed("without-weight"),
        }),
    },
    Driver {
        cells: [
            r"UR, RTDE",
            r"`actual_TCP_force`",
            r"the same [along the axes of `base`, about the configured TCP][ur-axes]",
            r"`--wrench-axes base`, and `--sensor-frame` for a TCP that is not the tip",
        ],
        known: Some(Known {
            ends: &["actual_tcp_force"],
            joint: None,
            content: "UR's wrench along the axes of the base, about the configured TCP",
            option: "wrench_axes",
            value: Value::Link("base"),
        }),
    },
    Driver {
        cells: [
            r"UR, RTDE",
            r"`ft_raw_wrench`",
            r"[the raw wrench of the sensor][ur-zero]",
            r"none",
        ],
        known: None,
    },
    Driver {
        cells: [
            r"UR, `ur_robot_driver`",
            r"efforts in `/joint_states`",
            r"motor currents; with a recent driver and controller [torques, `actual_current_as_torque`][ur-efforts]",
            r"currents: [calibrate](calibrate.md); torques: `--efforts-are measured`, or `without-gravity` where the message says so",
        ],
        known: None,
    },
    Driver {
        cells: [
            r"Franka, `franka_ros2`, `franka_ros`",
            r"`.../external_wrench_in_stiffness_frame`, `/franka_state_controller/F_ext`, `K_F_ext_hat_K`",
            r"an estimate from the joint torques [in the stiffness frame][franka]",
            r"`--wrench-is contact`, with `--configured-payload`, if a load is configured; `--sensor-frame`, if this frame is not the tip",
        ],
        known: Some(Known {
            ends: &["external_wrench_in_stiffness_frame", "franka_state_controller/f_ext", "k_f_ext_hat_k"],
            joint: None,
            content: FRANKA_WRENCH,
            option: "wrench_is",
            value: Value::Fixed("contact"),
        }),
    },
    Driver {
        cells: [
            r"Franka, `franka_ros2`",
            r"`.../external_wrench_in_base_frame`, `O_F_ext_hat_K`",
            r"the same [along the axes of the base][franka]",
            r"`--wrench-axes panda_link0` or `fr3_link0`",
        ],
        known: Some(Known {
            ends: &["external_wrench_in_base_frame", "o_f_ext_hat_k"],
            joint: None,
            content: "Franka's estimate, along the axes of the base and about the origin of its stiffness frame",
            option: "wrench_axes",
            value: Value::Base,
        }),
    },
    Driver {
        cells: [
            r"Franka",
            r"`.../external_joint_torques`, `tau_ext_hat_filtered`",
            r"[torques without those of the arm and of the configured load][franka]",
            r"`--efforts-are external`, with the joint positions in the same messages or as [arrays](../tutorials/arrays.md)",
        ],
        known: Some(Known {
            ends: &["external_joint_torques", "tau_ext_hat_filtered"],
            joint: None,
            content: "Franka's estimate of torques without those of the arm itself",
            option: "efforts_are",
            value: Value::Fixed("external"),
        }),
    },
    Driver {
        cells: [
            r"Franka",
            r"`.../measured_joint_states`, `tau_J`",
            r"[measured torques][franka]",
            r"none",
        ],
        known: None,
    },
    Driver {
        cells: [
            r"KUKA, FRI",
            r"[`getMeasuredTorque`, `getExternalTorque`][kuka], columns such as `external_torque_1`",
            r"measured torques; torques without those of the arm and of the configured tool",
            r"none; `--efforts-are external`",
        ],
        known: Some(Known {
            ends: &["external_torque", "external_torques", "getexternaltorque"],
            joint: None,
            content: "torques without those of the arm and of the configured tool, as KUKA's external torques",
            option: "efforts_are",
            value: Value::Fixed("external"),
        }),
    },
    Driver {
        cells: [
            r"Kinova Gen3",
            r"efforts in `/joint_states`",
            r"torques of the joints",
            r"none",
        ],
        known: None,
    },
    Driver {
        cells: [
            r"Kinova Gen3",
            r"`tool_external_wrench_*` in the base feedback",
            r"[an estimate from the joint torques, without the arm's weight, and only in high-level control][kinova]",
            r"its axes are not documented: a finding names them; torques of the joints are better",
        ],
        known: None,
    },
    Driver {
        cells: [
            r"xArm",
            r"`uf_ftsensor_raw_states`",
            r"[the raw wrench][xarm]",
            r"none",
        ],
        known: None,
    },
    Driver {
        cells: [
            r"xArm",
            r"`uf_ftsensor_ext_states`",
            r"[filtered, and without the load that the controller knows][xarm]",
            r"name the raw topic: `--wrench-topic`",
        ],
        known: Some(Known {
            ends: &["uf_ftsensor_ext_states"],
            joint: None,
            content: "xArm's wrench without the load that its controller knows",
            option: "wrench_topic",
            value: Value::Sibling("uf_ftsensor_raw_states"),
        }),
    },
    Driver {
        cells: [
            r"Doosan",
            r"`get_external_torque`, `actual_ejt`",
            r"[torques without those of the arm][doosan-torque]",
            r"`--efforts-are external`",
        ],
        known: Some(Known {
            ends: &["actual_ejt", "get_external_torque"],
            joint: None,
            content: "Doosan's torques without those of the arm",
            option: "efforts_are",
            value: Value::Fixed("external"),
        }),
    },
    Driver {
        cells: [
            r"Doosan",
            r"`actual_jts`",
            r"[torques of the joints' sensors][doosan-monitor]",
            r"none",
        ],
        known: None,
    },
    Driver {
        cells: [
            r"Doosan",
            r"`get_tool_force`",
            r"[along the axes of the reference coordinates; moments were along those of the tool before version 2.8][doosan-force]",
            r"`--wrench-axes`, with the link of these coordinates",
        ],
        known: Some(Known {
            ends: &["get_tool_force"],
            joint: None,
            content: "Doosan's wrench along the axes of the reference coordinates",
            option: "wrench_axes",
            value: Value::Base,
        }),
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of the page is the one here.
    #[test]
    fn the_page_has_the_table() {
        let page = include_str!("../../../../docs/how-to/drivers.md");
        let table = driver_table();
        assert!(
            page.contains(&table),
            "docs/how-to/drivers.md must contain:\n{table}"
        );
    }
}
