//! Robots that are derived from another: with one more frame, with a payload, without a subtree.

use std::ops::Range;

use nalgebra::Isometry3;

use crate::{FrameId, InertialParameters, Manipulator};

impl Manipulator {
    /// Returns the robot with a massless link attached rigidly to the link of `parent` as its last child, for instance
    /// a sensor that the URDF does not contain. `parent_from_frame` is the pose of the new link's frame.
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

    /// Returns the robot with a body attached rigidly to the link of `frame`. `payload` is expressed in that frame,
    /// with the inertia about its origin.
    #[must_use]
    pub fn with_payload(&self, frame: FrameId, payload: &InertialParameters) -> Self {
        let mut robot = self.clone();
        let link = &mut robot.links[self.position(frame)];
        link.parameters = link.parameters + *payload;
        let body = &mut robot.bodies[link.body];
        body.parameters = body.parameters + payload.expressed_in(&link.body_from_link);
        robot
    }

    /// Returns the robot without the masses of the links below `frame`: the model of its known part where the
    /// end-effector counts as unknown. The link of `frame` keeps its mass, and all joints stay.
    #[must_use]
    pub fn without_subtree(&self, frame: FrameId) -> Self {
        let mut robot = self.clone();
        for link in &mut robot.links[self.links_below(frame)] {
            link.removed = link.removed + link.parameters;
            link.parameters = InertialParameters::zero();
        }
        let mut lumped = vec![InertialParameters::zero(); robot.bodies.len()];
        for link in &robot.links {
            lumped[link.body] =
                lumped[link.body] + link.parameters.expressed_in(&link.body_from_link);
        }
        for (body, parameters) in robot.bodies.iter_mut().zip(lumped) {
            body.parameters = parameters;
        }
        robot
    }

    /// Returns the positions of the links below the link of `frame`, which itself is not included.
    pub(crate) fn links_below(&self, frame: FrameId) -> Range<usize> {
        let position = self.position(frame);
        let first = position + 1;
        // In depth-first order a subtree is contiguous, and its links alone have parents at or after its root.
        let followers = self.links[first..].iter();
        let count = followers.take_while(|link| link.parent >= position).count();
        first..first + count
    }
}
