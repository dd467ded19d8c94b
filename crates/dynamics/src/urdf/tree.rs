//! The tree of links that a robot's joints form.

use std::collections::{HashMap, HashSet};

use urdf_rs::{Joint, JointType, Link, Robot};

use crate::{JointKind, ModelError};

/// Links and joints of a robot by name, each link with at most one joint above it.
pub(super) struct Tree<'a> {
    robot: &'a Robot,
    links: HashMap<&'a str, &'a Link>,
    pub(super) joints: HashMap<&'a str, &'a Joint>,
    /// Joint above each link except the root.
    above: HashMap<&'a str, &'a Joint>,
    /// Joints below each link, in the order of the file.
    below: HashMap<&'a str, Vec<&'a Joint>>,
}

impl<'a> Tree<'a> {
    /// Indexes the links and joints of a robot.
    ///
    /// # Errors
    /// Returns [`ModelError::Duplicate`], [`ModelError::MissingLink`] or [`ModelError::Loop`].
    pub(super) fn new(robot: &'a Robot) -> Result<Self, ModelError> {
        let mut tree = Self {
            robot,
            links: HashMap::new(),
            joints: HashMap::new(),
            above: HashMap::new(),
            below: HashMap::new(),
        };
        for link in &robot.links {
            if tree.links.insert(&link.name, link).is_some() {
                return Err(ModelError::Duplicate("link", link.name.clone()));
            }
        }
        for joint in &robot.joints {
            tree.add_joint(joint)?;
        }
        Ok(tree)
    }

    fn add_joint(&mut self, joint: &'a Joint) -> Result<(), ModelError> {
        if self.joints.insert(&joint.name, joint).is_some() {
            return Err(ModelError::Duplicate("joint", joint.name.clone()));
        }
        let (parent, child) = (&joint.parent.link, &joint.child.link);
        for link in [parent, child] {
            if !self.links.contains_key(link.as_str()) {
                return Err(ModelError::MissingLink {
                    joint: joint.name.clone(),
                    link: link.clone(),
                });
            }
        }
        if self.above.insert(child, joint).is_some() {
            return Err(ModelError::Loop(child.clone()));
        }
        self.below.entry(parent).or_default().push(joint);
        Ok(())
    }

    /// Returns the link with a name.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`], which lists the links.
    pub(super) fn link(&self, name: &str) -> Result<&'a Link, ModelError> {
        let found = self.links.get(name).copied();
        found.ok_or_else(|| ModelError::unknown_frame(name, names(self.robot)))
    }

    /// Returns the link without a parent, from which all other links must be reachable.
    ///
    /// # Errors
    /// Returns [`ModelError::Syntax`] if there is no link, [`ModelError::Roots`] or
    /// [`ModelError::Loop`].
    pub(super) fn root(&self) -> Result<&'a str, ModelError> {
        let is_root = |name: &&str| !self.above.contains_key(name);
        let roots: Vec<_> = names(self.robot).filter(is_root).collect();
        if roots.len() > 1 {
            let names = roots.into_iter().map(str::to_owned).collect();
            return Err(ModelError::Roots(names));
        }
        let reached = self.reached_from(&roots);
        // With one parent each, links that no root reaches hang below a loop.
        if let Some(lost) = names(self.robot).find(|name| !reached.contains(name)) {
            return Err(ModelError::Loop(self.in_loop_above(lost).to_owned()));
        }
        let root = roots.first().copied();
        root.ok_or_else(|| ModelError::Syntax("there is no link".to_owned()))
    }

    /// Returns the given links and all links below them.
    pub(super) fn reached_from(&self, roots: &[&'a str]) -> HashSet<&'a str> {
        let mut reached = HashSet::new();
        let mut open = roots.to_vec();
        while let Some(link) = open.pop() {
            reached.insert(link);
            let below = self.joints_below(link).iter();
            open.extend(below.map(|joint| joint.child.link.as_str()));
        }
        reached
    }

    /// Returns a link of the loop above `link`: the first that is met twice on the way up.
    fn in_loop_above(&self, mut link: &'a str) -> &'a str {
        let mut met = HashSet::new();
        while met.insert(link) {
            let above = self.above.get(link);
            link = above.map_or(link, |joint| joint.parent.link.as_str());
        }
        link
    }

    /// Returns the joints below a link, in the order of the file.
    pub(super) fn joints_below(&self, link: &str) -> &[&'a Joint] {
        self.below.get(link).map_or(&[], Vec::as_slice)
    }
}

/// Returns the names of the links of a robot in the order of the file.
pub(super) fn names(robot: &Robot) -> impl Iterator<Item = &str> {
    robot.links.iter().map(|link| link.name.as_str())
}

/// Returns the kind of a joint with one degree of freedom, or `None` for another joint.
pub(super) fn joint_kind(joint: &Joint) -> Option<JointKind> {
    match joint.joint_type {
        JointType::Revolute | JointType::Continuous => Some(JointKind::Revolute),
        JointType::Prismatic => Some(JointKind::Prismatic),
        _ => None,
    }
}
