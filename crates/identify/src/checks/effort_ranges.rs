//! Efforts that drives or drivers limit, and efforts that are zero in all samples.

use educe::Educe;
use tactid_dynamics::{FrameId, Manipulator};

use super::{RangeMonitor, Saturation};

/// Records the ranges of the efforts of some joints, with their positions.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct EffortRanges {
    names: Vec<String>,
    /// Whether each of the joints moves the tip.
    moves_tip: Vec<bool>,
    /// Efforts, then positions.
    ranges: RangeMonitor,
}

impl EffortRanges {
    /// Creates the monitor of some joints of a robot, by their indices, that measures a load at
    /// `tip`.
    #[must_use]
    pub fn new(robot: &Manipulator, joints: &[usize], tip: FrameId) -> Self {
        let names = robot.joint_names();
        Self {
            names: joints.iter().map(|&joint| names[joint].clone()).collect(),
            moves_tip: joints
                .iter()
                .map(|&joint| robot.moves(joint, tip))
                .collect(),
            ranges: RangeMonitor::new(2 * joints.len(), joints.len()),
        }
    }

    /// Adds efforts and positions of the joints. Without efforts, they count for nothing.
    pub fn push(&mut self, efforts: &[f64], positions: &[f64]) {
        self.ranges.push(efforts.iter().chain(positions).copied());
    }

    /// Returns the joints that move the tip whose efforts are at a limit while others change: a
    /// gripper holds its effort.
    #[must_use]
    pub fn saturation(&self) -> Option<Saturation> {
        let name = |joint: usize| self.moves_tip[joint].then_some(&*self.names[joint]);
        self.ranges.saturation(name, 1.0)
    }

    /// Returns the joints that move the tip with efforts of zero in all samples.
    #[must_use]
    pub fn unmeasured(&self) -> Vec<String> {
        let count = self.names.len();
        let unmeasured = (0..count).filter(|&joint| {
            self.moves_tip[joint]
                && self.ranges.is_zero(joint)
                && self.ranges.changes(count + joint)
        });
        unmeasured.map(|joint| self.names[joint].clone()).collect()
    }

    /// Returns whether the efforts of all joints are zero in all of at least 100 samples.
    #[must_use]
    pub fn are_zero(&self) -> bool {
        (0..self.names.len()).all(|joint| self.ranges.is_zero(joint))
    }
}

#[cfg(test)]
mod tests {
    use tactid_dynamics::BaseKind;

    use super::*;

    /// A gripper that holds its effort is no limit of the arm, whose efforts may have one.
    #[test]
    fn a_gripper_holds_its_effort() {
        let urdf = r#"<robot name="arm"><link name="base"/><link name="tip"/><link name="finger"/>
            <joint name="elbow" type="revolute"><parent link="base"/><child link="tip"/>
                <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
            <joint name="slide" type="prismatic"><parent link="tip"/><child link="finger"/>
                <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="9" velocity="9"/></joint></robot>"#;
        let robot = Manipulator::from_urdf(urdf, BaseKind::Fixed).unwrap();
        let tip = robot.frame("tip").unwrap();
        let limited = |of_elbow: f64, of_slide: f64| {
            let mut ranges = EffortRanges::new(&robot, &[0, 1], tip);
            for k in 0..2000 {
                let time_s = 0.01 * f64::from(k);
                let efforts = [(9.0 * time_s.sin()).min(of_elbow), time_s.min(of_slide)];
                ranges.push(&efforts, &[(1.7 * time_s).cos(), 0.0]);
            }
            ranges.saturation().map(|found| found.channels)
        };
        assert_eq!(limited(10.0, 1.5), None);
        assert_eq!(limited(5.0, 1.5), Some(vec!["elbow".to_owned()]));
    }
}
