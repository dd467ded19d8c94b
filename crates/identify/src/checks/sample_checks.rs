//! Checks of the last samples of an online identifier.

use educe::Educe;
use tactid_dynamics::{BaseKind, Manipulator};

use super::{
    ChannelMonitor, EffortMonitor, INTERVAL_S, JointRates, PositionMonitor, StepMonitor, TwistAxes,
    TwistRates,
};
use crate::equations::{EquationSettings, Sample};

/// Checks the last 10 s of samples. Nothing is allocated after construction.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct SampleChecks {
    /// Names of the joints, in the order of the samples.
    pub joint_names: Vec<String>,
    /// Joint velocities against joint positions.
    pub joints: JointRates,
    /// Jumps of joint positions.
    pub steps: StepMonitor,
    /// Joint positions against the limits.
    pub positions: PositionMonitor,
    /// Joint efforts against the limits; `None` where no equation uses efforts.
    pub efforts: Option<EffortMonitor>,
    /// Twist against pose of the base; `None` for a fixed base.
    pub twist: Option<TwistRates>,
    /// Links of the wrench sensors, in the order of the samples.
    pub sensors: Vec<String>,
    /// Channels of the wrench sensors that never change.
    pub channels: ChannelMonitor,
}

impl SampleChecks {
    /// Time at the end of which samples are checked, s.
    pub const SPAN_S: f64 = 10.0;

    /// Creates the checks for the samples of a robot and its wrench sensors.
    pub(crate) fn new(robot: &Manipulator, sensors: &[&str], settings: &EquationSettings) -> Self {
        let (max_gap_s, uses_effort) = (settings.max_gap_s, settings.method.uses_effort());
        let intervals = Some((Self::SPAN_S / INTERVAL_S).round() as usize);
        let floats = robot.base_kind() == BaseKind::Floating;
        Self {
            joint_names: robot.joint_names().to_vec(),
            joints: JointRates::new(robot.dof(), max_gap_s, intervals),
            steps: StepMonitor::new(robot, &(0..robot.dof()).collect::<Vec<_>>()),
            positions: PositionMonitor::new(robot),
            efforts: uses_effort.then(|| EffortMonitor::new(robot, Self::SPAN_S)),
            twist: floats.then(|| TwistRates::new(TwistAxes::World, max_gap_s, intervals)),
            sensors: sensors.iter().map(|&name| name.to_owned()).collect(),
            channels: ChannelMonitor::new(sensors.len()),
        }
    }

    /// Adds a sample.
    pub(crate) fn push(&mut self, sample: &Sample<'_>) {
        let (position, velocity) = (sample.joint_position, sample.joint_velocity);
        self.joints.push(sample.time_s, position, velocity);
        self.steps.push(sample.time_s, position);
        for (joint, &position) in position.iter().enumerate() {
            self.positions.push(joint, sample.time_s, position);
        }
        if let Some(efforts) = &mut self.efforts {
            for (joint, &effort) in sample.joint_effort.iter().enumerate() {
                efforts.push(joint, sample.time_s, effort);
            }
        }
        if let Some(twist) = &mut self.twist {
            twist.push(sample.time_s, &sample.base);
        }
        for (sensor, wrench) in sample.wrenches.iter().enumerate() {
            self.channels.push(sensor, sample.time_s, wrench);
        }
    }
}
