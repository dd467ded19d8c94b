//! Forces and moments between bodies, (21)-(41), and what they say of an unknown end-effector.

use nalgebra::Vector3;

use crate::Wrench;
use crate::manipulator::{Body, FrameId, JointKind, Manipulator};
use crate::motion::{BodyState, Workspace};

/// Computes the force and moment on every body from its parent, (21)-(41), for the motion that the
/// workspace holds. `gravity` is the gravitational acceleration in the inertial frame, m/s²,
/// pointing down; zero in orbit.
///
/// Cost: one pass over the bodies outwards, one inwards, no allocation.
pub fn forces(robot: &Manipulator, workspace: &mut Workspace, gravity: &Vector3<f64>) {
    for (body, state) in robot.bodies.iter().zip(&mut workspace.bodies) {
        let inertial = inertial_wrench(body, state, gravity);
        state.force = inertial.force; // f_U = f̂_U, (24), until the children are added
        state.moment = inertial.moment + state.a.cross(&inertial.force); // (37)
    }
    workspace.joint_torques.fill(0.0);
    for (index, body) in robot.bodies.iter().enumerate().rev() {
        let Some(joint) = &body.joint else { continue };
        let (before, after) = workspace.bodies.split_at_mut(index);
        let (parent, state) = (&mut before[body.parent], &after[0]);
        // a × f_{i-1} + b × f_i of (34) is a × f̂_{i-1}, added above, and (a + b) × f_i.
        parent.force += state.force; // (22), (23)
        parent.moment += state.moment + state.from_parent.cross(&state.force); // (33), (34)
        let torque = match joint.kind {
            JointKind::Revolute => state.axis.dot(&state.moment), // τ_i = z_i · n_i
            JointKind::Prismatic => state.axis.dot(&state.force),
        };
        workspace.joint_torques[joint.coordinate] += joint.ratio * torque;
    }
}

/// `f̂` and `n̂` of one body, about its centre of mass, in the inertial frame.
fn inertial_wrench(body: &Body, state: &BodyState, gravity: &Vector3<f64>) -> Wrench {
    let rotation = &state.origin.pose.rotation;
    // I is constant in the body's frame alone.
    let w = rotation.inverse_transform_vector(&state.origin.angular_velocity);
    let dw = rotation.inverse_transform_vector(&state.origin.angular_acceleration);
    let moment = body.inertia * dw + w.cross(&(body.inertia * w)); // (38)-(41)
    Wrench {
        force: (state.center_acceleration - gravity) * body.mass_kg, // (25)-(27)
        moment: rotation * moment,
    }
}

impl Workspace {
    /// Torque of each joint (force of a prismatic one) along its axis on the link it moves, N m or
    /// N, as [`forces`] found it. A mimic joint's torque counts towards the joint it follows.
    #[must_use]
    pub fn joint_torques(&self) -> &[f64] {
        &self.joint_torques
    }

    /// What the outside must apply to the base for this motion, about the base frame's origin, in
    /// the inertial frame; zero for a free-floating robot whose motion is its own.
    #[must_use]
    pub fn base_wrench(&self) -> Wrench {
        Wrench {
            force: self.bodies[0].force,
            moment: self.bodies[0].moment,
        }
    }
}

/// The wrench on an unknown end-effector that the motion of all the rest implies when nothing acts
/// from outside: `f_U = -f_K` of (30) and `n_U` of (44), in the frame `tool` and about its origin.
///
/// `robot` is the robot without its end-effector, [`Manipulator::without_subtree`] of `tool`, and the
/// workspace holds the [`motion`](crate::motion()) of that same robot: the full robot's workspace
/// has other centres of mass. [`forces`] is not needed.
#[must_use]
pub fn wrench_on_end_effector(robot: &Manipulator, workspace: &Workspace, tool: FrameId) -> Wrench {
    let world_from_tool = workspace.pose(robot, tool);
    let p_u = world_from_tool.translation.vector;
    let mut on_rest = Wrench::zero();
    for (body, state) in robot.bodies.iter().zip(&workspace.bodies) {
        let inertial = inertial_wrench(body, state, &Vector3::zeros());
        on_rest.force += inertial.force; // f_K, below (29)
        on_rest.moment += inertial.moment + (state.center - p_u).cross(&inertial.force); // -n_U, (44)
    }
    let tool_from_world = world_from_tool.rotation.inverse();
    Wrench {
        force: tool_from_world * -on_rest.force,
        moment: tool_from_world * -on_rest.moment,
    }
}
