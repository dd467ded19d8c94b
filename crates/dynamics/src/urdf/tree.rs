//! The tree of links that a URDF describes, from its elements.

use std::collections::{HashMap, HashSet};

use super::element::{Element, syntax};
use super::numbers::number;
use crate::{JointKind, ModelError};

/// A joint of a URDF and the links that it connects.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointElement<'a> {
    pub(super) element: &'a Element,
    pub(super) name: &'a str,
    pub(super) parent: &'a str,
    pub(super) child: &'a str,
}

/// What a joint lets its child link do.
#[derive(Clone, Copy, Debug)]
pub(super) enum Motion {
    /// The child does not move.
    Fixed,
    /// The child moves about or along an axis.
    OneFreedom(JointKind),
    /// The child moves in a plane or freely; the field is the type of the joint.
    SeveralFreedoms(&'static str),
}

impl JointElement<'_> {
    /// Returns what the joint lets its child link do. The case of the letters of its type does not matter.
    ///
    /// # Errors
    /// Returns [`ModelError::JointKind`] for a type that the format does not have.
    pub(super) fn motion(&self) -> Result<Motion, ModelError> {
        let kind = self.element.attribute("type").unwrap_or_default();
        Ok(match kind.to_ascii_lowercase().as_str() {
            "fixed" => Motion::Fixed,
            "revolute" | "continuous" => Motion::OneFreedom(JointKind::Revolute),
            "prismatic" => Motion::OneFreedom(JointKind::Prismatic),
            "floating" => Motion::SeveralFreedoms("floating"),
            "planar" => Motion::SeveralFreedoms("planar"),
            _ => {
                return Err(ModelError::JointKind {
                    joint: self.name.to_owned(),
                    kind: kind.to_owned(),
                });
            }
        })
    }
}

/// Returns the lower and upper limit of a joint's position, rad or m, or `None` for a joint that is continuous or fixed, or
/// whose limits are not two finite numbers of which the lower comes first.
pub(super) fn position_limits(joint: &Element) -> Option<(f64, f64)> {
    let kind = joint.attribute("type")?.to_ascii_lowercase();
    let limit = joint.child("limit")?;
    let end = |name| Some(number(limit, name).ok()?.unwrap_or(0.0));
    let (lower, upper) = (end("lower")?, end("upper")?);
    let is_limited = ["revolute", "prismatic"].contains(&kind.as_str());
    (is_limited && lower < upper).then_some((lower, upper))
}

/// Returns the number `name` of a joint's `<limit>`, such as `velocity`, or `None` where it is missing, no finite number, or
/// not positive.
pub(super) fn positive_limit(joint: &Element, name: &'static str) -> Option<f64> {
    let limit = number(joint.child("limit")?, name).ok()?;
    limit.filter(|&limit| limit > 0.0)
}

/// Links and joints of a URDF by name, each with at most one joint above it.
pub(super) struct Tree<'a> {
    /// Names of the links in the order of the file.
    names: Vec<&'a str>,
    links: HashMap<&'a str, &'a Element>,
    pub(super) joints: HashMap<&'a str, JointElement<'a>>,
    /// Joint above each link except the root.
    above: HashMap<&'a str, JointElement<'a>>,
    /// Joints below each link, in the order of the file.
    below: HashMap<&'a str, Vec<JointElement<'a>>>,
}

impl<'a> Tree<'a> {
    /// Indexes the links and joints of the element `<robot>` in a text.
    ///
    /// # Errors
    /// Returns [`ModelError::Syntax`] for a link or joint without a name or for a joint that does not name its links,
    /// [`ModelError::Duplicate`], [`ModelError::MissingLink`] or [`ModelError::Loop`].
    pub(super) fn new(xml: &str, robot: &'a Element) -> Result<Self, ModelError> {
        let mut tree = Self {
            names: Vec::new(),
            links: HashMap::new(),
            joints: HashMap::new(),
            above: HashMap::new(),
            below: HashMap::new(),
        };
        for link in robot.children("link") {
            let name = name_in(xml, link, "name")?;
            tree.names.push(name);
            if tree.links.insert(name, link).is_some() {
                return Err(ModelError::Duplicate("link", name.to_owned()));
            }
        }
        for element in robot.children("joint") {
            let end = |which| match element.child(which) {
                Some(end) => name_in(xml, end, "link"),
                None => {
                    let message = format!("this <joint> has no <{which}>");
                    Err(syntax(xml, element.span.start, &message))
                }
            };
            tree.add_joint(JointElement {
                element,
                name: name_in(xml, element, "name")?,
                parent: end("parent")?,
                child: end("child")?,
            })?;
        }
        Ok(tree)
    }

    fn add_joint(&mut self, joint: JointElement<'a>) -> Result<(), ModelError> {
        if self.joints.insert(joint.name, joint).is_some() {
            return Err(ModelError::Duplicate("joint", joint.name.to_owned()));
        }
        for link in [joint.parent, joint.child] {
            if !self.links.contains_key(link) {
                return Err(ModelError::MissingLink {
                    joint: joint.name.to_owned(),
                    link: link.to_owned(),
                });
            }
        }
        if self.above.insert(joint.child, joint).is_some() {
            return Err(ModelError::Loop(joint.child.to_owned()));
        }
        self.below.entry(joint.parent).or_default().push(joint);
        Ok(())
    }

    /// Returns the element of a link.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`], which lists the links.
    pub(super) fn link(&self, name: &str) -> Result<&'a Element, ModelError> {
        let found = self.links.get(name).copied();
        found.ok_or_else(|| ModelError::unknown_frame(name, self.names.iter().copied()))
    }

    /// Returns the link without a parent, from which all other links must be reachable, or `None` if there is no link.
    ///
    /// # Errors
    /// Returns [`ModelError::Roots`] or [`ModelError::Loop`].
    pub(super) fn root(&self) -> Result<Option<&'a str>, ModelError> {
        let names = || self.names.iter().copied();
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
        Ok(roots.first().copied())
    }

    /// Returns the given links and all links below them.
    pub(super) fn reached_from(&self, roots: &[&'a str]) -> HashSet<&'a str> {
        let mut reached = HashSet::new();
        let mut open = roots.to_vec();
        while let Some(link) = open.pop() {
            reached.insert(link);
            open.extend(self.joints_below(link).iter().map(|joint| joint.child));
        }
        reached
    }

    /// Returns a link of the loop above `link`: the first that is met twice on the way up.
    fn in_loop_above(&self, mut link: &'a str) -> &'a str {
        let mut met = HashSet::new();
        while met.insert(link) {
            link = self.above.get(link).map_or(link, |joint| joint.parent);
        }
        link
    }

    /// Returns the joints below a link, in the order of the file.
    pub(super) fn joints_below(&self, link: &str) -> &[JointElement<'a>] {
        self.below.get(link).map_or(&[], Vec::as_slice)
    }
}

/// Returns the name in an attribute of an element.
///
/// # Errors
/// Returns [`ModelError::Syntax`], which names the line, if there is none.
fn name_in<'a>(xml: &str, element: &'a Element, attribute: &str) -> Result<&'a str, ModelError> {
    element.attribute(attribute).ok_or_else(|| {
        let message = format!("this <{}> has no attribute `{attribute}`", element.name);
        syntax(xml, element.span.start, &message)
    })
}
