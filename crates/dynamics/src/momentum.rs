//! Momentum of the whole robot, and the motion of the base that follows from its conservation.

use nalgebra::{Cholesky, Const, Isometry3, Vector3};

use crate::placement::MovingPlacement;
use crate::recursion::{BodyModel, BodyState};
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

/// Returns the linear and the angular momentum of the robot, in the places of force and moment, in
/// the frame of the base and about its origin.
fn momentum_about_base(workspace: &Workspace) -> Wrench {
    let base = &workspace.states[0];
    let base_velocity = base.rotation.tr_mul((&workspace.base_velocity).into());
    let of_bodies = workspace
        .placed_bodies()
        .map(|(body, state, moving)| momentum_of(body, state, &moving, base_velocity));
    of_bodies.fold(Wrench::zero(), |sum, one| sum + one)
}

/// Returns a body's momentum in the frame of the base, as `base_velocity`, about its origin.
fn momentum_of(
    body: &BodyModel,
    state: &BodyState<f64>,
    moving: &MovingPlacement,
    base_velocity: Vec3<f64>,
) -> Wrench {
    let placement = moving.placement;
    let velocity = placement.rotation.tr_mul(base_velocity + moving.velocity);
    let (linear, angular) = body.momentum(velocity, state.angular_velocity);
    placement.transform_wrench(&Wrench {
        force: linear.into(),
        moment: angular.into(),
    })
}

/// Computes the motion of a free-floating base for a motion of its joints if the robot started at
/// rest and nothing acts from outside: the velocity for which the momentum vanishes, and the
/// acceleration for which the wrench on the base does. `pose` is the pose of the base in the
/// inertial frame.
///
/// The workspace then holds the motion and its forces. The cost is three passes for the motion, one
/// for the momentum, two for the forces and the solution of two 3x3 systems. Nothing is allocated.
///
/// # Errors
/// Returns [`StateError::Length`] if a slice does not have one entry for each independent joint.
pub fn free_base_motion(
    workspace: &mut Workspace,
    pose: &Isometry3<f64>,
    joints: JointMotion<'_>,
) -> Result<FrameMotion, StateError> {
    FreeRobot::new(workspace, joints)?.base_motion(workspace, pose, joints)
}

/// Momentum and inertia of a robot on a base at rest, from which [`free_base_motion`] follows, also
/// with an additional body: where one motion is computed with many payloads, each costs four of the
/// six passes over the bodies.
#[derive(Clone, Copy, Debug)]
pub struct FreeRobot {
    /// Linear and angular momentum as force and moment, in the base's frame and about its origin.
    momentum: Wrench,
    /// Robot with locked joints, in the frame of the base.
    whole: InertialParameters,
}

impl FreeRobot {
    /// Computes momentum and inertia for a motion of the joints. The workspace then holds the
    /// motion with the base at rest at the origin of the inertial frame.
    ///
    /// # Errors
    /// Returns [`StateError::Length`] if a slice does not have one entry for each independent
    /// joint.
    pub fn new(workspace: &mut Workspace, joints: JointMotion<'_>) -> Result<Self, StateError> {
        motion(
            workspace,
            &FrameMotion::at_rest(Isometry3::identity()),
            joints,
        )?;
        let mut robot = Self {
            momentum: Wrench::zero(),
            whole: InertialParameters::zero(),
        };
        for (body, state, moving) in workspace.placed_bodies() {
            robot.momentum = robot.momentum + momentum_of(body, state, &moving, Vec3([0.0; 3]));
            robot.whole = robot.whole + moving.placement.parameters_of(body);
        }
        Ok(robot)
    }

    /// Returns momentum and inertia of the robot with an additional body, which may be the
    /// difference of two payloads. `frame` is the motion of the body's frame in the workspace of
    /// [`new`](Self::new), and `body` is expressed in that frame.
    #[must_use]
    pub fn with_body(&self, frame: &FrameMotion, body: &InertialParameters) -> Self {
        let in_frame = |vector: &Vector3<f64>| frame.pose.rotation.inverse() * vector;
        let velocity = in_frame(&frame.velocity);
        let angular_velocity = in_frame(&frame.angular_velocity);
        let first_moment = body.first_moment();
        let turning = body.inertia_about_origin() * angular_velocity;
        let linear = velocity * body.mass() + angular_velocity.cross(&first_moment);
        let angular = turning + first_moment.cross(&velocity);
        let force = frame.pose.rotation * linear;
        let lever = frame.pose.translation.vector;
        let momentum = Wrench {
            force,
            moment: frame.pose.rotation * angular + lever.cross(&force),
        };
        Self {
            momentum: self.momentum + momentum,
            whole: self.whole + body.expressed_in(&frame.pose),
        }
    }

    /// Computes the motion of the base as [`free_base_motion`] does, in the workspace of the robot
    /// with this payload.
    ///
    /// The workspace then holds the resulting motion and its forces. The cost is two passes for the
    /// motion, two for the forces and the solution of two 3x3 systems. Nothing is allocated.
    ///
    /// # Errors
    /// Returns [`StateError::Length`] if a slice does not have one entry for each independent
    /// joint.
    pub fn base_motion(
        &self,
        workspace: &mut Workspace,
        pose: &Isometry3<f64>,
        joints: JointMotion<'_>,
    ) -> Result<FrameMotion, StateError> {
        let locked = LockedRobot::of(&self.whole);
        let mut base = FrameMotion::at_rest(*pose);
        let (linear, angular) = locked.twist_that_cancels(&self.momentum);
        base.velocity = pose.rotation * linear;
        base.angular_velocity = pose.rotation * angular;
        let on_base = wrench_without_acceleration(workspace, &base, joints)?;
        let acceleration = locked.twist_that_cancels(&on_base);
        let found = accelerate(workspace, &base, joints, acceleration)?;
        (base.acceleration, base.angular_acceleration) = (found.linear, found.angular);
        Ok(base)
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

/// Computes the acceleration of a free-floating base for a motion of its joints if nothing acts
/// from outside: the acceleration for which the sum of forces (28) and the total moment vanish. The
/// accelerations in `base` are ignored.
///
/// The workspace then holds the resulting motion and its forces. The cost is two passes for the
/// motion, two for the forces and the solution of one 3x3 system. Nothing is allocated.
///
/// # Errors
/// Returns [`StateError::Length`] if a slice does not have one entry for each independent joint.
pub fn base_acceleration(
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
) -> Result<BaseAcceleration, StateError> {
    let on_base = wrench_without_acceleration(workspace, base, joints)?;
    let bodies = workspace.placed_bodies();
    let whole = bodies.map(|(body, _, at)| at.placement.parameters_of(body));
    let locked = LockedRobot::of(&whole.sum());
    accelerate(workspace, base, joints, locked.twist_that_cancels(&on_base))
}

/// Returns the wrench on the base, in its own frame, if the base does not accelerate.
fn wrench_without_acceleration(
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
) -> Result<Wrench, StateError> {
    let base = FrameMotion {
        acceleration: Vector3::zeros(),
        angular_acceleration: Vector3::zeros(),
        ..*base
    };
    inverse_dynamics(workspace, &base, joints, &Vector3::zeros())?;
    let of_base = &workspace.states[0];
    Ok(Wrench {
        force: of_base.force.into(),
        moment: of_base.moment.into(),
    })
}

/// Accelerates the base, by a linear and an angular acceleration in its own frame, and returns both
/// in the inertial frame.
fn accelerate(
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
    (linear, angular): (Vector3<f64>, Vector3<f64>),
) -> Result<BaseAcceleration, StateError> {
    let (linear, angular) = (base.pose.rotation * linear, base.pose.rotation * angular);
    let base = FrameMotion {
        acceleration: linear,
        angular_acceleration: angular,
        ..*base
    };
    inverse_dynamics(workspace, &base, joints, &Vector3::zeros())?;
    Ok(BaseAcceleration { linear, angular })
}

/// Ratio of two pivots of an inertia below which its mass is on a line: the square root of the
/// rounding of its entries.
const LEAST_PIVOT: f64 = 1e-7;

/// A robot with locked joints: one rigid body, in the frame of the base.
struct LockedRobot {
    mass: f64,
    center_of_mass: Vector3<f64>,
    /// Factor of the inertia about the centre of mass. It does not exist where all mass is on a
    /// line, about which no moment turns it: such a robot is taken not to turn at all.
    inertia: Option<Cholesky<f64, Const<3>>>,
}

impl LockedRobot {
    fn of(whole: &InertialParameters) -> Self {
        let mass = whole.mass();
        let body = whole.mass_properties();
        Self {
            mass,
            center_of_mass: whole.first_moment() / mass,
            inertia: body
                .and_then(|body| body.inertia.cholesky())
                .filter(|factor| {
                    let pivots = factor.l_dirty().diagonal();
                    pivots.min() > LEAST_PIVOT * pivots.max()
                }),
        }
    }

    /// Returns the linear and angular velocity of the base, in its own frame, that reduce a
    /// momentum to zero. `on_base` is the momentum in this frame and about its origin. For a wrench
    /// in its place, the result is an acceleration.
    fn twist_that_cancels(&self, on_base: &Wrench) -> (Vector3<f64>, Vector3<f64>) {
        let (force, moment) = (on_base.force, on_base.moment);
        let c = self.center_of_mass;
        let angular = self.inertia.as_ref().map_or_else(Vector3::zeros, |factor| {
            -factor.solve(&(moment - c.cross(&force)))
        });
        (-force / self.mass - angular.cross(&c), angular)
    }
}
