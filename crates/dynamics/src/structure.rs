//! Read access to the tree of bodies and links, for programs that build their own robot.

use nalgebra::{Isometry3, Unit, Vector3};

use crate::{InertialParameters, JointKind, Manipulator};

/// A link of a [`Manipulator`]: a named frame that is fixed to one body.
#[derive(Clone, Copy, Debug)]
pub struct LinkView<'a> {
    /// Name of the link.
    pub name: &'a str,
    /// Position of the parent link in [`Manipulator::links`]; `None` for the root.
    pub parent: Option<usize>,
    /// Position in [`Manipulator::bodies`] of the body that the link is fixed to.
    pub body: usize,
    /// Pose of the link's frame in the body's frame.
    pub body_from_link: Isometry3<f64>,
}

/// The joint that moves a body of a [`Manipulator`] relative to its parent.
#[derive(Clone, Copy, Debug)]
pub struct JointView<'a> {
    /// Name of the independent joint that moves this one: itself, or the joint it mimics.
    pub name: &'a str,
    /// Kind of the joint.
    pub kind: JointKind,
    /// Axis, expressed in the body's frame.
    pub axis: Unit<Vector3<f64>>,
    /// Position of the parent body in [`Manipulator::bodies`].
    pub parent: usize,
    /// Pose of the body's frame in the parent body's frame at joint position zero.
    pub parent_from_body: Isometry3<f64>,
    /// Lower and upper limit of the position, rad or m, where it is limited.
    pub limits: Option<(f64, f64)>,
}

/// A rigid body of a [`Manipulator`]: a link that a joint moves, or the base, with all links fixed
/// to it. Its frame is the frame of that link.
#[derive(Clone, Copy, Debug)]
pub struct BodyView<'a> {
    /// Joint that moves the body; `None` for the base.
    pub joint: Option<JointView<'a>>,
    /// Inertial parameters of all its links, expressed in the body's frame.
    pub parameters: InertialParameters,
}

impl Manipulator {
    /// Returns the links in depth-first order, the root first: parents precede children and each
    /// subtree is contiguous.
    pub fn links(&self) -> impl ExactSizeIterator<Item = LinkView<'_>> {
        self.links
            .iter()
            .enumerate()
            .map(|(position, link)| LinkView {
                name: &link.name,
                parent: (position > 0).then_some(link.parent),
                body: link.body,
                body_from_link: link.body_from_link,
            })
    }

    /// Returns the rigid bodies in depth-first order, the base first: parents precede children.
    pub fn bodies(&self) -> impl ExactSizeIterator<Item = BodyView<'_>> {
        self.bodies.iter().map(|body| BodyView {
            joint: body.joint.as_ref().map(|joint| JointView {
                name: &self.joint_names[joint.coordinate],
                kind: joint.kind,
                axis: joint.axis,
                parent: body.parent,
                parent_from_body: joint.parent_from_zero,
                limits: joint.limits,
            }),
            parameters: body.parameters,
        })
    }
}
