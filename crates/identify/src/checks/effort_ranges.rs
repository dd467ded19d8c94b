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

    /// Returns the joints whose efforts are at a limit while others change.
    #[must_use]
    pub fn saturation(&self) -> Option<Saturation> {
        self.ranges.saturation(&self.names, 1.0)
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
