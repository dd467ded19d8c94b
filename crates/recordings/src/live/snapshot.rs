//! What a live session has noticed, for another thread.

use tactid_batch::{Finding as DataFinding, online_findings};
use tactid_identify::Snapshot;
use tactid_logs::Topic;
use tactid_logs::messages::{JointState, WrenchStamped};

use super::running::Running;
use super::session::LiveSession;
use crate::sources::is_of_tactid;
use crate::{ActsOn, DataFault, Finding};

/// A topic that was silent for longer is reported, s: ten periods of the slowest sensor that is of use.
const LONGEST_SILENCE_S: f64 = 1.0;

impl LiveSession {
    /// Returns what is needed for the findings at a time, ns since the epoch, which takes longer than a control loop has.
    #[must_use]
    pub fn snapshot(&self, now_ns: u64) -> LiveSnapshot {
        let mut noticed = self.silent_topics(now_ns);
        noticed.extend(self.topics_not_used());
        if self.restarts > 0 {
            noticed.push(Finding::LiveRestarted {
                count: self.restarts,
            });
        }
        let running = self.running.as_ref();
        noticed.extend(running.map(Running::noticed).unwrap_or_default());
        LiveSnapshot {
            noticed,
            faults: running.map(Running::faults).unwrap_or_default(),
            data: running.map(|running| running.identifier().snapshot()),
            acts_on: self.request.wrench_acts_on.unwrap_or_default(),
        }
    }

    /// Reports topics that are used and have no messages at the moment.
    fn silent_topics(&self, now_ns: u64) -> Vec<Finding> {
        let used = self
            .running
            .iter()
            .flat_map(|running| &running.sources.names);
        let silent = used.filter_map(|name| {
            let last_ns = self.topics.get(name)?.last_ns?;
            let silent_s = now_ns.saturating_sub(last_ns) as f64 * 1e-9;
            (silent_s > LONGEST_SILENCE_S).then(|| Finding::TopicSilent {
                topic: name.clone(),
                silent_s,
            })
        });
        silent.collect()
    }

    /// Reports topics of joint states or wrenches that are not used, unless the request names those that are.
    fn topics_not_used(&self) -> Option<Finding> {
        let used = &self.running.as_ref()?.sources.names;
        let is_open = |topic: &Topic| {
            (topic.is::<JointState>() && self.request.joint_topic.is_none())
                || (topic.is::<WrenchStamped>()
                    && self.request.wrench_topic.is_none()
                    && !is_of_tactid(&topic.name))
        };
        let topics = self.topics.values().map(|known| &known.topic);
        let others = topics.filter(|topic| is_open(topic) && !used.contains(&topic.name));
        let topics: Vec<String> = others.map(|topic| topic.name.clone()).collect();
        (!topics.is_empty()).then_some(Finding::TopicsNotUsed { topics })
    }
}

/// What a live session has noticed up to some time.
#[derive(Clone, Debug)]
pub struct LiveSnapshot {
    noticed: Vec<Finding>,
    faults: Vec<DataFault>,
    data: Option<Snapshot>,
    acts_on: ActsOn,
}

impl LiveSnapshot {
    /// Returns all findings. Cost: some 20 ms, see [`online_findings`].
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        // Averages of a constant channel change by rounding, and hide the limit of one that leaves
        // it for a moment: the session looks at the messages instead.
        let is_of_messages = |found: &DataFinding| {
            matches!(
                found,
                DataFinding::ConstantChannels { .. }
                    | DataFinding::Saturated { .. }
                    | DataFinding::EffortsUnmeasured { .. }
            )
        };
        let found = self.data.iter().flat_map(online_findings);
        let found = found
            .filter(|found| !is_of_messages(found))
            .map(|mut found| {
                // The session gives the identifier wrenches on the payload.
                if self.acts_on == ActsOn::Sensor {
                    found.negate_wrenches();
                }
                found
            });
        self.noticed
            .iter()
            .cloned()
            .chain(found.map(Finding::Data))
            .collect()
    }

    /// Returns what could not be used of the messages.
    #[must_use]
    pub fn faults(&self) -> &[DataFault] {
        &self.faults
    }
}
