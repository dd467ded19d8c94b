//! What a robot measures at one time.

use nalgebra::{Isometry3, Quaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::Wrench;

use super::differentiation::{MIN_NODES, weighted_rotation_sum, weights};

/// Pose and motion of the base at one time, in the inertial frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseState {
    /// Pose of the base frame, `world_from_base`, in m.
    pub pose: Isometry3<f64>,
    /// Velocity of the base frame's origin, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Classical acceleration of the base frame's origin without gravity, m/s². `None` where it is
    /// not measured: it is then differentiated from the velocities of neighbouring samples.
    pub acceleration: Option<Vector3<f64>>,
    /// Angular acceleration, rad/s². `None` where it is not measured: it is then differentiated
    /// from the angular velocities of neighbouring samples.
    pub angular_acceleration: Option<Vector3<f64>>,
}

impl BaseState {
    /// Returns the state of a base at rest at the origin of the inertial frame.
    #[must_use]
    pub fn fixed() -> Self {
        Self {
            pose: Isometry3::identity(),
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
            acceleration: None,
            angular_acceleration: None,
        }
    }

    /// Whether all numbers are measurable.
    fn is_measurable(&self) -> bool {
        let (position, rotation) = (&self.pose.translation.vector, &self.pose.rotation.coords);
        let mut accelerations = self.acceleration.iter().chain(&self.angular_acceleration);
        all_measurable(position.as_slice())
            & all_measurable(rotation.as_slice())
            & all_measurable(self.velocity.as_slice())
            & all_measurable(self.angular_velocity.as_slice())
            & accelerations.all(|vector| all_measurable(vector.as_slice()))
    }
}

/// Returns the states of a body of which only poses were measured, `world_from_body`, at increasing
/// times, s.
///
/// Velocities are those of the polynomial through five neighbouring poses. Fewer than five poses
/// have velocities of zero. Where the slices differ in length, the surplus of the longer one is
/// ignored.
#[must_use]
pub fn states_of_poses(times_s: &[f64], poses: &[Isometry3<f64>]) -> Vec<BaseState> {
    let count = times_s.len().min(poses.len());
    let state = |k: usize| {
        let pose = poses[k];
        let at_rest = BaseState {
            pose,
            ..BaseState::fixed()
        };
        if count < MIN_NODES {
            return at_rest;
        }
        // The first and the last two poses use the five at the same end.
        let first = k.saturating_sub(MIN_NODES / 2).min(count - MIN_NODES);
        let near = first..first + MIN_NODES;
        let slope = weights(&times_s[near.clone()], times_s[k]).first;
        let near = || poses[near.clone()].iter().zip(slope);
        let rotations = near().map(|(other, weight)| (&other.rotation, weight));
        let rate = Quaternion::from(weighted_rotation_sum(rotations, &pose.rotation));
        // q̇ = ω q / 2 with ω in the inertial frame.
        let twice = rate * pose.rotation.conjugate().into_inner() * 2.0;
        BaseState {
            velocity: near().map(|(p, w)| p.translation.vector * w).sum(),
            angular_velocity: twice.imag(),
            ..at_rest
        }
    };
    (0..count).map(state).collect()
}

/// Body on which a measured wrench acts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ActsOn {
    /// The payload: the wrench that the robot exerts on it.
    #[default]
    Payload,
    /// The sensor: the wrench that the payload exerts on it, as most force-torque sensors report
    /// it.
    Sensor,
}

impl ActsOn {
    /// Returns the sign of a wrench on this body relative to that of the wrench on the payload: 1
    /// or -1.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Payload => 1.0,
            Self::Sensor => -1.0,
        }
    }
}

/// What a robot measures at one time. Slices are in the order of the robot's joints and of the
/// wrench sensors.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    /// Time on one clock for all samples, s.
    pub time_s: f64,
    /// Pose and motion of the base; [`BaseState::fixed`] where it is bolted down.
    pub base: BaseState,
    /// Joint positions, rad, or m for a prismatic joint.
    pub joint_position: &'a [f64],
    /// Joint velocities, rad/s or m/s. May be empty: they are then differentiated from the
    /// positions of neighbouring samples.
    pub joint_velocity: &'a [f64],
    /// Efforts of the joint motors, N m or N, gravity and payload included. May be empty unless the
    /// method uses efforts.
    pub joint_effort: &'a [f64],
    /// Wrench of each sensor **on the payload**, in the sensor's frame and about that frame's
    /// origin, N and N m.
    pub wrenches: &'a [Wrench],
}

impl Sample<'_> {
    /// Whether all numbers are measurable, see [`EquationStream::push`](crate::EquationStream::push).
    pub fn is_measurable(&self) -> bool {
        let joints = [self.joint_position, self.joint_velocity, self.joint_effort];
        let is_wrench = |wrench: &Wrench| {
            all_measurable(wrench.force.as_slice()) & all_measurable(wrench.moment.as_slice())
        };
        is_measurable(self.time_s)
            && self.base.is_measurable()
            && joints.into_iter().all(all_measurable)
            && self.wrenches.iter().all(is_wrench)
    }
}

/// Magnitude in SI units from which on a number is no measurement. Accelerations by differences
/// over a nanosecond, their squares and products of these stay finite.
const TOO_LARGE: f64 = 1e30;

/// Returns whether a number is finite and below `TOO_LARGE`.
pub(crate) fn is_measurable(number: f64) -> bool {
    number.abs() < TOO_LARGE
}

/// Returns whether all numbers are [measurable](is_measurable). They are compared without a branch,
/// which is faster than to stop at the first that is not.
fn all_measurable(numbers: &[f64]) -> bool {
    numbers
        .iter()
        .fold(true, |all, number| all & is_measurable(*number))
}
