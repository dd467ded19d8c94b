//! Joints that start at rest and accelerate by `amplitude · cos(2π · frequency · t)` plus noise.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};

use crate::Experiment;
use crate::experiment::{Excitation, ExcitationMode, JointExcitation};

/// Excitation of one joint and the interval in which it is driven.
struct Driven {
    /// Index in the commanded velocities.
    joint: usize,
    amplitude: f64,
    frequency_hz: f64,
    start_s: f64,
    end_s: f64,
}

/// Generator of accelerations that are cosines of time, joint by joint.
pub(super) struct Cosines {
    driven: Vec<Driven>,
    noise: f64,
    random: StdRng,
    dt: f64,
}

impl Cosines {
    /// Returns the generator of an experiment's excitation; `driven` has the position in the arm of
    /// each joint that it drives.
    pub(super) fn new(experiment: &Experiment, driven: &[usize]) -> Self {
        let Excitation {
            mode,
            joints: excitations,
            command_noise,
            ..
        } = &experiment.excitation;
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
        Self {
            driven: pairs.enumerate().map(motion).collect(),
            noise: *command_noise,
            random: StdRng::seed_from_u64(experiment.seed),
            dt: experiment.step_s,
        }
    }

    /// Changes the velocities of the arm's joints, rad/s or m/s, to those at the end of the step
    /// that starts at `time_s`.
    pub(super) fn accelerate(&mut self, time_s: f64, velocity: &mut [f64]) {
        for one in &self.driven {
            let velocity = &mut velocity[one.joint];
            let tolerance = 1e-6 * self.dt; // times are multiples of the step up to rounding
            if time_s < one.start_s - tolerance {
                continue;
            }
            let acceleration = if time_s < one.end_s - tolerance {
                let noise: f64 = StandardNormal.sample(&mut self.random);
                let phase = TAU * one.frequency_hz * (time_s - one.start_s);
                one.amplitude * (phase.cos() + self.noise * noise)
            } else {
                // After its interval the joint stops with at most the amplitude of its excitation.
                (-*velocity / self.dt).clamp(-one.amplitude, one.amplitude)
            };
            *velocity += acceleration * self.dt;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the velocities of an arm with six joints, of which joints 3, 5 and 6 are driven.
    fn run(experiment: &Experiment) -> Vec<Vec<f64>> {
        let mut cosines = Cosines::new(experiment, &[2, 4, 5]);
        let steps = (experiment.duration_s / experiment.step_s).round() as usize;
        let mut velocity = vec![0.0; 6];
        (0..steps)
            .map(|k| {
                cosines.accelerate(k as f64 * experiment.step_s, &mut velocity);
                velocity.clone()
            })
            .collect()
    }

    /// Without noise the velocity is the integral of the cosine, and each joint is driven for a
    /// third of the time.
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

    /// A joint that is not at rest when its interval ends is stopped with at most the amplitude of
    /// its excitation.
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
