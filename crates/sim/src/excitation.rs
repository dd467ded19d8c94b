//! Commanded joint velocities, step by step: of cosines, of a designed motion, or of motions that
//! are planned on the way.

mod active;
mod cosines;
mod grip;

use crate::contact::ContactPoint;
use crate::motion::JointMotion;
use crate::robot::Robot;
use crate::roles::{ArmDrive, Roles};
use crate::sample::Sample;
use crate::scene::State;
use crate::{Experiment, SimError};

pub use active::{ActiveContradiction, ActiveReport};

use active::ActiveControl;
use cosines::Cosines;

/// The robot and its grasp when the excitation starts.
pub(crate) struct Start<'a> {
    pub robot: &'a Robot,
    pub roles: &'a Roles,
    pub state: &'a State,
    /// Contacts of each finger.
    pub contacts: &'a [Vec<ContactPoint>; 2],
    /// Force of each finger on the payload, N.
    pub grip_force_n: f64,
}

/// Generator of the commanded velocities.
pub(crate) struct Commands {
    source: Source,
    dt: f64,
    /// Velocities at the end of the last step, in the order of the arm's joints, rad/s or m/s.
    velocity: Vec<f64>,
}

/// Where the velocities come from.
enum Source {
    Cosines(Box<Cosines>),
    Designed(JointMotion),
    Active(Box<ActiveControl>),
}

impl Commands {
    /// Returns the generator for the arm of an experiment.
    ///
    /// # Errors
    /// Returns [`SimError::Robot`] or [`SimError::Planning`] if no motion of the arm can be
    /// planned.
    pub(crate) fn new(experiment: &Experiment, start: &Start<'_>) -> Result<Self, SimError> {
        let roles = start.roles;
        Ok(Self {
            source: match &roles.drive {
                ArmDrive::Cosines(driven) => {
                    Source::Cosines(Box::new(Cosines::new(experiment, driven)))
                }
                ArmDrive::Designed(motion) => Source::Designed(motion.clone()),
                ArmDrive::Active => {
                    Source::Active(Box::new(ActiveControl::new(experiment, start)?))
                }
            },
            dt: experiment.step_s,
            velocity: vec![0.0; roles.arm.len()],
        })
    }

    /// Returns the velocities at the end of the step that starts at `time_s`, rad/s or m/s.
    ///
    /// # Errors
    /// Returns [`SimError::Planning`] if the motion cannot be planned further.
    pub(crate) fn step(&mut self, time_s: f64) -> Result<&[f64], SimError> {
        let Self {
            source,
            dt,
            velocity,
        } = self;
        // The mean velocity of a step leads to the position at its end.
        let mean = |before: f64, after: f64| (after - before) / *dt;
        match source {
            Source::Cosines(cosines) => cosines.accelerate(time_s, velocity),
            Source::Designed(motion) => {
                for (joint, velocity) in velocity.iter_mut().enumerate() {
                    let [before, after] = [time_s, time_s + *dt].map(|t| motion.position(joint, t));
                    *velocity = mean(before, after);
                }
            }
            Source::Active(control) => {
                control.plan_if_due(time_s)?;
                for (joint, velocity) in velocity.iter_mut().enumerate() {
                    let [before, after] =
                        [time_s, time_s + *dt].map(|t| control.position(joint, t));
                    *velocity = mean(before, after);
                }
            }
        }
        Ok(&self.velocity)
    }

    /// Takes the measurements of the step that [`step`](Self::step) commanded.
    ///
    /// # Errors
    /// Returns [`SimError::Planning`] if they cannot be used.
    pub(crate) fn observe(&mut self, sample: &Sample) -> Result<(), SimError> {
        match &mut self.source {
            Source::Active(control) => control.observe(sample),
            Source::Cosines(_) | Source::Designed(_) => Ok(()),
        }
    }

    /// Returns whether the arm rests for good: no motion is planned, and the last is at its end.
    pub(crate) fn is_finished(&self, time_s: f64) -> bool {
        matches!(&self.source, Source::Active(control) if control.is_finished(time_s))
    }

    /// Returns what active identification has reached; `None` for another kind of excitation.
    pub(crate) fn active_report(&self) -> Option<ActiveReport> {
        match &self.source {
            Source::Active(control) => Some(control.report()),
            Source::Cosines(_) | Source::Designed(_) => None,
        }
    }

    /// Integrates the given accelerations, rad/s² or m/s², over one step in place of the
    /// experiment's excitation and returns the velocities.
    ///
    /// # Errors
    /// Returns [`SimError::Command`] if there is not one acceleration for each joint.
    pub(crate) fn accelerate(&mut self, accelerations: &[f64]) -> Result<&[f64], SimError> {
        if accelerations.len() != self.velocity.len() {
            return Err(SimError::Command {
                given: accelerations.len(),
                expected: self.velocity.len(),
            });
        }
        for (velocity, acceleration) in self.velocity.iter_mut().zip(accelerations) {
            *velocity += acceleration * self.dt;
        }
        Ok(&self.velocity)
    }
}
