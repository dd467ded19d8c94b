//! ROS 2 messages with the fields of their `.msg` definitions.
//!
//! Units are SI as in ROS. Vectors are expressed in the frame that `frame_id` of the header names.
//! Each type that can be a topic of its own implements [`Message`].

mod geometry;
mod schema;
mod trajectory;

use std::sync::LazyLock;

use crate::cdr::{Field, fields};

pub use geometry::{
    Accel, AccelStamped, Inertia, InertiaStamped, Point, Pose, PoseStamped, PoseWithCovariance,
    Quaternion, Transform, TransformStamped, Twist, TwistStamped, TwistWithCovariance, Vector3,
    Wrench, WrenchStamped,
};
pub use trajectory::{Duration, JointTrajectory, JointTrajectoryPoint};

/// Returns the `ros2msg` schema of a type by its name; empty for a type that is not defined here.
pub(crate) fn schema_of(type_name: &str) -> String {
    schema::compose(type_name)
}

/// A message type that can be the type of a topic.
pub trait Message: Field + Default {
    /// Full name of the type, for instance `sensor_msgs/msg/JointState`.
    const TYPE: &'static str;

    /// Returns the `ros2msg` schema: the definition of the type, followed by all nested
    /// definitions.
    fn schema() -> &'static str;

    /// Returns the header of the message, or `None` if its type has none.
    fn header(&self) -> Option<&Header> {
        None
    }

    /// Returns the stamp of the header, which is the time of measurement, or `None` if the type has
    /// no header.
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

/// Implements [`Message`] for each type, and lists their names.
macro_rules! messages {
    ($([$type:ident, $name:literal $($header:tt)*])*) => {
        $(message!($type, $name $($header)*);)*

        /// Names of all types that implement [`Message`].
        pub const TYPES: &[&str] = &[$($name),*];
    };
}

messages! {
    [Time, "builtin_interfaces/msg/Time"]
    [StringMsg, "std_msgs/msg/String"]
    [Header, "std_msgs/msg/Header", |header| Some(header)]
    [Float64MultiArray, "std_msgs/msg/Float64MultiArray"]
    [JointState, "sensor_msgs/msg/JointState", header]
    [Imu, "sensor_msgs/msg/Imu", header]
    [PointCloud2, "sensor_msgs/msg/PointCloud2", header]
    [PoseStamped, "geometry_msgs/msg/PoseStamped", header]
    [TwistStamped, "geometry_msgs/msg/TwistStamped", header]
    [AccelStamped, "geometry_msgs/msg/AccelStamped", header]
    [WrenchStamped, "geometry_msgs/msg/WrenchStamped", header]
    [InertiaStamped, "geometry_msgs/msg/InertiaStamped", header]
    [TransformStamped, "geometry_msgs/msg/TransformStamped", header]
    [Odometry, "nav_msgs/msg/Odometry", header]
    [TFMessage, "tf2_msgs/msg/TFMessage"]
    [JointTrajectory, "trajectory_msgs/msg/JointTrajectory", header]
}

/// `builtin_interfaces/msg/Time`: a time since the epoch of the log's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time {
    /// Whole seconds.
    pub sec: i32,
    /// Nanoseconds after `sec`, less than 1e9.
    pub nanosec: u32,
}

fields!(Time: sec, nanosec);

/// Returns whole seconds and the nanoseconds after them, or the largest ones that ROS can store.
fn split_ns(ns: u64) -> (i32, u32) {
    match i32::try_from(ns / 1_000_000_000) {
        // The remainder is below 1e9, which fits in u32.
        Ok(sec) => (sec, (ns % 1_000_000_000) as u32),
        Err(_) => (i32::MAX, 999_999_999),
    }
}

impl Time {
    /// Converts nanoseconds since the epoch. ROS stores seconds in an `i32`: times after 2038
    /// become the latest representable time.
    #[must_use]
    pub fn from_ns(ns: u64) -> Self {
        let (sec, nanosec) = split_ns(ns);
        Self { sec, nanosec }
    }

    /// Returns the nanoseconds since the epoch, negative before it.
    #[must_use]
    pub fn as_ns(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

/// `std_msgs/msg/String`: a text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StringMsg {
    /// The text.
    pub data: String,
}

fields!(StringMsg: data);

/// `std_msgs/msg/Header`: time and frame of the data of a message.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// Time of measurement.
    pub stamp: Time,
    /// Name of the frame in which the data is expressed.
    pub frame_id: String,
}

fields!(Header: stamp, frame_id);

/// `std_msgs/msg/MultiArrayDimension`: one dimension of an array.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MultiArrayDimension {
    /// Name of the dimension.
    pub label: String,
    /// Size of the dimension in elements.
    pub size: u32,
    /// Stride of the dimension in elements.
    pub stride: u32,
}

fields!(MultiArrayDimension: label, size, stride);

/// `std_msgs/msg/MultiArrayLayout`: the dimensions of an array.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MultiArrayLayout {
    /// Dimensions, the outermost first.
    pub dim: Vec<MultiArrayDimension>,
    /// Number of padding elements before the data.
    pub data_offset: u32,
}

fields!(MultiArrayLayout: dim, data_offset);

/// `std_msgs/msg/Float64MultiArray`: an array of numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Float64MultiArray {
    /// Dimensions of the array.
    pub layout: MultiArrayLayout,
    /// Elements of the array.
    pub data: Vec<f64>,
}

fields!(Float64MultiArray: layout, data);

/// `sensor_msgs/msg/JointState`: measurements of joints. Each sequence is either empty, if the
/// quantity is not measured, or as long as `name`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointState {
    /// Time stamp. The frame is not used.
    pub header: Header,
    /// Names of the joints, in any order.
    pub name: Vec<String>,
    /// Positions, rad or m.
    pub position: Vec<f64>,
    /// Velocities, rad/s or m/s.
    pub velocity: Vec<f64>,
    /// Efforts, N m or N.
    pub effort: Vec<f64>,
}

fields!(JointState: header, name, position, velocity, effort);

/// `sensor_msgs/msg/Imu`: measurement of an inertial measurement unit, expressed in
/// `header.frame_id`. Covariances are row-major 3x3 matrices for x, y, z. A first element of -1
/// marks a quantity that is not measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imu {
    /// Time stamp and frame of the data.
    pub header: Header,
    /// Orientation of the sensor in a fixed reference frame.
    pub orientation: Quaternion,
    /// Covariance of the orientation, rad².
    pub orientation_covariance: [f64; 9],
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3,
    /// Covariance of the angular velocity, (rad/s)².
    pub angular_velocity_covariance: [f64; 9],
    /// Specific force, m/s²: a sensor at rest on the ground measures 9.81 upwards.
    pub linear_acceleration: Vector3,
    /// Covariance of the specific force, (m/s²)².
    pub linear_acceleration_covariance: [f64; 9],
}

fields!(Imu: header, orientation, orientation_covariance, angular_velocity, angular_velocity_covariance, linear_acceleration, linear_acceleration_covariance);

/// `sensor_msgs/msg/PointField`: one field of the points of a [`PointCloud2`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PointField {
    /// Name of the field, for instance `x`.
    pub name: String,
    /// Offset from the start of a point, bytes.
    pub offset: u32,
    /// Type of the elements, one of the constants of this type.
    pub datatype: u8,
    /// Number of elements in the field.
    pub count: u32,
}

fields!(PointField: name, offset, datatype, count);

impl PointField {
    /// Data type `i8`.
    pub const INT8: u8 = 1;
    /// Data type `u8`.
    pub const UINT8: u8 = 2;
    /// Data type `i16`.
    pub const INT16: u8 = 3;
    /// Data type `u16`.
    pub const UINT16: u8 = 4;
    /// Data type `i32`.
    pub const INT32: u8 = 5;
    /// Data type `u32`.
    pub const UINT32: u8 = 6;
    /// Data type `f32`.
    pub const FLOAT32: u8 = 7;
    /// Data type `f64`.
    pub const FLOAT64: u8 = 8;
}

/// `sensor_msgs/msg/PointCloud2`: points in `header.frame_id`, with the layout that `fields`
/// describes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PointCloud2 {
    /// Time stamp and frame of the data.
    pub header: Header,
    /// Number of rows, 1 for an unordered cloud.
    pub height: u32,
    /// Number of points in a row.
    pub width: u32,
    /// Fields of a point.
    pub fields: Vec<PointField>,
    /// Whether `data` is big endian.
    pub is_bigendian: bool,
    /// Size of a point, bytes.
    pub point_step: u32,
    /// Size of a row, bytes.
    pub row_step: u32,
    /// The points, `row_step * height` bytes.
    pub data: Vec<u8>,
    /// Whether all points are valid.
    pub is_dense: bool,
}

fields!(PointCloud2: header, height, width, fields, is_bigendian, point_step, row_step, data, is_dense);

/// `nav_msgs/msg/Odometry`: pose and twist of a moving body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Odometry {
    /// Time stamp and frame of the pose.
    pub header: Header,
    /// Name of the frame that moves with the body, in which the twist is expressed.
    pub child_frame_id: String,
    /// Pose of the child frame in `header.frame_id`.
    pub pose: PoseWithCovariance,
    /// Twist of the child frame's origin, expressed in `child_frame_id`.
    pub twist: TwistWithCovariance,
}

fields!(Odometry: header, child_frame_id, pose, twist);

/// `tf2_msgs/msg/TFMessage`: transforms between frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TFMessage {
    /// The transforms.
    pub transforms: Vec<TransformStamped>,
}

fields!(TFMessage: transforms);

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
