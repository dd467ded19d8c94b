//! Changes of joint positions, which for angles are the same after whole turns.

use std::f64::consts::TAU;

use tactid_dynamics::{JointKind, Manipulator};

/// For each joint whether its positions are angles, which are the same after whole turns.
pub(crate) struct Angles(Vec<bool>);

impl Angles {
    /// Creates the kinds of all joints of a robot.
    pub(crate) fn new(robot: &Manipulator) -> Self {
        let is_angle = |joint| robot.joint_kind(joint) == Some(JointKind::Revolute);
        Self((0..robot.dof()).map(is_angle).collect())
    }

    /// Returns the change of each joint, rad or m, from some positions to others, within half a
    /// turn for angles.
    pub(crate) fn changes<'a>(
        &'a self,
        from: &'a [f64],
        to: &'a [f64],
    ) -> impl Iterator<Item = f64> + 'a {
        let pairs = from.iter().zip(to).zip(&self.0);
        pairs.map(|((from, to), is_angle)| {
            let turns = if *is_angle {
                ((to - from) / TAU).round()
            } else {
                0.0
            };
            to - from - TAU * turns
        })
    }
}
