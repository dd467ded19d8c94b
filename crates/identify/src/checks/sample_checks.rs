//! Checks of the last samples of an online identifier.

use educe::Educe;
use tactid_dynamics::{BaseKind, FrameId, Manipulator};

use super::{
    ChannelMonitor, EffortMonitor, EffortRanges, INTERVAL_S, JointRates, PositionMonitor,
    RangeMonitor, StepMonitor, TwistAxes, TwistRates, WRENCH_CHANNELS,
};
use crate::equations::{EquationSettings, Sample};

/// Checks the last 10 s of samples, and the ranges of all. Nothing is allocated after construction.
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
    /// Ranges of the joint efforts; `None` where no equation uses efforts.
    pub effort_ranges: Option<EffortRanges>,
    /// Twist against pose of the base; `None` for a fixed base.
    pub twist: Option<TwistRates>,
    /// Links of the wrench sensors, in the order of the samples.
    pub sensors: Vec<String>,
    /// Channels of the wrench sensors that never change.
    pub channels: ChannelMonitor,
    /// Ranges of the channels of each wrench sensor.
    pub wrench_ranges: Vec<RangeMonitor>,
}

impl SampleChecks {
    /// Time at the end of which samples are checked, s.
    pub const SPAN_S: f64 = 10.0;

    /// Creates the checks for the samples of a robot with a tip and its wrench sensors.
    pub(crate) fn new(
        robot: &Manipulator,
        tip: FrameId,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Self {
        let (max_gap_s, uses_effort) = (settings.max_gap_s, settings.method.uses_effort());
        let intervals = Some((Self::SPAN_S / INTERVAL_S).round() as usize);
        let joints: Vec<usize> = (0..robot.dof()).collect();
        let floats = robot.base_kind() == BaseKind::Floating;
        Self {
            joint_names: robot.joint_names().to_vec(),
            joints: JointRates::new(robot.dof(), max_gap_s, intervals),
            steps: StepMonitor::new(robot, &joints),
            positions: PositionMonitor::new(robot),
            efforts: uses_effort.then(|| EffortMonitor::new(robot, Self::SPAN_S)),
            effort_ranges: uses_effort.then(|| EffortRanges::new(robot, &joints, tip)),
            twist: floats.then(|| TwistRates::new(TwistAxes::World, max_gap_s, intervals)),
            sensors: sensors.iter().map(|&name| name.to_owned()).collect(),
            channels: ChannelMonitor::new(sensors.len()),
            wrench_ranges: vec![
                RangeMonitor::new(WRENCH_CHANNELS.len(), WRENCH_CHANNELS.len());
                sensors.len()
            ],
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
        if let Some(efforts) = &mut self.effort_ranges {
            efforts.push(sample.joint_effort, position);
        }
        if let Some(twist) = &mut self.twist {
            twist.push(sample.time_s, &sample.base);
        }
        for (sensor, wrench) in sample.wrenches.iter().enumerate() {
            self.channels.push(sensor, sample.time_s, wrench);
        }
        for (ranges, wrench) in self.wrench_ranges.iter_mut().zip(sample.wrenches) {
            ranges.push(wrench.entries().into_iter());
        }
    }
}
