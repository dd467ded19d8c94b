//! The messages of `geometry_msgs`.

use crate::cdr::fields;

use super::Header;

/// `geometry_msgs/msg/Vector3`: a vector, in the unit of the field that holds it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector3 {
    /// Component along x.
    pub x: f64,
    /// Component along y.
    pub y: f64,
    /// Component along z.
    pub z: f64,
}

fields!(Vector3: x, y, z);

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

/// `geometry_msgs/msg/Point`: a position, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Coordinate along x.
    pub x: f64,
    /// Coordinate along y.
    pub y: f64,
    /// Coordinate along z.
    pub z: f64,
}

fields!(Point: x, y, z);

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

/// `geometry_msgs/msg/Quaternion`: a rotation. The default is the identity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion {
    /// Component of the vector part along x.
    pub x: f64,
    /// Component of the vector part along y.
    pub y: f64,
    /// Component of the vector part along z.
    pub z: f64,
    /// Scalar part.
    pub w: f64,
}

fields!(Quaternion: x, y, z, w);

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

/// `geometry_msgs/msg/Pose`: pose of a body in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Position of the body's origin, m.
    pub position: Point,
    /// Rotation from the body's axes to the frame's.
    pub orientation: Quaternion,
}

fields!(Pose: position, orientation);

/// `geometry_msgs/msg/PoseStamped`: a pose with time and frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseStamped {
    /// Time stamp and frame of the data.
    pub header: Header,
    /// Pose in `header.frame_id`.
    pub pose: Pose,
}

fields!(PoseStamped: header, pose);

/// `geometry_msgs/msg/PoseWithCovariance`: an estimate of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseWithCovariance {
    /// The estimate.
    pub pose: Pose,
    /// Row-major 6x6 covariance of x, y, z (m) and the rotations about x, y, z (rad).
    pub covariance: [f64; 36],
}

fields!(PoseWithCovariance: pose, covariance);

impl Default for PoseWithCovariance {
    fn default() -> Self {
        Self {
            pose: Pose::default(),
            covariance: [0.0; 36],
        }
    }
}

/// `geometry_msgs/msg/Twist`: velocity of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Velocity of the frame's origin, m/s.
    pub linear: Vector3,
    /// Angular velocity, rad/s.
    pub angular: Vector3,
}

fields!(Twist: linear, angular);

/// `geometry_msgs/msg/TwistStamped`: a twist with time and frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TwistStamped {
    /// Time stamp and frame of the data.
    pub header: Header,
    /// Twist, expressed in `header.frame_id`.
    pub twist: Twist,
}

fields!(TwistStamped: header, twist);

/// `geometry_msgs/msg/TwistWithCovariance`: an estimate of a twist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistWithCovariance {
    /// The estimate.
    pub twist: Twist,
    /// Row-major 6x6 covariance of the linear (m/s) and the angular velocity (rad/s).
    pub covariance: [f64; 36],
}

fields!(TwistWithCovariance: twist, covariance);

impl Default for TwistWithCovariance {
    fn default() -> Self {
        Self {
            twist: Twist::default(),
            covariance: [0.0; 36],
        }
    }
}

/// `geometry_msgs/msg/Accel`: acceleration of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accel {
    /// Acceleration of the frame's origin, m/s².
    pub linear: Vector3,
    /// Angular acceleration, rad/s².
    pub angular: Vector3,
}

fields!(Accel: linear, angular);

/// `geometry_msgs/msg/AccelStamped`: an acceleration with time and frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AccelStamped {
    /// Time stamp and frame of the data.
    pub header: Header,
    /// Acceleration, expressed in `header.frame_id`.
    pub accel: Accel,
}

fields!(AccelStamped: header, accel);

/// `geometry_msgs/msg/Wrench`: force and moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force, N.
    pub force: Vector3,
    /// Moment about the frame's origin, N m.
    pub torque: Vector3,
}

fields!(Wrench: force, torque);

/// `geometry_msgs/msg/WrenchStamped`: a wrench with time and frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WrenchStamped {
    /// Time stamp and frame of the data.
    pub header: Header,
    /// Wrench, expressed in `header.frame_id` and about its origin.
    pub wrench: Wrench,
}

fields!(WrenchStamped: header, wrench);

/// `geometry_msgs/msg/Inertia`: mass properties of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inertia {
    /// Mass, kg.
    pub m: f64,
    /// Centre of mass, m.
    pub com: Vector3,
    /// Moment of inertia about the centre of mass, kg m².
    pub ixx: f64,
    /// Product of inertia about the centre of mass, as a matrix entry, kg m².
    pub ixy: f64,
    /// Product of inertia about the centre of mass, as a matrix entry, kg m².
    pub ixz: f64,
    /// Moment of inertia about the centre of mass, kg m².
    pub iyy: f64,
    /// Product of inertia about the centre of mass, as a matrix entry, kg m².
    pub iyz: f64,
    /// Moment of inertia about the centre of mass, kg m².
    pub izz: f64,
}

fields!(Inertia: m, com, ixx, ixy, ixz, iyy, iyz, izz);

/// `geometry_msgs/msg/InertiaStamped`: mass properties with time and frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InertiaStamped {
    /// Time stamp and frame of the data.
    pub header: Header,
    /// Mass properties, expressed in `header.frame_id`.
    pub inertia: Inertia,
}

fields!(InertiaStamped: header, inertia);

/// `geometry_msgs/msg/Transform`: pose of a child frame in its parent frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transform {
    /// Position of the child's origin in the parent, m.
    pub translation: Vector3,
    /// Rotation from the child's axes to the parent's.
    pub rotation: Quaternion,
}

fields!(Transform: translation, rotation);

/// `geometry_msgs/msg/TransformStamped`: the pose of `child_frame_id` in `header.frame_id`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TransformStamped {
    /// Time stamp and parent frame.
    pub header: Header,
    /// Name of the child frame.
    pub child_frame_id: String,
    /// Transform `parent_from_child`.
    pub transform: Transform,
}

fields!(TransformStamped: header, child_frame_id, transform);
