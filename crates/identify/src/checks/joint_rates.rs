//! Joint velocities against joint positions.

use educe::Educe;
use std::f64::consts::PI;

use nalgebra::Vector4;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::increments::Increments;
use super::judge;
use crate::equations::LANES;

/// What the velocities of a joint seem to be instead of the derivatives of its positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VelocityCause {
    /// They have the opposite sign.
    OppositeSign,
    /// They are in degrees per second, and the positions in rad.
    Degrees,
    /// The positions are in degrees, and the velocities in rad/s.
    PositionsInDegrees,
    /// They are those of [`VelocityContradiction::other`].
    OtherJoint,
    /// The velocities of all joints of a publisher are exactly zero. They are not measured, and
    /// positions replace them.
    NotMeasured,
}

/// Velocities of joints that are not the derivatives of their positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VelocityContradiction {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Rms difference between the change of the position over 0.1 s and the integral of the
    /// velocity, relative to the larger of the two, without a unit: the largest of these joints.
    pub relative_difference: f64,
    /// What the velocities seem to be instead.
    pub cause: Option<VelocityCause>,
    /// The joint whose velocities they seem to be.
    pub other: Option<String>,
}

impl VelocityContradiction {
    /// Returns whether the velocities are measured and wrong.
    #[must_use]
    pub fn are_measured(&self) -> bool {
        self.cause != Some(VelocityCause::NotMeasured)
    }
}

/// Sums the changes of joint positions and the integrals of joint velocities.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct JointRates {
    joints: usize,
    increments: Increments,
    /// Time of the last sample, s, where it has positions and velocities.
    time_s: Option<f64>,
    /// Its positions and velocities, padded with zeros to whole vectors.
    position: Vec<Vector4<f64>>,
    velocity: Vec<Vector4<f64>>,
    /// Changes of the positions, then integrals of the velocities, from the last sample to this
    /// one.
    increment: Vec<Vector4<f64>>,
}

impl JointRates {
    /// Creates the sums for so many joints. Times between two samples that are longer than
    /// `max_gap_s` are not bridged. Only the last `most` intervals of 0.1 s are kept, if given:
    /// then nothing is allocated later.
    #[must_use]
    pub fn new(joints: usize, max_gap_s: f64, most: Option<usize>) -> Self {
        let vectors = joints.div_ceil(LANES);
        Self {
            joints,
            increments: Increments::new(2 * vectors, max_gap_s, most),
            time_s: None,
            position: vec![Vector4::zeros(); vectors],
            velocity: vec![Vector4::zeros(); vectors],
            increment: vec![Vector4::zeros(); 2 * vectors],
        }
    }

    /// Adds a sample at a time, s: positions, rad or m, and velocities, rad/s or m/s, of all
    /// joints. A sample without them starts the sums again.
    pub fn push(&mut self, time_s: f64, position: &[f64], velocity: &[f64]) {
        if self.joints == 0 || position.len() != self.joints || velocity.len() != self.joints {
            self.time_s = None;
            self.increments.interrupt();
            return;
        }
        let before_s = self.time_s.replace(time_s);
        let duration_s = before_s.map_or(0.0, |before_s| time_s - before_s);
        let has_jump = self.replace(position, velocity, duration_s);
        if before_s.is_none() {
            return;
        }
        if self.increments.is_bridged(duration_s) && !has_jump {
            self.increments.push(&self.increment, duration_s);
        } else {
            self.increments.interrupt();
        }
    }

    /// Replaces the last sample, and sets the increment from it to this one. Returns whether a
    /// position jumps by more than half a turn, as that of an angle which starts again.
    fn replace(&mut self, position: &[f64], velocity: &[f64], duration_s: f64) -> bool {
        let (changes, integrals) = self.increment.split_at_mut(self.position.len());
        let mut largest = Vector4::zeros();
        for (index, values) in position.chunks(LANES).enumerate() {
            let at = padded(values);
            changes[index] = at - self.position[index];
            largest = largest.sup(&changes[index].abs());
            self.position[index] = at;
        }
        for (index, values) in velocity.chunks(LANES).enumerate() {
            let rate = padded(values);
            integrals[index] = (self.velocity[index] + rate) * (0.5 * duration_s);
            self.velocity[index] = rate;
        }
        largest.max() > PI
    }

    /// Returns each joint whose velocities are not the derivatives of its positions. `names` are
    /// those of the joints, in the order of the samples; joints without a name are left out.
    #[must_use]
    pub fn contradictions(&self, names: &[&str]) -> Vec<VelocityContradiction> {
        let named = self.joints.min(names.len());
        let difference = |joint: usize, other: usize, scale: f64| {
            let (change, integral) = (joint, LANES * self.position.len() + other);
            let columns = (change..change + 1, integral..integral + 1);
            self.increments
                .relative_difference(columns.0, columns.1, scale)
        };
        let contradiction = |joint: usize| {
            let own = [
                (-1.0, VelocityCause::OppositeSign),
                (PI / 180.0, VelocityCause::Degrees),
                (180.0 / PI, VelocityCause::PositionsInDegrees),
            ];
            let own =
                own.map(|(scale, cause)| Some((difference(joint, joint, scale)?, (cause, None))));
            let others = (0..named).filter(|other| *other != joint).map(|other| {
                let cause = (VelocityCause::OtherJoint, Some(names[other]));
                Some((difference(joint, other, 1.0)?, cause))
            });
            let relative_difference = difference(joint, joint, 1.0)?;
            let cause = judge(relative_difference, own.into_iter().chain(others).flatten())?;
            let (cause, other) = cause.unzip();
            Some(VelocityContradiction {
                joints: vec![names[joint].to_owned()],
                relative_difference,
                cause,
                other: other.flatten().map(ToOwned::to_owned),
            })
        };
        (0..named).filter_map(contradiction).collect()
    }
}

/// Returns some values, padded with zeros to a whole vector.
fn padded(values: &[f64]) -> Vector4<f64> {
    match <&[f64; LANES]>::try_from(values) {
        Ok(all) => Vector4::from(*all),
        Err(_) => Vector4::from_fn(|k, _| values.get(k).copied().unwrap_or(0.0)),
    }
}

/// Returns one contradiction for the joints of each cause.
#[must_use]
pub fn grouped_by_cause(contradictions: Vec<VelocityContradiction>) -> Vec<VelocityContradiction> {
    let mut groups: Vec<VelocityContradiction> = Vec::new();
    for one in contradictions {
        match groups
            .iter_mut()
            .find(|group| (group.cause, &group.other) == (one.cause, &one.other))
        {
            Some(group) => {
                group.joints.extend(one.joints);
                group.relative_difference = group.relative_difference.max(one.relative_difference);
            }
            None => groups.push(one),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Joints without a name are left out, and cause no panic.
    #[test]
    fn joints_without_a_name_are_left_out() {
        let mut rates = JointRates::new(2, 0.1, None);
        for k in 0..300 {
            let time_s = 0.01 * f64::from(k);
            let position = [time_s.sin(), (2.0 * time_s).sin()];
            rates.push(time_s, &position, &[-time_s.cos(), 0.0]);
        }
        let joints = |names: &[&str]| -> Vec<String> {
            let found = rates.contradictions(names).into_iter();
            found.flat_map(|one| one.joints).collect()
        };
        assert_eq!(joints(&["a", "b"]), ["a", "b"]);
        assert_eq!(joints(&["a"]), ["a"]);
        assert_eq!(joints(&[]), [""; 0]);
    }
}
