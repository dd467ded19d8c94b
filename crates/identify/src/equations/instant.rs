//! Stored samples, and the smoothed and differentiated instant in the middle of a few of them.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tactid_dynamics::{FrameMotion, Wrench};

use super::differentiation::{CachedWeights, MAX_NODES, weighted_rotation_sum};
use super::sample::{BaseState, Sample};

/// A copy of a sample, which a polynomial is fitted to.
#[derive(Clone, Debug)]
pub(crate) struct StoredSample {
    /// Time, s; minus infinity before a sample is stored.
    pub(crate) time_s: f64,
    base: BaseState,
    joint_position: Vec<f64>,
    joint_velocity: Vec<f64>,
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
            joint_position: vec![0.0; joints],
            joint_velocity: vec![0.0; joints],
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
        self.base = base_motion(samples, &weights.value, &weights.first);
        self.joint_effort.copy_from_slice(&center.joint_effort);
        self.wrenches.copy_from_slice(&center.wrenches);
        let measured = samples.iter().all(|sample| sample.has_velocity);
        self.joint_position.fill(0.0);
        self.joint_velocity.fill(0.0);
        self.joint_acceleration.fill(0.0);
        let mean = (samples.len() as f64).recip();
        for (k, sample) in samples.iter().enumerate() {
            let (position, velocity, acceleration) = (
                &mut self.joint_position,
                &mut self.joint_velocity,
                &mut self.joint_acceleration,
            );
            if measured && nodes.are_alternate {
                add_scaled(position, mean, &sample.joint_position);
                add_scaled(position, -weights.displacement[k], &sample.joint_velocity);
            } else {
                add_scaled(position, weights.value[k], &sample.joint_position);
            }
            if measured {
                add_scaled(velocity, weights.value[k], &sample.joint_velocity);
                add_scaled(acceleration, weights.first[k], &sample.joint_velocity);
            } else {
                add_scaled(velocity, weights.first[k], &sample.joint_position);
                add_scaled(acceleration, weights.second[k], &sample.joint_position);
            }
        }
    }
}

impl Instant {
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

/// Adds `weight` times each value.
fn add_scaled(sums: &mut [f64], weight: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

/// Returns the base's motion at the middle sample, given the weights of values and of first derivatives.
/// Position and velocity enter no product and are those of the middle sample.
fn base_motion(
    samples: &[&StoredSample],
    value: &[f64; MAX_NODES],
    first: &[f64; MAX_NODES],
) -> FrameMotion {
    let center = &samples[samples.len() / 2].base;
    let sum = |weights: &[f64; MAX_NODES], of: fn(&BaseState) -> Vector3<f64>| -> Vector3<f64> {
        let pairs = samples.iter().zip(weights);
        pairs
            .map(|(sample, weight)| of(&sample.base) * *weight)
            .sum()
    };
    let rotations = samples.iter().zip(value);
    let rotations = rotations.map(|(sample, weight)| (&sample.base.pose.rotation, *weight));
    let rotation = weighted_rotation_sum(rotations, &center.pose.rotation);
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
