//! Angles that start again after a turn, as drivers wrap them, and how far a joint may move.

use std::f64::consts::{PI, TAU};

use tactid_dynamics::{JointKind, Manipulator};

/// Speed that no joint of a robot reaches, rad/s or m/s: three times that of fast arms, because
/// stamps are not exact.
const FASTEST: f64 = 30.0;

/// Steps below this size are no jumps, rad or m, however short their time: stamps may be late.
pub(crate) const SMALL_STEP: f64 = 0.3;

/// What a step of a joint is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step {
    /// A motion, after so many turns that were left out.
    Motion { turns: f64 },
    /// More than the joint can move.
    Jump,
}

/// Returns for some joints of a robot whether their positions are angles.
pub(crate) fn are_angles(robot: &Manipulator, joints: &[usize]) -> Vec<bool> {
    let is_angle = |&joint: &usize| robot.joint_kind(joint) == Some(JointKind::Revolute);
    joints.iter().map(is_angle).collect()
}

impl Step {
    /// Returns what a change of a joint within some time is, rad or m and s.
    pub(crate) fn of(change: f64, duration_s: f64, is_angle: bool) -> Self {
        let turns = if is_angle && change.abs() > PI {
            (change / TAU).round()
        } else {
            0.0
        };
        let moved = (change - TAU * turns).abs();
        if moved <= SMALL_STEP || moved <= FASTEST * duration_s {
            Self::Motion { turns }
        } else {
            Self::Jump
        }
    }
}

/// Returns the largest magnitude of the changes between the positions of two samples, rad or m. What
/// is no number counts for nothing.
pub(crate) fn largest_step(before: &[f64], after: &[f64]) -> f64 {
    let changes = before
        .iter()
        .zip(after)
        .map(|(before, after)| (after - before).abs());
    changes.fold(
        0.0,
        |largest, change| if change > largest { change } else { largest },
    )
}

/// Continues the positions of joints whose angles start again after a turn. Nothing is allocated
/// after construction.
#[derive(Clone, Debug)]
pub struct Continuation {
    are_angles: Vec<bool>,
    time_s: f64,
    /// The last positions as they were given, rad or m.
    last: Vec<f64>,
    /// Turns to add to each position.
    turns: Vec<f64>,
    /// Whether there are turns to add.
    has_turned: bool,
    continued: Vec<f64>,
}

impl Continuation {
    /// Creates the continuation of the positions of all joints of a robot.
    #[must_use]
    pub fn new(robot: &Manipulator) -> Self {
        let all: Vec<usize> = (0..robot.dof()).collect();
        Self::of_joints(robot, &all)
    }

    /// Creates the continuation of the positions of some joints of a robot.
    #[must_use]
    pub fn of_joints(robot: &Manipulator, joints: &[usize]) -> Self {
        let zeros = vec![0.0; joints.len()];
        Self {
            are_angles: are_angles(robot, joints),
            time_s: f64::NEG_INFINITY,
            last: zeros.clone(),
            turns: zeros.clone(),
            has_turned: false,
            continued: zeros,
        }
    }

    /// Returns positions at a time, s, continued from those before; the given ones where no angle
    /// has started again.
    pub fn push<'a>(&'a mut self, time_s: f64, position: &'a [f64]) -> &'a [f64] {
        if position.len() != self.last.len() {
            return position;
        }
        let duration_s = time_s - self.time_s;
        if duration_s.is_finite() && largest_step(&self.last, position) > PI {
            self.count_turns(duration_s, position);
        }
        self.time_s = time_s;
        self.last.copy_from_slice(position);
        if !self.has_turned {
            return position;
        }
        for (joint, continued) in self.continued.iter_mut().enumerate() {
            *continued = position[joint] + TAU * self.turns[joint];
        }
        &self.continued
    }

    /// Counts the turns that positions leave out after a time since the last ones, s.
    fn count_turns(&mut self, duration_s: f64, position: &[f64]) {
        for (joint, (&is_angle, &at)) in self.are_angles.iter().zip(position).enumerate() {
            let step = Step::of(at - self.last[joint], duration_s, is_angle);
            if let Step::Motion { turns } = step {
                self.turns[joint] -= turns;
            }
        }
        self.has_turned = self.turns.iter().any(|turns| *turns != 0.0);
    }

    /// Forgets all positions.
    pub fn clear(&mut self) {
        self.time_s = f64::NEG_INFINITY;
        self.turns.fill(0.0);
        self.has_turned = false;
    }
}

#[cfg(test)]
mod tests {
    use tactid_dynamics::BaseKind;

    use super::*;

    /// Angles that start again are continued; others stay as they are, bit by bit, and so do jumps.
    #[test]
    fn angles_are_continued() {
        let arm = r#"<robot name="arm"><link name="base"/><link name="upper"/><link name="tool0"/>
          <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
            <limit effort="1" velocity="3"/></joint>
          <joint name="slide" type="prismatic"><parent link="upper"/><child link="tool0"/><axis xyz="0 1 0"/>
            <limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>"#;
        let robot = Manipulator::from_urdf(arm, BaseKind::Fixed).unwrap();
        let mut continuation = Continuation::new(&robot);
        for k in 0..1000 {
            let angle = 0.03 * f64::from(k);
            let slide = if k == 500 { TAU } else { 0.1 };
            let given = [angle - TAU * (angle / TAU).round(), slide];
            let found = continuation.push(0.01 * f64::from(k), &given);
            assert!((found[0] - angle).abs() < 1e-12, "{k}");
            assert_eq!(found[1], slide);
        }
        let other = [0.03 * 999.0 - 10.0 * PI + 2.5, 0.1];
        let found = continuation.push(10.0, &other);
        assert!((found[0] - 0.03 * 999.0 - 2.5).abs() < 1e-9, "{found:?}");
    }
}
