//! Momentum of the whole robot, and the motion of the base that follows from its conservation.

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::vector::Vec3;
use crate::workspace::{JointMotion, Workspace, inverse_dynamics, motion};
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
    let on_base = momentum_about_base(workspace);
    let linear = Vector3::from(&base.rotation * Vec3::from(&on_base.force));
    let angular = Vector3::from(&base.rotation * Vec3::from(&on_base.moment));
    Momentum {
        linear,
        angular: angular + Vector3::from(base.translation).cross(&linear),
    }
}

/// Returns the linear and the angular momentum of the robot, in the places of force and moment, in the frame of the base and
/// about its origin.
fn momentum_about_base(workspace: &Workspace) -> Wrench {
    let base = &workspace.states[0];
    let base_velocity = base.rotation.tr_mul((&workspace.base_velocity).into());
    let of_bodies = workspace.placed_bodies().map(|(body, state, moving)| {
        let placement = moving.placement;
        let velocity = placement.rotation.tr_mul(base_velocity + moving.velocity);
        let (linear, angular) = body.momentum(velocity, state.angular_velocity);
        placement.transform_wrench(&Wrench {
            force: linear.into(),
            moment: angular.into(),
        })
    });
    of_bodies.fold(Wrench::zero(), |sum, one| sum + one)
}

/// Computes the motion of a free-floating base for a motion of its joints if the robot started at rest and nothing acts from
/// outside: the velocity for which the momentum vanishes, and the acceleration for which the wrench on the base does.
/// `pose` is the pose of the base in the inertial frame.
///
/// The workspace then holds the resulting motion and its forces. The cost is three passes for the motion, two for the
/// forces and the solution of two 3x3 systems. Nothing is allocated.
///
/// # Errors
/// Returns [`StateError::Length`] if a slice does not have one entry for each independent joint.
pub fn free_base_motion(
    workspace: &mut Workspace,
    pose: &Isometry3<f64>,
    joints: JointMotion<'_>,
) -> Result<FrameMotion, StateError> {
    let mut base = FrameMotion::at_rest(*pose);
    motion(workspace, &base, joints)?;
    let twist = twist_that_cancels(workspace, &momentum_about_base(workspace));
    (base.velocity, base.angular_velocity) = twist;
    let acceleration = base_acceleration(workspace, &base, joints)?;
    (base.acceleration, base.angular_acceleration) = (acceleration.linear, acceleration.angular);
    Ok(base)
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
    let of_base = &workspace.states[0];
    let on_base = Wrench {
        force: of_base.force.into(),
        moment: of_base.moment.into(),
    };
    let (linear, angular) = twist_that_cancels(workspace, &on_base);
    (base.acceleration, base.angular_acceleration) = (linear, angular);
    inverse_dynamics(workspace, &base, joints, &zero_gravity)?;
    Ok(BaseAcceleration { linear, angular })
}

/// Returns the linear and angular velocity of the base, in the inertial frame, that reduce a momentum of the robot with
/// locked joints to zero. `on_base` is the momentum in the frame of the base and about its origin. For a wrench in its
/// place, the result is an acceleration.
fn twist_that_cancels(workspace: &Workspace, on_base: &Wrench) -> (Vector3<f64>, Vector3<f64>) {
    let base = &workspace.states[0];
    let (force, moment) = (on_base.force, on_base.moment);
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
    (in_world(linear), in_world(angular))
}
