//! Limits of single joints.

use tactid_dynamics::Manipulator;

use crate::ExcitationError;

/// Limits of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Least and largest position, rad or m; infinite where there is none.
    pub position: (f64, f64),
    /// Largest speed, rad/s or m/s.
    pub velocity: f64,
    /// Largest magnitude of the acceleration, rad/s² or m/s².
    pub acceleration: f64,
    /// Largest magnitude of the torque, N m, or of the force of a prismatic joint, N; infinite
    /// where there is none.
    pub effort: f64,
}

impl JointLimits {
    /// Returns the limits of all joints of a robot, with one limit of the acceleration, rad/s² or
    /// m/s², for all joints: the format has none. Velocities and accelerations are multiplied by
    /// `speed`, such as 0.3.
    ///
    /// A joint without a positive `effort` has no limit of its torque; neither has one where
    /// `effort` is no number.
    ///
    /// # Errors
    /// Returns [`ExcitationError::NoVelocityLimit`] for a joint without a positive velocity limit.
    pub fn of_robot(
        robot: &Manipulator,
        acceleration: f64,
        speed: f64,
    ) -> Result<Vec<Self>, ExcitationError> {
        let of_joint = |(index, name): (usize, &String)| {
            let unlimited = (f64::NEG_INFINITY, f64::INFINITY);
            let velocity = robot.velocity_limit(index);
            Ok(Self {
                position: robot.joint_limits(index).unwrap_or(unlimited),
                velocity: speed * velocity.ok_or_else(|| no_velocity_limit(name))?,
                acceleration: speed * acceleration,
                effort: robot.effort_limit(index).unwrap_or(f64::INFINITY),
            })
        };
        robot
            .joint_names()
            .iter()
            .enumerate()
            .map(of_joint)
            .collect()
    }
}

fn no_velocity_limit(joint: &str) -> ExcitationError {
    ExcitationError::NoVelocityLimit {
        joint: joint.to_owned(),
    }
}
