//! The state that computations over a manipulator share: motion and forces of every body.

use nalgebra::{Isometry3, Vector3};

use crate::manipulator::Manipulator;
use crate::placement::FixedFrame;
use crate::recursion::{
    BaseMotion, BodyModel, BodyState, JointModel, JointState, JointStates, JointTorques, inward,
    matrix, outward,
};
use crate::virtual_work::RegressorState;
use crate::{FrameMotion, StateError, Wrench};

/// Position, velocity and acceleration of the independent joints, each in the order of
/// [`Manipulator::joint_names`](crate::Manipulator::joint_names).
#[derive(Clone, Copy, Debug)]
pub struct JointMotion<'a> {
    /// `θ`: positions, rad (m for a prismatic joint).
    pub position: &'a [f64],
    /// `θ̇`: velocities, rad/s (m/s for a prismatic joint).
    pub velocity: &'a [f64],
    /// `θ̈`: accelerations, rad/s² (m/s² for a prismatic joint).
    pub acceleration: &'a [f64],
}

/// State of a [`Manipulator`]: the motion of every body and, once computed, the forces.
///
/// A workspace owns a copy of its robot, so that it cannot be used with another one. It always
/// holds a motion: [`Workspace::new`] starts with the robot at rest at joint positions zero, its
/// base at the inertial frame, and [`motion`](crate::motion()) replaces that.
/// [`forces`](crate::forces()) adds its forces. After construction nothing allocates.
///
/// ```
/// use nalgebra::{Isometry3, Vector3};
/// use tactid_dynamics::{
///     BaseKind, FrameMotion, JointMotion, Manipulator, Workspace, forces, motion,
/// };
///
/// let urdf = r#"<robot name="pendulum">
///   <link name="base"/>
///   <link name="arm"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
///     <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
///   <joint name="hinge" type="continuous">
///     <parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
/// </robot>"#;
/// let robot = Manipulator::from_urdf(urdf, BaseKind::Fixed)?;
/// let mut workspace = Workspace::new(&robot);
///
/// let base = FrameMotion::at_rest(Isometry3::identity());
/// let held_still = JointMotion { position: &[0.0], velocity: &[0.0], acceleration: &[0.0] };
/// motion(&mut workspace, &base, held_still)?;
/// forces(&mut workspace, &Vector3::new(0.0, 0.0, -9.81));
/// // The weight 0.5 m out along x turns the arm about +y, so the joint holds it with -y.
/// assert!((workspace.joint_torques()?[0] + 2.0 * 9.81 * 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Workspace {
    pub(crate) robot: Manipulator,
    /// Constants of each body.
    pub(crate) bodies: Vec<BodyModel>,
    /// The frame of each link, in the order of the robot's links.
    pub(crate) frames: Vec<FixedFrame>,
    pub(crate) states: Vec<BodyState<f64>>,
    /// Velocity of the base frame's origin in the inertial frame, m/s. No force depends on it.
    pub(crate) base_velocity: Vector3<f64>,
    /// Gravitational acceleration in the inertial frame, m/s², which has been subtracted from the
    /// accelerations of the states.
    pub(crate) gravity: Vector3<f64>,
    joint_torques: Vec<f64>,
    /// Whether the forces belong to the motion.
    has_forces: bool,
    /// Scratch of [`joint_torque_regressor`](Self::joint_torque_regressor), an entry for each body.
    pub(crate) regressor_states: Vec<RegressorState>,
}

impl Workspace {
    /// Allocates the state of a robot: at rest at joint positions zero, its base frame at the
    /// inertial frame.
    #[must_use]
    pub fn new(robot: &Manipulator) -> Self {
        let bodies = BodyModel::of_bodies(&robot.bodies);
        let mut workspace = Self {
            frames: FixedFrame::of_links(&robot.links, &bodies),
            states: vec![BodyState::at_rest(0.0); bodies.len()],
            regressor_states: vec![RegressorState::default(); bodies.len()],
            bodies,
            base_velocity: Vector3::zeros(),
            gravity: Vector3::zeros(),
            joint_torques: vec![0.0; robot.dof()],
            has_forces: false,
            robot: robot.clone(),
        };
        let zeros = vec![0.0; robot.dof()];
        let at_rest = JointMotion {
            position: &zeros,
            velocity: &zeros,
            acceleration: &zeros,
        };
        workspace.move_bodies(
            &FrameMotion::at_rest(Isometry3::identity()),
            at_rest,
            &Vector3::zeros(),
        );
        workspace
    }

    /// Returns the robot that has this state.
    #[must_use]
    pub fn robot(&self) -> &Manipulator {
        &self.robot
    }

    /// Returns the joint torques (forces of prismatic joints) that [`forces`](crate::forces())
    /// computed, N m or N, in the order of [`Manipulator::joint_names`]. Each acts along the
    /// joint's axis on the link that the joint moves. The torque of a mimic joint counts towards
    /// the joint it follows, times its multiplier.
    ///
    /// # Errors
    /// Returns [`StateError::NoForces`] if the forces of the present motion have not been computed.
    pub fn joint_torques(&self) -> Result<&[f64], StateError> {
        self.check_forces()?;
        Ok(&self.joint_torques)
    }

    /// Returns the wrench that the environment must exert on the base for the motion, in the
    /// inertial frame, about the base frame's origin. It is zero for a free-floating robot that
    /// moves under its own joint torques only.
    ///
    /// # Errors
    /// Returns [`StateError::NoForces`] if the forces of the present motion have not been computed.
    pub fn base_wrench(&self) -> Result<Wrench, StateError> {
        self.check_forces()?;
        let base = &self.states[0];
        Ok(Wrench {
            force: (&base.rotation * base.force).into(),
            moment: (&base.rotation * base.moment).into(),
        })
    }

    fn check_forces(&self) -> Result<(), StateError> {
        self.has_forces.then_some(()).ok_or(StateError::NoForces)
    }

    /// Moves the bodies and subtracts `gravity` from their accelerations. Each slice of `joints`
    /// has one entry for each independent joint.
    fn move_bodies(&mut self, base: &FrameMotion, joints: JointMotion<'_>, gravity: &Vector3<f64>) {
        let base_state = BaseMotion::new(base, gravity);
        outward(&self.bodies, &mut self.states, &base_state, &joints);
        self.base_velocity = base.velocity;
        self.gravity = *gravity;
        self.has_forces = false;
    }

    /// Computes the forces of the present motion.
    fn compute_forces(&mut self) {
        self.joint_torques.fill(0.0);
        inward(&self.bodies, &mut self.states, &mut self.joint_torques);
        self.has_forces = true;
    }

    /// Subtracts `gravity` from the accelerations of the bodies, in place of the gravity that was
    /// subtracted before.
    pub(crate) fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        if *gravity == self.gravity {
            return;
        }
        let less = self.gravity - gravity;
        for index in 0..self.states.len() {
            let less = self.in_body(index, &less);
            self.states[index].acceleration = self.states[index].acceleration + less;
        }
        self.gravity = *gravity;
    }
}

impl JointStates<f64> for JointMotion<'_> {
    #[inline(always)]
    fn state(&self, joint: &JointModel) -> JointState<f64> {
        JointState {
            position: joint.position(self.position[joint.coordinate]),
            velocity: joint.ratio * self.velocity[joint.coordinate],
            acceleration: joint.ratio * self.acceleration[joint.coordinate],
        }
    }
}

impl JointTorques<f64> for Vec<f64> {
    #[inline(always)]
    fn add(&mut self, joint: &JointModel, torque: f64) {
        self[joint.coordinate] += joint.ratio * torque;
    }
}

impl BaseMotion<f64> {
    /// Returns the motion of a base, with `gravity` subtracted from its acceleration.
    pub(crate) fn new(base: &FrameMotion, gravity: &Vector3<f64>) -> Self {
        Self {
            rotation: matrix(&base.pose.rotation),
            position: (&base.pose.translation.vector).into(),
            angular_velocity: (&base.angular_velocity).into(),
            angular_acceleration: (&base.angular_acceleration).into(),
            acceleration: (&(base.acceleration - gravity)).into(),
        }
    }
}

/// Computes the motion of every body, (1)-(20) of Hou et al. 2016, from the motion of the base
/// frame and the joints, and stores it in the workspace. Forces computed before become unavailable.
///
/// The cost is one pass over the bodies. Nothing is allocated.
///
/// # Errors
/// Returns [`StateError::Length`] if a slice does not have one entry for each independent joint.
/// The workspace is then unchanged.
pub fn motion(
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
) -> Result<(), StateError> {
    motion_under_gravity(workspace, base, joints, &Vector3::zeros())
}

/// Computes the motion of every body as [`motion`] does. Where the computations that follow have
/// the same `gravity` (forces, a [`tool_motion`](Workspace::tool_motion), a regressor), these need
/// no pass of their own for it, because it acts as an upward acceleration of the base. What they
/// return is the same.
///
/// # Errors
/// Returns [`StateError::Length`] if a slice does not have one entry for each independent joint.
/// The workspace is then unchanged.
pub fn motion_under_gravity(
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
    gravity: &Vector3<f64>,
) -> Result<(), StateError> {
    let robot = &workspace.robot;
    robot.check_length("position", joints.position)?;
    robot.check_length("velocity", joints.velocity)?;
    robot.check_length("acceleration", joints.acceleration)?;
    workspace.move_bodies(base, joints, gravity);
    Ok(())
}

/// Computes the force and the moment on every body from its parent, (21)-(41) of Hou et al. 2016,
/// for the motion that the workspace holds, and stores them there. `gravity` is the gravitational
/// acceleration in the inertial frame, m/s², pointing down; it is zero in orbit.
///
/// A body without mass counts as massless:
/// [`Manipulator::check_masses`](crate::Manipulator::check_masses) reports whether the description
/// of the robot lacks a mass.
///
/// Read the result with [`Workspace::joint_torques`] and [`Workspace::base_wrench`]. The cost is
/// one pass inwards; where `gravity` differs from the motion's, each body also costs a pass over
/// those above it. Nothing is allocated. [`inverse_dynamics`] does the same together with the
/// motion, in less time.
pub fn forces(workspace: &mut Workspace, gravity: &Vector3<f64>) {
    workspace.set_gravity(gravity);
    workspace.compute_forces();
}

/// Computes motion and forces of every body: [`motion_under_gravity`] and then [`forces`].
///
/// # Errors
/// Returns [`StateError::Length`] if a slice does not have one entry for each independent joint.
/// The workspace is then unchanged.
pub fn inverse_dynamics(
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
    gravity: &Vector3<f64>,
) -> Result<(), StateError> {
    motion_under_gravity(workspace, base, joints, gravity)?;
    workspace.compute_forces();
    Ok(())
}
