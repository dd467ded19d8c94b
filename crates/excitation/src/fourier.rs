//! Periodic motions of a few harmonics, the usual excitation of the literature, for comparison.

use std::f64::consts::TAU;

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::ExcitationError;
use crate::checks::value;
use crate::dense::margins;
use crate::joint_limits::JointLimits;
use crate::limits::Margin;
use crate::motion::{JointStates, Motion};
use crate::problem::Problem;

/// Most factors that are tried for a motion to be within all limits.
const MOST_TRIALS: usize = 40;

/// Steps of a motion at which it is compared with the limits of the joints: a hundred for each
/// period of the fastest harmonic.
const STEPS: u32 = 500;

/// A sum of sines and cosines for each joint that moves, one period long, from a given posture.
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
    /// Number of harmonics of a random motion.
    const HARMONICS: usize = 5;

    /// Returns the motion of the problem's duration with amplitudes of acceleration in the given
    /// ratios within each joint: for each joint that moves, sine and cosine of each harmonic. Each
    /// joint moves as far as its own limits allow; the other limits are not regarded.
    ///
    /// # Errors
    /// Returns [`ExcitationError::Value`] for a number of amplitudes that is not a multiple of
    /// twice the number of joints, and the errors of a problem that is not valid.
    pub fn with_amplitudes(problem: &Problem, amplitudes: &[f64]) -> Result<Self, ExcitationError> {
        problem.check()?;
        let joints = problem.moving_joints()?;
        let count = amplitudes.len();
        let is_whole = count > 0 && count.is_multiple_of(2 * joints.len());
        let expected = format!(
            "a multiple of {}, two for each joint and harmonic",
            2 * joints.len()
        );
        value("amplitudes", count as f64, is_whole, &expected)?;
        let mut motion = Self::new(problem.duration_s, &problem.start, &joints, amplitudes);
        let times = (0..=STEPS).map(|k| problem.duration_s * f64::from(k) / f64::from(STEPS));
        let states: Vec<JointStates> = times.map(|time_s| motion.at(time_s)).collect();
        for (place, &joint) in joints.iter().enumerate() {
            let factor = largest_factor(&states, joint, &problem.limits[joint]);
            motion.scale(place, 0.999 * factor);
        }
        Ok(motion)
    }

    /// Creates a motion of some joints, of which each has the same number of amplitudes of
    /// accelerations, rad/s² or m/s².
    fn new(duration_s: f64, posture: &[f64], joints: &[usize], amplitudes: &[f64]) -> Self {
        let of_joint = amplitudes.chunks_exact(amplitudes.len() / joints.len());
        let harmonics = |(&joint, amplitudes): (&usize, &[f64])| Harmonics {
            joint,
            amplitudes: (1..)
                .zip(amplitudes.chunks_exact(2))
                .map(|(k, pair)| {
                    let rate = TAU * f64::from(k) / duration_s;
                    [pair[0], pair[1]].map(|a| a / (rate * rate))
                })
                .collect(),
        };
        Self {
            duration_s,
            posture: posture.to_vec(),
            joints: joints.iter().zip(of_joint).map(harmonics).collect(),
        }
    }

    /// Returns the motion with all amplitudes multiplied by a factor.
    fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        for place in 0..self.joints.len() {
            scaled.scale(place, factor);
        }
        scaled
    }

    /// Multiplies the amplitudes of the joint at a place among those that move.
    fn scale(&mut self, place: usize, factor: f64) {
        for amplitude in self.joints[place].amplitudes.iter_mut().flatten() {
            *amplitude *= factor;
        }
    }

    /// Draws a motion with five harmonics of the problem's duration, scaled into the limits of the
    /// problem: each joint as far as its own limits allow, and then all joints together as far as
    /// the other limits do.
    ///
    /// # Errors
    /// Returns the errors of [`with_amplitudes`](Self::with_amplitudes) and
    /// [`scaled_into_limits`](Self::scaled_into_limits).
    pub fn within_limits(
        random: &mut impl Rng,
        problem: &Problem,
    ) -> Result<Self, ExcitationError> {
        let count = 2 * Self::HARMONICS * problem.moving_joints()?.len();
        let amplitudes: Vec<f64> = StandardNormal.sample_iter(random).take(count).collect();
        Self::with_amplitudes(problem, &amplitudes)?.scaled_into_limits(problem)
    }

    /// Returns the motion itself where it is within all limits of a problem, and a smaller one of
    /// the same shape otherwise.
    ///
    /// # Errors
    /// Returns [`ExcitationError::Impossible`] where no multiple that was tried is within the
    /// limits, and the errors of [`margins`].
    pub fn scaled_into_limits(&self, problem: &Problem) -> Result<Self, ExcitationError> {
        // The other limits are not homogeneous: gravity uses some of a torque. So the largest
        // factor is bracketed.
        let mut possible: Option<f64> = None;
        let mut impossible: Option<(f64, Margin)> = None;
        let mut factor = 1.0;
        for _ in 0..MOST_TRIALS {
            let (all, _) = margins(problem, &self.scaled(factor))?;
            match all.into_iter().find(|margin| margin.used > 1.0) {
                None => possible = Some(factor),
                Some(exceeded) => impossible = Some((factor, exceeded)),
            }
            factor = match (possible, &impossible) {
                (_, None) => break,
                (None, Some((high, _))) => 0.5 * high,
                (Some(low), Some((high, _))) if low > 0.98 * high => break,
                (Some(low), Some((high, _))) => 0.5 * (low + high),
            };
        }
        match (possible, impossible) {
            (Some(factor), _) => Ok(self.scaled(factor)),
            (None, Some((_, Margin { limit, used, .. }))) => Err(ExcitationError::Impossible {
                limit,
                used,
                at: "in every motion that was tried",
            }),
            (None, None) => Err(ExcitationError::NotObservable),
        }
    }
}

/// Returns the factor by which a joint's excursion from its start reaches the first of its limits.
fn largest_factor(states: &[JointStates], joint: usize, limits: &JointLimits) -> f64 {
    let start = states[0].position[joint];
    let largest = |of: &dyn Fn(&JointStates) -> f64| states.iter().map(of).fold(0.0, f64::max);
    let up = largest(&|states| states.position[joint] - start);
    let down = largest(&|states| start - states.position[joint]);
    let velocity = largest(&|states| states.velocity[joint].abs());
    let acceleration = largest(&|states| states.acceleration[joint].abs());
    // A start on a limit that the motion does not pass leaves 0 / 0, which a minimum ignores.
    ((limits.position.1 - start) / up)
        .min((start - limits.position.0) / down)
        .min(limits.velocity / velocity)
        .min(limits.acceleration / acceleration)
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

    fn random_motion(random: &mut SmallRng, posture: &[f64], joints: &[usize]) -> FourierMotion {
        let normal = StandardNormal.sample_iter(random);
        let amplitudes: Vec<f64> = normal.take(10 * joints.len()).collect();
        FourierMotion::new(4.0, posture, joints, &amplitudes)
    }

    /// Velocities and accelerations are derivatives; the motion is periodic from its posture.
    #[test]
    fn derivatives_and_period() {
        let mut random = SmallRng::seed_from_u64(1);
        let motion = random_motion(&mut random, &[0.3, 0.1, -0.2], &[0, 2]);
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

    /// The factor moves a joint exactly to the end of its range that it reaches first, wherever in
    /// the range it starts.
    #[test]
    fn the_factor_reaches_the_first_limit() {
        let mut random = SmallRng::seed_from_u64(2);
        for k in 0..40 {
            let mut motion = random_motion(&mut random, &[0.3], &[0]);
            let times = (0..=STEPS).map(|k| 4.0 * f64::from(k) / f64::from(STEPS));
            let at = |motion: &FourierMotion| -> Vec<JointStates> {
                times.clone().map(|time_s| motion.at(time_s)).collect()
            };
            let limits = JointLimits {
                position: (0.3 - 0.05 * f64::from(k), 0.3 + 0.05 * f64::from(40 - k)),
                velocity: 1e3,
                acceleration: 1e3,
                effort: 1.0,
            };
            motion.scale(0, largest_factor(&at(&motion), 0, &limits));
            let (low, high) = limits.position;
            let room = |states: &JointStates| {
                let position = states.position[0];
                (high - position).min(position - low)
            };
            let least = at(&motion).iter().map(room).fold(f64::INFINITY, f64::min);
            assert!(least.abs() < 1e-12, "{least}");
        }
    }
}
