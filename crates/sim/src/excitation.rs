//! Commanded joint velocities: each joint starts at rest and is accelerated with `amplitude · cos(2π · frequency · t)`
//! plus noise.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};

use crate::experiment::{Excitation, ExcitationMode, JointExcitation};
use crate::joint_table::JointTable;
use crate::{Experiment, SimError};

/// Excitation of one joint and the interval in which it is driven.
struct Driven {
    /// Index in the commanded velocities.
    joint: usize,
    amplitude: f64,
    frequency_hz: f64,
    start_s: f64,
    end_s: f64,
}

/// A motion that is followed, and the index in the commanded velocities of each of its joints.
struct Followed {
    motion: JointTable,
    joints: Vec<usize>,
}

/// Generator of the commanded velocities, step by step.
pub(crate) struct Commands {
    followed: Option<Followed>,
    driven: Vec<Driven>,
    noise: f64,
    random: StdRng,
    dt: f64,
    velocity: Vec<f64>,
}

impl Commands {
    /// Returns the generator for an arm with so many joints, of which the excitation drives those with the indices
    /// `driven`, one for each entry of its list or each joint of its motion.
    ///
    /// # Errors
    /// Returns the errors of [`JointTable::read`] for a motion that cannot be read.
    pub(crate) fn new(
        experiment: &Experiment,
        joints: usize,
        driven: &[usize],
    ) -> Result<Self, SimError> {
        let Excitation {
            mode,
            joints: excitations,
            command_noise,
            file,
            ..
        } = &experiment.excitation;
        let followed = match file {
            Some(path) => Some(Followed {
                motion: JointTable::read(path)?,
                joints: driven.to_vec(),
            }),
            None => None,
        };
        let share_s = experiment.duration_s / excitations.len() as f64;
        let motion = |(i, (one, &joint)): (usize, (&JointExcitation, &usize))| {
            let (start_s, end_s) = match mode {
                ExcitationMode::Sequence => (share_s * i as f64, share_s * (i + 1) as f64),
                ExcitationMode::Together => (0.0, experiment.duration_s),
            };
            Driven {
                joint,
                amplitude: one.amplitude_rad_s2,
                frequency_hz: one.frequency_hz,
                start_s,
                end_s,
            }
        };
        let pairs = excitations.iter().zip(driven);
        Ok(Self {
            driven: match followed {
                Some(_) => Vec::new(),
                None => pairs.enumerate().map(motion).collect(),
            },
            followed,
            noise: *command_noise,
            random: StdRng::seed_from_u64(experiment.seed),
            dt: experiment.step_s,
            velocity: vec![0.0; joints],
        })
    }

    /// Returns the velocities at the end of the step that starts at `time_s`, rad/s or m/s.
    pub(crate) fn step(&mut self, time_s: f64) -> &[f64] {
        if let Some(Followed { motion, joints }) = &self.followed {
            // The velocities that lead the joints from one position to the next, which the physics add up.
            let now = motion.positions_at(time_s);
            let next = motion.positions_at(time_s + self.dt);
            for (k, &joint) in joints.iter().enumerate() {
                self.velocity[joint] = (next[k] - now[k]) / self.dt;
            }
        }
        for one in &self.driven {
            let velocity = &mut self.velocity[one.joint];
            let tolerance = 1e-6 * self.dt; // times are multiples of the step up to rounding
            if time_s < one.start_s - tolerance {
                continue;
            }
            let acceleration = if time_s < one.end_s - tolerance {
                let noise: f64 = StandardNormal.sample(&mut self.random);
                let phase = TAU * one.frequency_hz * (time_s - one.start_s);
                one.amplitude * (phase.cos() + self.noise * noise)
            } else {
                // After its interval the joint is stopped with at most the amplitude of its excitation.
                (-*velocity / self.dt).clamp(-one.amplitude, one.amplitude)
            };
            *velocity += acceleration * self.dt;
        }
        &self.velocity
    }

    /// Integrates the given accelerations, rad/s² or m/s², over one step in place of the experiment's excitation and
    /// returns the velocities.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs the commands of an arm with six joints, of which joints 3, 5 and 6 are driven.
    fn run(experiment: &Experiment) -> Vec<Vec<f64>> {
        let mut commands = Commands::new(experiment, 6, &[2, 4, 5]).unwrap();
        let steps = (experiment.duration_s / experiment.step_s).round() as usize;
        (0..steps)
            .map(|k| commands.step(k as f64 * experiment.step_s).to_vec())
            .collect()
    }

    /// Without noise the velocity is the integral of the cosine, and each joint is driven for a third of the time.
    #[test]
    fn joints_are_driven_one_after_another_from_rest() {
        let mut experiment = Experiment::paper();
        experiment.duration_s = 30.0;
        experiment.excitation.command_noise = 0.0;
        let velocities = run(&experiment);
        let integral = |t: f64| (TAU * 0.2 * t).sin() / (TAU * 0.2);
        for (k, v) in velocities.iter().enumerate() {
            let t = (k as f64 + 0.5) * 1e-3; // a velocity belongs to the middle of its step
            for (joint, start) in [(2, 0.0), (4, 10.0), (5, 20.0)] {
                let expected = if (start..start + 10.0).contains(&t) {
                    integral(t - start)
                } else {
                    0.0
                };
                assert!(
                    (v[joint] - expected).abs() < 6e-4,
                    "joint {joint} at {t}: {}",
                    v[joint]
                );
            }
            assert_eq!([v[0], v[1], v[3]], [0.0; 3]);
        }
    }

    /// The noise has the requested standard deviation and depends on the seed only.
    #[test]
    fn command_noise_is_white_and_seeded() {
        let mut experiment = Experiment::paper();
        experiment.duration_s = 30.0;
        let noisy = run(&experiment);
        assert_eq!(noisy, run(&experiment));
        experiment.seed = 1;
        assert_ne!(noisy, run(&experiment));
        experiment.excitation.command_noise = 0.0;
        let clean = run(&experiment);
        let error = |k: usize| (noisy[k + 1][2] - noisy[k][2]) - (clean[k + 1][2] - clean[k][2]);
        let variance = (0..9000).map(|k| error(k).powi(2)).sum::<f64>() / 9000.0;
        assert!((variance.sqrt() / 1e-3 - 0.01).abs() < 5e-4);
    }

    /// A joint that is not at rest when its interval ends is stopped with at most the amplitude of its excitation.
    #[test]
    fn a_joint_is_brought_to_rest() {
        let mut experiment = Experiment::paper();
        experiment.duration_s = 6.0; // 2 s each: 0.4 of a period
        let velocities = run(&experiment);
        assert!(velocities[1999][2] > 0.4);
        assert_eq!(velocities[3500][2], 0.0);
        let hardest = velocities[2000..]
            .windows(2)
            .map(|w| (w[1][2] - w[0][2]).abs());
        assert!(hardest.fold(0.0, f64::max) < 1.0001e-3);
    }
}
