//! Samples, and the instant in the middle of a few of them.

use nalgebra::{Isometry3, Quaternion, Vector3};
use tactid_dynamics::{FrameMotion, Wrench};

use crate::stencil::weights;

/// The base's pose and motion at one time, in the inertial frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseState {
    /// `world_from_base`.
    pub pose: Isometry3<f64>,
    /// Velocity of the base frame's origin, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Classical acceleration of the frame's origin, m/s², where it is measured; otherwise it follows
    /// from the velocities of neighbouring samples.
    pub acceleration: Option<Vector3<f64>>,
    /// Angular acceleration, rad/s², likewise.
    pub angular_acceleration: Option<Vector3<f64>>,
}

impl BaseState {
    /// A base that does not move, at the inertial frame's origin.
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

    pub(crate) fn is_finite(&self) -> bool {
        let pose = &self.pose;
        let parts = pose
            .translation
            .vector
            .iter()
            .chain(pose.rotation.coords.iter());
        let rates = self.velocity.iter().chain(self.angular_velocity.iter());
        let measured = self.acceleration.iter().chain(&self.angular_acceleration);
        let second = measured.flat_map(|vector| vector.iter());
        parts
            .chain(rates)
            .chain(second)
            .all(|value| value.is_finite())
    }
}

/// The states of a body of which only poses were measured: velocities are those of the polynomial
/// through five of them. The first and the last two have those of the polynomial beside them.
///
/// Fewer than five poses stand still.
#[must_use]
pub fn states_of_poses(times_s: &[f64], poses: &[Isometry3<f64>]) -> Vec<BaseState> {
    let count = times_s.len().min(poses.len());
    let state = |k: usize| {
        let pose = poses[k];
        let still = BaseState {
            pose,
            ..BaseState::fixed()
        };
        if count < SPAN {
            return still;
        }
        let first = k.saturating_sub(SPAN / 2).min(count - SPAN);
        let nodes: [f64; SPAN] = std::array::from_fn(|j| times_s[first + j]);
        let [_, slope, _] = weights(&nodes, times_s[k]);
        let near = || poses[first..first + SPAN].iter().zip(&slope);
        let rate: nalgebra::Vector4<f64> = near()
            .map(|(other, w)| {
                let coords = other.rotation.coords;
                // Either sign is the same rotation: all on the side of this one.
                coords * (w * 1f64.copysign(coords.dot(&pose.rotation.coords)))
            })
            .sum();
        // q̇ = ω q / 2 with ω in the inertial frame.
        let turn = Quaternion::from(rate) * pose.rotation.conjugate().into_inner() * 2.0;
        BaseState {
            velocity: near().map(|(p, w)| p.translation.vector * *w).sum(),
            angular_velocity: turn.imag(),
            ..still
        }
    };
    (0..count).map(state).collect()
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
    /// rad/s, or m/s. May be empty: it then follows from the positions of neighbouring samples.
    pub joint_velocity: &'a [f64],
    /// What each joint exerts, N m or N, gravity and payload included. Empty but for the effort way.
    pub joint_effort: &'a [f64],
    /// **On the payload**, each in its sensor's frame and about that frame's origin.
    pub wrenches: &'a [Wrench],
}

impl Sample<'_> {
    pub(crate) fn is_finite(&self) -> bool {
        let joints = [self.joint_position, self.joint_velocity, self.joint_effort];
        self.time_s.is_finite()
            && self.base.is_finite()
            && joints.iter().all(|all| all.iter().all(|x| x.is_finite()))
            && self.wrenches.iter().all(Wrench::is_finite)
    }
}

/// A sample that was kept.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) time_s: f64,
    pub(crate) base: BaseState,
    pub(crate) joint_position: Vec<f64>,
    pub(crate) joint_velocity: Vec<f64>,
    /// Whether `joint_velocity` was measured.
    has_velocity: bool,
    pub(crate) joint_effort: Vec<f64>,
    pub(crate) wrenches: Vec<Wrench>,
}

impl Node {
    pub(crate) fn new(joints: usize, wrenches: usize) -> Self {
        Self {
            time_s: f64::NEG_INFINITY,
            base: BaseState::fixed(),
            joint_position: vec![0.0; joints],
            joint_velocity: vec![0.0; joints],
            has_velocity: false,
            joint_effort: vec![0.0; joints],
            wrenches: vec![Wrench::zero(); wrenches],
        }
    }

    /// Takes over a sample whose slices have the right lengths, or none.
    pub(crate) fn set(&mut self, sample: &Sample<'_>) {
        self.time_s = sample.time_s;
        self.base = sample.base;
        self.joint_position.copy_from_slice(sample.joint_position);
        self.has_velocity = sample.joint_velocity.len() == self.joint_velocity.len();
        if self.has_velocity {
            self.joint_velocity.copy_from_slice(sample.joint_velocity);
        }
        if sample.joint_effort.len() == self.joint_effort.len() {
            self.joint_effort.copy_from_slice(sample.joint_effort);
        }
        self.wrenches.copy_from_slice(sample.wrenches);
    }
}

/// How many samples an [`Instant`] is made of.
pub(crate) const SPAN: usize = 5;

/// Everything at the time of one sample, with what was not measured of its motion: derivatives of
/// the polynomial through it and two neighbours on each side.
///
/// Derivatives are linear in what is measured and local, so that a filter over many instants later
/// treats what is derived and what is measured alike.
#[derive(Clone, Debug)]
pub(crate) struct Instant {
    pub(crate) time_s: f64,
    pub(crate) base: FrameMotion,
    pub(crate) joint_position: Vec<f64>,
    pub(crate) joint_velocity: Vec<f64>,
    pub(crate) joint_acceleration: Vec<f64>,
    pub(crate) joint_effort: Vec<f64>,
    pub(crate) wrenches: Vec<Wrench>,
}

impl Instant {
    pub(crate) fn new(joints: usize, wrenches: usize) -> Self {
        Self {
            time_s: 0.0,
            base: FrameMotion::at_rest(Isometry3::identity()),
            joint_position: vec![0.0; joints],
            joint_velocity: vec![0.0; joints],
            joint_acceleration: vec![0.0; joints],
            joint_effort: vec![0.0; joints],
            wrenches: vec![Wrench::zero(); wrenches],
        }
    }

    /// From samples in the order of time, at the time of the middle one.
    pub(crate) fn set(&mut self, nodes: &[&Node; SPAN]) {
        let center = nodes[SPAN / 2];
        self.time_s = center.time_s;
        let [_, first, second] = weights(&nodes.map(|node| node.time_s), center.time_s);
        self.base = base_motion(nodes, &first);
        self.joint_position.copy_from_slice(&center.joint_position);
        self.joint_effort.copy_from_slice(&center.joint_effort);
        self.wrenches.copy_from_slice(&center.wrenches);
        let measured = nodes.iter().all(|node| node.has_velocity);
        for joint in 0..self.joint_position.len() {
            let positions = nodes.map(|node| node.joint_position[joint]);
            let velocities = nodes.map(|node| node.joint_velocity[joint]);
            (self.joint_velocity[joint], self.joint_acceleration[joint]) = if measured {
                (center.joint_velocity[joint], dot(&velocities, &first))
            } else {
                (dot(&positions, &first), dot(&positions, &second))
            };
        }
    }
}

fn dot(values: &[f64; SPAN], weights: &[f64; SPAN]) -> f64 {
    values.iter().zip(weights).map(|(x, w)| x * w).sum()
}

fn base_motion(nodes: &[&Node; SPAN], first: &[f64; SPAN]) -> FrameMotion {
    let center = &nodes[SPAN / 2].base;
    let derivative = |of: fn(&BaseState) -> Vector3<f64>| -> Vector3<f64> {
        nodes.iter().zip(first).map(|(n, w)| of(&n.base) * *w).sum()
    };
    FrameMotion {
        pose: center.pose,
        velocity: center.velocity,
        angular_velocity: center.angular_velocity,
        acceleration: center
            .acceleration
            .unwrap_or_else(|| derivative(|base| base.velocity)),
        angular_acceleration: center
            .angular_acceleration
            .unwrap_or_else(|| derivative(|base| base.angular_velocity)),
    }
}
