//! The independent joint that a mimic joint follows.

use std::collections::HashSet;

use super::element::Element;
use super::numbers::number;
use super::tree::{JointElement, Motion, Tree};
use crate::finding::{MimicFault, ModelFinding};

/// The independent joint that a mimic joint follows: `position = ratio · leader + offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leader<'a> {
    pub(super) joint: &'a str,
    pub(super) ratio: f64,
    /// Position of the mimic joint at leader position zero, rad or m.
    pub(super) offset: f64,
}

/// Returns the joint that a joint follows, directly or through other mimic joints, or `None` for an independent joint.
/// `links` are those of the robot.
///
/// # Errors
/// Returns [`ModelFinding::MimicNotFollowed`] if the joint cannot follow the one that it names.
pub(super) fn leader<'a>(
    tree: &Tree<'a>,
    links: &HashSet<&str>,
    joint: &JointElement<'a>,
) -> Option<Result<Leader<'a>, ModelFinding>> {
    let mimic = joint.element.child("mimic")?;
    let found = follow(tree, links, joint, mimic);
    Some(found.map_err(|because| ModelFinding::MimicNotFollowed {
        joint: joint.name.to_owned(),
        leader: mimic.attribute("joint").unwrap_or_default().to_owned(),
        because,
    }))
}

fn follow<'a>(
    tree: &Tree<'a>,
    links: &HashSet<&str>,
    joint: &JointElement<'a>,
    mimic: &Element,
) -> Result<Leader<'a>, MimicFault> {
    let mut met = HashSet::from([joint.name]);
    let mut leader = step(tree, links, mimic)?;
    while met.insert(leader.joint.name) {
        let (ratio, offset) = (leader.ratio, leader.offset);
        let next = leader.joint.element.child("mimic");
        // A leader that cannot follow another joint moves independently.
        let Some(Ok(next)) = next.map(|next| step(tree, links, next)) else {
            let joint = leader.joint.name;
            let is_finite = ratio.is_finite() && offset.is_finite();
            return is_finite
                .then_some(Leader {
                    joint,
                    ratio,
                    offset,
                })
                .ok_or(MimicFault::Numbers);
        };
        leader = Step {
            joint: next.joint,
            ratio: ratio * next.ratio,
            offset: ratio * next.offset + offset,
        };
    }
    Err(MimicFault::Circular)
}

/// The joint that a mimic joint names: `position = ratio · joint + offset`.
struct Step<'a> {
    joint: JointElement<'a>,
    ratio: f64,
    offset: f64,
}

fn step<'a>(
    tree: &Tree<'a>,
    links: &HashSet<&str>,
    mimic: &Element,
) -> Result<Step<'a>, MimicFault> {
    let named = mimic.attribute("joint").unwrap_or_default();
    let joint = tree.joints.get(named).copied();
    let joint = joint.filter(|joint| links.contains(joint.parent));
    let joint = joint.ok_or(MimicFault::NoSuchJoint)?;
    if !matches!(joint.motion(), Ok(Motion::OneFreedom(_))) {
        return Err(MimicFault::LeaderIsFixed);
    }
    let ratio = number(mimic, "multiplier").map_err(|_| MimicFault::Numbers)?;
    let offset = number(mimic, "offset").map_err(|_| MimicFault::Numbers)?;
    Ok(Step {
        joint,
        ratio: ratio.unwrap_or(1.0),
        offset: offset.unwrap_or(0.0),
    })
}
