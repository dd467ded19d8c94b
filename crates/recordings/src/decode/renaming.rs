//! Joints whose names in a log differ from those of the robot.

use std::collections::{BTreeMap, BTreeSet};

use tactid_dynamics::list_similar;

use crate::{Finding, RecordingError};

/// Characters that end a prefix of names.
const SEPARATORS: [char; 4] = ['_', '/', '-', '.'];

/// The robot's names of joints that have others in a log.
#[derive(Clone, Debug, Default)]
pub(crate) struct Renaming {
    robot_names: BTreeMap<String, String>,
    /// Whether the names were found, and not requested.
    is_found: bool,
}

impl Renaming {
    /// Takes the requested names, or finds those of a log in which no joint has the name of one of
    /// the robot: all joints of the log, or all of the robot, must have names that are the same
    /// behind a prefix of the log and one of the robot.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] if a requested name is not in the log or not one of the
    /// robot, or if two are to have the same name.
    pub(crate) fn new(
        recorded: &BTreeSet<&String>,
        joints: &[String],
        requested: Option<&BTreeMap<String, String>>,
    ) -> Result<Self, RecordingError> {
        let wrong = |what| RecordingError::Option {
            option: "rename_joints",
            what,
        };
        let mut requested_names = BTreeMap::new();
        for (name, joint) in requested.into_iter().flatten() {
            if let Some(other) = requested_names.insert(joint, name) {
                return Err(wrong(format!(
                    "cannot rename both `{other}` and `{name}` to the joint `{joint}`"
                )));
            }
            let (place, known) = if !recorded.contains(name) {
                let known = recorded.iter().map(|name| name.as_str());
                ("the log", list_similar(name, known))
            } else if !joints.contains(joint) {
                let known = joints.iter().map(String::as_str);
                ("the robot", list_similar(joint, known))
            } else {
                continue;
            };
            return Err(wrong(format!(
                "cannot rename the joint `{name}` to `{joint}`: {place} has no such joint; its joints are: {known}"
            )));
        }
        let fits = |name: &&String| joints.contains(name);
        let is_found = requested.is_none_or(BTreeMap::is_empty) && !recorded.iter().any(fits);
        let names = if is_found {
            behind_prefixes(recorded, joints).unwrap_or_default()
        } else {
            requested.cloned().unwrap_or_default()
        };
        Ok(Self {
            is_found: !names.is_empty() && is_found,
            robot_names: names,
        })
    }

    /// Returns the robot's name of a joint in the log.
    pub(crate) fn apply<'a>(&'a self, recorded: &'a str) -> &'a str {
        self.robot_names
            .get(recorded)
            .map_or(recorded, String::as_str)
    }

    /// Reports names that were found.
    pub(crate) fn finding(&self) -> Option<Finding> {
        let names = || self.robot_names.clone().into_iter().collect();
        self.is_found
            .then(|| Finding::JointsRenamed { names: names() })
    }
}

/// Returns the joints whose names are the same behind the prefix that all in the log share, and
/// that which all of the robot share; `None` unless these are all joints of the robot, or all of
/// the log where it has fewer.
fn behind_prefixes(
    recorded: &BTreeSet<&String>,
    joints: &[String],
) -> Option<BTreeMap<String, String>> {
    let theirs = prefix(recorded.iter().map(|name| name.as_str()));
    let ours = prefix(joints.iter().map(String::as_str));
    let behind: BTreeMap<&str, &String> = joints.iter().map(|name| (&name[ours..], name)).collect();
    let found: BTreeMap<String, String> = recorded
        .iter()
        .filter_map(|name| Some(((*name).clone(), (*behind.get(&name[theirs..])?).clone())))
        .collect();
    let is_whole = found.len() == recorded.len().min(joints.len());
    (is_whole && !found.is_empty()).then_some(found)
}

/// Returns the length of the prefix that all names share, up to and with the last separator in it.
fn prefix<'a>(names: impl Iterator<Item = &'a str>) -> usize {
    let shared = names.reduce(|shared, name| {
        let pairs = shared.char_indices().zip(name.chars());
        let equal = pairs.take_while(|((_, a), b)| a == b).last();
        equal.map_or("", |((at, a), _)| &shared[..at + a.len_utf8()])
    });
    let end = shared.unwrap_or("").rfind(SEPARATORS);
    end.map_or(0, |at| at + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|&name| name.to_owned()).collect()
    }

    fn found(recorded: &[&str], joints: &[&str]) -> Vec<(String, String)> {
        let recorded = names(recorded);
        let recorded = recorded.iter().collect();
        let renaming = Renaming::new(&recorded, &names(joints), None).unwrap();
        match renaming.finding() {
            Some(Finding::JointsRenamed { names }) => names,
            None => Vec::new(),
            other => panic!("{other:?}"),
        }
    }

    fn pairs(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
        let pairs = pairs.iter();
        pairs.map(|&(a, b)| (a.to_owned(), b.to_owned())).collect()
    }

    /// Names are matched behind prefixes on either side, in any order, and fingers with them.
    #[test]
    fn names_are_matched_behind_prefixes() {
        let log = ["fer_joint2", "fer_joint1", "fer_finger_joint1"];
        let robot = ["panda_joint1", "panda_joint2", "panda_finger_joint1"];
        let expected = [
            ("fer_finger_joint1", "panda_finger_joint1"),
            ("fer_joint1", "panda_joint1"),
            ("fer_joint2", "panda_joint2"),
        ];
        assert_eq!(found(&log, &robot), pairs(&expected));
        let log = ["left/elbow_joint", "left/shoulder_joint"];
        let expected = [
            ("left/elbow_joint", "elbow_joint"),
            ("left/shoulder_joint", "shoulder_joint"),
        ];
        assert_eq!(
            found(&log, &["shoulder_joint", "elbow_joint"]),
            pairs(&expected)
        );
    }

    /// Names stay where one of them fits, or where joints on both sides would have none.
    #[test]
    fn names_stay_where_a_match_is_not_whole() {
        assert_eq!(found(&["a_1", "b_2"], &["a_1", "b_3"]), []);
        assert_eq!(found(&["a_1", "a_2"], &["b_1", "b_3"]), []);
        assert_eq!(found(&["a_1"], &["b_1", "b_2"]), pairs(&[("a_1", "b_1")]));
    }

    /// Requested names must be there.
    #[test]
    fn requested_names_must_be_there() {
        let (recorded, joints) = (names(&["a", "b"]), names(&["c", "d"]));
        let recorded: BTreeSet<&String> = recorded.iter().collect();
        let new = |requested: &[(&str, &str)]| {
            let requested = pairs(requested).into_iter().collect();
            Renaming::new(&recorded, &joints, Some(&requested))
        };
        let renaming = new(&[("a", "d")]).unwrap();
        assert_eq!((renaming.apply("a"), renaming.apply("b")), ("d", "b"));
        assert_eq!(renaming.finding(), None);
        for (requested, lacks) in [(("x", "d"), "the log has"), (("a", "x"), "the robot has")] {
            let error = new(&[requested]).err().unwrap();
            assert_eq!(error.option(), Some("rename_joints"));
            assert!(error.to_string().contains(lacks), "{error}");
        }
    }
}
