//! Momentum of the whole robot, and the base's motion that follows from its conservation.

use nalgebra::{Matrix3, Vector3};

use crate::manipulator::Manipulator;
use crate::motion::{JointMotion, Workspace, motion};
use crate::{FrameMotion, StateError, Wrench, cross, forces};

/// Momentum in the inertial frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum {
    /// Linear, kg m/s.
    pub linear: Vector3<f64>,
    /// Angular, about the inertial frame's origin, kg m²/s.
    pub angular: Vector3<f64>,
}

/// Total momentum of the robot in the motion that the workspace holds.
#[must_use]
pub fn momentum(robot: &Manipulator, workspace: &Workspace) -> Momentum {
    let mut total = Momentum {
        linear: Vector3::zeros(),
        angular: Vector3::zeros(),
    };
    for (body, state) in robot.bodies.iter().zip(&workspace.bodies) {
        let rotation = &state.origin.pose.rotation;
        let spin = rotation.inverse() * state.origin.angular_velocity;
        let linear = state.center_velocity * body.mass_kg;
        total.linear += linear;
        total.angular += state.center.cross(&linear) + rotation * (body.inertia * spin);
    }
    total
}

/// The base's acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseAcceleration {
    /// Classical acceleration of the base frame's origin in the inertial frame, m/s².
    pub linear: Vector3<f64>,
    /// Angular acceleration in the inertial frame, rad/s².
    pub angular: Vector3<f64>,
}

/// How a free-floating base accelerates when its joints do as `joints` says and nothing acts from
/// outside: what makes the sum of (28) and the total moment zero. The accelerations in `base` are
/// not read. Leaves the workspace with the motion and the forces that result.
///
/// Cost: two passes for the motion, two for the forces, one 3x3 solution; no allocation.
///
/// # Errors
/// Where a slice does not have one entry for each joint.
pub fn base_acceleration(
    robot: &Manipulator,
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
) -> Result<BaseAcceleration, StateError> {
    let mut base = FrameMotion {
        acceleration: Vector3::zeros(),
        angular_acceleration: Vector3::zeros(),
        ..*base
    };
    motion(robot, workspace, &base, joints)?;
    forces(robot, workspace, &Vector3::zeros());
    let needed = workspace.base_wrench();
    let acceleration = acceleration_that_cancels(robot, workspace, &needed);
    (base.acceleration, base.angular_acceleration) = (acceleration.linear, acceleration.angular);
    motion(robot, workspace, &base, joints)?;
    forces(robot, workspace, &Vector3::zeros());
    Ok(acceleration)
}

/// Solves the locked robot's Newton-Euler equations about its centre of mass.
fn acceleration_that_cancels(
    robot: &Manipulator,
    workspace: &Workspace,
    needed: &Wrench,
) -> BaseAcceleration {
    let p_b = workspace.bodies[0].origin.pose.translation.vector;
    let states = || robot.bodies.iter().zip(&workspace.bodies);
    let mass: f64 = robot.mass();
    let first_moment: Vector3<f64> = states()
        .map(|(body, state)| (state.center - p_b) * body.mass_kg)
        .sum();
    let c = first_moment / mass;
    let inertia: Matrix3<f64> = states()
        .map(|(body, state)| {
            let rotation = state.origin.pose.rotation.to_rotation_matrix().into_inner();
            let arm = cross(&(state.center - p_b - c));
            rotation * body.inertia * rotation.transpose() - arm * arm * body.mass_kg
        })
        .sum();
    let about_center = needed.moment - c.cross(&needed.force);
    // A robot with mass has an inertia that can be inverted, but for a lone point: that one cannot
    // be turned by any moment.
    let angular = inertia
        .cholesky()
        .map_or_else(Vector3::zeros, |factor| -factor.solve(&about_center));
    BaseAcceleration {
        linear: -needed.force / mass - angular.cross(&c),
        angular,
    }
}
