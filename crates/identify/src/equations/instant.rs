//! Stored samples, and the smoothed and differentiated instant in the middle of a few of them.

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector4};
use tactid_dynamics::{FrameMotion, Wrench};

use super::differentiation::{CachedWeights, MAX_NODES, Weights};
use super::sample::{BaseState, Sample};

/// Number of joints, or of other columns, whose values are summed together.
pub(crate) const LANES: usize = 4;

/// What a polynomial is fitted to of the motion of a base.
pub(crate) type BaseVectors = [Vector4<f64>; 3];

/// A copy of a sample, which a polynomial is fitted to.
#[derive(Clone, Debug)]
pub(crate) struct StoredSample {
    /// Time, s; minus infinity before a sample is stored.
    pub(crate) time_s: f64,
    base: BaseState,
    /// Quaternion of the base's rotation, its angular velocity and its velocity, padded to four
    /// entries. The quaternion has the sign that is nearest to the previous sample's.
    base_vectors: BaseVectors,
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
            base_vectors: [Vector4::w(), Vector4::zeros(), Vector4::zeros()],
            joint_position: vec![Vector4::zeros(); joints.div_ceil(LANES)],
            joint_velocity: vec![Vector4::zeros(); joints.div_ceil(LANES)],
            has_velocity: false,
            joint_effort: vec![0.0; joints],
            wrenches: vec![Wrench::zero(); wrenches],
        }
    }

    /// Returns the vectors of the base's motion.
    pub(crate) fn base_vectors(&self) -> &BaseVectors {
        &self.base_vectors
    }

    /// Copies a sample whose slices have the right lengths; those that may be empty are empty or
    /// have the right length. `before` are the [`base_vectors`](Self::base_vectors) of the sample
    /// before.
    pub(crate) fn set(&mut self, sample: &Sample<'_>, before: &BaseVectors) {
        self.time_s = sample.time_s;
        self.base = sample.base;
        let rotation = sample.base.pose.rotation.coords;
        let side = 1f64.copysign(rotation.dot(&before[0]));
        let padded = |vector: &Vector3<f64>| vector.push(0.0);
        self.base_vectors = [
            rotation * side,
            padded(&sample.base.angular_velocity),
            padded(&sample.base.velocity),
        ];
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

    /// Returns the motion of a base whose rotation and velocities do not change.
    fn steady_base_motion(&self) -> FrameMotion {
        let [rotation, angular_velocity, _] = self.base_vectors;
        self.base_motion([
            rotation,
            angular_velocity,
            Vector4::zeros(),
            Vector4::zeros(),
        ])
    }

    /// Returns the motion of the base, given its smoothed rotation and angular velocity, and its
    /// differentiated acceleration and angular acceleration, which those that were measured
    /// replace.
    fn base_motion(&self, smoothed: [Vector4<f64>; 4]) -> FrameMotion {
        let [
            rotation,
            angular_velocity,
            acceleration,
            angular_acceleration,
        ] = smoothed;
        let (base, of_angle) = (&self.base, angular_acceleration.xyz());
        FrameMotion {
            pose: Isometry3::from_parts(
                base.pose.translation,
                UnitQuaternion::new_normalize(rotation.into()),
            ),
            velocity: base.velocity,
            angular_velocity: angular_velocity.xyz(),
            acceleration: base.acceleration.unwrap_or(acceleration.xyz()),
            angular_acceleration: base.angular_acceleration.unwrap_or(of_angle),
        }
    }
}

/// Copies values to vectors that have room for them.
fn copy_padded(vectors: &mut [Vector4<f64>], values: &[f64]) {
    for (vector, values) in vectors.iter_mut().zip(values.chunks(LANES)) {
        for (entry, value) in vector.iter_mut().zip(values) {
            *entry = *value;
        }
    }
}

/// The samples that a polynomial is fitted to, in the order of time.
pub(crate) struct Nodes<'a> {
    pub(crate) samples: [&'a StoredSample; MAX_NODES],
    /// Number of valid samples, which is odd.
    pub(crate) count: usize,
    /// Whether they are every second sample, so that neighbouring instants have none in common.
    pub(crate) are_alternate: bool,
    /// Whether all have the same rotation and velocities of the base, as where it is bolted down.
    pub(crate) is_base_steady: bool,
}

impl<'a> Nodes<'a> {
    /// Returns the samples.
    fn samples(&self) -> &[&'a StoredSample] {
        &self.samples[..self.count]
    }
}

/// State of the robot at the time of one sample. The motion is that of a polynomial fitted to the
/// sample and some neighbours on each side, and so are the derivatives that were not measured.
///
/// Angles and rates enter products, in which noise does not average out, so they are smoothed
/// first. Where joint velocities are measured, they lead from the mean of the positions at all
/// samples to the position at the middle one: a mean has less noise than the value of a polynomial,
/// and an integral over so short a time has hardly any. A mean of neighbours would give all
/// instants the same noise, which their differences must show, so it takes every second. All of it
/// is linear in the measurements and local, so that a filter over many instants afterwards has the
/// same effect on what is differentiated, smoothed or neither.
#[derive(Clone, Debug)]
pub struct Instant {
    /// Time, s.
    pub time_s: f64,
    /// Motion of the base in the inertial frame.
    pub base: FrameMotion,
    /// Joint positions, rad or m.
    pub joint_position: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub joint_velocity: Vec<f64>,
    /// Joint accelerations, rad/s² or m/s².
    pub joint_acceleration: Vec<f64>,
    /// Measured joint efforts, N m or N.
    pub joint_effort: Vec<f64>,
    /// Measured wrenches on the payload, each in the frame of its sensor.
    pub wrenches: Vec<Wrench>,
    weights: CachedWeights,
}

impl Instant {
    /// Creates a robot of so many joints and wrenches at rest in its zero posture.
    pub fn new(joints: usize, wrenches: usize) -> Self {
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
        self.base = if nodes.is_base_steady {
            center.steady_base_motion()
        } else {
            base_motion(samples, weights)
        };
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
            let places = [position, velocity, acceleration];
            for (place, values) in places.into_iter().zip(&motion) {
                for (entry, value) in place.iter_mut().zip(values) {
                    *entry = *value;
                }
            }
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

/// Returns position, velocity and acceleration of some joints, by their index among the vectors, at
/// the middle sample, from measured positions and velocities.
///
/// What is differentiated is the change from the middle sample: the derivative of a constant is
/// then zero, and not the rounding of the weights, which are large and sum to zero. That would be
/// the same in all windows, as motion is and noise is not.
///
/// It is not inlined, because the compiler then keeps the sums of four joints in vector registers;
/// among the code that copies them joint by joint it takes them apart in each pass, which doubles
/// the instructions.
#[inline(never)]
fn motion_of_rates(
    samples: &[&StoredSample],
    index: usize,
    weights: &Weights,
    are_alternate: bool,
) -> [Vector4<f64>; 3] {
    let mean = (samples.len() as f64).recip();
    let center = &samples[samples.len() / 2].joint_velocity[index];
    let [mut position, mut velocity, mut acceleration] = [Vector4::zeros(); 3];
    for (k, sample) in samples.iter().enumerate() {
        let (at, rate) = (&sample.joint_position[index], &sample.joint_velocity[index]);
        if are_alternate {
            position += at * mean - rate * weights.displacement[k];
        } else {
            position += at * weights.value[k];
        }
        velocity += rate * weights.value[k];
        acceleration += (rate - center) * weights.first[k];
    }
    [position, velocity, acceleration]
}

/// Returns position, velocity and acceleration of some joints, by their index among the vectors, at
/// the middle sample, from measured positions alone. It is not inlined for the reason of
/// [`motion_of_rates`].
#[inline(never)]
fn motion_of_positions(
    samples: &[&StoredSample],
    index: usize,
    weights: &Weights,
) -> [Vector4<f64>; 3] {
    let center = &samples[samples.len() / 2].joint_position[index];
    let [mut position, mut velocity, mut acceleration] = [Vector4::zeros(); 3];
    for (k, sample) in samples.iter().enumerate() {
        let at = &sample.joint_position[index];
        let change = at - center;
        position += at * weights.value[k];
        velocity += change * weights.first[k];
        acceleration += change * weights.second[k];
    }
    [position, velocity, acceleration]
}

/// Returns the base's motion at the middle sample. Position and velocity enter no product and are
/// those of the middle sample.
fn base_motion(samples: &[&StoredSample], weights: &Weights) -> FrameMotion {
    let middle = samples[samples.len() / 2];
    let [mut rotation, mut acceleration] = [Vector4::zeros(); 2];
    let [mut angular_velocity, mut angular_acceleration] = [Vector4::zeros(); 2];
    for (k, sample) in samples.iter().enumerate() {
        let (value, first) = (weights.value[k], weights.first[k]);
        let [quaternion, turning, velocity] = &sample.base_vectors;
        rotation += quaternion * value;
        angular_velocity += turning * value;
        angular_acceleration += (turning - middle.base_vectors[1]) * first;
        acceleration += (velocity - middle.base_vectors[2]) * first;
    }
    middle.base_motion([
        rotation,
        angular_velocity,
        acceleration,
        angular_acceleration,
    ])
}
