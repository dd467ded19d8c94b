//! Messages of `trajectory_msgs`: motions of joints over time.

use crate::cdr::fields;

use super::{Header, split_ns};

/// `builtin_interfaces/msg/Duration`: a span of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Duration {
    /// Whole seconds.
    pub sec: i32,
    /// Nanoseconds after `sec`, less than 1e9.
    pub nanosec: u32,
}

fields!(Duration: sec, nanosec);

impl Duration {
    /// Converts nanoseconds. A span of more than 68 years becomes the longest representable one.
    #[must_use]
    pub fn from_ns(ns: u64) -> Self {
        let (sec, nanosec) = split_ns(ns);
        Self { sec, nanosec }
    }

    /// Returns the span in seconds.
    #[must_use]
    pub fn as_s(self) -> f64 {
        f64::from(self.sec) + 1e-9 * f64::from(self.nanosec)
    }
}

/// `trajectory_msgs/msg/JointTrajectoryPoint`: states of joints at one time. Each sequence is
/// either empty or as long as the trajectory's list of joint names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointTrajectoryPoint {
    /// Positions, rad or m.
    pub positions: Vec<f64>,
    /// Velocities, rad/s or m/s.
    pub velocities: Vec<f64>,
    /// Accelerations, rad/s² or m/s².
    pub accelerations: Vec<f64>,
    /// Efforts, N m or N.
    pub effort: Vec<f64>,
    /// Time since the start of the trajectory.
    pub time_from_start: Duration,
}

fields!(JointTrajectoryPoint: positions, velocities, accelerations, effort, time_from_start);

/// `trajectory_msgs/msg/JointTrajectory`: a motion of joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointTrajectory {
    /// Time at which the motion starts; zero for as soon as it arrives.
    pub header: Header,
    /// Names of the joints.
    pub joint_names: Vec<String>,
    /// States in order of time.
    pub points: Vec<JointTrajectoryPoint>,
}

fields!(JointTrajectory: header, joint_names, points);
