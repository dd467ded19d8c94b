//! The message definitions of ROS 2 and the schemas that a log contains.

use std::fmt::Write;

/// Name (`pkg/Type`) and text of one definition under `schemas/`.
macro_rules! definition {
    ($package:literal, $name:literal) => {
        (
            concat!($package, "/", $name),
            include_str!(concat!("../../schemas/", $package, "/msg/", $name, ".msg")),
        )
    };
}

const DEFINITIONS: &[(&str, &str)] = &[
    definition!("builtin_interfaces", "Duration"),
    definition!("builtin_interfaces", "Time"),
    definition!("geometry_msgs", "Accel"),
    definition!("geometry_msgs", "AccelStamped"),
    definition!("geometry_msgs", "Inertia"),
    definition!("geometry_msgs", "InertiaStamped"),
    definition!("geometry_msgs", "Point"),
    definition!("geometry_msgs", "Pose"),
    definition!("geometry_msgs", "PoseStamped"),
    definition!("geometry_msgs", "PoseWithCovariance"),
    definition!("geometry_msgs", "Quaternion"),
    definition!("geometry_msgs", "Transform"),
    definition!("geometry_msgs", "TransformStamped"),
    definition!("geometry_msgs", "Twist"),
    definition!("geometry_msgs", "TwistStamped"),
    definition!("geometry_msgs", "TwistWithCovariance"),
    definition!("geometry_msgs", "Vector3"),
    definition!("geometry_msgs", "Wrench"),
    definition!("geometry_msgs", "WrenchStamped"),
    definition!("nav_msgs", "Odometry"),
    definition!("sensor_msgs", "Imu"),
    definition!("sensor_msgs", "JointState"),
    definition!("sensor_msgs", "PointCloud2"),
    definition!("sensor_msgs", "PointField"),
    definition!("std_msgs", "Float64MultiArray"),
    definition!("std_msgs", "Header"),
    definition!("std_msgs", "MultiArrayDimension"),
    definition!("std_msgs", "MultiArrayLayout"),
    definition!("std_msgs", "String"),
    definition!("tf2_msgs", "TFMessage"),
    definition!("trajectory_msgs", "JointTrajectory"),
    definition!("trajectory_msgs", "JointTrajectoryPoint"),
];

/// Separator between two definitions in a `ros2msg` schema.
const SEPARATOR: &str =
    "================================================================================";

/// Returns the `ros2msg` schema of `type_name` (`pkg/msg/Type`): its definition, then every nested
/// definition once.
pub(super) fn compose(type_name: &str) -> String {
    let root = type_name.replace("/msg/", "/");
    let mut names = vec![root];
    let mut schema = String::new();
    // Breadth first: `names` grows during the iteration.
    let mut next = 0;
    while let Some(name) = names.get(next).cloned() {
        let text = definition(&name);
        if next > 0 {
            // Writing to a string cannot fail.
            let _ = write!(schema, "{SEPARATOR}\nMSG: {name}\n");
        }
        schema.push_str(text);
        for nested in nested_types(&name, text) {
            if !names.contains(&nested) {
                names.push(nested);
            }
        }
        next += 1;
    }
    schema
}

/// Returns the text of a definition, or an empty text for an unknown name, which the tests exclude.
fn definition(name: &str) -> &'static str {
    DEFINITIONS
        .iter()
        .find(|(known, _)| *known == name)
        .map_or("", |(_, text)| text)
}

/// Returns the full names of the message types of the fields of a definition.
fn nested_types(name: &str, text: &str) -> Vec<String> {
    let package = name.split('/').next().unwrap_or_default();
    text.lines()
        .filter_map(|line| line.split_whitespace().next())
        .map(|field_type| field_type.split('[').next().unwrap_or_default())
        .filter(|base| base.starts_with(char::is_uppercase) || base.contains('/'))
        .map(|base| {
            if base.contains('/') {
                base.to_owned()
            } else {
                format!("{package}/{base}")
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every nested type has a definition, so that every schema is complete.
    #[test]
    fn definitions_are_closed() {
        for (name, text) in DEFINITIONS {
            for nested in nested_types(name, text) {
                assert!(
                    !definition(&nested).is_empty(),
                    "{name} nests {nested}, which has no .msg"
                );
            }
        }
    }

    #[test]
    fn nested_definitions_follow_once_each() {
        let nested = |name: &str, text: &str| format!("{SEPARATOR}\nMSG: {name}\n{text}");
        let expected = [
            "geometry_msgs/TransformStamped[] transforms\n".to_owned(),
            nested(
                "geometry_msgs/TransformStamped",
                "std_msgs/Header header\nstring child_frame_id\nTransform transform\n",
            ),
            nested(
                "std_msgs/Header",
                "builtin_interfaces/Time stamp\nstring frame_id\n",
            ),
            nested(
                "geometry_msgs/Transform",
                "Vector3 translation\nQuaternion rotation\n",
            ),
            nested("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
            nested("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
            nested(
                "geometry_msgs/Quaternion",
                "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
            ),
        ]
        .concat();
        assert_eq!(compose("tf2_msgs/msg/TFMessage"), expected);
        assert_eq!(SEPARATOR.len(), 80);
    }
}
