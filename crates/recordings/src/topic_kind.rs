//! Kinds of topics.

/// Kind of a topic, as the options of [`Request`](crate::Request) distinguish them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TopicKind {
    /// Joint states: [`Request::joint_topic`](crate::Request::joint_topic).
    Joints,
    /// Wrenches: [`Request::wrench_topic`](crate::Request::wrench_topic).
    Wrenches,
    /// Odometry of the base or of the sensor:
    /// [`Request::odometry_topic`](crate::Request::odometry_topic).
    Odometry,
    /// Measurements of an inertial unit: [`Request::imu_topic`](crate::Request::imu_topic).
    Imu,
    /// Accelerations of the body that the odometry moves:
    /// [`Request::acceleration_topic`](crate::Request::acceleration_topic).
    Acceleration,
}

impl TopicKind {
    /// Returns the name of the option that chooses the topic.
    pub(crate) fn option(self) -> &'static str {
        match self {
            Self::Joints => "joint_topic",
            Self::Wrenches => "wrench_topic",
            Self::Odometry => "odometry_topic",
            Self::Imu => "imu_topic",
            Self::Acceleration => "acceleration_topic",
        }
    }
}
