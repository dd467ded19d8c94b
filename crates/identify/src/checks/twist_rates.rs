//! The twist of a base, or of a sensor that is carried about, against its pose.

use nalgebra::Vector3;

use super::increments::Increments;
use super::judge;
use crate::BaseState;

/// Number of columns of a velocity or an angular velocity.
const AXES: usize = 3;

/// Axes along which a twist is expressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TwistAxes {
    /// Axes of the world, as a [`BaseState`] has them.
    World,
    /// Axes of the moving body, as the messages of `nav_msgs/msg/Odometry` have them.
    Body,
}

/// A twist that is not the derivative of its pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistContradiction {
    /// Rms difference between the change of the pose over 0.1 s and the integral of the twist, relative to the larger of
    /// the two: of positions or of rotations, whichever differ more.
    pub relative_difference: f64,
    /// The axes in which the twist would fit the pose.
    pub better_axes: Option<TwistAxes>,
}

/// Sums the changes of a pose and the integrals of its twist.
#[derive(Clone, Debug)]
pub struct TwistRates {
    axes: TwistAxes,
    increments: Increments,
    last: Option<(f64, BaseState)>,
}

impl TwistRates {
    /// Creates the sums for a twist that was measured along `axes`. Times between two samples that are longer than
    /// `max_gap_s` are not bridged. Only the last `most` intervals of 0.1 s are kept, if given: then nothing is allocated
    /// later.
    #[must_use]
    pub fn new(axes: TwistAxes, max_gap_s: f64, most: Option<usize>) -> Self {
        Self {
            axes,
            increments: Increments::new(6 * AXES, max_gap_s, most),
            last: None,
        }
    }

    /// Adds a sample at a time, s. Its velocities are in world axes, into which those along other axes were turned.
    pub fn push(&mut self, time_s: f64, base: &BaseState) {
        if let Some((before_s, before)) = &self.last {
            let duration_s = time_s - before_s;
            if self.increments.is_bridged(duration_s) {
                let increment = self.increment(before, base, duration_s);
                self.increments.push(&increment, duration_s);
            } else {
                self.increments.interrupt();
            }
        }
        self.last = Some((time_s, *base));
    }

    /// Returns a contradiction, if the twist is not the derivative of the pose.
    #[must_use]
    pub fn contradiction(&self) -> Option<TwistContradiction> {
        let other = match self.axes {
            TwistAxes::World => TwistAxes::Body,
            TwistAxes::Body => TwistAxes::World,
        };
        // Linear and angular velocity are judged apart, because their units differ.
        let contradictions = [0, AXES].into_iter().filter_map(|first| {
            let difference = |hypothesis: usize| {
                let integral = 2 * AXES * hypothesis + first;
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

    /// Returns the changes of position and rotation, then the integrals of the velocities, then what these would be if
    /// they had been measured along the other axes.
    fn increment(&self, a: &BaseState, b: &BaseState, duration_s: f64) -> [f64; 6 * AXES] {
        let turned = |base: &BaseState, rate: Vector3<f64>| match self.axes {
            TwistAxes::World => base.pose.rotation * rate,
            TwistAxes::Body => base.pose.rotation.inverse() * rate,
        };
        let mean = |of: &dyn Fn(&BaseState) -> Vector3<f64>| 0.5 * duration_s * (of(a) + of(b));
        let vectors = [
            b.pose.translation.vector - a.pose.translation.vector,
            (b.pose.rotation * a.pose.rotation.inverse()).scaled_axis(),
            mean(&|base| base.velocity),
            mean(&|base| base.angular_velocity),
            mean(&|base| turned(base, base.velocity)),
            mean(&|base| turned(base, base.angular_velocity)),
        ];
        std::array::from_fn(|k| vectors[k / AXES][k % AXES])
    }
}
