//! Motion of frames in the inertial frame, along the chain of bodies that carries them.

use nalgebra::{Isometry3, Vector3, Vector6};

use crate::placement::Placement;
use crate::recursion::{BodyModel, BodyState, JointModel};
use crate::vector::Vec3;
use crate::{
    FrameId, FrameMotion, InertialParameters, JointKind, StateError, ToolMotion, Workspace,
};

impl Workspace {
    /// Returns the placement of a frame in the frame of the base.
    pub(crate) fn frame_on_base(&self, frame: FrameId) -> Placement {
        let fixed = &self.frames[self.robot.position(frame)];
        self.placement_on_base(fixed.body)
            .followed_by(&fixed.placement())
    }

    /// Returns the motion of a frame, expressed in the inertial frame. The cost is one pass over the bodies above it.
    #[must_use]
    pub fn frame_motion(&self, frame: FrameId) -> FrameMotion {
        let fixed = &self.frames[self.robot.position(frame)];
        let state = &self.states[fixed.body];
        let body = self.placement(fixed.body);
        let arm_velocity = state.angular_velocity.cross(fixed.translation);
        let acceleration = state.acceleration + &state.omega_matrix * fixed.translation;
        let in_world = |vector| Vector3::from(&body.rotation * vector);
        FrameMotion {
            pose: body.pose() * fixed.joint_from_frame,
            velocity: Vector3::from(body.velocity) + in_world(arm_velocity),
            angular_velocity: in_world(state.angular_velocity),
            acceleration: in_world(acceleration) + self.gravity,
            angular_acceleration: in_world(state.angular_acceleration),
        }
    }

    /// Returns the motion of a frame as the regressors need it: expressed in the frame itself, the acceleration less
    /// `gravity`, the gravitational acceleration in the inertial frame, m/s², pointing down.
    ///
    /// It is [`FrameMotion::in_frame`] of [`frame_motion`](Self::frame_motion), in less time. The cost is that of a few
    /// products where the workspace was last used with the same gravity, and else one pass over the bodies above the frame.
    #[must_use]
    pub fn tool_motion(&self, frame: FrameId, gravity: &Vector3<f64>) -> ToolMotion {
        let fixed = &self.frames[self.robot.position(frame)];
        let state = &self.states[fixed.body];
        let mut acceleration = state.acceleration + &state.omega_matrix * fixed.translation;
        if *gravity != self.gravity {
            acceleration = acceleration + self.in_body(fixed.body, &(self.gravity - gravity));
        }
        let in_frame = |vector| fixed.rotation.tr_mul(vector).into();
        ToolMotion {
            acceleration: in_frame(acceleration),
            angular_velocity: in_frame(state.angular_velocity),
            angular_acceleration: in_frame(state.angular_acceleration),
        }
    }

    /// Returns `world_from_frame`, the pose of a frame in the inertial frame. The cost is one pass over the bodies above it.
    #[must_use]
    pub fn pose(&self, frame: FrameId) -> Isometry3<f64> {
        let fixed = &self.frames[self.robot.position(frame)];
        self.placement(fixed.body).pose() * fixed.joint_from_frame
    }

    /// Returns a vector of the inertial frame in the joint frame of a body.
    pub(crate) fn in_body(&self, index: usize, vector: &Vector3<f64>) -> Vec3<f64> {
        self.placement(index).rotation.tr_mul(vector.into())
    }

    /// Returns the placement of a body's joint frame in the inertial frame.
    fn placement(&self, index: usize) -> Placement {
        let mut base = Placement::in_parent(&self.states[0], Vec3([0.0; 3]));
        base.velocity = (&self.base_velocity).into();
        match index {
            0 => base,
            _ => base.followed_by(&self.placement_on_base(index)),
        }
    }

    /// Returns the placement of a body's joint frame in the frame of the base, in which no digits are lost far from the
    /// inertial frame's origin.
    fn placement_on_base(&self, index: usize) -> Placement {
        if index == 0 {
            return Placement::identity();
        }
        let mut placement = self.placement_on_parent(index);
        let mut above = self.bodies[index].parent;
        while above > 0 {
            placement = self.placement_on_parent(above).followed_by(&placement);
            above = self.bodies[above].parent;
        }
        placement
    }

    /// Returns the placement of a body's joint frame in that of its parent.
    #[inline(always)]
    fn placement_on_parent(&self, index: usize) -> Placement {
        let parent = &self.states[self.bodies[index].parent];
        Placement::in_parent(&self.states[index], parent.angular_velocity)
    }

    /// Returns all bodies with their states and placements in the frame of the base. The cost is one product for each body
    /// that follows its parent, and one pass over those above it for any other.
    pub(crate) fn placed_bodies(
        &self,
    ) -> impl Iterator<Item = (&BodyModel, &BodyState<f64>, Placement)> + '_ {
        let mut last: Option<(usize, Placement)> = None;
        let bodies = self.bodies.iter().zip(&self.states).enumerate();
        bodies.map(move |(index, (body, state))| {
            let placement = match &last {
                Some((above, placement)) if *above == body.parent => {
                    placement.followed_by(&self.placement_on_parent(index))
                }
                _ => self.placement_on_base(index),
            };
            last = Some((index, placement));
            (body, state, placement)
        })
    }

    /// Computes the geometric Jacobian of a frame, one column for each independent joint: velocity of the frame's
    /// origin (m/s), then angular velocity (rad/s), both expressed in the frame itself, for a unit velocity of the joint.
    /// The column of a joint that does not move the frame is zero.
    ///
    /// Its transpose maps wrenches to joint torques: `τ_j = J_jᵀ [f; n]` is what joint `j` must add for the wrench
    /// `[f; n]`, expressed in the frame and about its origin, to act **on** a body held there.
    ///
    /// The cost is one pass over the bodies above the frame. Nothing is allocated.
    ///
    /// # Errors
    /// Returns [`StateError::Length`] if `columns` does not have one entry for each independent joint.
    pub fn jacobian(&self, frame: FrameId, columns: &mut [Vector6<f64>]) -> Result<(), StateError> {
        self.robot.check_count("the Jacobian", columns.len())?;
        columns.fill(Vector6::zeros());
        for (joint, column) in self.jacobian_columns(frame) {
            columns[joint.coordinate] += column * joint.ratio;
        }
        Ok(())
    }

    /// Returns the joints above a frame with the velocity of the frame for a unit velocity of each, as in
    /// [`jacobian`](Self::jacobian).
    pub(crate) fn jacobian_columns(
        &self,
        frame: FrameId,
    ) -> impl Iterator<Item = (&JointModel, Vector6<f64>)> + '_ {
        let fixed = &self.frames[self.robot.position(frame)];
        let mut placement = fixed.placement();
        let mut index = fixed.body;
        std::iter::from_fn(move || {
            let joint = self.bodies[index].joint.as_ref()?;
            // Rows of the rotation are the axes of the joint frame, expressed in the frame.
            let [x_axis, y_axis, z_axis] = placement.rotation.0.map(Vector3::from);
            let [x, y, _] = placement.position.0;
            let (linear, angular) = match joint.kind {
                JointKind::Revolute => (y_axis * x - x_axis * y, z_axis), // z × p
                JointKind::Prismatic => (z_axis, Vector3::zeros()),
            };
            placement = self.placement_on_parent(index).followed_by(&placement);
            index = self.bodies[index].parent;
            let [vx, vy, vz] = linear.into();
            let [wx, wy, wz] = angular.into();
            Some((joint, Vector6::new(vx, vy, vz, wx, wy, wz)))
        })
    }

    /// Returns the links below `frame` as one rigid body, expressed in that frame, at the present posture. It depends
    /// on the joints below the frame. Links that [`Manipulator::without_subtree`](crate::Manipulator::without_subtree) has
    /// removed are included, so that the robot with and without its end-effector give the same.
    #[must_use]
    pub fn subtree_parameters(&self, frame: FrameId) -> InertialParameters {
        let frame_from_world = self.pose(frame).inverse();
        let below = &self.robot.links[self.robot.links_below(frame)];
        let frames = &self.frames[self.robot.links_below(frame)];
        let in_frame = below.iter().zip(frames).map(|(link, fixed)| {
            let world_from_link = self.placement(fixed.body).pose() * fixed.joint_from_frame;
            (link.parameters + link.removed).expressed_in(&(frame_from_world * world_from_link))
        });
        in_frame.sum()
    }
}
