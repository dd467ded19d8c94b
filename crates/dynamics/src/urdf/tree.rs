//! The tree of links that a URDF describes, from its lists of links and joints.

use std::collections::{HashMap, HashSet};

use nalgebra::{Isometry3, Unit, Vector3};
use urdf_rs::JointType;

use super::{isometry, link_parameters, not_finite};
use crate::ModelError;
use crate::manipulator::{BaseKind, Joint, JointKind, Link, Manipulator};

/// Links and joints of a URDF by name, each with at most one joint above it.
pub(super) struct Tree<'a> {
    urdf: &'a urdf_rs::Robot,
    links: HashMap<&'a str, &'a urdf_rs::Link>,
    joints: HashMap<&'a str, &'a urdf_rs::Joint>,
    /// Joint above each link except the root.
    above: HashMap<&'a str, &'a urdf_rs::Joint>,
    /// Joints below each link, in the order of the file.
    below: HashMap<&'a str, Vec<&'a urdf_rs::Joint>>,
}

impl<'a> Tree<'a> {
    /// Indexes a URDF.
    ///
    /// # Errors
    /// Returns [`ModelError::Duplicate`], [`ModelError::MissingLink`] or [`ModelError::Loop`].
    pub(super) fn new(urdf: &'a urdf_rs::Robot) -> Result<Self, ModelError> {
        let mut tree = Self {
            urdf,
            links: HashMap::new(),
            joints: HashMap::new(),
            above: HashMap::new(),
            below: HashMap::new(),
        };
        for link in &urdf.links {
            if tree.links.insert(&link.name, link).is_some() {
                return Err(ModelError::Duplicate("link", link.name.clone()));
            }
        }
        for joint in &urdf.joints {
            tree.add_joint(joint)?;
        }
        Ok(tree)
    }

    fn add_joint(&mut self, joint: &'a urdf_rs::Joint) -> Result<(), ModelError> {
        let (parent, child) = (&joint.parent.link, &joint.child.link);
        if self.joints.insert(&joint.name, joint).is_some() {
            return Err(ModelError::Duplicate("joint", joint.name.clone()));
        }
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

    /// Returns the link without a parent, from which all other links must be reachable.
    ///
    /// # Errors
    /// Returns [`ModelError::Roots`], [`ModelError::Loop`], or [`ModelError::Syntax`] if there is no link.
    pub(super) fn root(&self) -> Result<&'a str, ModelError> {
        let names = || self.urdf.links.iter().map(|link| link.name.as_str());
        let roots: Vec<_> = names()
            .filter(|name| !self.above.contains_key(name))
            .collect();
        if roots.len() > 1 {
            let names = roots.into_iter().map(str::to_owned).collect();
            return Err(ModelError::Roots(names));
        }
        let reached = self.reached_from(&roots);
        // With one parent each, links that no root reaches hang below a loop.
        if let Some(lost) = names().find(|name| !reached.contains(name)) {
            return Err(ModelError::Loop(self.in_loop_above(lost).to_owned()));
        }
        let root = roots.first().copied();
        root.ok_or_else(|| ModelError::Syntax("there is no link".to_owned()))
    }

    fn reached_from(&self, roots: &[&'a str]) -> HashSet<&'a str> {
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
            link = self
                .above
                .get(link)
                .map_or(link, |joint| &joint.parent.link);
        }
        link
    }

    fn joints_below(&self, link: &str) -> &[&'a urdf_rs::Joint] {
        self.below.get(link).map_or(&[], Vec::as_slice)
    }

    /// Builds the model of a link and of all links below it.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`] if there is no link `base`, or the first fault of a link or joint.
    pub(super) fn build(&self, base_kind: BaseKind, base: &str) -> Result<Manipulator, ModelError> {
        let Some(root) = self.links.get(base) else {
            let links = self.urdf.links.iter().map(|link| link.name.as_str());
            return Err(ModelError::unknown_frame(base, links));
        };
        let mut robot = Manipulator::with_root(base_kind, base, link_parameters(root)?);
        let mimics = self.add_links(base, &mut robot)?;
        self.resolve_mimics(&mut robot, &mimics)?;
        Ok(robot)
    }

    /// Adds all links below the root in depth-first order and returns the indices of the bodies with mimic joints, each
    /// with its joint. The stack is explicit, because a long chain would exhaust that of a recursion.
    fn add_links(
        &self,
        root: &str,
        robot: &mut Manipulator,
    ) -> Result<Vec<(usize, &'a urdf_rs::Joint)>, ModelError> {
        let mut mimics = Vec::new();
        let mut open: Vec<_> = self
            .joints_below(root)
            .iter()
            .rev()
            .map(|&joint| (joint, 0))
            .collect();
        while let Some((joint, above)) = open.pop() {
            let Link {
                body,
                body_from_link,
                ..
            } = robot.links[above];
            let zero = body_from_link * isometry(&joint.origin, "the origin", &joint.name)?;
            let child = &joint.child.link;
            let own = link_parameters(self.links[child.as_str()])?;
            let child_link = match moving_joint(joint, zero)? {
                None => robot.add_link(child, above, body, zero, own),
                Some(mut moving) => {
                    moving.coordinate = robot.joint_names.len();
                    let moved = robot.add_body(body, moving);
                    if joint.mimic.is_some() {
                        mimics.push((moved, joint));
                    } else {
                        robot.joint_names.push(joint.name.clone());
                    }
                    robot.add_link(child, above, moved, Isometry3::identity(), own)
                }
            };
            let below = self.joints_below(child).iter().rev();
            open.extend(below.map(|&joint| (joint, child_link)));
        }
        Ok(mimics)
    }

    /// Lets each mimic joint share the coordinate of the joint that it follows.
    fn resolve_mimics(
        &self,
        robot: &mut Manipulator,
        mimics: &[(usize, &urdf_rs::Joint)],
    ) -> Result<(), ModelError> {
        for &(body, joint) in mimics {
            let Some(mimic) = &joint.mimic else { continue };
            let refuse = |why| ModelError::Mimic {
                joint: joint.name.clone(),
                source_joint: mimic.joint.clone(),
                why,
            };
            let coordinate = robot.joint_index(&mimic.joint).ok_or_else(|| {
                refuse(match self.joints.get(mimic.joint.as_str()) {
                    None => "which the URDF does not have",
                    Some(source) if source.mimic.is_some() => {
                        "which mimics a joint itself: name the joint that leads"
                    }
                    Some(_) => "which does not move or is not below the base",
                })
            })?;
            let (ratio, offset) = (mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0));
            if !(ratio.is_finite() && offset.is_finite()) {
                return Err(refuse("with a multiplier or offset that is not finite"));
            }
            if let Some(moving) = &mut robot.bodies[body].joint {
                (moving.coordinate, moving.ratio, moving.offset) = (coordinate, ratio, offset);
            }
        }
        Ok(())
    }
}

/// Returns the joint above a moving link, or `None` for a fixed joint. The caller sets its coordinate.
fn moving_joint(
    joint: &urdf_rs::Joint,
    parent_from_zero: Isometry3<f64>,
) -> Result<Option<Joint>, ModelError> {
    let kind = match joint.joint_type {
        JointType::Fixed => return Ok(None),
        JointType::Revolute | JointType::Continuous => JointKind::Revolute,
        JointType::Prismatic => JointKind::Prismatic,
        ref other => {
            return Err(ModelError::JointKind {
                joint: joint.name.clone(),
                kind: format!("{other:?}").to_lowercase(),
            });
        }
    };
    let axis = Vector3::from(joint.axis.xyz.0);
    if !axis.iter().all(|v| v.is_finite()) {
        return Err(not_finite("the axis", &joint.name));
    }
    let axis = Unit::try_new(axis, 1e-9).ok_or_else(|| ModelError::Axis(joint.name.clone()))?;
    Ok(Some(Joint {
        name: joint.name.clone(),
        kind,
        axis,
        parent_from_zero,
        coordinate: 0,
        ratio: 1.0,
        offset: 0.0,
        is_mimic: joint.mimic.is_some(),
    }))
}
