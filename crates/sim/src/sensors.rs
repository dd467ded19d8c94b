//! Sensors: a [`Sample`] from the states before and after a step, with measurement noise.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use tactid_dynamics::Wrench;

use crate::Experiment;
use crate::contact::ContactPoint;
use crate::experiment::{Noise, StdDev};
use crate::robot::{LinkFrame, Robot};
use crate::roles::Roles;
use crate::sample::{BaseSample, Contact, FingerSample, ImuSample, Sample, Truth};
use crate::scene::{BodyState, State};

/// Distinguishes the random stream of the measurement noise from the stream of the command noise,
/// which has the same seed.
const MEASUREMENT_STREAM: u64 = 0x7461_6374_6964_0001;

/// All sensors of the robot.
pub(crate) struct Sensors {
    /// Pose of the base link on its body, which has its frame at the centre of mass.
    body_from_base: Isometry3<f64>,
    tool: LinkFrame,
    fingers: [Finger; 2],
    gravity: Vector3<f64>,
    noise: Noise,
    random: StdRng,
    dt: f64,
}

/// A finger's body, and the axis of its joint in the body's frame.
struct Finger {
    body: usize,
    mass_kg: f64,
    axis: Vector3<f64>,
}

/// The states before and after a step and the contacts and efforts during it.
pub(crate) struct StepRecord<'a> {
    pub before: &'a State,
    pub after: &'a State,
    pub contacts: &'a [Vec<ContactPoint>; 2],
    /// Efforts of the drives, in the order of the arm's joints, N m or N.
    pub efforts: &'a [f64],
    /// Indices of the bodies that the arm's joints move.
    pub arm: &'a [usize],
}

fn mean(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    (a + b) * 0.5
}

impl Sensors {
    pub(crate) fn new(robot: &Robot, roles: &Roles, experiment: &Experiment) -> Self {
        let fingers = roles.fingers.map(|body| Finger {
            body,
            mass_kg: robot.bodies[body].mass.mass_kg,
            axis: robot.bodies[body]
                .joint
                .as_ref()
                .map_or_else(Vector3::zeros, |joint| joint.axis.into_inner()),
        });
        Self {
            body_from_base: robot.links[0].body_from_link,
            tool: roles.tool.clone(),
            fingers,
            gravity: experiment.gravity(),
            noise: experiment.noise.clone(),
            random: StdRng::seed_from_u64(experiment.seed ^ MEASUREMENT_STREAM),
            dt: experiment.step_s,
        }
    }

    /// Returns `world_from_tool` in a state.
    pub(crate) fn tool_pose(&self, state: &State) -> Isometry3<f64> {
        state.bodies[self.tool.body].pose * self.tool.body_from_link
    }

    /// Measures a step. The time of the sample is not set.
    pub(crate) fn measure(&mut self, step: &StepRecord<'_>, sample: &mut Sample) {
        let (before, after) = (step.before, step.after);
        sample
            .joint_position
            .copy_from_slice(&before.joint_position);
        for (i, velocity) in sample.joint_velocity.iter_mut().enumerate() {
            *velocity = 0.5 * (before.joint_velocity[i] + after.joint_velocity[i]);
        }
        for (&body, &effort) in step.arm.iter().zip(step.efforts) {
            sample.joint_torque[body - 1] = effort;
        }
        self.measure_base(before, after, sample);
        for (i, finger) in self.fingers.iter().enumerate() {
            let (x, next) = (&before.bodies[finger.body], &after.bodies[finger.body]);
            measure_finger(x, &step.contacts[i], &mut sample.fingers[i]);
            let acceleration = (next.velocity - x.velocity) / self.dt - self.gravity;
            // The drive accelerates the finger, bears its weight and presses on the payload.
            let along =
                finger.mass_kg * finger.axis.dot(&(x.pose.rotation.inverse() * acceleration));
            sample.joint_torque[finger.body - 1] =
                along + finger.axis.dot(&sample.fingers[i].wrench.force);
        }
        sample.truth = Truth {
            tool: self.tool_pose(before),
            payload: before.payload.pose,
            payload_velocity: mean(&before.payload.velocity, &after.payload.velocity),
            payload_angular_velocity: mean(
                &before.payload.angular_velocity,
                &after.payload.angular_velocity,
            ),
        };
        if self.noise != Noise::default() {
            self.add_noise(sample);
        }
    }

    fn measure_base(&self, before: &State, after: &State, sample: &mut Sample) {
        let (x, next) = (&before.bodies[0], &after.bodies[0]);
        let pose = x.pose * self.body_from_base;
        let angular_velocity = mean(&x.angular_velocity, &next.angular_velocity);
        let arm = pose.translation.vector - x.pose.translation.vector;
        let angular_acceleration = (next.angular_velocity - x.angular_velocity) / self.dt;
        let acceleration = (next.velocity - x.velocity) / self.dt
            + angular_acceleration.cross(&arm)
            + angular_velocity.cross(&angular_velocity.cross(&arm));
        sample.base = BaseSample {
            pose,
            velocity: mean(&x.velocity, &next.velocity) + angular_velocity.cross(&arm),
            angular_velocity,
        };
        let base_from_world = pose.rotation.inverse();
        sample.imu = ImuSample {
            angular_velocity: base_from_world * angular_velocity,
            acceleration: base_from_world * (acceleration - self.gravity),
        };
    }

    fn add_noise(&mut self, sample: &mut Sample) {
        let Self { noise, random, .. } = self;
        let values = |values: &mut [f64], std_dev: &StdDev, random: &mut StdRng| {
            for (channel, value) in values.iter_mut().enumerate() {
                *value += std_dev.of(channel) * normal(random);
            }
        };
        values(
            &mut sample.joint_position,
            &noise.joint_position_rad,
            random,
        );
        values(
            &mut sample.joint_velocity,
            &noise.joint_velocity_rad_s,
            random,
        );
        values(&mut sample.joint_torque, &noise.joint_torque_nm, random);
        let base = &mut sample.base;
        base.pose.translation.vector += vector(&noise.base_position_m, 0, random);
        let turn = vector(&noise.base_orientation_rad, 0, random);
        base.pose.rotation = UnitQuaternion::from_scaled_axis(turn) * base.pose.rotation;
        base.velocity += vector(&noise.base_velocity_m_s, 0, random);
        base.angular_velocity += vector(&noise.base_angular_velocity_rad_s, 0, random);
        let imu = &mut sample.imu;
        imu.angular_velocity += vector(&noise.imu_angular_velocity_rad_s, 0, random);
        imu.acceleration += vector(&noise.imu_acceleration_m_s2, 0, random);
        for (k, finger) in sample.fingers.iter_mut().enumerate() {
            finger.wrench.force += vector(&noise.finger_force_n, 3 * k, random);
            finger.wrench.moment += vector(&noise.finger_moment_nm, 3 * k, random);
            for contact in &mut finger.contacts {
                contact.force += vector(&noise.contact_force_n, 0, random);
            }
        }
    }
}

/// Returns a number from the standard normal distribution.
fn normal(random: &mut StdRng) -> f64 {
    StandardNormal.sample(random)
}

/// Returns noise for three channels, starting with the channel `first`.
fn vector(std_dev: &StdDev, first: usize, random: &mut StdRng) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| std_dev.of(first + axis) * normal(random))
}

/// Expresses the contacts in the finger's frame and sums them about its origin.
fn measure_finger(finger: &BodyState, contacts: &[ContactPoint], sample: &mut FingerSample) {
    sample.pose = finger.pose;
    sample.wrench = Wrench::zero();
    sample.contacts.clear();
    for point in contacts {
        let position = finger
            .pose
            .inverse_transform_point(&point.position.into())
            .coords;
        let force = finger.pose.rotation.inverse() * point.force;
        sample.wrench.force += force;
        sample.wrench.moment += position.cross(&force);
        sample.contacts.push(Contact { position, force });
    }
}
