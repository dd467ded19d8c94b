//! Checks of the last samples of an online identifier.

use educe::Educe;
use tactid_dynamics::{BaseKind, Manipulator};

use crate::Finding;
use crate::checks::{
    ChannelMonitor, EffortMonitor, INTERVAL_S, JointRates, PositionMonitor, StepMonitor, TwistAxes,
    TwistRates, grouped_by_cause,
};
use crate::equations::{EquationSettings, Sample};

/// Time at the end of which samples are checked, s.
const SPAN_S: f64 = 10.0;

/// Checks the last 10 s of samples. Nothing is allocated after construction, but by
/// [`findings`](Self::findings).
#[derive(Debug, Educe)]
#[educe(Clone)]
pub(crate) struct OnlineChecks {
    joint_names: Vec<String>,
    joints: JointRates,
    steps: StepMonitor,
    positions: PositionMonitor,
    /// `None` where no equation uses efforts.
    efforts: Option<EffortMonitor>,
    /// `None` for a fixed base.
    twist: Option<TwistRates>,
    sensors: Vec<String>,
    channels: ChannelMonitor,
}

impl OnlineChecks {
    /// Creates the checks for the samples of a robot and its wrench sensors.
    pub(crate) fn new(robot: &Manipulator, sensors: &[&str], settings: &EquationSettings) -> Self {
        let (max_gap_s, uses_effort) = (settings.max_gap_s, settings.method.uses_effort());
        let intervals = Some((SPAN_S / INTERVAL_S).round() as usize);
        let floats = robot.base_kind() == BaseKind::Floating;
        Self {
            joint_names: robot.joint_names().to_vec(),
            joints: JointRates::new(robot.dof(), max_gap_s, intervals),
            steps: StepMonitor::new(robot, &(0..robot.dof()).collect::<Vec<_>>()),
            positions: PositionMonitor::new(robot),
            efforts: uses_effort.then(|| EffortMonitor::new(robot, SPAN_S)),
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

    /// Returns what the samples show.
    pub(crate) fn findings(&self) -> Vec<Finding> {
        let names: Vec<&str> = self.joint_names.iter().map(String::as_str).collect();
        let joints = grouped_by_cause(self.joints.contradictions(&names)).into_iter();
        let jumps = self.steps.jumps("q", SPAN_S).map(Finding::PositionsJump);
        let mut findings: Vec<Finding> = jumps.into_iter().collect();
        let starts = self.steps.starts(SPAN_S);
        findings.extend(starts.map(|(joints, count)| Finding::AnglesContinued { joints, count }));
        findings.extend(joints.map(Finding::VelocitiesContradicted));
        let beyond = self.positions.beyond_limits(SPAN_S);
        findings.extend(beyond.map(Finding::PositionsBeyondLimits));
        let efforts = self.efforts.as_ref();
        let beyond = efforts.and_then(EffortMonitor::beyond_limits);
        findings.extend(beyond.map(Finding::EffortsBeyondLimits));
        let twist = self.twist.as_ref().and_then(TwistRates::contradiction);
        findings.extend(twist.map(|contradiction| Finding::TwistContradicted {
            source: "twist".to_owned(),
            contradiction,
        }));
        let constant = self.channels.constant_channels(SPAN_S).into_iter();
        findings.extend(constant.map(|constant| Finding::ConstantChannels {
            source: "wrench".to_owned(),
            frame: self.sensors[constant.sensor].clone(),
            channels: constant.channels.into_iter().map(Into::into).collect(),
            is_zero: constant.is_zero,
            is_left_out: false,
            without_moments: false,
        }));
        findings
    }
}
