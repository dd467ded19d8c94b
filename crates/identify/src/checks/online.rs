//! The checks of an online identifier.

use tactid_dynamics::{BaseKind, Manipulator};

use super::constant_channels::ConstantChannels;
use super::joint_rates::{JointRates, grouped_by_cause};
use super::twist_rates::{TwistAxes, TwistRates};
use crate::Finding;
use crate::equations::Sample;

/// Number of intervals of 0.1 s that are kept: 10 s.
const INTERVALS: usize = 100;

/// Checks the last 10 s of samples. Nothing is allocated after construction, but by [`findings`](Self::findings).
#[derive(Clone, Debug)]
pub(crate) struct OnlineChecks {
    joint_names: Vec<String>,
    joints: JointRates,
    /// `None` for a fixed base.
    twist: Option<TwistRates>,
    sensors: Vec<String>,
    constant: ConstantChannels,
}

impl OnlineChecks {
    /// Creates the checks for the samples of a robot and its wrench sensors.
    pub(crate) fn new(robot: &Manipulator, sensors: &[&str], max_gap_s: f64) -> Self {
        let floats = robot.base_kind() == BaseKind::Floating;
        Self {
            joint_names: robot.joint_names().to_vec(),
            joints: JointRates::new(robot.dof(), max_gap_s, Some(INTERVALS)),
            twist: floats.then(|| TwistRates::new(TwistAxes::World, max_gap_s, Some(INTERVALS))),
            sensors: sensors.iter().map(|&name| name.to_owned()).collect(),
            constant: ConstantChannels::new(sensors.len()),
        }
    }

    /// Adds a sample.
    pub(crate) fn push(&mut self, sample: &Sample<'_>) {
        let (position, velocity) = (sample.joint_position, sample.joint_velocity);
        self.joints.push(sample.time_s, position, velocity);
        if let Some(twist) = &mut self.twist {
            twist.push(sample.time_s, &sample.base);
        }
        for (sensor, wrench) in sample.wrenches.iter().enumerate() {
            self.constant.push(sensor, wrench);
        }
    }

    /// Returns what the samples show.
    pub(crate) fn findings(&self) -> Vec<Finding> {
        let names: Vec<&str> = self.joint_names.iter().map(String::as_str).collect();
        let joints = grouped_by_cause(self.joints.contradictions(&names)).into_iter();
        let mut findings: Vec<Finding> = joints.map(Finding::VelocitiesContradicted).collect();
        let twist = self.twist.as_ref().and_then(TwistRates::contradiction);
        findings.extend(twist.map(Finding::TwistContradicted));
        let constants = self.constant.constants().into_iter();
        findings.extend(constants.map(|constants| Finding::ConstantChannels {
            frame: self.sensors[constants.sensor].clone(),
            channels: constants.channels,
            is_zero: constants.is_zero,
        }));
        findings
    }
}
