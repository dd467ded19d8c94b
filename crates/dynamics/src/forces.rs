//! Forces and moments between bodies, (21)-(41), and the wrench on an unknown end-effector, (28)-(30) and (42)-(44).

use nalgebra::Vector3;

use crate::Wrench;
use crate::manipulator::{Body, FrameId, JointKind};
use crate::motion::BodyState;
use crate::workspace::Workspace;

/// Computes the force and the moment on every body from its parent, (21)-(41) of Hou et al. 2016, for the motion that
/// the workspace holds, and stores them there. `gravity` is the gravitational acceleration in the inertial frame, m/s²,
/// pointing down; it is zero in orbit.
///
/// A body without mass counts as massless: [`Manipulator::check_masses`](crate::Manipulator::check_masses) reports whether the
/// description of the robot lacks a mass.
///
/// Read the result with [`Workspace::joint_torques`] and [`Workspace::base_wrench`]. The cost is one pass over the
/// bodies outwards and one inwards. Nothing is allocated.
pub fn forces(workspace: &mut Workspace, gravity: &Vector3<f64>) {
    let Workspace {
        robot,
        bodies: states,
        joint_torques,
        has_forces,
    } = workspace;
    for (body, state) in robot.bodies.iter().zip(states.iter_mut()) {
        let inertial = inertial_wrench(body, state, gravity);
        state.force = inertial.force; // f_U = f̂_U, (24), until the children are added
        state.moment = inertial.moment + state.a.cross(&inertial.force); // (37)
    }
    joint_torques.fill(0.0);
    for (index, body) in robot.bodies.iter().enumerate().rev() {
        let Some(joint) = &body.joint else { continue };
        let (before, after) = states.split_at_mut(index);
        let (parent, state) = (&mut before[body.parent], &after[0]);
        // a × f_{i-1} + b × f_i of (34) is a × f̂_{i-1}, added above, and (a + b) × f_i.
        parent.force += state.force; // (22), (23)
        parent.moment += state.moment + state.from_parent.cross(&state.force); // (33), (34)
        let torque = match joint.kind {
            JointKind::Revolute => state.axis.dot(&state.moment), // τ_i = z_i · n_i
            JointKind::Prismatic => state.axis.dot(&state.force),
        };
        joint_torques[joint.coordinate] += joint.ratio * torque;
    }
    *has_forces = true;
}

/// Returns `f̂` and `n̂` of one body in the inertial frame, the moment about its centre of mass, with `-m g` added to
/// `f̂`.
fn inertial_wrench(body: &Body, state: &BodyState, gravity: &Vector3<f64>) -> Wrench {
    let rotation = &state.origin.pose.rotation;
    // The inertia is constant in the body's frame only.
    let w = rotation.inverse_transform_vector(&state.origin.angular_velocity);
    let dw = rotation.inverse_transform_vector(&state.origin.angular_acceleration);
    let moment = body.inertia * dw + w.cross(&(body.inertia * w)); // (38)-(41)
    Wrench {
        force: (state.center_acceleration - gravity) * body.mass_kg, // (25)-(27)
        moment: rotation * moment,
    }
}

/// Returns the wrench on an unknown end-effector that follows from the motion of all other bodies if nothing acts from
/// outside: `f_U = -f_K` by (28)-(30) and `n_U` of (44) in Hou et al. 2016, expressed in the frame `tool` and about its
/// origin.
///
/// The workspace holds the [`motion`](crate::motion()) of the robot without its end-effector, which is
/// [`Manipulator::without_subtree`](crate::Manipulator::without_subtree) of `tool`: the masses of its robot count as
/// known. [`forces`] is not needed. The cost is one pass over the bodies. Nothing is allocated.
#[must_use]
pub fn wrench_on_end_effector(workspace: &Workspace, tool: FrameId) -> Wrench {
    let world_from_tool = workspace.pose(tool);
    let p_u = world_from_tool.translation.vector;
    let mut on_rest = Wrench::zero();
    for (body, state) in workspace.robot.bodies.iter().zip(&workspace.bodies) {
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
