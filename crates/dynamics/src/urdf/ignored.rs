//! Parts of a URDF that the format does not have.

use std::collections::BTreeMap;

use super::element::Element;
use crate::finding::{IgnoredPart, ModelFinding};

/// What the format has inside an element.
struct Format {
    element: &'static str,
    children: &'static [&'static str],
    /// Attributes; `None` where they are not checked, because a misspelled one is missed elsewhere or means nothing for
    /// motion and mass.
    attributes: Option<&'static [&'static str]>,
}

/// The elements that a model is made from. What others contain, such as `<visual>` and `<limit>`, is not checked.
const FORMAT: [Format; 10] = [
    Format {
        element: "link",
        children: &["inertial", "visual", "collision"],
        attributes: None,
    },
    Format {
        element: "joint",
        children: &[
            "parent",
            "child",
            "origin",
            "axis",
            "mimic",
            "limit",
            "dynamics",
            "calibration",
            "safety_controller",
        ],
        attributes: None,
    },
    Format {
        element: "inertial",
        children: &["origin", "mass", "inertia"],
        attributes: None,
    },
    leaf("origin", &["xyz", "rpy", "quat_xyzw"]),
    leaf("axis", &["xyz"]),
    leaf("mass", &["value"]),
    leaf("inertia", &super::inertial::ENTRIES),
    leaf("mimic", &["joint", "multiplier", "offset"]),
    leaf("parent", &["link"]),
    leaf("child", &["link"]),
];

/// Elements that a link may have more than once.
const REPEATABLE: [&str; 2] = ["visual", "collision"];

const fn leaf(element: &'static str, attributes: &'static [&'static str]) -> Format {
    Format {
        element,
        children: &[],
        attributes: Some(attributes),
    }
}

/// Ignored parts of a description, each with the names of the links or joints in which it occurs.
#[derive(Debug, Default)]
pub(super) struct Ignored(BTreeMap<(&'static str, IgnoredPart, String), Vec<String>>);

impl Ignored {
    /// Adds what is ignored in an element of a link or joint, whose name is `owner`.
    pub(super) fn add(&mut self, element: &Element, owner: &str) {
        let Some(format) = FORMAT.iter().find(|known| known.element == element.name) else {
            return;
        };
        let inside = format.element;
        if let Some(known) = format.attributes {
            let names = element.attributes.iter().map(|(name, _)| name);
            let names = names.filter(|name| !is_of_another_program(name) && *name != "xmlns");
            for name in names.filter(|name| !known.contains(&name.as_str())) {
                self.insert(inside, IgnoredPart::UnknownAttribute, name, owner);
            }
        }
        let mut met: Vec<&str> = Vec::new();
        let children = element.children.iter();
        for child in children.filter(|child| !is_of_another_program(&child.name)) {
            let name = child.name.as_str();
            if !format.children.contains(&name) {
                self.insert(inside, IgnoredPart::UnknownElement, name, owner);
            } else if !met.contains(&name) {
                met.push(name);
                self.add(child, owner);
            } else if !REPEATABLE.contains(&name) {
                self.insert(inside, IgnoredPart::RepeatedElement, name, owner);
            }
        }
    }

    fn insert(&mut self, inside: &'static str, part: IgnoredPart, name: &str, owner: &str) {
        let owners = self.0.entry((inside, part, name.to_owned())).or_default();
        if owners.last().is_none_or(|last| last != owner) {
            owners.push(owner.to_owned());
        }
    }

    /// Returns a finding for each part.
    pub(super) fn into_findings(self) -> impl Iterator<Item = ModelFinding> {
        let parts = self.0.into_iter();
        parts.map(|((inside, part, name), owners)| ModelFinding::PartIgnored {
            part,
            name,
            inside,
            owners,
        })
    }
}

/// Returns whether a name has a prefix, as in `drake:acceleration`.
fn is_of_another_program(name: &str) -> bool {
    name.contains(':')
}
