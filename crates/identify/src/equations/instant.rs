//! Stored samples, and the smoothed and differentiated instant in the middle of a few of them.

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector4};
use tactid_dynamics::{FrameMotion, Wrench};

use super::differentiation::{CachedWeights, MAX_NODES, Weights, weighted_rotation_sum};
use super::sample::{BaseState, Sample};

/// Number of joints whose values are summed together.
const LANES: usize = 4;

/// A copy of a sample, which a polynomial is fitted to.
#[derive(Clone, Debug)]
pub(crate) struct StoredSample {
    /// Time, s; minus infinity before a sample is stored.
    pub(crate) time_s: f64,
    base: BaseState,
    /// Joint values, padded with zeros to whole vectors.
    joint_position: Vec<Vector4<f64>>,
    joint_velocity: Vec<Vector4<f64>>,
    /// Whether `joint_velocity` was measured.
    has_velocity: bool,
    joint_effort: Vec<f64>,
    wrenches: Vec<Wrench>,
}

impl StoredSample {
    /// Creates a place for a sample of so many joints and wrenches.
    pub(crate) fn new(joints: usize, wrenches: usize) -> Self {
        Self {
            time_s: f64::NEG_INFINITY,
            base: BaseState::fixed(),
            joint_position: vec![Vector4::zeros(); joints.div_ceil(LANES)],
            joint_velocity: vec![Vector4::zeros(); joints.div_ceil(LANES)],
            has_velocity: false,
            joint_effort: vec![0.0; joints],
            wrenches: vec![Wrench::zero(); wrenches],
        }
    }

    /// Copies a sample whose slices have the right lengths; those that may be empty are empty or have the
    /// right length.
    pub(crate) fn set(&mut self, sample: &Sample<'_>) {
        self.time_s = sample.time_s;
        self.base = sample.base;
        copy_padded(&mut self.joint_position, sample.joint_position);
        self.has_velocity = sample.joint_velocity.len() == sample.joint_position.len();
        if self.has_velocity {
            copy_padded(&mut self.joint_velocity, sample.joint_velocity);
        }
        if sample.joint_effort.len() == self.joint_effort.len() {
            self.joint_effort.copy_from_slice(sample.joint_effort);
        }
        self.wrenches.copy_from_slice(sample.wrenches);
    }
}

/// Copies values to vectors that have room for them.
fn copy_padded(vectors: &mut [Vector4<f64>], values: &[f64]) {
    for (vector, values) in vectors.iter_mut().zip(values.chunks(LANES)) {
        vector.as_mut_slice()[..values.len()].copy_from_slice(values);
    }
}

/// The samples that a polynomial is fitted to, in the order of time.
pub(crate) struct Nodes<'a> {
    pub(crate) samples: [&'a StoredSample; MAX_NODES],
    /// Number of valid samples, which is odd.
    pub(crate) count: usize,
    /// Whether they are every second sample, so that neighbouring instants have none in common.
    pub(crate) are_alternate: bool,
}

impl<'a> Nodes<'a> {
    /// Returns the samples.
    fn samples(&self) -> &[&'a StoredSample] {
        &self.samples[..self.count]
    }
}

/// State of the robot at the time of one sample. The motion is that of a polynomial fitted to the sample and
/// some neighbours on each side, and so are the derivatives that were not measured.
///
/// Angles and rates enter products, in which noise does not average out, so they are smoothed first. Where joint
/// velocities are measured, they lead from the mean of the positions at all samples to the position at the middle one:
/// a mean has less noise than the value of a polynomial, and an integral over so short a time has hardly any. A mean of
/// neighbours would give all instants the same noise, which their differences must show, so it takes every second. All of
/// it is linear in the measurements and local, so that a filter over many instants afterwards has the same
/// effect on what is differentiated, smoothed or neither.
#[derive(Clone, Debug)]
pub(crate) struct Instant {
    /// Time, s.
    pub(crate) time_s: f64,
    /// Motion of the base in the inertial frame.
    pub(crate) base: FrameMotion,
    /// Joint positions, rad or m.
    pub(crate) joint_position: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub(crate) joint_velocity: Vec<f64>,
    /// Joint accelerations, rad/s² or m/s².
    pub(crate) joint_acceleration: Vec<f64>,
    /// Measured joint efforts, N m or N.
    pub(crate) joint_effort: Vec<f64>,
    /// Measured wrenches on the payload, each in the frame of its sensor.
    pub(crate) wrenches: Vec<Wrench>,
    weights: CachedWeights,
}

impl Instant {
    /// Creates a robot of so many joints and wrenches at rest in its zero posture.
    pub(crate) fn new(joints: usize, wrenches: usize) -> Self {
        Self {
            time_s: 0.0,
            base: FrameMotion::at_rest(Isometry3::identity()),
            joint_position: vec![0.0; joints],
            joint_velocity: vec![0.0; joints],
            joint_acceleration: vec![0.0; joints],
            joint_effort: vec![0.0; joints],
            wrenches: vec![Wrench::zero(); wrenches],
            weights: CachedWeights::new(),
        }
    }

    /// Computes the instant of the middle one of some samples.
    pub(crate) fn set(&mut self, nodes: &Nodes<'_>) {
        let samples = nodes.samples();
        let center = samples[samples.len() / 2];
        let times_s = samples.iter().map(|sample| sample.time_s);
        let weights = self.weights.at_middle(times_s);
        self.time_s = center.time_s;
        self.base = base_motion(samples, weights);
        self.joint_effort.copy_from_slice(&center.joint_effort);
        self.wrenches.copy_from_slice(&center.wrenches);
        let is_measured = samples.iter().all(|sample| sample.has_velocity);
        let joints = self.joint_position.chunks_mut(LANES);
        let joints = joints.zip(self.joint_velocity.chunks_mut(LANES));
        let joints = joints.zip(self.joint_acceleration.chunks_mut(LANES));
        for (index, ((position, velocity), acceleration)) in joints.enumerate() {
            let motion = if is_measured {
                motion_of_rates(samples, index, weights, nodes.are_alternate)
            } else {
                motion_of_positions(samples, index, weights)
            };
            let count = position.len();
            position.copy_from_slice(&motion[0].as_slice()[..count]);
            velocity.copy_from_slice(&motion[1].as_slice()[..count]);
            acceleration.copy_from_slice(&motion[2].as_slice()[..count]);
        }
    }

    /// Copies the state of another instant of as many joints and wrenches, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        (self.time_s, self.base) = (other.time_s, other.base);
        self.joint_position.copy_from_slice(&other.joint_position);
        self.joint_velocity.copy_from_slice(&other.joint_velocity);
        self.joint_acceleration
            .copy_from_slice(&other.joint_acceleration);
        self.joint_effort.copy_from_slice(&other.joint_effort);
        self.wrenches.copy_from_slice(&other.wrenches);
    }

    /// Returns whether another instant has the same state, bit by bit.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.time_s == other.time_s
            && self.joint_acceleration == other.joint_acceleration
            && self.joint_velocity == other.joint_velocity
            && self.joint_position == other.joint_position
            && self.base == other.base
            && self.joint_effort == other.joint_effort
            && self.wrenches == other.wrenches
    }
}

/// Returns position, velocity and acceleration of some joints, by their index among the vectors, at the middle sample,
/// from measured positions and velocities.
fn motion_of_rates(
    samples: &[&StoredSample],
    index: usize,
    weights: &Weights,
    are_alternate: bool,
) -> [Vector4<f64>; 3] {
    let mean = (samples.len() as f64).recip();
    let [mut position, mut velocity, mut acceleration] = [Vector4::zeros(); 3];
    for (k, sample) in samples.iter().enumerate() {
        let (at, rate) = (&sample.joint_position[index], &sample.joint_velocity[index]);
        if are_alternate {
            position += at * mean - rate * weights.displacement[k];
        } else {
            position += at * weights.value[k];
        }
        velocity += rate * weights.value[k];
        acceleration += rate * weights.first[k];
    }
    [position, velocity, acceleration]
}

/// Returns position, velocity and acceleration of some joints, by their index among the vectors, at the middle sample,
/// from measured positions alone.
fn motion_of_positions(
    samples: &[&StoredSample],
    index: usize,
    weights: &Weights,
) -> [Vector4<f64>; 3] {
    let [mut position, mut velocity, mut acceleration] = [Vector4::zeros(); 3];
    for (k, sample) in samples.iter().enumerate() {
        let at = &sample.joint_position[index];
        position += at * weights.value[k];
        velocity += at * weights.first[k];
        acceleration += at * weights.second[k];
    }
    [position, velocity, acceleration]
}

/// Returns the base's motion at the middle sample. Position and velocity enter no product and are those of the middle
/// sample.
fn base_motion(samples: &[&StoredSample], weights: &Weights) -> FrameMotion {
    let center = &samples[samples.len() / 2].base;
    let [mut rate, mut acceleration, mut angular_acceleration] = [Vector3::zeros(); 3];
    for (k, sample) in samples.iter().enumerate() {
        let base = &sample.base;
        rate += base.angular_velocity * weights.value[k];
        acceleration += base.velocity * weights.first[k];
        angular_acceleration += base.angular_velocity * weights.first[k];
    }
    let rotations = samples.iter().zip(&weights.value);
    let rotations = rotations.map(|(sample, weight)| (&sample.base.pose.rotation, *weight));
    let rotation = weighted_rotation_sum(rotations, &center.pose.rotation);
    FrameMotion {
        pose: Isometry3::from_parts(
            center.pose.translation,
            UnitQuaternion::new_normalize(rotation.into()),
        ),
        velocity: center.velocity,
        angular_velocity: rate,
        acceleration: center.acceleration.unwrap_or(acceleration),
        angular_acceleration: center.angular_acceleration.unwrap_or(angular_acceleration),
    }
}
