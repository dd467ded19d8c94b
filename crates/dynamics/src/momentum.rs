//! Momentum of the whole robot, and the motion of the base that follows from its conservation.

use nalgebra::{Matrix3, Vector3};

use crate::vector::Vec3;
use crate::workspace::{JointMotion, Workspace, inverse_dynamics};
use crate::{FrameMotion, InertialParameters, StateError, Wrench};

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
    let base = &workspace.states[0];
    let base_velocity = base.rotation.tr_mul((&workspace.base_velocity).into());
    let of_bodies = workspace.placed_bodies().map(|(body, state, moving)| {
        let placement = moving.placement;
        let velocity = placement.rotation.tr_mul(base_velocity + moving.velocity);
        let (linear, angular) = body.momentum(velocity, state.angular_velocity);
        placement.of_wrench(&Wrench {
            force: linear.into(),
            moment: angular.into(),
        })
    });
    let on_base = of_bodies.fold(Wrench::zero(), |sum, one| sum + one);
    let linear = Vector3::from(&base.rotation * Vec3::from(&on_base.force));
    let angular = Vector3::from(&base.rotation * Vec3::from(&on_base.moment));
    Momentum {
        linear,
        angular: angular + Vector3::from(base.translation).cross(&linear),
    }
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
    let zero_gravity = Vector3::zeros();
    inverse_dynamics(workspace, &base, joints, &zero_gravity)?;
    let acceleration = acceleration_that_cancels(workspace);
    (base.acceleration, base.angular_acceleration) = (acceleration.linear, acceleration.angular);
    inverse_dynamics(workspace, &base, joints, &zero_gravity)?;
    Ok(acceleration)
}

/// Solves the Newton-Euler equations of the robot with locked joints about its centre of mass, for the base
/// acceleration that makes the present wrench on the base zero.
fn acceleration_that_cancels(workspace: &Workspace) -> BaseAcceleration {
    let base = &workspace.states[0];
    let (force, moment) = (Vector3::from(base.force), Vector3::from(base.moment));
    let bodies = workspace.placed_bodies();
    let whole: InertialParameters = bodies
        .map(|(body, _, at)| at.placement.parameters_of(body))
        .sum();
    let mass = whole.mass();
    let c = whole.first_moment() / mass;
    let inertia = whole
        .mass_properties()
        .map_or_else(Matrix3::zeros, |body| body.inertia);
    // The inertia of a robot with mass is invertible, except that of a point mass, which no moment can turn.
    let angular = inertia.cholesky().map_or_else(Vector3::zeros, |factor| {
        -factor.solve(&(moment - c.cross(&force)))
    });
    let linear = -force / mass - angular.cross(&c);
    let in_world = |vector: Vector3<f64>| Vector3::from(&base.rotation * Vec3::from(&vector));
    BaseAcceleration {
        linear: in_world(linear),
        angular: in_world(angular),
    }
}
