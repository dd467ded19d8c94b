//! Construction of a [`Manipulator`] from the tree of a URDF.

use std::collections::HashSet;

use nalgebra::{Isometry3, Unit};

use super::ignored::Ignored;
use super::inertial::link_parameters;
use super::mimic::{Leader, leader};
use super::numbers::{axis, origin};
use super::tree::{JointElement, Motion, Tree, position_limits, positive_limit};
use crate::manipulator::{BaseKind, Joint, Link, Manipulator};
use crate::{InertialParameters, ModelError, ModelFinding};

/// Reads links and joints outwards from the base, and keeps what is wrong with them.
struct Builder<'a> {
    tree: &'a Tree<'a>,
    base_kind: BaseKind,
    /// The base and all links below it.
    links: HashSet<&'a str>,
    /// Indices of the bodies with mimic joints, each with the joint that it follows.
    mimics: Vec<(usize, Leader<'a>)>,
    findings: Vec<ModelFinding>,
    ignored: Ignored,
}

/// Builds the model of a link and of all links below it.
///
/// # Errors
/// Returns [`ModelError::UnknownFrame`] if there is no link `base`, or the first fault of a joint.
pub(super) fn build(
    tree: &Tree<'_>,
    base_kind: BaseKind,
    base: &str,
) -> Result<Manipulator, ModelError> {
    let base = tree.link(base)?.attribute("name").unwrap_or_default();
    let mut builder = Builder {
        tree,
        base_kind,
        links: tree.reached_from(&[base]),
        mimics: Vec::new(),
        findings: Vec::new(),
        ignored: Ignored::default(),
    };
    let own = builder.parameters(base, 0)?;
    let mut robot = Manipulator::with_root(base_kind, base, own);
    builder.add_links(base, &mut robot)?;
    builder.resolve_mimics(&mut robot);
    robot.findings = builder.findings;
    robot.findings.extend(builder.ignored.into_findings());
    Ok(robot)
}

impl<'a> Builder<'a> {
    /// Returns the inertial parameters of a link that is fixed to the body with an index.
    fn parameters(&mut self, link: &str, body: usize) -> Result<InertialParameters, ModelError> {
        let element = self.tree.link(link)?;
        self.ignored.add(element, link);
        let (parameters, findings) = link_parameters(link, element);
        // The mass of a fixed base has no effect.
        if body > 0 || self.base_kind == BaseKind::Floating {
            self.findings.extend(findings);
        }
        Ok(parameters)
    }

    /// Adds all links below the root in depth-first order. The stack is explicit, because a long chain would exhaust that
    /// of a recursion.
    fn add_links(&mut self, root: &str, robot: &mut Manipulator) -> Result<(), ModelError> {
        let tree = self.tree;
        let below = |link: &str, position: usize| {
            let joints = tree.joints_below(link).iter().rev();
            joints.map(move |&joint| (joint, position))
        };
        let mut open: Vec<_> = below(root, 0).collect();
        while let Some((joint, above)) = open.pop() {
            self.ignored.add(joint.element, joint.name);
            let Link {
                body,
                body_from_link,
                ..
            } = robot.links[above];
            let origin = origin(joint.element).map_err(|fault| fault.of("joint", joint.name))?;
            let zero = body_from_link * origin;
            let (body, body_from_link) = match self.moving_joint(&joint, zero)? {
                None => (body, zero),
                Some(moving) => {
                    let moved = self.add_body(robot, body, moving, &joint);
                    (moved, Isometry3::identity())
                }
            };
            let own = self.parameters(joint.child, body)?;
            let position = robot.add_link(joint.child, above, body, body_from_link, own);
            open.extend(below(joint.child, position));
        }
        Ok(())
    }

    /// Returns the joint above a moving link, or `None` for a joint that is fixed or taken to be. The caller sets its
    /// coordinate.
    fn moving_joint(
        &mut self,
        joint: &JointElement<'_>,
        parent_from_zero: Isometry3<f64>,
    ) -> Result<Option<Joint>, ModelError> {
        let name = || joint.name.to_owned();
        let kind = match joint.motion()? {
            Motion::Fixed => return Ok(None),
            Motion::OneFreedom(kind) => kind,
            Motion::SeveralFreedoms(kind) => {
                let joint = name();
                let finding = ModelFinding::JointTakenAsFixed {
                    joint,
                    joint_type: kind,
                };
                self.findings.push(finding);
                return Ok(None);
            }
        };
        let axis = axis(joint.element).map_err(|fault| fault.of("joint", joint.name))?;
        let axis = Unit::try_new(axis, 1e-9).ok_or_else(|| ModelError::Axis(name()))?;
        Ok(Some(Joint {
            name: name(),
            kind,
            axis,
            parent_from_zero,
            coordinate: 0,
            ratio: 1.0,
            offset: 0.0,
            is_mimic: false,
            limits: position_limits(joint.element),
            effort_limit: positive_limit(joint.element, "effort"),
        }))
    }

    /// Adds the body that a joint moves and returns its index. The joint has a coordinate of its own unless it mimics
    /// another joint.
    fn add_body(
        &mut self,
        robot: &mut Manipulator,
        parent: usize,
        mut moving: Joint,
        joint: &JointElement<'a>,
    ) -> usize {
        let followed = leader(self.tree, &self.links, joint);
        moving.is_mimic = matches!(followed, Some(Ok(_)));
        moving.coordinate = robot.joint_names.len();
        if !moving.is_mimic {
            robot.joint_names.push(moving.name.clone());
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
            if let Some(coordinate) = robot.joint_index(leader.joint)
                && let Some(moving) = &mut robot.bodies[*body].joint
            {
                moving.coordinate = coordinate;
                (moving.ratio, moving.offset) = (leader.ratio, leader.offset);
            }
        }
    }
}
