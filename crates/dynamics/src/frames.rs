//! Motion of frames in the inertial frame, along the chain of bodies that carries them.

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

use crate::placement::{MovingPlacement, Placement, quaternion};
use crate::recursion::{BodyModel, BodyState, JointModel};
use crate::vector::Vec3;
use crate::{
    FrameId, FrameMotion, InertialParameters, JointKind, StateError, ToolMotion, Workspace, Wrench,
};

impl Workspace {
    /// Returns the placement of a frame in the frame of the base.
    pub(crate) fn frame_on_base(&self, frame: FrameId) -> Placement {
        let fixed = &self.frames[self.robot.position(frame)];
        self.placement_above(fixed.placement(), fixed.body, 0)
    }

    /// Returns the motion of a frame in the inertial frame, in one pass over the bodies above it.
    #[must_use]
    pub fn frame_motion(&self, frame: FrameId) -> FrameMotion {
        let fixed = &self.frames[self.robot.position(frame)];
        let state = &self.states[fixed.body];
        let moving = MovingPlacement {
            placement: fixed.placement(),
            velocity: state.angular_velocity.cross(fixed.translation),
        };
        let on_base = self.moving_placement_above(moving, fixed.body);
        let in_world = self.base_placement().followed_by(&on_base.placement);
        let velocity = &self.states[0].rotation * on_base.velocity;
        let seen = fixed.motion(state);
        let turned = |vector: Vec3<f64>| Vector3::from(&in_world.rotation * vector);
        FrameMotion {
            pose: in_world.pose(),
            velocity: Vector3::from(velocity) + self.base_velocity,
            angular_velocity: turned(seen.angular_velocity),
            acceleration: turned(seen.acceleration) + self.gravity,
            angular_acceleration: turned(seen.angular_acceleration),
        }
    }

    /// Returns the motion of a frame as the regressors need it: expressed in the frame itself, the
    /// acceleration less `gravity`, the gravitational acceleration in the inertial frame, m/s²,
    /// pointing down.
    ///
    /// It is [`FrameMotion::in_frame`] of [`frame_motion`](Self::frame_motion), in less time. It
    /// costs a few products where the workspace was last used with the same gravity, and else one
    /// pass over the bodies above the frame.
    #[must_use]
    pub fn tool_motion(&self, frame: FrameId, gravity: &Vector3<f64>) -> ToolMotion {
        let fixed = &self.frames[self.robot.position(frame)];
        let seen = fixed.motion(&self.states[fixed.body]);
        let mut motion = ToolMotion {
            acceleration: seen.acceleration.into(),
            angular_velocity: seen.angular_velocity.into(),
            angular_acceleration: seen.angular_acceleration.into(),
        };
        if *gravity != self.gravity {
            motion.acceleration += self.vector_in_frame(frame, &(self.gravity - gravity));
        }
        motion
    }

    /// Returns `world_from_frame`, the pose of a frame in the inertial frame. The cost is one pass
    /// over the bodies above it.
    #[must_use]
    pub fn pose(&self, frame: FrameId) -> Isometry3<f64> {
        let on_base = self.frame_on_base(frame);
        self.base_placement().followed_by(&on_base).pose()
    }

    /// Returns `world_from_frame`, the rotation of a frame in the inertial frame: that of its
    /// [`pose`](Self::pose), in less time.
    #[must_use]
    pub fn rotation(&self, frame: FrameId) -> UnitQuaternion<f64> {
        let fixed = &self.frames[self.robot.position(frame)];
        let (mut rotation, mut index) = (fixed.rotation, fixed.body);
        while index != 0 {
            rotation = &self.states[index].rotation * &rotation;
            index = self.bodies[index].parent;
        }
        quaternion(&(&self.states[0].rotation * &rotation))
    }

    /// Returns `a_from_b`, the pose of frame `b` in frame `a`. The cost is one pass over the bodies
    /// above either frame that do not carry the other.
    #[must_use]
    pub fn relative_pose(&self, a: FrameId, b: FrameId) -> Isometry3<f64> {
        let [a, b] = [a, b].map(|frame| &self.frames[self.robot.position(frame)]);
        let common = self.common_body(a.body, b.body);
        let [above_a, above_b] =
            [a, b].map(|fixed| self.placement_above(fixed.placement(), fixed.body, common));
        above_a.inverse().followed_by(&above_b).pose()
    }

    /// Returns a wrench expressed in frame `a`, about its origin. `wrench` is expressed in frame
    /// `b`, about its origin. Equals [`Wrench::expressed_in`] with
    /// [`relative_pose`](Self::relative_pose), in less time.
    #[must_use]
    pub fn wrench_in_frame(&self, a: FrameId, b: FrameId, wrench: &Wrench) -> Wrench {
        if a == b {
            return *wrench;
        }
        let [a, b] = [a, b].map(|frame| &self.frames[self.robot.position(frame)]);
        let common = self.common_body(a.body, b.body);
        let mut wrench = b.placement().transform_wrench(wrench);
        let mut index = b.body;
        while index != common {
            wrench = Placement::in_parent(&self.states[index]).transform_wrench(&wrench);
            index = self.bodies[index].parent;
        }
        let above_a = self.placement_above(a.placement(), a.body, common);
        above_a.inverse_transform_wrench(&wrench)
    }

    /// Returns a vector of the inertial frame, such as gravity, expressed in a frame. The cost is
    /// one product for each body above the frame.
    #[must_use]
    pub fn vector_in_frame(&self, frame: FrameId, vector: &Vector3<f64>) -> Vector3<f64> {
        let fixed = &self.frames[self.robot.position(frame)];
        let in_body = self.in_body(fixed.body, vector);
        fixed.rotation.tr_mul(in_body).into()
    }

    /// Returns a vector of the inertial frame in the joint frame of a body.
    pub(crate) fn in_body(&self, index: usize, vector: &Vector3<f64>) -> Vec3<f64> {
        let path = self.bodies[..=index].iter().zip(&self.states);
        let path = path.filter(|(body, _)| body.end > index);
        path.fold(vector.into(), |vector, (_, state)| {
            state.rotation.tr_mul(vector)
        })
    }

    /// Returns the body farthest from the base that carries both; a body carries itself, too.
    fn common_body(&self, a: usize, b: usize) -> usize {
        let (mut common, last) = (a.min(b), a.max(b));
        // In depth-first order, the bodies that one carries have the indices that follow its own.
        while self.bodies[common].end <= last {
            common = self.bodies[common].parent;
        }
        common
    }

    /// Returns the placement of the base in the inertial frame.
    fn base_placement(&self) -> Placement {
        Placement::in_parent(&self.states[0])
    }

    /// Returns the placement of a frame in the joint frame of a body above, where `placement` is
    /// that in the joint frame of the body `index`. In the frame of the base no digits are lost far
    /// from the inertial frame's origin.
    #[inline(always)]
    fn placement_above(
        &self,
        mut placement: Placement,
        mut index: usize,
        above: usize,
    ) -> Placement {
        while index != above {
            placement = Placement::in_parent(&self.states[index]).followed_by(&placement);
            index = self.bodies[index].parent;
        }
        placement
    }

    /// Returns the moving placement of a frame in the frame of the base, where `moving` is that in
    /// the joint frame of the body `index`.
    #[inline(always)]
    fn moving_placement_above(
        &self,
        mut moving: MovingPlacement,
        mut index: usize,
    ) -> MovingPlacement {
        while index != 0 {
            moving = self.moving_placement_in_parent(index).followed_by(&moving);
            index = self.bodies[index].parent;
        }
        moving
    }

    /// Returns the moving placement of a body's joint frame in the parent's joint frame.
    #[inline(always)]
    fn moving_placement_in_parent(&self, index: usize) -> MovingPlacement {
        let parent = &self.states[self.bodies[index].parent];
        MovingPlacement::in_parent(&self.states[index], parent.angular_velocity)
    }

    /// Returns all bodies with their states and placements in the frame of the base. It costs a
    /// product for each body that follows its parent, and a pass over those above it for any other.
    pub(crate) fn placed_bodies(
        &self,
    ) -> impl Iterator<Item = (&BodyModel, &BodyState<f64>, MovingPlacement)> + '_ {
        let mut last: Option<(usize, MovingPlacement)> = None;
        let bodies = self.bodies.iter().zip(&self.states).enumerate();
        bodies.map(move |(index, (body, state))| {
            let placement = match &last {
                Some((above, placement)) if *above == body.parent => {
                    placement.followed_by(&self.moving_placement_in_parent(index))
                }
                _ => self.moving_placement_above(MovingPlacement::identity(), index),
            };
            last = Some((index, placement));
            (body, state, placement)
        })
    }

    /// Computes the geometric Jacobian of a frame, one column for each independent joint: velocity
    /// of the frame's origin (m/s), then angular velocity (rad/s), both expressed in the frame
    /// itself, for a unit velocity of the joint: zero for a joint that does not move the frame.
    ///
    /// Its transpose maps wrenches to joint torques: `τ_j = J_jᵀ [f; n]` is what joint `j` must add
    /// for the wrench `[f; n]`, in the frame and about its origin, to act **on** a body held there.
    ///
    /// The cost is one pass over the bodies above the frame. Nothing is allocated.
    ///
    /// # Errors
    /// Returns [`StateError::Length`] if `columns` has not one entry for each independent joint.
    pub fn jacobian(&self, frame: FrameId, columns: &mut [Vector6<f64>]) -> Result<(), StateError> {
        self.robot.check_count("the Jacobian", columns.len())?;
        columns.fill(Vector6::zeros());
        for (joint, column) in self.jacobian_columns(frame) {
            columns[joint.coordinate] += column * joint.ratio;
        }
        Ok(())
    }

    /// Returns the joints above a frame with the velocity of the frame for a unit velocity of each,
    /// as in [`jacobian`](Self::jacobian).
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
            placement = Placement::in_parent(&self.states[index]).followed_by(&placement);
            index = self.bodies[index].parent;
            let [vx, vy, vz] = linear.into();
            let [wx, wy, wz] = angular.into();
            Some((joint, Vector6::new(vx, vy, vz, wx, wy, wz)))
        })
    }

    /// Returns the links below `frame` as one rigid body, expressed in that frame, at the present
    /// posture. It depends on the joints below the frame. Links that
    /// [`Manipulator::without_subtree`](crate::Manipulator::without_subtree) has removed are
    /// included, so that the robot with and without its end-effector give the same.
    #[must_use]
    pub fn subtree_parameters(&self, frame: FrameId) -> InertialParameters {
        let fixed = &self.frames[self.robot.position(frame)];
        let frame_from_body = fixed.placement().inverse();
        let below = &self.robot.links[self.robot.links_below(frame)];
        let frames = &self.frames[self.robot.links_below(frame)];
        let in_frame = below.iter().zip(frames).map(|(link, below)| {
            let in_body = self.placement_above(below.placement(), below.body, fixed.body);
            let frame_from_link = frame_from_body.followed_by(&in_body).pose();
            (link.parameters + link.removed).expressed_in(&frame_from_link)
        });
        in_frame.sum()
    }
}
