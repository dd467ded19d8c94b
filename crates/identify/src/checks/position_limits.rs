//! Joint positions against the limits of the robot's description.

use educe::Educe;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::Manipulator;

/// A joint is beyond its limits where its position exceeds one by this fraction of the range:
/// descriptions are not exact, and positions in degrees exceed it many times.
const POSITION_TOLERANCE: f64 = 0.1;

/// Joint positions beyond the limits of the robot's description.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PositionsBeyondLimits {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Position of the first of these joints that is farthest beyond its limits, rad or m.
    pub position: f64,
    /// Lower limit of the same joint, rad or m.
    pub lower: f64,
    /// Upper limit of the same joint, rad or m.
    pub upper: f64,
    /// Whether the positions of all of these joints are within their limits if they are taken for
    /// degrees.
    pub are_degrees: bool,
}

/// Records the positions of joints that are beyond their limits.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct PositionMonitor {
    joints: Vec<Joint>,
    time_s: f64,
}

#[derive(Debug, Educe)]
#[educe(Clone)]
struct Joint {
    name: String,
    limits: Option<(f64, f64)>,
    /// Time of the last position beyond the limits, s; minus infinity before there is one.
    time_s: f64,
    /// The position that is farthest beyond the limits.
    farthest: f64,
}

impl Joint {
    /// Returns by how much a position exceeds the limits, rad or m.
    fn excess(&self, position: f64) -> f64 {
        self.limits.map_or(0.0, |(lower, upper)| {
            f64::max(lower - position, position - upper).max(0.0)
        })
    }

    fn is_beyond(&self, position: f64) -> bool {
        let range = self
            .limits
            .map_or(f64::INFINITY, |(lower, upper)| upper - lower);
        self.excess(position) > POSITION_TOLERANCE * range
    }
}

impl PositionMonitor {
    /// Creates the monitor of the joints of a robot.
    #[must_use]
    pub fn new(robot: &Manipulator) -> Self {
        let names = robot.joint_names().iter().enumerate();
        let joint = |(index, name): (usize, &String)| Joint {
            name: name.clone(),
            limits: robot.joint_limits(index),
            time_s: f64::NEG_INFINITY,
            farthest: 0.0,
        };
        Self {
            joints: names.map(joint).collect(),
            time_s: f64::NEG_INFINITY,
        }
    }

    /// Adds the position of one joint, by its index in `q`, at a time, s.
    pub fn push(&mut self, joint: usize, time_s: f64, position: f64) {
        self.time_s = time_s;
        let Some(joint) = self.joints.get_mut(joint) else {
            return;
        };
        if joint.is_beyond(position) {
            joint.time_s = time_s;
            if joint.excess(position) > joint.excess(joint.farthest) {
                joint.farthest = position;
            }
        }
    }

    /// Returns the joints that were beyond their limits in the last `span_s` seconds.
    #[must_use]
    pub fn beyond_limits(&self, span_s: f64) -> Option<PositionsBeyondLimits> {
        let begin_s = self.time_s - span_s;
        let beyond = |joint: &&Joint| joint.time_s.is_finite() && joint.time_s >= begin_s;
        let beyond: Vec<&Joint> = self.joints.iter().filter(beyond).collect();
        let first = beyond.first()?;
        let (lower, upper) = first.limits?;
        let in_degrees = |joint: &&Joint| !joint.is_beyond(joint.farthest.to_radians());
        let is_more_than_a_turn = |joint: &&Joint| joint.farthest.abs() > std::f64::consts::TAU;
        Some(PositionsBeyondLimits {
            joints: beyond.iter().map(|joint| joint.name.clone()).collect(),
            position: first.farthest,
            lower,
            upper,
            are_degrees: beyond.iter().all(in_degrees) && beyond.iter().any(is_more_than_a_turn),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tactid_dynamics::BaseKind;

    const ARM: &str = r#"<robot name="arm"><link name="base"/><link name="upper"/><link name="tool0"/>
      <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
        <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
      <joint name="wrist" type="continuous"><parent link="upper"/><child link="tool0"/><axis xyz="0 1 0"/></joint></robot>"#;

    fn monitor(positions: &[[f64; 2]]) -> PositionMonitor {
        let mut monitor =
            PositionMonitor::new(&Manipulator::from_urdf(ARM, BaseKind::Fixed).unwrap());
        for (k, position) in positions.iter().enumerate() {
            for (joint, position) in position.iter().enumerate() {
                monitor.push(joint, k as f64, *position);
            }
        }
        monitor
    }

    /// A small excess is no finding, a joint without limits has none, and degrees are recognised.
    #[test]
    fn positions_beyond_their_limits() {
        assert_eq!(
            monitor(&[[2.3, 50.0], [-2.3, 0.0]]).beyond_limits(f64::INFINITY),
            None
        );
        let found = |position: f64, are_degrees| {
            Some(PositionsBeyondLimits {
                joints: vec!["shoulder".to_owned()],
                position,
                lower: -2.0,
                upper: 2.0,
                are_degrees,
            })
        };
        let degrees = monitor(&[[30.0, 0.0], [-80.0, 0.0], [10.0, 0.0]]);
        assert_eq!(degrees.beyond_limits(f64::INFINITY), found(-80.0, true));
        // An angle within a turn may as well be that of another joint.
        let exchanged = monitor(&[[3.0, 0.0]]);
        assert_eq!(exchanged.beyond_limits(f64::INFINITY), found(3.0, false));
        let wrong = monitor(&[[500.0, 0.0]]);
        assert_eq!(wrong.beyond_limits(f64::INFINITY), found(500.0, false));
    }

    /// What was beyond the limits before the span is forgotten.
    #[test]
    fn only_the_span_counts() {
        let mut positions = vec![[0.0, 0.0]; 20];
        positions[5][0] = 3.0;
        assert_eq!(monitor(&positions).beyond_limits(10.0), None);
        assert!(monitor(&positions).beyond_limits(15.0).is_some());
    }
}
