//! Joint efforts against the limits of the robot's description.

use educe::Educe;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::Manipulator;

/// An effort is beyond the limit of its joint where it exceeds it this many times: descriptions
/// give rated torques, which a motor exceeds for a short time, and efforts in N mm or of currents
/// in mA exceed a limit in N m many times.
const EFFORT_TOLERANCE: f64 = 5.0;

/// Joint efforts beyond the limits of the robot's description.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffortsBeyondLimits {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Mean magnitude of the effort of the first of these joints, N m or N.
    pub effort: f64,
    /// Largest effort of the same joint as the description has it, N m or N.
    pub limit: f64,
    /// Whether the description has the same limit for all of several joints, which may be a
    /// placeholder.
    pub limits_are_equal: bool,
}

/// Compares the efforts of joints with their limits.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct EffortMonitor {
    joints: Vec<Joint>,
    /// Time constant with which the weight of an effort decreases, s.
    span_s: f64,
}

#[derive(Debug, Educe)]
#[educe(Clone)]
struct Joint {
    name: String,
    limit: Option<f64>,
    /// Time of the last effort, s.
    time_s: f64,
    /// Sum of the weights of the efforts.
    all: f64,
    /// Sum of the weights of those beyond the limit.
    beyond: f64,
    /// Weighted sum of the magnitudes of those beyond the limit, N m or N.
    magnitude: f64,
}

impl Joint {
    fn push(&mut self, time_s: f64, effort: f64, span_s: f64) {
        let age_s = if self.all > 0.0 {
            time_s - self.time_s
        } else {
            0.0
        };
        let keep = (1.0 - age_s / span_s).clamp(0.0, 1.0);
        let beyond = self
            .limit
            .is_some_and(|limit| effort.abs() > EFFORT_TOLERANCE * limit);
        let weight = f64::from(u8::from(beyond));
        self.time_s = time_s;
        self.all = keep * self.all + 1.0;
        self.beyond = keep * self.beyond + weight;
        self.magnitude = keep * self.magnitude + weight * effort.abs();
    }

    /// Returns whether most efforts are beyond the limit.
    fn is_beyond(&self) -> bool {
        self.beyond > 0.5 * self.all
    }
}

impl EffortMonitor {
    /// Creates the monitor of the joints of a robot, which weighs an effort less the older it is:
    /// its weight decreases with the time constant `span_s`, s. With an infinite one, all efforts
    /// weigh the same.
    #[must_use]
    pub fn new(robot: &Manipulator, span_s: f64) -> Self {
        let names = robot.joint_names().iter().enumerate();
        let joint = |(index, name): (usize, &String)| Joint {
            name: name.clone(),
            limit: robot.effort_limit(index),
            time_s: 0.0,
            all: 0.0,
            beyond: 0.0,
            magnitude: 0.0,
        };
        Self {
            joints: names.map(joint).collect(),
            span_s,
        }
    }

    /// Adds the effort of one joint, N m or N, by its index in `q`, at a time, s. What is not
    /// finite, and zero, which a driver gives for what it does not measure, counts for nothing.
    pub fn push(&mut self, joint: usize, time_s: f64, effort: f64) {
        if effort != 0.0
            && effort.is_finite()
            && let Some(joint) = self.joints.get_mut(joint)
        {
            joint.push(time_s, effort, self.span_s);
        }
    }

    /// Returns the joints of which most efforts are beyond their limits.
    #[must_use]
    pub fn beyond_limits(&self) -> Option<EffortsBeyondLimits> {
        let beyond: Vec<&Joint> = self.joints.iter().filter(|j| j.is_beyond()).collect();
        let first = beyond.first()?;
        let limit = first.limit?;
        let mut limits = self.joints.iter().filter_map(|joint| joint.limit);
        Some(EffortsBeyondLimits {
            joints: beyond.iter().map(|joint| joint.name.clone()).collect(),
            effort: first.magnitude / first.beyond,
            limit,
            limits_are_equal: limits.clone().count() > 1 && limits.all(|other| other == limit),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tactid_dynamics::BaseKind;

    fn arm(limits: [f64; 3]) -> Manipulator {
        let [a, b, c] = limits;
        let urdf = format!(
            r#"<robot name="arm"><link name="l0"/><link name="l1"/><link name="l2"/><link name="l3"/>
            <joint name="a" type="revolute"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/>
              <limit lower="-2" upper="2" effort="{a}" velocity="1"/></joint>
            <joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
              <limit lower="-2" upper="2" effort="{b}" velocity="1"/></joint>
            <joint name="c" type="continuous"><parent link="l2"/><child link="l3"/><axis xyz="0 1 0"/>
              <limit effort="{c}" velocity="1"/></joint></robot>"#
        );
        Manipulator::from_urdf(&urdf, BaseKind::Fixed).unwrap()
    }

    /// Returns what is found in efforts of the three joints, one sample each second.
    fn found(limits: [f64; 3], efforts: &[[f64; 3]], span_s: f64) -> Option<EffortsBeyondLimits> {
        let mut monitor = EffortMonitor::new(&arm(limits), span_s);
        for (k, efforts) in efforts.iter().enumerate() {
            for (joint, &effort) in efforts.iter().enumerate() {
                monitor.push(joint, 1e9 + k as f64, effort);
            }
        }
        monitor.beyond_limits()
    }

    /// Overload, single spikes, zeros and joints without a limit are no finding; most efforts far
    /// beyond a limit are.
    #[test]
    fn efforts_beyond_their_limits() {
        let limits = [100.0, 10.0, 0.0];
        let forever = f64::INFINITY;
        let mut efforts = vec![[300.0, -30.0, 1e6]; 30];
        assert_eq!(found(limits, &efforts, forever), None);
        efforts[3] = [1e5, 1e5, 0.0];
        assert_eq!(found(limits, &efforts, forever), None);
        let beyond = |limits_are_equal| {
            Some(EffortsBeyondLimits {
                joints: vec!["b".to_owned()],
                effort: 300.0,
                limit: 10.0,
                limits_are_equal,
            })
        };
        let mut in_milli = vec![[0.5, -300.0, 1e6]; 30];
        assert_eq!(found(limits, &in_milli, forever), beyond(false));
        assert_eq!(
            found([10.0; 3], &in_milli, forever).unwrap().joints,
            ["b", "c"]
        );
        assert!(
            found([10.0; 3], &in_milli, forever)
                .unwrap()
                .limits_are_equal
        );
        in_milli.extend([[0.5, 0.0, 0.0]; 50]);
        assert_eq!(found(limits, &in_milli, forever), beyond(false));
    }

    /// Efforts beyond the limits lose their weight with time.
    #[test]
    fn old_efforts_are_forgotten() {
        let mut efforts = vec![[0.5, -300.0, 0.0]; 50];
        efforts.extend([[0.5, -3.0, 0.0]; 15]);
        let limits = [100.0, 10.0, 0.0];
        assert!(found(limits, &efforts, f64::INFINITY).is_some());
        assert_eq!(found(limits, &efforts, 10.0), None);
        assert!(found(limits, &efforts[..50], 10.0).is_some());
    }
}
