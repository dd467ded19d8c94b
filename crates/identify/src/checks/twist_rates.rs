//! The twist of a base, or of a sensor that is carried about, against its pose.

use educe::Educe;
use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::increments::Increments;
use super::judge;
use crate::BaseState;
use crate::equations::LANES;

/// Number of columns of a velocity or an angular velocity.
const AXES: usize = 3;

/// Axes along which a twist is expressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TwistAxes {
    /// Axes of the world, as a [`BaseState`] has them.
    World,
    /// Axes of the moving body, as the messages of `nav_msgs/msg/Odometry` have them.
    Body,
}

/// A twist that is not the derivative of its pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TwistContradiction {
    /// Rms difference between the change of the pose over 0.1 s and the integral of the twist,
    /// relative to the larger of the two, without a unit: of positions or of rotations, whichever
    /// differ more.
    pub relative_difference: f64,
    /// The axes in which the twist would fit the pose.
    pub better_axes: Option<TwistAxes>,
}

/// Sums the changes of a pose and the integrals of its twist.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct TwistRates {
    axes: TwistAxes,
    increments: Increments,
    last: Option<(f64, PoseAndTwist)>,
}

impl TwistRates {
    /// Creates the sums for a twist that was measured along `axes`. Times between two samples that
    /// are longer than `max_gap_s` are not bridged. Only the last `most` intervals of 0.1 s are
    /// kept, if given: then nothing is allocated later.
    #[must_use]
    pub fn new(axes: TwistAxes, max_gap_s: f64, most: Option<usize>) -> Self {
        Self {
            axes,
            increments: Increments::new(6, max_gap_s, most),
            last: None,
        }
    }

    /// Adds a sample at a time, s. Its velocities are in world axes, into which those along other
    /// axes were turned.
    pub fn push(&mut self, time_s: f64, base: &BaseState) {
        let current = PoseAndTwist::new(self.axes, base);
        if let Some((before_s, before)) = &self.last {
            let duration_s = time_s - before_s;
            if self.increments.is_bridged(duration_s) {
                let increment = increment(before, &current, duration_s);
                self.increments.push(&increment, duration_s);
            } else {
                self.increments.interrupt();
            }
        }
        self.last = Some((time_s, current));
    }

    /// Returns a contradiction, if the twist is not the derivative of the pose.
    #[must_use]
    pub fn contradiction(&self) -> Option<TwistContradiction> {
        let other = match self.axes {
            TwistAxes::World => TwistAxes::Body,
            TwistAxes::Body => TwistAxes::World,
        };
        // Linear and angular velocity are judged apart, because their units differ.
        let contradictions = [0, LANES].into_iter().filter_map(|first| {
            let difference = |hypothesis: usize| {
                let integral = 2 * LANES * hypothesis + first;
                let (changes, integrals) = (first..first + AXES, integral..integral + AXES);
                self.increments.relative_difference(changes, integrals, 1.0)
            };
            let relative_difference = difference(1)?;
            let causes = difference(2).into_iter().map(|rest| (rest, other));
            Some(TwistContradiction {
                relative_difference,
                better_axes: judge(relative_difference, causes)?,
            })
        });
        contradictions.max_by(|a, b| a.relative_difference.total_cmp(&b.relative_difference))
    }
}

/// Pose and twist at one time.
#[derive(Clone, Copy, Debug)]
struct PoseAndTwist {
    pose: Isometry3<f64>,
    /// Velocity and angular velocity in world axes, then what they would be if they had been
    /// measured along the other axes.
    rates: [Vector3<f64>; 4],
}

impl PoseAndTwist {
    fn new(axes: TwistAxes, base: &BaseState) -> Self {
        let rotation = &base.pose.rotation;
        let (velocity, angular_velocity) = (base.velocity, base.angular_velocity);
        let turned = match axes {
            TwistAxes::World => [rotation * velocity, rotation * angular_velocity],
            TwistAxes::Body => [velocity, angular_velocity].map(|v| rotation.inverse() * v),
        };
        Self {
            pose: base.pose,
            rates: [velocity, angular_velocity, turned[0], turned[1]],
        }
    }
}

/// Returns the changes of position and rotation, then the integrals of the
/// [rates](PoseAndTwist::rates).
fn increment(before: &PoseAndTwist, current: &PoseAndTwist, duration_s: f64) -> [Vector4<f64>; 6] {
    let moved = current.pose.translation.vector - before.pose.translation.vector;
    let rotation = current.pose.rotation * before.pose.rotation.inverse();
    let integral = |k: usize| (before.rates[k] + current.rates[k]) * (0.5 * duration_s);
    let [velocity, turning, other_velocity, other_turning] = std::array::from_fn(integral);
    let columns = [
        moved,
        rotation_vector(&rotation),
        velocity,
        turning,
        other_velocity,
        other_turning,
    ];
    columns.map(|columns| columns.push(0.0))
}

/// Squared sine of half an angle below which the first two terms of the arcsine's series are exact
/// to rounding.
const SMALL_SQUARE: f64 = 1e-8;

/// Returns axis times angle of a rotation, rad, without a trigonometric function for a small angle,
/// as between two samples.
fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let half_sine = rotation.imag() * rotation.w.signum();
    let square = half_sine.norm_squared();
    if square < SMALL_SQUARE {
        half_sine * (2.0 + square / 3.0)
    } else {
        rotation.scaled_axis()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Translation3;
    use rand::rngs::SmallRng;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use super::*;

    const PERIOD_S: f64 = 1e-3;

    /// Returns noise of variance one in three axes that forgets within `time_s`.
    fn colored_noise(random: &mut SmallRng, time_s: f64) -> impl FnMut() -> Vector3<f64> {
        let kept = (-PERIOD_S / time_s).exp();
        let mut noise = Vector3::zeros();
        move || {
            let white = Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
            noise = noise * kept + white * (1.0 - kept * kept).sqrt();
            noise
        }
    }

    /// Returns the checks of 10 s of a base that swings with up to `fastest` m/s, with its real
    /// velocity or with one along other axes, and noise of the position, 0.5 mm, and of the
    /// velocity, 5 mm/s, that forgets within `time_s`.
    fn swinging_base(time_s: f64, fastest: f64, has_velocity: bool) -> TwistRates {
        let mut random = [5, 6].map(SmallRng::seed_from_u64);
        let [mut of_position, mut of_velocity] =
            random.each_mut().map(|r| colored_noise(r, time_s));
        let mut rates = TwistRates::new(TwistAxes::World, 0.1, None);
        for k in 0..10_000 {
            let time = f64::from(k) * PERIOD_S;
            let (sine, cosine) = (0.5 * time).sin_cos();
            let position = Vector3::new(2.0 * fastest * sine, 0.0, 0.0);
            let velocity = Vector3::new(fastest * cosine, 0.0, 0.0);
            let velocity = if has_velocity {
                velocity
            } else {
                velocity.yzx()
            };
            rates.push(
                time,
                &BaseState {
                    pose: Isometry3::from_parts(
                        Translation3::from(position + of_position() * 5e-4),
                        UnitQuaternion::identity(),
                    ),
                    velocity: velocity + of_velocity() * 5e-3,
                    angular_velocity: Vector3::zeros(),
                    acceleration: None,
                    angular_acceleration: None,
                },
            );
        }
        rates
    }

    /// Noise of a filtered sensor, which neighbouring samples share, is no contradiction; a
    /// velocity along other axes is one beside the same noise.
    #[test]
    fn noise_that_neighbouring_samples_share_is_no_contradiction() {
        for time_s in [1e-5, 2e-3, 8e-3, 0.02] {
            let slow = swinging_base(time_s, 0.02, true);
            assert_eq!(slow.contradiction(), None, "{time_s} s");
            let other = swinging_base(time_s, 0.2, false).contradiction();
            assert!(
                other.is_some_and(|found| found.relative_difference > 0.9),
                "{time_s} s"
            );
        }
    }

    /// The vector of a small rotation, of either quaternion, is that of the arcsine.
    #[test]
    fn small_rotations_have_their_vector() {
        for angle in [0.0, 1e-9, 1e-4, 1.9e-4, 2.1e-4, 0.3] {
            let vector = Vector3::new(0.6, 0.0, -0.8) * angle;
            let rotation = UnitQuaternion::from_scaled_axis(vector);
            for quaternion in [
                rotation,
                UnitQuaternion::new_unchecked(-rotation.into_inner()),
            ] {
                let found = rotation_vector(&quaternion);
                assert!((found - vector).norm() <= 1e-15 * (1e-2 + angle), "{angle}");
            }
        }
    }
}
