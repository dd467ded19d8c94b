//! Momentum of the whole robot, and the motion of the base that follows from its conservation.

use nalgebra::{Matrix3, Vector3};

use crate::motion::JointMotion;
use crate::workspace::Workspace;
use crate::workspace::motion;
use crate::{FrameMotion, StateError, Wrench, cross, forces};

/// Momentum of a robot, expressed in the inertial frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum {
    /// Linear momentum, kg m/s.
    pub linear: Vector3<f64>,
    /// Angular momentum about the inertial frame's origin, kg m²/s.
    pub angular: Vector3<f64>,
}

/// Returns the total momentum of the robot in the motion that the workspace holds.
///
/// The cost is one pass over the bodies. Nothing is allocated.
#[must_use]
pub fn momentum(workspace: &Workspace) -> Momentum {
    let mut total = Momentum {
        linear: Vector3::zeros(),
        angular: Vector3::zeros(),
    };
    for (body, state) in workspace.robot.bodies.iter().zip(&workspace.bodies) {
        let rotation = &state.origin.pose.rotation;
        let spin = rotation.inverse() * state.origin.angular_velocity;
        let linear = state.center_velocity * body.mass_kg;
        total.linear += linear;
        total.angular += state.center.cross(&linear) + rotation * (body.inertia * spin);
    }
    total
}

/// Acceleration of the base, expressed in the inertial frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseAcceleration {
    /// Classical acceleration of the base frame's origin, m/s².
    pub linear: Vector3<f64>,
    /// Angular acceleration, rad/s².
    pub angular: Vector3<f64>,
}

/// Computes the acceleration of a free-floating base for a motion of its joints if nothing acts from outside: the
/// acceleration for which the sum of forces (28) and the total moment vanish. The accelerations in `base` are ignored.
///
/// The workspace then holds the resulting motion and its forces. The cost is two passes for the motion, two for the
/// forces and the solution of one 3x3 system. Nothing is allocated.
///
/// # Errors
/// Returns [`StateError::Length`] if a slice does not have one entry for each independent joint.
pub fn base_acceleration(
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
) -> Result<BaseAcceleration, StateError> {
    let mut base = FrameMotion {
        acceleration: Vector3::zeros(),
        angular_acceleration: Vector3::zeros(),
        ..*base
    };
    motion(workspace, &base, joints)?;
    forces(workspace, &Vector3::zeros());
    let needed = workspace.base_wrench()?;
    let acceleration = acceleration_that_cancels(workspace, &needed);
    (base.acceleration, base.angular_acceleration) = (acceleration.linear, acceleration.angular);
    motion(workspace, &base, joints)?;
    forces(workspace, &Vector3::zeros());
    Ok(acceleration)
}

/// Solves the Newton-Euler equations of the robot with locked joints about its centre of mass, for the base
/// acceleration that makes the wrench `needed` on the base, in the inertial frame and about the base's origin, zero.
fn acceleration_that_cancels(workspace: &Workspace, needed: &Wrench) -> BaseAcceleration {
    let robot = &workspace.robot;
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
    // The inertia of a robot with mass is invertible, except that of a point mass, which no moment can turn.
    let angular = inertia
        .cholesky()
        .map_or_else(Vector3::zeros, |factor| -factor.solve(&about_center));
    BaseAcceleration {
        linear: -needed.force / mass - angular.cross(&c),
        angular,
    }
}
