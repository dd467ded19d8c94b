//! Which joints the messages of a log carry, in which order, from which publisher.

use std::collections::{BTreeMap, BTreeSet};

use tactid_logs::LogReader;
use tactid_logs::messages::JointState;

use super::sources::{Motion, Sources};
use crate::{IdentifyError, Method};

/// How many messages are looked at to find who publishes which joints.
const LOOKED_AT: usize = 600;

/// The joints of the robot by who publishes them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Groups {
    /// Places among the robot's joints, ascending; the group with most joints first: all others are
    /// brought to its clock.
    pub(crate) places: Vec<Vec<usize>>,
    /// Names in the log that the robot does not have.
    pub(crate) strangers: BTreeSet<String>,
    /// Joints of the robot that the log does not have, and that do not matter.
    pub(crate) absent: Vec<String>,
}

impl Groups {
    /// Looks into the beginning of a log.
    pub(crate) fn find(log: &LogReader, sources: &Sources) -> Result<Self, IdentifyError> {
        let Motion::Joints(topics) = &sources.motion else {
            return Ok(Self::default());
        };
        let mut groups = Self::default();
        let mut seen: BTreeMap<Vec<usize>, BTreeSet<String>> = BTreeMap::new();
        for message in log.messages_on(topics)?.take(LOOKED_AT) {
            let message = message?;
            let Ok(state) = message.decode::<JointState>() else {
                continue; // counted when it is read
            };
            let mut places = Vec::new();
            for name in state.name {
                match sources.robot.joint_index(&name) {
                    Some(place) => places.push(place),
                    None => {
                        groups.strangers.insert(name);
                    }
                }
            }
            places.sort_unstable();
            if !places.is_empty() {
                let topic = message.topic.name.clone();
                seen.entry(places).or_default().insert(topic);
            }
        }
        groups.sort(seen)?;
        groups.check_complete(sources)?;
        Ok(groups)
    }

    /// Larger groups first; those that only repeat joints of a larger one are left out.
    fn sort(&mut self, seen: BTreeMap<Vec<usize>, BTreeSet<String>>) -> Result<(), IdentifyError> {
        let mut seen: Vec<_> = seen.into_iter().collect();
        seen.sort_by_key(|(places, _)| std::cmp::Reverse(places.len()));
        let mut taken: BTreeMap<usize, BTreeSet<String>> = BTreeMap::new();
        for (places, topics) in seen {
            let before: BTreeSet<&String> = places
                .iter()
                .filter_map(|p| taken.get(p))
                .flatten()
                .collect();
            let repeated = places.iter().all(|place| taken.contains_key(place));
            let same_topics = topics.iter().all(|topic| before.contains(topic));
            if before.is_empty() && topics.len() == 1 {
                for place in &places {
                    taken.insert(*place, topics.clone());
                }
                self.places.push(places);
            } else if !(repeated && same_topics && topics.len() == 1) {
                let all: BTreeSet<&String> = topics.iter().chain(before).collect();
                let all: Vec<&str> = all.into_iter().map(String::as_str).collect();
                return Err(IdentifyError::SeveralTopics {
                    what: "joint states of the same joints",
                    topics: all.join(", "),
                    option: "--joints",
                });
            }
        }
        Ok(())
    }

    /// That every joint is there that moves the tool or a sensor, or is weighed.
    fn check_complete(&mut self, sources: &Sources) -> Result<(), IdentifyError> {
        let robot = &sources.robot;
        let tool = robot.frame(&sources.tool)?;
        for (place, name) in robot.joint_names().iter().enumerate() {
            if self.places.iter().flatten().any(|known| *known == place) {
                continue;
            }
            let weighs_links = matches!(sources.method, Method::JointSensing | Method::Combined { .. });
            let mut matters = weighs_links || robot.moves(place, tool);
            for sensor in &sources.sensors {
                matters |= robot.moves(place, robot.frame(sensor)?);
            }
            if matters {
                let known = self.places.iter().flatten();
                let known = known.map(|p| robot.joint_names()[*p].as_str());
                let strangers = self.strangers.iter().map(String::as_str);
                return Err(IdentifyError::MissingJoint {
                    joint: name.clone(),
                    joints: known.chain(strangers).collect::<Vec<_>>().join(", "),
                });
            }
            self.absent.push(name.clone());
        }
        Ok(())
    }
}

/// Where the joints of a group stand in a message.
#[derive(Clone, Debug)]
pub(crate) struct Mapping {
    pub(crate) group: usize,
    /// The group's places among the robot's joints.
    pub(crate) places: Vec<usize>,
    /// For each of these places: the entry of the message.
    pub(crate) entries: Vec<usize>,
}

impl Groups {
    /// Which group a message with these joints belongs to; `None` for one that has only a part.
    pub(crate) fn mapping(&self, sources: &Sources, names: &[String]) -> Option<Mapping> {
        let mut found: Vec<(usize, usize)> = names
            .iter()
            .enumerate()
            .filter_map(|(entry, name)| Some((sources.robot.joint_index(name)?, entry)))
            .collect();
        found.sort_unstable();
        let places: Vec<usize> = found.iter().map(|(place, _)| *place).collect();
        let group = self.places.iter().position(|group| *group == places)?;
        let entries = found.into_iter().map(|(_, entry)| entry).collect();
        Some(Mapping {
            group,
            places,
            entries,
        })
    }
}
