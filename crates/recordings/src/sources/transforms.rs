//! Transforms of a log: which frames are fixed to each other.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use tactid_dynamics::{FrameId, Manipulator};
use tactid_logs::LogReader;
use tactid_logs::messages::{TFMessage, TransformStamped};

use crate::RecordingError;

/// Transforms of a log, by which frames are fixed to each other.
pub(crate) struct Transforms<'a> {
    log: &'a LogReader,
    /// For each frame the frames next to it, with `frame_from_other`.
    fixed: BTreeMap<String, Vec<(String, Isometry3<f64>)>>,
    /// Topics of transforms that may change.
    changing: Vec<String>,
    /// Topics of joint states, by which the robot moves.
    joints: Vec<String>,
}

impl<'a> Transforms<'a> {
    /// Reads the static transforms of a log, in which the topics `joints` have the joint states.
    pub(crate) fn read(log: &'a LogReader, joints: &[String]) -> Result<Self, RecordingError> {
        let names = log.topics_of::<TFMessage>().map(|topic| topic.name.clone());
        let (fixed, changing): (Vec<String>, Vec<String>) =
            names.partition(|name| name.ends_with("tf_static"));
        let mut transforms = Self {
            log,
            fixed: BTreeMap::new(),
            changing,
            joints: joints.to_vec(),
        };
        for message in log.messages_on(fixed)? {
            for stamped in message?.decode::<TFMessage>()?.transforms {
                transforms.add(stamped);
            }
        }
        Ok(transforms)
    }

    /// Adds a fixed transform, which leads from the parent to the child and back.
    fn add(&mut self, stamped: TransformStamped) {
        let parent_from_child = pose(&stamped);
        let (parent, child) = (stamped.header.frame_id, stamped.child_frame_id);
        let mut add = |from: &String, to: &String, pose| {
            let next = self.fixed.entry(from.clone()).or_default();
            next.push((to.clone(), pose));
        };
        add(&parent, &child, parent_from_child);
        add(&child, &parent, parent_from_child.inverse());
    }

    /// Returns all frames that are fixed to one, that itself first, each with its pose in it.
    pub(super) fn fixed_to(&self, frame: &str) -> Vec<(&str, Isometry3<f64>)> {
        let mut found = BTreeMap::from([(frame, Isometry3::identity())]);
        let mut order = Vec::new();
        let start = self
            .fixed
            .get_key_value(frame)
            .map(|(name, _)| name.as_str());
        let mut waiting = VecDeque::from_iter(start);
        order.extend(start.map(|name| (name, Isometry3::identity())));
        while let Some(next) = waiting.pop_front() {
            let frame_from_next = found[next];
            for (other, next_from_other) in self.fixed.get(next).into_iter().flatten() {
                if !found.contains_key(other.as_str()) {
                    let frame_from_other = frame_from_next * next_from_other;
                    found.insert(other, frame_from_other);
                    order.push((other, frame_from_other));
                    waiting.push_back(other);
                }
            }
        }
        order
    }

    /// Returns the link that a frame is or is fixed to, with `link_from_frame`.
    pub(super) fn link_of(
        &self,
        robot: &Manipulator,
        frame: &str,
    ) -> Option<(FrameId, Isometry3<f64>)> {
        if let Ok(link) = robot.frame(frame) {
            return Some((link, Isometry3::identity()));
        }
        self.fixed_to(frame)
            .into_iter()
            .find_map(|(name, frame_from_name)| {
                Some((robot.frame(name).ok()?, frame_from_name.inverse()))
            })
    }

    /// The log.
    pub(super) fn log(&self) -> &LogReader {
        self.log
    }

    /// Topics of transforms that may change.
    pub(super) fn changing(&self) -> &[String] {
        &self.changing
    }

    /// Topics of joint states.
    pub(super) fn joints(&self) -> &[String] {
        &self.joints
    }
}

/// Returns the pose of the child of a transform in its parent.
pub(super) fn pose(stamped: &TransformStamped) -> Isometry3<f64> {
    let (t, q) = (stamped.transform.translation, stamped.transform.rotation);
    Isometry3::from_parts(
        Translation3::new(t.x, t.y, t.z),
        UnitQuaternion::new_normalize(Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}
