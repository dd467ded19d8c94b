//! Samples, and the instant in the middle of a few of them.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3, Vector4};
use tactid_dynamics::{FrameMotion, Wrench};

use super::differentiation::{FEWEST, MOST, Stencil, weights};

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
        if count < FEWEST {
            return still;
        }
        let first = k.saturating_sub(FEWEST / 2).min(count - FEWEST);
        let near = first..first + FEWEST;
        let [_, slope, _] = weights(&times_s[near.clone()], times_s[k]);
        let near = || poses[near.clone()].iter().zip(slope);
        let rate = blend(
            near().map(|(other, w)| (&other.rotation, w)),
            &pose.rotation,
        );
        // q̇ = ω q / 2 with ω in the inertial frame.
        let turn = Quaternion::from(rate) * pose.rotation.conjugate().into_inner() * 2.0;
        BaseState {
            velocity: near().map(|(p, w)| p.translation.vector * w).sum(),
            angular_velocity: turn.imag(),
            ..still
        }
    };
    (0..count).map(state).collect()
}

/// A weighted sum of rotations' quaternions, each of the two that is on the side of one of them.
fn blend<'a>(
    rotations: impl Iterator<Item = (&'a UnitQuaternion<f64>, f64)>,
    near: &UnitQuaternion<f64>,
) -> Vector4<f64> {
    let signed = |(rotation, weight): (&UnitQuaternion<f64>, f64)| {
        let coords = rotation.coords;
        coords * (weight * 1f64.copysign(coords.dot(&near.coords)))
    };
    rotations.map(signed).sum()
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
    /// What each joint exerts, N m or N, gravity and payload included. Empty but for the effort method.
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

/// Everything at the time of one sample: motion is that of the polynomial near it and some neighbours
/// on each side, and so are the derivatives that were not measured.
///
/// Angles and rates enter products, where noise does not average out: so they are made smooth first.
/// All of it is linear in what is measured and local, so that a filter over many instants later
/// treats what is derived, what is smooth and what is neither alike.
#[derive(Clone, Debug)]
pub(crate) struct Instant {
    pub(crate) time_s: f64,
    pub(crate) base: FrameMotion,
    pub(crate) joint_position: Vec<f64>,
    pub(crate) joint_velocity: Vec<f64>,
    pub(crate) joint_acceleration: Vec<f64>,
    pub(crate) joint_effort: Vec<f64>,
    pub(crate) wrenches: Vec<Wrench>,
    stencil: Stencil,
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
            stencil: Stencil::new(),
        }
    }

    /// From an odd number of samples in the order of time, at most [`MOST`], at the time of the middle
    /// one.
    pub(crate) fn set(&mut self, nodes: &[&Node]) {
        let center = nodes[nodes.len() / 2];
        let times_s = nodes.iter().map(|node| node.time_s);
        let [value, first, second] = self.stencil.at_middle(times_s);
        self.time_s = center.time_s;
        self.base = base_motion(nodes, &value, &first);
        self.joint_effort.copy_from_slice(&center.joint_effort);
        self.wrenches.copy_from_slice(&center.wrenches);
        let measured = nodes.iter().all(|node| node.has_velocity);
        self.joint_position.fill(0.0);
        self.joint_velocity.fill(0.0);
        self.joint_acceleration.fill(0.0);
        for (k, node) in nodes.iter().enumerate() {
            let (rates, velocity, acceleration) = if measured {
                (&node.joint_velocity, value[k], first[k])
            } else {
                (&node.joint_position, first[k], second[k])
            };
            add(&mut self.joint_position, value[k], &node.joint_position);
            add(&mut self.joint_velocity, velocity, rates);
            add(&mut self.joint_acceleration, acceleration, rates);
        }
    }
}

fn add(sums: &mut [f64], weight: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

fn base_motion(nodes: &[&Node], value: &[f64; MOST], first: &[f64; MOST]) -> FrameMotion {
    let center = &nodes[nodes.len() / 2].base;
    let sum = |weights: &[f64; MOST], of: fn(&BaseState) -> Vector3<f64>| -> Vector3<f64> {
        let pairs = nodes.iter().zip(weights);
        pairs.map(|(node, weight)| of(&node.base) * *weight).sum()
    };
    let rotations = nodes.iter().zip(value);
    let rotations = rotations.map(|(node, weight)| (&node.base.pose.rotation, *weight));
    let rotation = blend(rotations, &center.pose.rotation);
    FrameMotion {
        pose: Isometry3::from_parts(
            center.pose.translation,
            UnitQuaternion::new_normalize(rotation.into()),
        ),
        velocity: center.velocity,
        angular_velocity: sum(value, |base| base.angular_velocity),
        acceleration: center
            .acceleration
            .unwrap_or_else(|| sum(first, |base| base.velocity)),
        angular_acceleration: center
            .angular_acceleration
            .unwrap_or_else(|| sum(first, |base| base.angular_velocity)),
    }
}
