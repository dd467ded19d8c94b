//! Kinds of topics.

/// Kind of a topic, as the fields of [`Topics`](crate::Topics) distinguish them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TopicKind {
    /// Joint states: [`Topics::joints`](crate::Topics::joints).
    Joints,
    /// Wrenches: [`Topics::wrenches`](crate::Topics::wrenches).
    Wrenches,
    /// Odometry of the base or of the sensor: [`Topics::odometry`](crate::Topics::odometry).
    Odometry,
    /// Measurements of an inertial unit: [`Topics::imu`](crate::Topics::imu).
    Imu,
    /// Accelerations of the body that the odometry moves:
    /// [`Topics::acceleration`](crate::Topics::acceleration).
    Acceleration,
}
