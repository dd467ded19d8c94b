//! Construction of a [`Manipulator`] from the links and joints that urdf-rs has read.

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use nalgebra::{Isometry3, Unit, Vector3};
use urdf_rs::JointType;

use super::inertial::link_parameters;
use super::mimic::{Leader, leader};
use super::pose::{is_finite, isometry};
use super::preprocess::{Repair, Repairs};
use super::tree::{Tree, joint_kind};
use crate::finding::IgnoredPart;
use crate::manipulator::{BaseKind, Joint, Link, Manipulator};
use crate::{InertialParameters, ModelError, ModelFinding};

/// Reads links and joints outwards from the base, and keeps what is wrong with them.
struct Builder<'a> {
    tree: &'a Tree<'a>,
    base_kind: BaseKind,
    repairs: &'a Repairs,
    /// The base and all links below it.
    links: HashSet<&'a str>,
    /// Indices of the bodies with mimic joints, each with the joint that it follows.
    mimics: Vec<(usize, Leader<'a>)>,
    findings: Vec<ModelFinding>,
    /// Ignored parts, each with the names of the links or joints in which it occurs.
    ignored: BTreeMap<(&'static str, IgnoredPart, &'a str), Vec<String>>,
}

/// Builds the model of a link and of all links below it. `repairs` are what the preprocessing has
/// changed.
///
/// # Errors
/// Returns [`ModelError::UnknownFrame`] if there is no link `base`, or the first fault of a joint.
pub(super) fn build(
    tree: &Tree<'_>,
    repairs: &Repairs,
    base_kind: BaseKind,
    base: &str,
) -> Result<Manipulator, ModelError> {
    let base = tree.link(base)?.name.as_str();
    let mut builder = Builder {
        tree,
        base_kind,
        repairs,
        links: tree.reached_from(&[base]),
        mimics: Vec::new(),
        findings: Vec::new(),
        ignored: BTreeMap::new(),
    };
    let own = builder.parameters(base, 0)?;
    let mut robot = Manipulator::with_root(base_kind, base, own);
    builder.add_links(base, &mut robot)?;
    builder.resolve_mimics(&mut robot);
    robot.findings = builder.findings;
    let ignored = builder.ignored.into_iter();
    let ignored = ignored.map(|((inside, part, name), owners)| ModelFinding::PartIgnored {
        part,
        name: name.to_owned(),
        inside: inside.into(),
        owners,
    });
    robot.findings.extend(ignored);
    Ok(robot)
}

impl<'a> Builder<'a> {
    /// Returns the inertial parameters of a link that is fixed to the body with an index.
    fn parameters(&mut self, link: &str, body: usize) -> Result<InertialParameters, ModelError> {
        let link = self.tree.link(link)?;
        let repair = self.repairs.links.get(&link.name);
        self.report_ignored(repair, &link.name);
        let rotation = repair.and_then(|repair| repair.rotation).unwrap_or("rpy");
        let (parameters, findings) = link_parameters(link, rotation);
        // The mass of a fixed base has no effect.
        if body > 0 || self.base_kind == BaseKind::Floating {
            self.findings.extend(findings);
        }
        Ok(parameters)
    }

    /// Reports what the preprocessing has left out in a link or joint with the name `owner`.
    fn report_ignored(&mut self, repair: Option<&'a Repair>, owner: &str) {
        for (inside, part, name) in repair.iter().flat_map(|repair| &repair.ignored) {
            let owners = self.ignored.entry((inside, *part, name)).or_default();
            if owners.last().is_none_or(|last| last != owner) {
                owners.push(owner.to_owned());
            }
        }
    }

    /// Adds all links below the root in depth-first order. The stack is explicit, because a
    /// recursion along a chain could exhaust its own.
    fn add_links(&mut self, root: &str, robot: &mut Manipulator) -> Result<(), ModelError> {
        let tree = self.tree;
        let below = |link: &str, position: usize| {
            let joints = tree.joints_below(link).iter().rev();
            joints.map(move |&joint| (joint, position))
        };
        let mut open: Vec<_> = below(root, 0).collect();
        while let Some((joint, above)) = open.pop() {
            self.report_ignored(self.repairs.joints.get(&joint.name), &joint.name);
            let Link {
                body,
                body_from_link,
                ..
            } = robot.links[above];
            check(joint, "the origin", &[*joint.origin.xyz, *joint.origin.rpy])?;
            let zero = body_from_link * isometry(&joint.origin);
            let (body, body_from_link) = match self.moving_joint(joint, zero)? {
                None => (body, zero),
                Some(moving) => {
                    let moved = self.add_body(robot, body, moving, joint);
                    (moved, Isometry3::identity())
                }
            };
            let child = &joint.child.link;
            let own = self.parameters(child, body)?;
            let position = robot.add_link(child, above, body, body_from_link, own);
            open.extend(below(child, position));
        }
        Ok(())
    }

    /// Returns the joint above a moving link, or `None` for a joint that is fixed or taken to be.
    /// The caller sets its coordinate.
    fn moving_joint(
        &mut self,
        joint: &urdf_rs::Joint,
        parent_from_zero: Isometry3<f64>,
    ) -> Result<Option<Joint>, ModelError> {
        let name = || joint.name.clone();
        let Some(kind) = joint_kind(joint) else {
            let joint_type = match joint.joint_type {
                JointType::Floating => "floating",
                JointType::Planar => "planar",
                JointType::Spherical => "spherical",
                _ => return Ok(None),
            };
            let finding = ModelFinding::JointTakenAsFixed {
                joint: name(),
                joint_type: joint_type.into(),
            };
            self.findings.push(finding);
            return Ok(None);
        };
        check(joint, "the axis", &[*joint.axis.xyz])?;
        let axis = Unit::try_new(Vector3::from(*joint.axis.xyz), 1e-9);
        Ok(Some(Joint {
            name: name(),
            kind,
            axis: axis.ok_or_else(|| ModelError::Axis(name()))?,
            parent_from_zero,
            coordinate: 0,
            ratio: 1.0,
            offset: 0.0,
            is_mimic: false,
            limits: position_limits(joint),
            velocity_limit: positive(joint.limit.velocity),
            effort_limit: positive(joint.limit.effort),
        }))
    }

    /// Adds the body that a joint moves and returns its index. The joint has a coordinate of its
    /// own unless it mimics another joint.
    fn add_body(
        &mut self,
        robot: &mut Manipulator,
        parent: usize,
        mut moving: Joint,
        joint: &'a urdf_rs::Joint,
    ) -> usize {
        let followed = leader(self.tree, &self.links, joint);
        moving.is_mimic = matches!(followed, Some(Ok(_)));
        moving.coordinate = robot.joint_names.len();
        if !moving.is_mimic {
            Arc::make_mut(&mut robot.joint_names).push(moving.name.clone());
        }
        let body = robot.add_body(parent, moving);
        match followed {
            None => {}
            Some(Ok(leader)) => self.mimics.push((body, leader)),
            Some(Err(finding)) => self.findings.push(finding),
        }
        body
    }

    /// Lets each mimic joint share the coordinate of the joint that it follows.
    fn resolve_mimics(&self, robot: &mut Manipulator) {
        for (body, leader) in &self.mimics {
            // A leader is a moving joint below the base, and so has a coordinate.
            if let Some(coordinate) = robot.joint_index(&leader.joint.name)
                && let Some(moving) = &mut robot.bodies[*body].joint
            {
                moving.coordinate = coordinate;
                (moving.ratio, moving.offset) = (leader.ratio, leader.offset);
            }
        }
    }
}

/// Checks that a vector or two of a joint are finite, as they are in every text that is read.
///
/// # Errors
/// Returns [`ModelError::NotFinite`].
fn check(
    joint: &urdf_rs::Joint,
    what: &'static str,
    vectors: &[[f64; 3]],
) -> Result<(), ModelError> {
    let name = joint.name.clone();
    let is_finite = is_finite(vectors.as_flattened());
    is_finite
        .then_some(())
        .ok_or(ModelError::NotFinite { what, name })
}

/// Returns the lower and upper limit of a joint's position, rad or m, or `None` for a continuous
/// joint and for limits that are not two finite numbers, the lower first.
fn position_limits(joint: &urdf_rs::Joint) -> Option<(f64, f64)> {
    let (lower, upper) = (joint.limit.lower, joint.limit.upper);
    let is_limited = joint.joint_type != JointType::Continuous;
    (is_limited && is_finite(&[lower, upper]) && lower < upper).then_some((lower, upper))
}

/// Returns a limit that is a positive finite number.
fn positive(limit: f64) -> Option<f64> {
    Some(limit).filter(|limit| limit.is_finite() && *limit > 0.0)
}
