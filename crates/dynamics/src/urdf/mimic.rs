//! The independent joint that a mimic joint follows.

use std::collections::HashSet;

use urdf_rs::{Joint, Mimic};

use super::pose::is_finite;
use super::tree::{Tree, joint_kind};
use crate::finding::{MimicFault, ModelFinding};

/// The joint that a mimic joint follows: `position = ratio · leader + offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leader<'a> {
    pub(super) joint: &'a Joint,
    pub(super) ratio: f64,
    /// Position of the mimic joint at leader position zero, rad or m.
    pub(super) offset: f64,
}

/// Returns the independent joint that a joint follows, directly or through other mimic joints, or
/// `None` for an independent joint. `links` are the links of the robot.
///
/// # Errors
/// Returns [`ModelFinding::MimicNotFollowed`] if the joint cannot follow the one that it names.
pub(super) fn leader<'a>(
    tree: &Tree<'a>,
    links: &HashSet<&str>,
    joint: &'a Joint,
) -> Option<Result<Leader<'a>, ModelFinding>> {
    let mimic = joint.mimic.as_ref()?;
    let found = follow(tree, links, joint, mimic);
    Some(found.map_err(|because| ModelFinding::MimicNotFollowed {
        joint: joint.name.clone(),
        leader: mimic.joint.clone(),
        because,
    }))
}

fn follow<'a>(
    tree: &Tree<'a>,
    links: &HashSet<&str>,
    joint: &'a Joint,
    mimic: &Mimic,
) -> Result<Leader<'a>, MimicFault> {
    let mut met = HashSet::from([joint.name.as_str()]);
    let mut leader = step(tree, links, mimic)?;
    while met.insert(&leader.joint.name) {
        let next = leader.joint.mimic.as_ref();
        // A leader that cannot follow another joint moves independently.
        let Some(Ok(next)) = next.map(|next| step(tree, links, next)) else {
            return finite(leader);
        };
        leader = Leader {
            joint: next.joint,
            ratio: leader.ratio * next.ratio,
            offset: leader.ratio * next.offset + leader.offset,
        };
    }
    Err(MimicFault::Circular)
}

/// Returns the joint that a mimic joint names.
fn step<'a>(
    tree: &Tree<'a>,
    links: &HashSet<&str>,
    mimic: &Mimic,
) -> Result<Leader<'a>, MimicFault> {
    let joint = tree.joints.get(mimic.joint.as_str()).copied();
    let joint = joint.filter(|joint| links.contains(joint.parent.link.as_str()));
    let joint = joint.ok_or(MimicFault::NoSuchJoint)?;
    if joint_kind(joint).is_none() {
        return Err(MimicFault::LeaderIsFixed);
    }
    finite(Leader {
        joint,
        ratio: mimic.multiplier.unwrap_or(1.0),
        offset: mimic.offset.unwrap_or(0.0),
    })
}

/// Returns a leader, or [`MimicFault::Numbers`] if its numbers are not finite.
fn finite(leader: Leader<'_>) -> Result<Leader<'_>, MimicFault> {
    let is_finite = is_finite(&[leader.ratio, leader.offset]);
    is_finite.then_some(leader).ok_or(MimicFault::Numbers)
}
