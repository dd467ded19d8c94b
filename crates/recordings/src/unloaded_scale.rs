//! The unit of an unloaded recording's efforts, by the weight of the arm that they hold.

use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::{BaseKind, FrameMotion, JointMotion, Workspace, forces, motion};
use tactid_identify::EffortContent;

use crate::Finding;
use crate::alignment::JointValues;
use crate::plan::Plan;

/// One sample of so many is compared: postures change slowly.
const EVERY: u64 = 16;
/// Least part of the square of a joint's efforts that the weight of the arm must explain: friction
/// and accelerations are the rest.
const LEAST_EXPLAINED: f64 = 0.5;
/// Joints that need less than this fraction of the largest effort are not compared.
const LEAST_EFFORT: f64 = 0.1;
/// Smallest ratio of efforts, or its inverse, that wrong masses of a URDF hardly explain.
const OTHER_UNIT: f64 = 3.0;

/// Compares the efforts of the unloaded arm with what its weight needs by the URDF.
pub(crate) struct UnloadedScale {
    /// The arm and the gravitational acceleration, m/s²; `None` where there is no unloaded recording,
    /// its efforts do not hold the arm, or the base moves.
    arm: Option<(Workspace, Vector3<f64>)>,
    still: Vec<f64>,
    /// Whether the request has gains of the efforts.
    has_gains: bool,
    count: u64,
    sums: Vec<Sums>,
}

/// Sums of the products of the needed and the measured efforts of a joint.
#[derive(Clone, Default)]
struct Sums {
    needed: f64,
    both: f64,
    measured: f64,
}

impl Sums {
    fn add(&mut self, needed: f64, measured: f64) {
        self.needed += needed * needed;
        self.both += needed * measured;
        self.measured += measured * measured;
    }

    /// Whether the weight of the arm explains the measured efforts, up to a factor.
    fn is_explained(&self) -> bool {
        self.both * self.both > LEAST_EXPLAINED * self.needed * self.measured
    }
}

impl UnloadedScale {
    pub(crate) fn new(plan: &Plan<'_>) -> Self {
        let robot = &plan.sources.robot;
        let gravity = plan.equations.gravity_for(robot.base_kind());
        let content = plan.request.efforts_are.unwrap_or_default();
        let holds_arm = content == EffortContent::Measured;
        let is_fixed = robot.base_kind() == BaseKind::Fixed;
        let is_compared = plan.streams.unloaded && holds_arm && is_fixed;
        Self {
            arm: is_compared.then(|| (Workspace::new(robot), gravity)),
            still: vec![0.0; robot.dof()],
            has_gains: plan.request.effort_gain.is_some(),
            count: 0,
            sums: vec![Sums::default(); robot.dof()],
        }
    }

    /// Adds the efforts of the unloaded arm at an instant.
    pub(crate) fn push(&mut self, values: &JointValues) {
        self.count += 1;
        let Some((workspace, gravity)) = &mut self.arm else {
            return;
        };
        if !self.count.is_multiple_of(EVERY) {
            return;
        }
        let joints = JointMotion {
            position: &values.position,
            velocity: &self.still,
            acceleration: &self.still,
        };
        let base = FrameMotion::at_rest(Isometry3::identity());
        if motion(workspace, &base, joints).is_err() {
            return;
        }
        forces(workspace, gravity);
        let needed = workspace.joint_torques().unwrap_or_default();
        for ((sums, needed), measured) in self.sums.iter_mut().zip(needed).zip(&values.effort) {
            sums.add(*needed, *measured);
        }
    }

    /// Returns the finding that the efforts have another unit, where at least two joints show it.
    pub(crate) fn finding(&self, names: &[String]) -> Option<Finding> {
        let largest = self.sums.iter().map(|sums| sums.needed);
        let least = LEAST_EFFORT.powi(2) * largest.fold(0.0, f64::max);
        let explained = names
            .iter()
            .zip(&self.sums)
            .filter(|(_, sums)| sums.needed > least && sums.is_explained());
        let ratios = explained.map(|(name, sums)| (name.clone(), sums.both / sums.needed));
        let is_other = |ratio: f64| !(OTHER_UNIT.recip()..=OTHER_UNIT).contains(&ratio.abs());
        let (joints, ratios): (Vec<String>, Vec<f64>) =
            ratios.filter(|(_, ratio)| is_other(*ratio)).unzip();
        (joints.len() > 1).then_some(Finding::UnloadedEffortsScaled {
            joints,
            ratios,
            has_gains: self.has_gains,
        })
    }
}
