//! The unknowns of a calibration by link and joint, and the delay, as its file has them, and in the
//! one vector of the model.

use tactid_calibrate::Calibration;

/// Number of inertial parameters of a link.
pub(super) const OF_LINK: usize = 10;
/// Number of unknowns of a joint besides the friction terms.
const OF_JOINT: usize = 6;

/// Numbers of links, joints and friction terms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub(super) links: usize,
    pub(super) joints: usize,
    pub(super) frictions: usize,
}

impl Layout {
    /// Returns the numbers of a calibration.
    pub(super) fn of(calibration: &Calibration) -> Self {
        Self {
            links: calibration.links.len(),
            joints: calibration.joints.len(),
            frictions: calibration.friction_widths.len(),
        }
    }

    /// Number of the unknowns.
    pub(super) fn unknowns(self) -> usize {
        OF_LINK * self.links + self.of_joint() * self.joints + 1
    }

    /// Number of unknowns of one joint: offset, viscous friction, the friction terms, both
    /// load-dependent frictions, rotor inertia, inverse gain.
    pub(super) fn of_joint(self) -> usize {
        OF_JOINT + self.frictions
    }

    /// Returns the parameters of one link.
    pub(super) fn link(self, unknowns: &[f64], link: usize) -> [f64; OF_LINK] {
        std::array::from_fn(|k| unknowns[OF_LINK * link + k])
    }

    /// Returns the unknowns of one joint, in the order of [`Self::of_joint`].
    pub(super) fn joint(self, unknowns: &[f64], joint: usize) -> Vec<f64> {
        let first = OF_LINK * self.links + joint;
        let groups = 0..self.of_joint();
        groups
            .map(|group| unknowns[first + group * self.joints])
            .collect()
    }

    /// Returns the delay, the last of the unknowns.
    pub(super) fn delay(self, unknowns: &[f64]) -> f64 {
        unknowns[self.unknowns() - 1]
    }

    /// Returns the vector of all unknowns, from those of the links and of the joints, and the
    /// delay.
    pub(super) fn vector<'a>(
        self,
        links: impl Iterator<Item = &'a [f64; OF_LINK]>,
        joints: impl Iterator<Item = Vec<f64>>,
        delay: f64,
    ) -> Vec<f64> {
        let mut all: Vec<f64> = links.flatten().copied().collect();
        let joints: Vec<Vec<f64>> = joints.collect();
        for group in 0..self.of_joint() {
            all.extend(joints.iter().map(|of_joint| of_joint[group]));
        }
        all.push(delay);
        all
    }
}
