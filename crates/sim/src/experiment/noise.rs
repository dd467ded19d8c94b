//! Noise of the sensors.

use serde::{Deserialize, Serialize};

/// Standard deviations of the sensors' white noise, with a new value for every sample and axis.
///
/// The default is zero for all channels. Noise is added to measurements, not to the robot's motion.
///
/// A list has one entry for each channel: for joints, each moving joint in the order of the log,
/// fingers included; for base and IMU, x, y and z, along world axes for the base and along its own
/// axes for the IMU; for fingers, x, y and z of the first finger and then of the second, each in
/// its own frame.
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
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct Noise {
    /// Standard deviation of the joint positions, rad (m for a prismatic joint).
    pub joint_position_rad: StdDev,
    /// Standard deviation of the joint velocities, rad/s (m/s for a prismatic joint).
    pub joint_velocity_rad_s: StdDev,
    /// Standard deviation of the joint torques, N m (N for a prismatic joint).
    pub joint_torque_nm: StdDev,
    /// Standard deviation of the base position, m.
    pub base_position_m: StdDev,
    /// Standard deviation of the base orientation, as a rotation vector, rad.
    pub base_orientation_rad: StdDev,
    /// Standard deviation of the base velocity, m/s.
    pub base_velocity_m_s: StdDev,
    /// Standard deviation of the base angular velocity, rad/s.
    pub base_angular_velocity_rad_s: StdDev,
    /// Standard deviation of the IMU's angular velocity, rad/s.
    pub imu_angular_velocity_rad_s: StdDev,
    /// Standard deviation of the IMU's linear acceleration, m/s².
    pub imu_acceleration_m_s2: StdDev,
    /// Standard deviation of the force of each finger, N.
    pub finger_force_n: StdDev,
    /// Standard deviation of the moment of each finger, N m.
    pub finger_moment_nm: StdDev,
    /// Standard deviation of the force at each contact point, N.
    pub contact_force_n: StdDev,
}

/// Standard deviation of each channel of one kind, in the unit of the field that holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, or a list of one for each channel"
)]
pub enum StdDev {
    /// The same standard deviation for all channels.
    All(f64),
    /// One standard deviation for each channel.
    Each(Vec<f64>),
}

impl Default for StdDev {
    fn default() -> Self {
        Self::All(0.0)
    }
}

impl From<f64> for StdDev {
    fn from(std_dev: f64) -> Self {
        Self::All(std_dev)
    }
}

impl StdDev {
    /// Returns the standard deviation of one channel, counted from 0.
    ///
    /// # Panics
    /// Panics if there is a list without that channel. [`Simulation::new`](crate::Simulation::new)
    /// checks its length.
    #[must_use]
    pub fn of(&self, channel: usize) -> f64 {
        match self {
            Self::All(std_dev) => *std_dev,
            Self::Each(std_devs) => std_devs[channel],
        }
    }
}
