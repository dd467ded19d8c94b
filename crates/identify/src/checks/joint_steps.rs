//! Steps of joint positions from one sample to the next that are no motion: angles that start again
//! after a turn, and jumps that no joint can make.

use educe::Educe;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::Manipulator;

use crate::equations::{SMALL_STEP, Step, are_angles, largest_step};

/// Fewest jumps that show two mixed sources: five samples of the other one.
const FEWEST_JUMPS: u64 = 10;

/// Positions that jump faster than any joint moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PositionJumps {
    /// Topic or array of the positions.
    pub source: String,
    /// Names of the joints, of the first jump first.
    pub joints: Vec<String>,
    /// Number of samples with a jump.
    pub count: u64,
    /// Number of samples.
    pub samples: u64,
    /// Time of the first jump, s.
    pub time_s: f64,
    /// Largest change of a joint in the first jump, rad or m.
    pub change: f64,
    /// Time from the sample before, s.
    pub duration_s: f64,
}

impl PositionJumps {
    /// Returns whether there are so many jumps that samples of two sources are mixed.
    #[must_use]
    pub fn are_of_two_sources(&self) -> bool {
        self.count >= FEWEST_JUMPS
    }
}

/// Counts steps of joint positions that are no motion. Nothing is allocated after construction, but
/// by what returns them.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct StepMonitor {
    are_angles: Vec<bool>,
    names: Vec<String>,
    time_s: f64,
    last: Vec<f64>,
    /// The last step of each joint that is more than a motion, rad or m; zero before there is one.
    fast: Vec<f64>,
    samples: u64,
    /// Number of new starts of each joint.
    starts: Vec<u64>,
    /// Number of jumps of each joint.
    jumps: Vec<u64>,
    /// Number of jumps in the direction of the one before: many of them are a motion, as of
    /// positions in degrees. Samples of two sources go to and fro.
    onward: u64,
    /// Number of samples with a jump.
    jumped: u64,
    /// Time of the last jump or start, s.
    noticed_s: f64,
    first: Option<FirstJump>,
}

#[derive(Clone, Copy, Debug)]
struct FirstJump {
    joint: usize,
    time_s: f64,
    change: f64,
    duration_s: f64,
}

impl StepMonitor {
    /// Creates the monitor of some joints of a robot, in their order in a sample.
    #[must_use]
    pub fn new(robot: &Manipulator, joints: &[usize]) -> Self {
        let names = robot.joint_names();
        Self {
            are_angles: are_angles(robot, joints),
            names: joints.iter().map(|&joint| names[joint].clone()).collect(),
            time_s: f64::NEG_INFINITY,
            last: vec![0.0; joints.len()],
            fast: vec![0.0; joints.len()],
            samples: 0,
            starts: vec![0; joints.len()],
            jumps: vec![0; joints.len()],
            onward: 0,
            jumped: 0,
            noticed_s: f64::NEG_INFINITY,
            first: None,
        }
    }

    /// Adds the positions of all joints of the monitor at a time, s.
    pub fn push(&mut self, time_s: f64, position: &[f64]) {
        if position.len() != self.last.len() {
            return;
        }
        let duration_s = time_s - self.time_s;
        let follows = duration_s.is_finite() && duration_s > 0.0;
        if follows && largest_step(&self.last, position) > SMALL_STEP {
            self.count_steps(time_s, duration_s, position);
        }
        self.samples += 1;
        self.time_s = time_s;
        self.last.copy_from_slice(position);
    }

    /// Counts the steps of all joints to the positions at a time, s, after a time since the last
    /// ones, s.
    fn count_steps(&mut self, time_s: f64, duration_s: f64, position: &[f64]) {
        let mut largest: Option<FirstJump> = None;
        for (joint, &at) in position.iter().enumerate() {
            let jump = self.jump(joint, at - self.last[joint], duration_s);
            let is_larger = |jump: &f64| largest.is_none_or(|other| other.change < *jump);
            if let Some(change) = jump.filter(is_larger) {
                largest = Some(FirstJump {
                    joint,
                    time_s,
                    change,
                    duration_s,
                });
            }
        }
        self.jumped += u64::from(largest.is_some());
        self.first = self.first.or(largest);
    }

    /// Counts a step of a joint, and returns its size if it is a jump.
    fn jump(&mut self, joint: usize, change: f64, duration_s: f64) -> Option<f64> {
        let step = Step::of(change, duration_s, self.are_angles[joint]);
        match step {
            Step::Motion { turns: 0.0 } => return None,
            Step::Motion { .. } => self.starts[joint] += 1,
            Step::Jump => {
                let before = std::mem::replace(&mut self.fast[joint], change);
                self.onward += u64::from(before * change > 0.0);
                self.jumps[joint] += 1;
            }
        }
        self.noticed_s = self.time_s + duration_s;
        (step == Step::Jump).then_some(change.abs())
    }

    /// Returns the jumps, if one of them or a turn was in the last `span_s` seconds. `source` is
    /// the topic or the array of the positions.
    #[must_use]
    pub fn jumps(&self, source: &str, span_s: f64) -> Option<PositionJumps> {
        let jumps: u64 = self.jumps.iter().sum();
        let is_motion = self.onward >= FEWEST_JUMPS && 2 * self.onward > jumps;
        let first = self
            .first
            .filter(|_| !is_motion && self.is_recent(span_s))?;
        let others = (0..self.names.len()).filter(|&joint| joint != first.joint);
        let jumping = others.filter(|&joint| self.jumps[joint] > 0);
        let joints = std::iter::once(first.joint).chain(jumping);
        Some(PositionJumps {
            source: source.to_owned(),
            joints: joints.map(|joint| self.names[joint].clone()).collect(),
            count: self.jumped,
            samples: self.samples,
            time_s: first.time_s,
            change: first.change,
            duration_s: first.duration_s,
        })
    }

    /// Returns the joints whose angles started again after a turn, with the number of times, if
    /// that was in the last `span_s` seconds; `None` where there are jumps, between which nothing
    /// is known to go on.
    #[must_use]
    pub fn starts(&self, span_s: f64) -> Option<(Vec<String>, u64)> {
        let count: u64 = self.starts.iter().sum();
        let joints = self.names.iter().zip(&self.starts);
        let joints = joints.filter(|(_, starts)| **starts > 0);
        let is_reported = count > 0 && self.first.is_none() && self.is_recent(span_s);
        is_reported.then(|| (joints.map(|(name, _)| name.clone()).collect(), count))
    }

    fn is_recent(&self, span_s: f64) -> bool {
        self.noticed_s >= self.time_s - span_s
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use tactid_dynamics::BaseKind;

    use super::*;

    const ARM: &str = r#"<robot name="arm"><link name="base"/><link name="upper"/><link name="tool0"/>
      <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
        <limit effort="1" velocity="3"/></joint>
      <joint name="slide" type="prismatic"><parent link="upper"/><child link="tool0"/><axis xyz="0 1 0"/>
        <limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>"#;

    fn robot() -> Manipulator {
        Manipulator::from_urdf(ARM, BaseKind::Fixed).unwrap()
    }

    type Counted = (Option<PositionJumps>, Option<(Vec<String>, u64)>);

    fn counted(positions: impl Iterator<Item = [f64; 2]>) -> Counted {
        let mut monitor = StepMonitor::new(&robot(), &[0, 1]);
        for (k, position) in positions.enumerate() {
            monitor.push(0.01 * k as f64, &position);
        }
        let all_s = f64::INFINITY;
        (monitor.jumps("/joint_states", all_s), monitor.starts(all_s))
    }

    /// An angle that turns at 3 rad/s, wrapped to (-pi, pi].
    fn wrapped(k: i32) -> f64 {
        let angle = 0.03 * f64::from(k);
        angle - TAU * (angle / TAU).round()
    }

    /// Angles that start again are counted, and a slide of as much is a jump.
    #[test]
    fn turns_are_no_jumps() {
        let (jumps, starts) = counted((0..1000).map(|k| [wrapped(k), 0.0]));
        let joints = vec!["shoulder".to_owned()];
        assert_eq!((jumps, starts), (None, Some((joints, 5))));
        let (jumps, starts) = counted((0..1000).map(|k| [0.0, wrapped(k)]));
        assert_eq!((jumps.unwrap().count, starts), (5, None));
    }

    /// Samples of another source are jumps, which are not continued, and a single one is an
    /// accident.
    #[test]
    fn samples_of_two_sources_jump() {
        for (every, is_mixed) in [(10, true), (90, false)] {
            let positions = (0..100).map(|k| if k % every == 5 { [0.0; 2] } else { [3.5, 0.2] });
            let jumps = counted(positions).0.unwrap();
            assert_eq!(jumps.are_of_two_sources(), is_mixed);
            assert_eq!(jumps.joints, ["shoulder"]);
            assert_eq!((jumps.time_s, jumps.change), (0.05, 3.5));
        }
    }

    /// Positions in degrees are fast, but do not jump.
    #[test]
    fn degrees_do_not_jump() {
        let degrees = |k: i32| (0.03 * f64::from(k)).sin().to_degrees();
        let found = counted((0..500).map(|k| [degrees(k), 0.0]));
        assert_eq!(found, (None, None));
    }

    /// Late stamps are no jumps: two samples of a fast motion at almost the same time.
    #[test]
    fn late_stamps_are_no_jumps() {
        let mut monitor = StepMonitor::new(&robot(), &[0, 1]);
        for k in 0..100 {
            let late_s = if k % 2 == 0 { 0.0099 } else { 0.0 };
            monitor.push(0.01 * f64::from(k) + late_s, &[0.03 * f64::from(k), 0.0]);
        }
        assert_eq!(monitor.jumps("q", f64::INFINITY), None);
    }
}
