//! Samples, and the state in the middle between two of them.

use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::{FrameMotion, Wrench};

/// The base's pose and velocity at one time, in the inertial frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseState {
    /// `world_from_base`.
    pub pose: Isometry3<f64>,
    /// Velocity of the base frame's origin, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
}

impl BaseState {
    /// A base that does not move, at the inertial frame's origin.
    #[must_use]
    pub fn fixed() -> Self {
        Self {
            pose: Isometry3::identity(),
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
        }
    }

    fn is_finite(&self) -> bool {
        let pose = &self.pose;
        let parts = pose
            .translation
            .vector
            .iter()
            .chain(pose.rotation.coords.iter());
        let rates = self.velocity.iter().chain(self.angular_velocity.iter());
        parts.chain(rates).all(|value| value.is_finite())
    }
}

/// What a robot measures at one time. Slices are in the order of the robot's joints and of the
/// identifier's wrench sensors.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    /// On one clock, s.
    pub time_s: f64,
    /// The base; [`BaseState::fixed`] where it is bolted down.
    pub base: BaseState,
    /// rad, or m for a prismatic joint.
    pub joint_position: &'a [f64],
    /// rad/s, or m/s.
    pub joint_velocity: &'a [f64],
    /// **On the payload**, each in its sensor's frame and about that frame's origin.
    pub wrenches: &'a [Wrench],
}

impl Sample<'_> {
    pub(crate) fn is_finite(&self) -> bool {
        self.time_s.is_finite()
            && self.base.is_finite()
            && self.joint_position.iter().all(|value| value.is_finite())
            && self.joint_velocity.iter().all(|value| value.is_finite())
            && self.wrenches.iter().all(Wrench::is_finite)
    }
}

/// A sample that was kept, or the middle between two.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) time_s: f64,
    pub(crate) base: BaseState,
    pub(crate) joint_position: Vec<f64>,
    pub(crate) joint_velocity: Vec<f64>,
    pub(crate) wrenches: Vec<Wrench>,
}

impl Node {
    pub(crate) fn new(joints: usize, wrenches: usize) -> Self {
        Self {
            time_s: f64::NEG_INFINITY,
            base: BaseState::fixed(),
            joint_position: vec![0.0; joints],
            joint_velocity: vec![0.0; joints],
            wrenches: vec![Wrench::zero(); wrenches],
        }
    }

    /// Takes over a sample whose slices have the right lengths.
    pub(crate) fn set(&mut self, sample: &Sample<'_>) {
        self.time_s = sample.time_s;
        self.base = sample.base;
        self.joint_position.copy_from_slice(sample.joint_position);
        self.joint_velocity.copy_from_slice(sample.joint_velocity);
        self.wrenches.copy_from_slice(sample.wrenches);
    }
}

/// The state in the middle between two samples.
///
/// Over the time between samples the change of velocity is the mean acceleration, and the mean of
/// the wrenches is what caused it. A one-sided difference would set accelerations half a sample
/// beside the forces.
#[derive(Clone, Debug)]
pub(crate) struct Middle {
    pub(crate) base: FrameMotion,
    pub(crate) joint_position: Vec<f64>,
    pub(crate) joint_velocity: Vec<f64>,
    pub(crate) joint_acceleration: Vec<f64>,
    pub(crate) wrenches: Vec<Wrench>,
}

impl Middle {
    pub(crate) fn new(joints: usize, wrenches: usize) -> Self {
        Self {
            base: FrameMotion::at_rest(Isometry3::identity()),
            joint_position: vec![0.0; joints],
            joint_velocity: vec![0.0; joints],
            joint_acceleration: vec![0.0; joints],
            wrenches: vec![Wrench::zero(); wrenches],
        }
    }

    /// Between two samples, `to` later than `from`.
    pub(crate) fn set(&mut self, from: &Node, to: &Node) {
        let rate = 1.0 / (to.time_s - from.time_s);
        let (a, b) = (&from.base, &to.base);
        self.base = FrameMotion {
            pose: Isometry3::from_parts(
                ((a.pose.translation.vector + b.pose.translation.vector) * 0.5).into(),
                a.pose.rotation.nlerp(&b.pose.rotation, 0.5),
            ),
            velocity: (a.velocity + b.velocity) * 0.5,
            angular_velocity: (a.angular_velocity + b.angular_velocity) * 0.5,
            acceleration: (b.velocity - a.velocity) * rate,
            angular_acceleration: (b.angular_velocity - a.angular_velocity) * rate,
        };
        for joint in 0..self.joint_position.len() {
            let (q0, q1) = (from.joint_position[joint], to.joint_position[joint]);
            let (v0, v1) = (from.joint_velocity[joint], to.joint_velocity[joint]);
            self.joint_position[joint] = 0.5 * (q0 + q1);
            self.joint_velocity[joint] = 0.5 * (v0 + v1);
            self.joint_acceleration[joint] = (v1 - v0) * rate;
        }
        let pairs = from.wrenches.iter().zip(&to.wrenches);
        for (middle, (first, second)) in self.wrenches.iter_mut().zip(pairs) {
            middle.force = (first.force + second.force) * 0.5;
            middle.moment = (first.moment + second.moment) * 0.5;
        }
    }
}
