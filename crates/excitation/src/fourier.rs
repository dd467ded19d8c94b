//! Periodic motions of a few harmonics: the usual excitation of the literature, to compare designs with.

use std::f64::consts::TAU;

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::ExcitationError;
use crate::dense::margins;
use crate::motion::{JointStates, Motion};
use crate::problem::Problem;

/// Most factors that are tried for a motion to be within all limits.
const MOST_TRIALS: usize = 40;

/// A sum of sines and cosines for each joint that moves, one period long, which begins in a given posture.
#[derive(Clone, Debug)]
pub struct FourierMotion {
    duration_s: f64,
    posture: Vec<f64>,
    joints: Vec<Harmonics>,
}

/// Motion of one joint.
#[derive(Clone, Debug)]
struct Harmonics {
    joint: usize,
    /// Amplitudes of sine and cosine of each multiple of the basic frequency, rad or m.
    amplitudes: Vec<[f64; 2]>,
}

impl FourierMotion {
    /// Draws a motion of some joints with so many harmonics, whose accelerations are normal with a standard deviation of
    /// about one, rad/s² or m/s².
    pub fn random(
        random: &mut impl Rng,
        duration_s: f64,
        posture: &[f64],
        joints: &[usize],
        harmonics: usize,
    ) -> Self {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let of_joint = |&joint: &usize| Harmonics {
            joint,
            amplitudes: (1..=harmonics)
                .map(|k| {
                    let rate = TAU * k as f64 / duration_s;
                    [normal(), normal()].map(|a| a / (rate * rate * (harmonics as f64).sqrt()))
                })
                .collect(),
        };
        Self {
            duration_s,
            posture: posture.to_vec(),
            joints: joints.iter().map(of_joint).collect(),
        }
    }

    /// Returns the motion with all amplitudes multiplied by a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        for place in 0..self.joints.len() {
            scaled.scale(place, factor);
        }
        scaled
    }

    /// Multiplies the amplitudes of the joint at a place among those that move.
    pub fn scale(&mut self, place: usize, factor: f64) {
        for amplitude in self.joints[place].amplitudes.iter_mut().flatten() {
            *amplitude *= factor;
        }
    }
}

impl FourierMotion {
    /// Draws a motion with five harmonics of the problem's duration, scaled into the limits of the problem: each joint as
    /// far as its own limits allow, and then all joints together as far as the other limits do.
    ///
    /// # Errors
    /// Returns the errors of [`margins`].
    pub fn within_limits(
        random: &mut impl Rng,
        problem: &Problem,
    ) -> Result<Self, ExcitationError> {
        let joints = problem.moving_joints()?;
        let mut motion = Self::random(random, problem.duration_s, &problem.start, &joints, 5);
        let (of_joints, _) = margins(problem, &motion)?;
        for (place, limits) in of_joints.chunks(3).take(joints.len()).enumerate() {
            // The way from the start to the end of the range is what a position has left.
            let [position, others @ ..] = limits else {
                continue;
            };
            let at_rest = margins_at_rest(problem, joints[place]);
            let excursion = (position.used - at_rest) / (1.0 - at_rest);
            let used = others.iter().map(|m| m.used).fold(excursion, f64::max);
            motion.scale(place, 0.999 / used.max(f64::MIN_POSITIVE));
        }
        // The other limits are not homogeneous: gravity uses some of a torque. So the largest factor is bracketed.
        let (mut possible, mut impossible) = (0.0, None);
        let mut factor = 1.0;
        for _ in 0..MOST_TRIALS {
            let scaled = motion.scaled(factor);
            let (all, _) = margins(problem, &scaled)?;
            if all.iter().all(|margin| margin.used <= 1.0) {
                possible = factor;
            } else {
                impossible = Some(factor);
            }
            factor = match impossible {
                None => break,
                Some(high) if possible == 0.0 => 0.5 * high,
                Some(high) if possible > 0.98 * high => break,
                Some(high) => 0.5 * (possible + high),
            };
        }
        motion = motion.scaled(possible);
        Ok(motion)
    }
}

/// Returns the fraction of the range of a joint's position that the start uses.
fn margins_at_rest(problem: &Problem, joint: usize) -> f64 {
    let (low, high) = problem.limits[joint].position;
    let used = (problem.start[joint] - 0.5 * (low + high)).abs() / (0.5 * (high - low));
    if used.is_finite() { used } else { 0.0 }
}

impl Motion for FourierMotion {
    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn at(&self, time_s: f64) -> JointStates {
        let mut states = JointStates::at_rest(&self.posture);
        for Harmonics { joint, amplitudes } in &self.joints {
            for (k, [sine, cosine]) in amplitudes.iter().enumerate() {
                let rate = TAU * (k + 1) as f64 / self.duration_s;
                let (sin, cos) = (rate * time_s).sin_cos();
                states.position[*joint] += sine * sin + cosine * (cos - 1.0);
                states.velocity[*joint] += rate * (sine * cos - cosine * sin);
                states.acceleration[*joint] -= rate * rate * (sine * sin + cosine * cos);
            }
        }
        states
    }
}

#[cfg(test)]
mod tests {
    use rand::{SeedableRng, rngs::SmallRng};

    use super::*;

    /// Velocities and accelerations are derivatives, and the motion is periodic and begins in its posture.
    #[test]
    fn derivatives_and_period() {
        let mut random = SmallRng::seed_from_u64(1);
        let motion = FourierMotion::random(&mut random, 4.0, &[0.3, 0.1, -0.2], &[0, 2], 5);
        assert_eq!(motion.at(0.0).position, [0.3, 0.1, -0.2]);
        let step = 1e-6;
        for k in 0..20 {
            let t = 0.2 * f64::from(k);
            let (before, at, after) = (motion.at(t - step), motion.at(t), motion.at(t + step));
            for joint in 0..3 {
                let slope = (after.position[joint] - before.position[joint]) / (2.0 * step);
                assert!((slope - at.velocity[joint]).abs() < 1e-7);
                let slope = (after.velocity[joint] - before.velocity[joint]) / (2.0 * step);
                assert!((slope - at.acceleration[joint]).abs() < 1e-7);
                let later = motion.at(t + 4.0).position[joint];
                assert!((later - at.position[joint]).abs() < 1e-12);
            }
            assert_eq!(at.position[1], 0.1);
        }
    }
}
