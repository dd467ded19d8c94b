//! Servos of the arm's joints, which follow commanded velocities.

use nalgebra::Vector3;
use rapier3d_f64::math::Vector;

use super::{Scene, State};
use crate::Experiment;
use crate::convert::glam_vector;

/// Damping of the joint servos, N m s/rad. The drive's torque is
/// `DRIVE_DAMPING · (commanded - actual velocity)`, with the velocities at the end of the step. At
/// this stiffness the joint follows within 1e-4 rad/s.
pub(super) const DRIVE_DAMPING: f64 = 1e6;

/// Fraction of the position error that a servo corrects in a second where gravity acts, 1/s.
/// Without it an arm would sink by 1e-4 rad/s under 100 N m; with it the error is below 1e-5 rad.
const POSITION_GAIN: f64 = 10.0;

/// State of the servos.
pub(super) struct Drives {
    /// Position to which the commanded velocities lead, rad or m.
    positions: Vec<f64>,
    /// Velocities at the end of the present step that the servos aim at, rad/s or m/s.
    velocities: Vec<f64>,
    /// Fraction of the position error that is corrected in a second: zero without gravity, where
    /// nothing makes a joint drift.
    gain: f64,
}

impl Drives {
    pub(super) fn new(experiment: &Experiment, joints: usize) -> Self {
        let is_weightless = experiment.gravity() == Vector3::zeros();
        Self {
            positions: experiment.posture.positions(),
            velocities: vec![0.0; joints],
            gain: if is_weightless { 0.0 } else { POSITION_GAIN },
        }
    }
}

impl Scene {
    /// Commands the velocity of each drive at the end of the next step, rad/s or m/s.
    pub(crate) fn drive(&mut self, velocities: &[f64]) {
        self.aim(velocities);
        for link in &self.links {
            if let Some(body) = self.bodies.get_mut(link.handle) {
                body.reset_forces(false);
                body.reset_torques(false);
            }
        }
        for (&link, velocity) in self.roles.arm.iter().zip(&self.drives.velocities) {
            let Some(joint) = &self.robot.bodies[link].joint else {
                continue;
            };
            let (child, parent) = (self.links[link].handle, self.links[joint.parent].handle);
            let pose = *self.bodies[child].position();
            // The effort acts between link and parent. The multibody's own damping is the other
            // half of the servo.
            let effort: Vector =
                pose.rotation * glam_vector(&joint.axis) * (DRIVE_DAMPING * velocity);
            for (body, effort) in [(child, effort), (parent, -effort)] {
                if joint.prismatic {
                    self.bodies[body].add_force_at_point(effort, pose.translation, false);
                } else {
                    self.bodies[body].add_torque(effort, false);
                }
            }
        }
    }

    /// Adds the correction of position errors to the commanded velocities, and moves positions on.
    fn aim(&mut self, velocities: &[f64]) {
        let actual = self.arm_positions();
        let drives = &mut self.drives;
        for (k, velocity) in velocities.iter().enumerate() {
            let error = drives.positions[k] - actual[k];
            drives.velocities[k] = velocity + drives.gain * error;
            drives.positions[k] += velocity * self.parameters.dt;
        }
    }

    /// Computes the efforts of the drives in the step to `state`, N m (N for a prismatic joint).
    pub(crate) fn drive_efforts(&self, state: &State, efforts: &mut [f64]) {
        let aims = self.roles.arm.iter().zip(&self.drives.velocities);
        for ((&link, velocity), effort) in aims.zip(efforts) {
            *effort = DRIVE_DAMPING * (velocity - state.joint_velocity[link - 1]);
        }
    }
}
