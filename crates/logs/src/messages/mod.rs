//! ROS 2 messages, field for field as their `.msg` files have them.
//!
//! Units and frames are those of ROS: SI, and what a header's `frame_id` says. Each type that is
//! logged on a topic of its own implements [`Message`].

mod schema;

use std::sync::LazyLock;

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_big_array::BigArray;

/// A type that can be a log's topic.
pub trait Message: Serialize + DeserializeOwned {
    /// The full name, such as `sensor_msgs/msg/JointState`.
    const TYPE: &'static str;

    /// The `ros2msg` schema: the definition, then every nested one.
    fn schema() -> &'static str;

    /// The header of the message, if its type has one.
    fn header(&self) -> Option<&Header> {
        None
    }

    /// The header's stamp: when the message's data was measured.
    fn stamp(&self) -> Option<Time> {
        self.header().map(|header| header.stamp)
    }
}

/// Implements [`Message`] for a type, with or without a header.
macro_rules! message {
    ($type:ident, $name:literal) => {
        message!($type, $name, |_| None);
    };
    ($type:ident, $name:literal, header) => {
        message!($type, $name, |message| Some(&message.header));
    };
    ($type:ident, $name:literal, |$message:tt| $header:expr) => {
        impl Message for $type {
            const TYPE: &'static str = $name;

            fn schema() -> &'static str {
                static SCHEMA: LazyLock<String> = LazyLock::new(|| schema::compose($name));
                &SCHEMA
            }

            fn header(&self) -> Option<&Header> {
                let $message = self;
                $header
            }
        }
    };
}

message!(Time, "builtin_interfaces/msg/Time");
message!(StringMsg, "std_msgs/msg/String");
message!(Header, "std_msgs/msg/Header", |header| Some(header));
message!(Float64MultiArray, "std_msgs/msg/Float64MultiArray");
message!(JointState, "sensor_msgs/msg/JointState", header);
message!(Imu, "sensor_msgs/msg/Imu", header);
message!(PointCloud2, "sensor_msgs/msg/PointCloud2", header);
message!(PoseStamped, "geometry_msgs/msg/PoseStamped", header);
message!(TwistStamped, "geometry_msgs/msg/TwistStamped", header);
message!(AccelStamped, "geometry_msgs/msg/AccelStamped", header);
message!(WrenchStamped, "geometry_msgs/msg/WrenchStamped", header);
message!(InertiaStamped, "geometry_msgs/msg/InertiaStamped", header);
message!(
    TransformStamped,
    "geometry_msgs/msg/TransformStamped",
    header
);
message!(Odometry, "nav_msgs/msg/Odometry", header);
message!(TFMessage, "tf2_msgs/msg/TFMessage");

/// `builtin_interfaces/msg/Time`: a point in time since the epoch of the log's clock.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Time {
    /// Whole seconds.
    pub sec: i32,
    /// Nanoseconds after `sec`, less than 1e9.
    pub nanosec: u32,
}

impl Time {
    /// From nanoseconds since the epoch. ROS counts seconds in an `i32`: times after 2038 become
    /// the last one that it can say.
    #[must_use]
    pub fn from_ns(ns: u64) -> Self {
        match i32::try_from(ns / 1_000_000_000) {
            // A remainder of 1e9 fits in u32.
            Ok(sec) => Self {
                sec,
                nanosec: (ns % 1_000_000_000) as u32,
            },
            Err(_) => Self {
                sec: i32::MAX,
                nanosec: 999_999_999,
            },
        }
    }

    /// Nanoseconds since the epoch, negative before it.
    #[must_use]
    pub fn as_ns(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

/// `std_msgs/msg/String`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StringMsg {
    /// The text.
    pub data: String,
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// When the data was measured.
    pub stamp: Time,
    /// The frame in which the data is expressed.
    pub frame_id: String,
}

/// `std_msgs/msg/MultiArrayDimension`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MultiArrayDimension {
    /// What the dimension is.
    pub label: String,
    /// Its size in elements.
    pub size: u32,
    /// Its stride in elements.
    pub stride: u32,
}

/// `std_msgs/msg/MultiArrayLayout`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MultiArrayLayout {
    /// Outermost dimension first.
    pub dim: Vec<MultiArrayDimension>,
    /// Padding elements before the data.
    pub data_offset: u32,
}

/// `std_msgs/msg/Float64MultiArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Float64MultiArray {
    /// What the data's dimensions mean.
    pub layout: MultiArrayLayout,
    /// The elements.
    pub data: Vec<f64>,
}

/// `sensor_msgs/msg/JointState`. Each sequence is empty where nothing is measured, and otherwise
/// as long as `name`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointState {
    /// The stamp; the frame is not used.
    pub header: Header,
    /// The joints, in any order.
    pub name: Vec<String>,
    /// rad or m.
    pub position: Vec<f64>,
    /// rad/s or m/s.
    pub velocity: Vec<f64>,
    /// N m or N.
    pub effort: Vec<f64>,
}

/// `sensor_msgs/msg/Imu`, expressed in `header.frame_id`. Covariances are row-major 3 x 3 about
/// x, y, z; a first element of -1 says that the quantity is not measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Imu {
    /// Stamp and frame.
    pub header: Header,
    /// Of the sensor in its world.
    pub orientation: Quaternion,
    /// rad².
    pub orientation_covariance: [f64; 9],
    /// rad/s.
    pub angular_velocity: Vector3,
    /// (rad/s)².
    pub angular_velocity_covariance: [f64; 9],
    /// Specific force in m/s²: a sensor at rest on the ground reads 9.81 upwards.
    pub linear_acceleration: Vector3,
    /// (m/s²)².
    pub linear_acceleration_covariance: [f64; 9],
}

/// `sensor_msgs/msg/PointField`: one channel of a [`PointCloud2`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointField {
    /// Such as `x`.
    pub name: String,
    /// Bytes from the start of a point.
    pub offset: u32,
    /// One of the constants of this type.
    pub datatype: u8,
    /// Elements in the field.
    pub count: u32,
}

impl PointField {
    /// `i8`.
    pub const INT8: u8 = 1;
    /// `u8`.
    pub const UINT8: u8 = 2;
    /// `i16`.
    pub const INT16: u8 = 3;
    /// `u16`.
    pub const UINT16: u8 = 4;
    /// `i32`.
    pub const INT32: u8 = 5;
    /// `u32`.
    pub const UINT32: u8 = 6;
    /// `f32`.
    pub const FLOAT32: u8 = 7;
    /// `f64`.
    pub const FLOAT64: u8 = 8;
}

/// `sensor_msgs/msg/PointCloud2`: points whose channels `fields` describes, in `header.frame_id`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointCloud2 {
    /// Stamp and frame.
    pub header: Header,
    /// 1 for an unordered cloud.
    pub height: u32,
    /// Points in a row.
    pub width: u32,
    /// The channels of a point.
    pub fields: Vec<PointField>,
    /// The byte order of `data`.
    pub is_bigendian: bool,
    /// Bytes of a point.
    pub point_step: u32,
    /// Bytes of a row.
    pub row_step: u32,
    /// `row_step * height` bytes.
    pub data: Vec<u8>,
    /// Whether no point is invalid.
    pub is_dense: bool,
}

/// `geometry_msgs/msg/Vector3`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vector3 {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
}

impl From<[f64; 3]> for Vector3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

impl From<Vector3> for [f64; 3] {
    fn from(v: Vector3) -> Self {
        [v.x, v.y, v.z]
    }
}

/// `geometry_msgs/msg/Point`: a position in m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
}

impl From<[f64; 3]> for Point {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

impl From<Point> for [f64; 3] {
    fn from(p: Point) -> Self {
        [p.x, p.y, p.z]
    }
}

/// `geometry_msgs/msg/Quaternion`; the default is no rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// Vector part along x.
    pub x: f64,
    /// Vector part along y.
    pub y: f64,
    /// Vector part along z.
    pub z: f64,
    /// Scalar part.
    pub w: f64,
}

impl Default for Quaternion {
    fn default() -> Self {
        Self {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        }
    }
}

/// `geometry_msgs/msg/Pose`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Of the body's origin, in m.
    pub position: Point,
    /// From the body's axes to the frame's.
    pub orientation: Quaternion,
}

/// `geometry_msgs/msg/PoseStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// Stamp and frame.
    pub header: Header,
    /// In `header.frame_id`.
    pub pose: Pose,
}

/// `geometry_msgs/msg/PoseWithCovariance`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The estimate.
    pub pose: Pose,
    /// Row-major 6 x 6 of x, y, z, and the rotations about x, y, z.
    #[serde(with = "BigArray")]
    pub covariance: [f64; 36],
}

impl Default for PoseWithCovariance {
    fn default() -> Self {
        Self {
            pose: Pose::default(),
            covariance: [0.0; 36],
        }
    }
}

/// `geometry_msgs/msg/Twist`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// m/s, of the frame's origin.
    pub linear: Vector3,
    /// rad/s.
    pub angular: Vector3,
}

/// `geometry_msgs/msg/TwistStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistStamped {
    /// Stamp and frame.
    pub header: Header,
    /// In `header.frame_id`.
    pub twist: Twist,
}

/// `geometry_msgs/msg/TwistWithCovariance`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// The estimate.
    pub twist: Twist,
    /// Row-major 6 x 6 of the linear and the angular velocity.
    #[serde(with = "BigArray")]
    pub covariance: [f64; 36],
}

impl Default for TwistWithCovariance {
    fn default() -> Self {
        Self {
            twist: Twist::default(),
            covariance: [0.0; 36],
        }
    }
}

/// `geometry_msgs/msg/Accel`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Accel {
    /// m/s², of the frame's origin.
    pub linear: Vector3,
    /// rad/s².
    pub angular: Vector3,
}

/// `geometry_msgs/msg/AccelStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AccelStamped {
    /// Stamp and frame.
    pub header: Header,
    /// In `header.frame_id`.
    pub accel: Accel,
}

/// `geometry_msgs/msg/Wrench`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// N.
    pub force: Vector3,
    /// N m, about the frame's origin.
    pub torque: Vector3,
}

/// `geometry_msgs/msg/WrenchStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WrenchStamped {
    /// Stamp and frame.
    pub header: Header,
    /// Expressed in `header.frame_id`, about its origin.
    pub wrench: Wrench,
}

/// `geometry_msgs/msg/Inertia`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inertia {
    /// Mass in kg.
    pub m: f64,
    /// Centre of mass in m.
    pub com: Vector3,
    /// kg m², about the centre of mass, as the five below.
    pub ixx: f64,
    /// Off the diagonal.
    pub ixy: f64,
    /// Off the diagonal.
    pub ixz: f64,
    /// On the diagonal.
    pub iyy: f64,
    /// Off the diagonal.
    pub iyz: f64,
    /// On the diagonal.
    pub izz: f64,
}

/// `geometry_msgs/msg/InertiaStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InertiaStamped {
    /// Stamp and frame.
    pub header: Header,
    /// In `header.frame_id`.
    pub inertia: Inertia,
}

/// `geometry_msgs/msg/Transform`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// Of the child's origin in the parent, in m.
    pub translation: Vector3,
    /// From the child's axes to the parent's.
    pub rotation: Quaternion,
}

/// `geometry_msgs/msg/TransformStamped`: the pose of `child_frame_id` in `header.frame_id`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// Stamp and parent frame.
    pub header: Header,
    /// The frame whose pose it is.
    pub child_frame_id: String,
    /// parent_from_child.
    pub transform: Transform,
}

/// `nav_msgs/msg/Odometry`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// Stamp, and the frame of the pose.
    pub header: Header,
    /// The frame of the twist, and the body that moves.
    pub child_frame_id: String,
    /// Of the child in `header.frame_id`.
    pub pose: PoseWithCovariance,
    /// Of the child's origin, expressed in `child_frame_id`.
    pub twist: TwistWithCovariance,
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TFMessage {
    /// One for each frame that moved.
    pub transforms: Vec<TransformStamped>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_and_nanoseconds_are_inverse() {
        for ns in [0, 1, 999_999_999, 1_000_000_000, 1_700_000_000_123_456_789] {
            assert_eq!(Time::from_ns(ns).as_ns(), ns as i64);
        }
        assert_eq!(
            Time {
                sec: -1,
                nanosec: 5
            }
            .as_ns(),
            -999_999_995
        );
        assert_eq!(
            Time::from_ns(u64::MAX),
            Time {
                sec: i32::MAX,
                nanosec: 999_999_999
            }
        );
    }
}
