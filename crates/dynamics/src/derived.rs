//! Robots that are derived from another: with one more frame, with a payload, without a subtree,
//! with locked joints.

use std::ops::Range;

use nalgebra::Isometry3;

use crate::manipulator::{Body, subtree_ends};
use crate::{FrameId, InertialParameters, Manipulator};

impl Manipulator {
    /// Returns the robot with a massless link attached rigidly to the link of `parent` as its last
    /// child, for instance a sensor that the URDF does not contain. `parent_from_frame` is the pose
    /// of the new link's frame.
    ///
    /// The name is not checked: [`Self::frame`] finds the oldest of two links with one name.
    #[must_use]
    pub fn with_frame(
        &self,
        name: &str,
        parent: FrameId,
        parent_from_frame: &Isometry3<f64>,
    ) -> Self {
        let mut robot = self.clone();
        let above = self.link(parent);
        let body_from_frame = above.body_from_link * parent_from_frame;
        robot.insert_link(
            self.links_below(parent).end,
            name,
            (self.position(parent), above.body),
            body_from_frame,
            InertialParameters::zero(),
        );
        robot
    }

    /// Returns the robot with a body attached rigidly to the link of `frame`. `payload` is
    /// expressed in that frame, with the inertia about its origin.
    #[must_use]
    pub fn with_payload(&self, frame: FrameId, payload: &InertialParameters) -> Self {
        let mut robot = self.clone();
        let link = &mut robot.links[self.position(frame)];
        link.parameters = link.parameters + *payload;
        let body = &mut robot.bodies[link.body];
        body.parameters = body.parameters + payload.expressed_in(&link.body_from_link);
        robot
    }

    /// Returns the robot without the masses of the links below `frame`: the known part where the
    /// end-effector counts as unknown. The link of `frame` keeps its mass, and all joints stay.
    #[must_use]
    pub fn without_subtree(&self, frame: FrameId) -> Self {
        let mut robot = self.clone();
        for link in &mut robot.links[self.links_below(frame)] {
            link.removed = link.removed + link.parameters;
            link.parameters = InertialParameters::zero();
        }
        robot.lump_links();
        robot
    }

    /// Returns the robot with all joints locked at position zero that move none of the given
    /// frames. The number and order of joints stay; values given for a locked joint have no effect.
    /// The frames move as in the whole robot, at the cost of fewer bodies.
    #[must_use]
    pub fn locked_beyond(&self, frames: &[FrameId]) -> Self {
        let carried: Vec<usize> = frames.iter().map(|&frame| self.link(frame).body).collect();
        let mut robot = self.clone();
        robot.bodies.clear();
        // For each body, the index of the new robot's body that carries it, and its pose there.
        let mut places: Vec<(usize, Isometry3<f64>)> = Vec::with_capacity(self.bodies.len());
        for (index, (body, end)) in self
            .bodies
            .iter()
            .zip(subtree_ends(&self.bodies))
            .enumerate()
        {
            let above = places.get(body.parent).copied();
            let (parent, parent_from_above) = above.unwrap_or((0, Isometry3::identity()));
            let is_free = carried.iter().any(|body| (index..end).contains(body));
            match &body.joint {
                Some(joint) if !is_free => {
                    let place = parent_from_above * joint.parent_from_zero;
                    places.push((parent, place));
                }
                _ => {
                    places.push((robot.bodies.len(), Isometry3::identity()));
                    robot.bodies.push(Body {
                        parent,
                        ..body.clone()
                    });
                }
            }
        }
        for link in &mut robot.links {
            let (body, body_from_place) = places[link.body];
            link.body_from_link = body_from_place * link.body_from_link;
            link.body = body;
        }
        robot.lump_links();
        robot
    }

    /// Sets the parameters of each body to the sum over its links.
    fn lump_links(&mut self) {
        for body in &mut self.bodies {
            body.parameters = InertialParameters::zero();
        }
        for link in &self.links {
            let body = &mut self.bodies[link.body];
            body.parameters = body.parameters + link.parameters.expressed_in(&link.body_from_link);
        }
    }

    /// Returns the positions of the links below the link of `frame`, which itself is not included.
    pub(crate) fn links_below(&self, frame: FrameId) -> Range<usize> {
        let position = self.position(frame);
        let first = position + 1;
        // In depth-first order a subtree is contiguous; no other link has a parent from its root
        // on.
        let followers = self.links[first..].iter();
        let count = followers.take_while(|link| link.parent >= position).count();
        first..first + count
    }
}
