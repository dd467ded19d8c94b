//! Ranges of the channels of a recording as they are measured, before they are averaged: sensors
//! that are saturated, and efforts that nobody measured.

use tactid_batch::range_findings;
use tactid_identify::checks::{EffortRanges, RangeMonitor, WRENCH_CHANNELS};

use crate::alignment::{Event, JointValues, Measured};
use crate::recording::Sources;
use crate::{Finding, RecordingError};

/// The ranges of all channels of a recording.
pub(crate) struct ChannelRanges {
    wrenches: Vec<RangeMonitor>,
    /// Efforts of the first publisher, which has a place for each joint of the robot, and of further
    /// ones.
    efforts: Vec<EffortRanges>,
}

impl ChannelRanges {
    pub(crate) fn new(sources: &Sources, tip: &str) -> Self {
        let channels = WRENCH_CHANNELS.len();
        let robot = &sources.robot;
        let first: Vec<usize> = (0..robot.dof()).collect();
        let publishers = std::iter::once(&first).chain(&sources.streams.more_joints);
        // Without a frame of the tip, the request was refused.
        let tip = robot.frame(tip).ok().filter(|_| robot.dof() > 0);
        let efforts = publishers.filter_map(|joints| Some(EffortRanges::new(robot, joints, tip?)));
        Self {
            wrenches: vec![RangeMonitor::new(channels, channels); sources.sensors.len()],
            efforts: efforts.collect(),
        }
    }

    pub(crate) fn push(&mut self, event: &Event) {
        match &event.measured {
            Measured::Wrench(sensor, wrench) => {
                if let Some(ranges) = self.wrenches.get_mut(*sensor) {
                    ranges.push(wrench.entries().into_iter());
                }
            }
            Measured::Joints(values) => self.push_joints(0, values),
            Measured::MoreJoints(publisher, values) => self.push_joints(publisher + 1, values),
            _ => {}
        }
    }

    fn push_joints(&mut self, publisher: usize, values: &JointValues) {
        if let Some(ranges) = self.efforts.get_mut(publisher) {
            ranges.push(&values.effort, &values.position);
        }
    }

    /// Checks that some effort is measured, where efforts are used.
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`] if all of them are zero in all samples.
    pub(crate) fn check_efforts(&self, sources: &Sources) -> Result<(), RecordingError> {
        if self.efforts.is_empty() || !self.efforts.iter().all(EffortRanges::are_zero) {
            return Ok(());
        }
        Err(RecordingError::data(format!(
            "{}: the efforts of all joints (`effort`) are exactly zero in all samples, as of a driver \
             that does not measure them: record them, or identify from wrenches",
            efforts_name(sources)
        )))
    }

    /// Returns what the ranges show.
    pub(crate) fn findings(&self, sources: &Sources) -> Vec<Finding> {
        let names = sources.wrench_names.iter().map(String::as_str);
        let wrenches = names.zip(&self.wrenches);
        let efforts = (efforts_name(sources), self.efforts.as_slice());
        let found = range_findings(wrenches, sources.options.wrench_sign, efforts);
        found.into_iter().map(Finding::Data).collect()
    }
}

/// Returns the name of the topic or array of the efforts.
fn efforts_name(sources: &Sources) -> &str {
    match sources.joints_name.as_str() {
        "q" => "effort",
        topics => topics,
    }
}
