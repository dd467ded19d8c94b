//! Measurements of the robot at one instant.

use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::Wrench;

/// One sample of every sensor with a single time stamp.
///
/// The physics engine integrates `v' = v + dt · a(x)`, `x' = x + dt · v'`, so that a velocity
/// belongs to the middle between two positions. A sample holds the positions `x` at its time, the
/// mean of the velocities before and after, and the forces that changed the former into the latter.
/// Hence the payload's mass times the difference of the velocities of two consecutive samples
/// equals the mean of their forces times the step.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Time since the start of the excitation, s.
    pub time_s: f64,
    /// Positions of all moving joints, fingers included, in the order of
    /// [`Simulation::joint_names`], rad or m.
    ///
    /// [`Simulation::joint_names`]: crate::Simulation::joint_names
    pub joint_position: Vec<f64>,
    /// Velocities of these joints, rad/s or m/s.
    pub joint_velocity: Vec<f64>,
    /// Torques of the drives about the joints' axes on the links they move, N m (forces of
    /// prismatic joints, N).
    pub joint_torque: Vec<f64>,
    /// Motion of the base.
    pub base: BaseSample,
    /// Measurement of the base's IMU.
    pub imu: ImuSample,
    /// Measurements of both fingers, in the order of the experiment.
    pub fingers: [FingerSample; 2],
    /// Ground truth, which a robot cannot measure, for tests and reports.
    pub truth: Truth,
}

/// Pose and twist of the base link's frame, expressed in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseSample {
    /// Pose `world_from_base`.
    pub pose: Isometry3<f64>,
    /// Velocity of the frame's origin, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
}

/// Measurement of an inertial measurement unit at the base link's origin, in the link's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Specific force, m/s²: the acceleration less gravity.
    pub acceleration: Vector3<f64>,
}

/// Measurement of a finger's tactile pad, expressed in the frame of the finger's link.
#[derive(Clone, Debug)]
pub struct FingerSample {
    /// Pose `world_from_finger`, for tests and reports.
    pub pose: Isometry3<f64>,
    /// Wrench on the payload about the frame's origin, N and N m.
    pub wrench: Wrench,
    /// Contact points between pad and payload.
    pub contacts: Vec<Contact>,
}

/// A contact point, expressed in the frame of the finger's link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Position, m.
    pub position: Vector3<f64>,
    /// Force on the payload, N.
    pub force: Vector3<f64>,
}

/// Ground truth of the motion of tool and payload, expressed in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Pose `world_from_tool`.
    pub tool: Isometry3<f64>,
    /// Pose `world_from_payload`; the payload's frame is at its centre of mass.
    pub payload: Isometry3<f64>,
    /// Velocity of the payload's centre of mass, m/s.
    pub payload_velocity: Vector3<f64>,
    /// Angular velocity of the payload, rad/s.
    pub payload_angular_velocity: Vector3<f64>,
}

impl Sample {
    /// Returns a sample of zeros for a robot with so many moving joints.
    pub(crate) fn new(joints: usize) -> Self {
        let finger = || FingerSample {
            pose: Isometry3::identity(),
            wrench: Wrench::zero(),
            contacts: Vec::with_capacity(4),
        };
        Self {
            time_s: 0.0,
            joint_position: vec![0.0; joints],
            joint_velocity: vec![0.0; joints],
            joint_torque: vec![0.0; joints],
            base: BaseSample {
                pose: Isometry3::identity(),
                velocity: Vector3::zeros(),
                angular_velocity: Vector3::zeros(),
            },
            imu: ImuSample {
                angular_velocity: Vector3::zeros(),
                acceleration: Vector3::zeros(),
            },
            fingers: [finger(), finger()],
            truth: Truth {
                tool: Isometry3::identity(),
                payload: Isometry3::identity(),
                payload_velocity: Vector3::zeros(),
                payload_angular_velocity: Vector3::zeros(),
            },
        }
    }
}
