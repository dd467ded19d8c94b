//! How much noise the sensors have.

use serde::{Deserialize, Serialize};

use crate::SimError;

/// Standard deviation of the white noise on each sensor channel, a new value for every sample and axis.
/// Default zero for all. It is in what is measured and logged, not in what moves the robot.
///
/// A list has one for each channel: each moving joint as the log orders them, fingers included; x, y and z, of
/// the base in world axes and of the IMU in its own; of the fingers x, y and z of the first, then of the
/// second, each in its own frame.
///
/// ```
/// use tactid_sim::Experiment;
///
/// let text = "[noise]\nbase_position_m = 1e-5\nimu_acceleration_m_s2 = [1e-3, 1e-3, 2e-3]";
/// let noise = Experiment::from_toml(text)?.noise;
/// assert_eq!(noise.base_position_m.of(2), 1e-5);
/// assert_eq!(noise.imu_acceleration_m_s2.of(2), 2e-3);
/// # Ok::<(), tactid_sim::SimError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Noise {
    /// Joint positions, rad (m for a prismatic joint), of each moving joint.
    pub joint_position_rad: Deviation,
    /// Joint velocities, rad/s (m/s), of each moving joint.
    pub joint_velocity_rad_s: Deviation,
    /// Joint torques, N m (N), of each moving joint.
    pub joint_torque_nm: Deviation,
    /// Position of the base, m.
    pub base_position_m: Deviation,
    /// Orientation of the base, as a rotation vector, rad.
    pub base_orientation_rad: Deviation,
    /// Velocity of the base, m/s.
    pub base_velocity_m_s: Deviation,
    /// Angular velocity of the base, rad/s.
    pub base_angular_velocity_rad_s: Deviation,
    /// Angular velocity by the IMU, rad/s.
    pub imu_angular_velocity_rad_s: Deviation,
    /// Linear acceleration by the IMU, m/s².
    pub imu_acceleration_m_s2: Deviation,
    /// Force of each finger, N.
    pub finger_force_n: Deviation,
    /// Moment of each finger, N m.
    pub finger_moment_nm: Deviation,
    /// Force at each contact point, N.
    pub contact_force_n: Deviation,
}

impl Noise {
    /// Whether lists for joints are as long as the robot has moving joints.
    pub(crate) fn check_joints(&self, joints: usize) -> Result<(), SimError> {
        for (field, deviation) in [
            ("joint_position_rad", &self.joint_position_rad),
            ("joint_velocity_rad_s", &self.joint_velocity_rad_s),
            ("joint_torque_nm", &self.joint_torque_nm),
        ] {
            if let Deviation::Each(values) = deviation
                && values.len() != joints
            {
                return Err(SimError::Robot(format!(
                    "noise.{field} has {} values, but the robot has {joints} moving joints",
                    values.len()
                )));
            }
        }
        Ok(())
    }
}

/// Standard deviations of one kind of channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, or a list of one for each channel"
)]
pub enum Deviation {
    /// Of all alike.
    All(f64),
    /// Of each.
    Each(Vec<f64>),
}

impl Default for Deviation {
    fn default() -> Self {
        Self::All(0.0)
    }
}

impl From<f64> for Deviation {
    fn from(deviation: f64) -> Self {
        Self::All(deviation)
    }
}

impl Deviation {
    /// Of one channel, from 0.
    ///
    /// # Panics
    /// Where there is a list and the channel is not in it; a run checks its length before.
    #[must_use]
    pub fn of(&self, channel: usize) -> f64 {
        match self {
            Self::All(deviation) => *deviation,
            Self::Each(deviations) => deviations[channel],
        }
    }
}
