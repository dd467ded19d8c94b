//! What the robot measures, at one time.

use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::Wrench;

/// One sample of every sensor, with a single stamp.
///
/// The physics steps by `v' = v + dt · a(x)`, `x' = x + dt · v'`, so a velocity belongs to the middle between two
/// positions. A sample holds the positions `x` of its time, the mean of the velocities before and after, and the
/// forces that took one to the other. So the payload's mass times the difference of the velocities of two samples is
/// exactly the mean of their forces times the step.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Time since the start of the excitation, s.
    pub time_s: f64,
    /// Positions of all moving joints, fingers included, in the order of [`Simulation::joint_names`], rad or m.
    ///
    /// [`Simulation::joint_names`]: crate::Simulation::joint_names
    pub joint_position: Vec<f64>,
    /// Their velocities, rad/s or m/s.
    pub joint_velocity: Vec<f64>,
    /// Torques of the drives about the joints' axes, N m; forces for prismatic joints, N.
    pub joint_torque: Vec<f64>,
    /// The base.
    pub base: BaseSample,
    /// The base's IMU.
    pub imu: ImuSample,
    /// Both fingers, in the order of the experiment.
    pub fingers: [FingerSample; 2],
    /// What no robot can measure, for tests and reports.
    pub truth: Truth,
}

/// Pose and twist of the frame of the base link, in world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseSample {
    /// `world_from_base`.
    pub pose: Isometry3<f64>,
    /// Of the frame's origin, in world, m/s.
    pub velocity: Vector3<f64>,
    /// In world, rad/s.
    pub angular_velocity: Vector3<f64>,
}

/// An inertial measurement unit in the frame of the base link, at its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// In the base's frame, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Specific force in the base's frame, m/s²; without gravity, the acceleration.
    pub acceleration: Vector3<f64>,
}

/// What a finger's tactile pad gives, in the frame of the finger's link.
#[derive(Clone, Debug)]
pub struct FingerSample {
    /// `world_from_finger`, for tests and reports.
    pub pose: Isometry3<f64>,
    /// On the payload, about the frame's origin, N and N m.
    pub wrench: Wrench,
    /// Where it touches.
    pub contacts: Vec<Contact>,
}

/// One point of contact, in the frame of the finger's link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// m.
    pub position: Vector3<f64>,
    /// On the payload, N.
    pub force: Vector3<f64>,
}

/// The state of tool and payload, in world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// `world_from_tool`.
    pub tool: Isometry3<f64>,
    /// `world_from_payload`: at the payload's centre of mass.
    pub payload: Isometry3<f64>,
    /// Of the payload's centre of mass, m/s.
    pub payload_velocity: Vector3<f64>,
    /// rad/s.
    pub payload_angular_velocity: Vector3<f64>,
}

impl Sample {
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
