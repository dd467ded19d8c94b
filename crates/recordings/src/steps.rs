//! Steps of joint positions over a recording: angles that start again after a turn, and jumps.

use tactid_batch::Finding as DataFinding;
use tactid_dynamics::Notice;
use tactid_identify::checks::StepMonitor;

use crate::Finding;
use crate::alignment::{Event, Measured};
use crate::recording::Sources;

/// The steps of all joints of a recording.
pub(crate) struct Steps {
    first: StepMonitor,
    /// Steps of the joints of further publishers, a monitor for each.
    others: Vec<StepMonitor>,
}

impl Steps {
    pub(crate) fn new(sources: &Sources) -> Self {
        let robot = &sources.robot;
        let all: Vec<usize> = (0..robot.dof()).collect();
        let others = sources.streams.more_joints.iter();
        Self {
            first: StepMonitor::new(robot, &all),
            others: others
                .map(|joints| StepMonitor::new(robot, joints))
                .collect(),
        }
    }

    /// Returns what some events show.
    pub(crate) fn findings_of(sources: &Sources, events: &[Event]) -> Vec<Finding> {
        let mut steps = Self::new(sources);
        events.iter().for_each(|event| steps.push(event));
        steps.findings(sources)
    }

    pub(crate) fn push(&mut self, event: &Event) {
        match &event.measured {
            Measured::Joints(values) => self.first.push(event.time_s, &values.position),
            Measured::MoreJoints(publisher, values) => {
                if let Some(monitor) = self.others.get_mut(*publisher) {
                    monitor.push(event.time_s, &values.position);
                }
            }
            _ => {}
        }
    }

    pub(crate) fn findings(&self, sources: &Sources) -> Vec<Finding> {
        let (source, all_s) = (&sources.joints_name, f64::INFINITY);
        let monitors = std::iter::once(&self.first).chain(&self.others);
        let findings = monitors.flat_map(|monitor| {
            let jumps = monitor.jumps(source, all_s).map(DataFinding::PositionsJump);
            let starts = monitor.starts(all_s);
            let continued =
                starts.map(|(joints, count)| DataFinding::AnglesContinued { joints, count });
            jumps.into_iter().chain(continued)
        });
        findings.map(Finding::Data).collect()
    }
}

/// Returns whether positions of two sources are mixed, which explains whatever else the data
/// contradict.
pub(crate) fn are_mixed<'a>(findings: impl IntoIterator<Item = &'a Finding>) -> bool {
    findings.into_iter().any(|finding| match finding {
        Finding::Data(DataFinding::PositionsJump(jumps)) => jumps.are_of_two_sources(),
        _ => false,
    })
}

/// Leaves out findings that mixed positions explain: all but notes.
pub(crate) fn without_explained(
    noticed: impl IntoIterator<Item = Finding>,
) -> impl Iterator<Item = Finding> {
    let is_note = |finding: &Finding| finding.severity() == tactid_dynamics::Severity::Notes;
    noticed.into_iter().filter(is_note)
}
