//! Joints of a log: which publisher has which of the robot's joints, in which order.

use std::collections::{BTreeMap, BTreeSet};

use tactid_dynamics::{Manipulator, list_similar};
use tactid_logs::LogReader;
use tactid_logs::messages::JointState;

use super::renaming::Renaming;
use crate::error::RecordingError;
use crate::sources::several_topics;
use crate::sources::{LogSources, MotionTopics};
use crate::topic_kind::TopicKind;
use crate::{Finding, Method};

/// Number of messages that are read to find who publishes which joints.
const READ: usize = 600;

/// The joints of the robot by publisher.
#[derive(Clone, Debug, Default)]
pub(crate) struct JointGroups {
    /// Names of the robot's joints, in its order.
    names: Vec<String>,
    renaming: Renaming,
    /// For each publisher the indices of its joints among the robot's, ascending. The one with most
    /// joints is first: all streams are aligned to its times.
    groups: Vec<Vec<usize>>,
    /// Joints in the log that the robot does not have.
    unknown: BTreeSet<String>,
    /// Joints of the robot that are not in the log and do not matter.
    absent: Vec<String>,
}

/// The joints of one publisher in a message.
#[derive(Clone, Debug)]
pub(crate) struct Mapping {
    /// Index of the publisher.
    pub(crate) group: usize,
    /// Indices of its joints among the robot's.
    pub(crate) places: Vec<usize>,
    /// For each of these joints its entry in the message.
    pub(crate) entries: Vec<usize>,
}

impl JointGroups {
    /// Reads the beginning of a log. `renamed` are names of joints in the log with those of the
    /// robot.
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`] if several topics have the same joints or a joint that
    /// moves the tool is not in the log, and [`RecordingError::Option`] if a name of `renamed` is
    /// not there.
    pub(crate) fn find(
        log: &LogReader,
        sources: &LogSources,
        renamed: Option<&BTreeMap<String, String>>,
    ) -> Result<Self, RecordingError> {
        let MotionTopics::Joints { joints, .. } = &sources.topics.motion else {
            return Ok(Self::default());
        };
        let robot = &sources.robot;
        let published = published(log, joints)?;
        let recorded: BTreeSet<&String> = published.keys().flatten().collect();
        let renaming = Renaming::new(&recorded, robot.joint_names(), renamed)?;
        let mut unknown = BTreeSet::new();
        let mut seen: BTreeMap<Vec<usize>, BTreeSet<String>> = BTreeMap::new();
        for (names, topics) in &published {
            let mut places = Vec::new();
            for name in names {
                match robot.joint_index(renaming.apply(name)) {
                    Some(place) => places.push(place),
                    None => {
                        unknown.insert(name.clone());
                    }
                }
            }
            places.sort_unstable();
            if !places.is_empty() {
                let known = seen.entry(places).or_default();
                known.extend(topics.iter().cloned());
            }
        }
        let groups = sort(seen)?;
        let absent = absent(&groups, &unknown, sources)?;
        Ok(Self {
            names: robot.joint_names().to_vec(),
            renaming,
            groups,
            unknown,
            absent,
        })
    }

    /// Returns the indices of the joints of each publisher but the first.
    pub(crate) fn others(&self) -> Vec<Vec<usize>> {
        self.groups.iter().skip(1).cloned().collect()
    }

    /// Number of publishers.
    pub(crate) fn count(&self) -> usize {
        self.groups.len()
    }

    /// Names of the robot's joints.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of joints of the robot.
    pub(crate) fn dof(&self) -> usize {
        self.names.len()
    }

    /// Returns which group a message with these joints belongs to; `None` for one that has only
    /// some of a publisher's joints.
    pub(crate) fn mapping(&self, names: &[String]) -> Option<Mapping> {
        let place = |name: &String| {
            let name = self.renaming.apply(name);
            self.names.iter().position(|known| known == name)
        };
        let entries = names.iter().enumerate();
        let mut found: Vec<(usize, usize)> = entries
            .filter_map(|(entry, name)| Some((place(name)?, entry)))
            .collect();
        found.sort_unstable();
        let (places, entries): (Vec<usize>, Vec<usize>) = found.into_iter().unzip();
        let group = self.groups.iter().position(|group| *group == places)?;
        Some(Mapping {
            group,
            places,
            entries,
        })
    }

    /// Reports joints that were renamed, and those of only one of log and robot.
    pub(crate) fn findings(&self) -> Vec<Finding> {
        let mut findings: Vec<Finding> = self.renaming.finding().into_iter().collect();
        if !self.unknown.is_empty() {
            findings.push(Finding::UnknownJoints {
                joints: self.unknown.iter().cloned().collect(),
            });
        }
        if !self.absent.is_empty() {
            findings.push(Finding::AbsentJoints {
                joints: self.absent.clone(),
            });
        }
        findings
    }
}

/// Returns the lists of joints that the messages at the beginning of a log have, with their topics.
fn published(
    log: &LogReader,
    topics: &[String],
) -> Result<BTreeMap<Vec<String>, BTreeSet<String>>, RecordingError> {
    let mut published: BTreeMap<Vec<String>, BTreeSet<String>> = BTreeMap::new();
    for message in log.messages_on(topics)?.take(READ) {
        let message = message?;
        let Ok(state) = message.decode::<JointState>() else {
            continue; // counted as a fault when the log is read
        };
        let topic = message.topic.name.clone();
        published.entry(state.name).or_default().insert(topic);
    }
    Ok(published)
}

/// Sorts the groups of joints, largest first, and leaves out those that repeat joints of a larger
/// one.
fn sort(seen: BTreeMap<Vec<usize>, BTreeSet<String>>) -> Result<Vec<Vec<usize>>, RecordingError> {
    let mut seen: Vec<_> = seen.into_iter().collect();
    seen.sort_by_key(|(places, _)| std::cmp::Reverse(places.len()));
    let mut groups = Vec::new();
    let mut topics_of: BTreeMap<usize, BTreeSet<String>> = BTreeMap::new();
    for (places, topics) in seen {
        let sorted = places.iter().filter_map(|place| topics_of.get(place));
        let before: BTreeSet<&String> = sorted.flatten().collect();
        let is_repeated = places.iter().all(|place| topics_of.contains_key(place));
        let has_same_topics = topics.iter().all(|topic| before.contains(topic));
        if before.is_empty() && topics.len() == 1 {
            for place in &places {
                topics_of.insert(*place, topics.clone());
            }
            groups.push(places);
        } else if !(is_repeated && has_same_topics && topics.len() == 1) {
            let all: BTreeSet<&String> = topics.iter().chain(before).collect();
            let all: Vec<&str> = all.into_iter().map(String::as_str).collect();
            let what = "joint states of the same joints";
            return Err(several_topics(what, &all.join(", "), TopicKind::Joints));
        }
    }
    Ok(groups)
}

/// Returns the joints of the robot that are in no group.
///
/// # Errors
/// Returns [`RecordingError::Data`] if one of them matters: it moves the tool or a sensor, or the
/// method needs the motion of its link.
fn absent(
    groups: &[Vec<usize>],
    unknown: &BTreeSet<String>,
    sources: &LogSources,
) -> Result<Vec<String>, RecordingError> {
    let robot = &sources.robot;
    let is_known = |place: usize| groups.iter().flatten().any(|known| *known == place);
    let mut absent = Vec::new();
    for (place, name) in robot.joint_names().iter().enumerate() {
        if is_known(place) {
            continue;
        }
        if matters(robot, place, sources)? {
            let known = groups.iter().flatten();
            let known = known.map(|place| robot.joint_names()[*place].as_str());
            let names = known.chain(unknown.iter().map(String::as_str));
            return Err(RecordingError::data_of(
                "rename_joints",
                format!(
                    "joint `{name}` of the URDF is needed, but is not in the log, whose joints are: {}; record its joint \
                     states, or make the joint fixed in the URDF; `rename_joints` renames joints of the log",
                    list_similar(name, names)
                ),
            ));
        }
        absent.push(name.clone());
    }
    Ok(absent)
}

fn matters(
    robot: &Manipulator,
    place: usize,
    sources: &LogSources,
) -> Result<bool, RecordingError> {
    let method = sources.options.method();
    if matches!(method, Method::JointSensing | Method::Combined { .. }) {
        return Ok(true);
    }
    let frames = std::iter::once(&sources.options.tip).chain(&sources.sensors);
    for frame in frames {
        if robot.moves(place, robot.frame(frame)?) {
            return Ok(true);
        }
    }
    Ok(false)
}
