//! The state that computations over a manipulator share: motion and forces of every body.

use nalgebra::{Isometry3, SVector, Vector3, Vector6};

use crate::manipulator::{FrameId, JointKind, Manipulator};
use crate::motion::{BodyState, JointMotion, move_bodies};
use crate::{FrameMotion, InertialParameters, StateError, Wrench, wrench_regressor};

/// State of a [`Manipulator`]: the motion of every body and, once computed, the forces between bodies.
///
/// A workspace owns a copy of its robot, so that it cannot be used with another one. It always holds a motion:
/// [`Workspace::new`] starts with the robot at rest at joint positions zero, its base at the inertial frame, and
/// [`motion`](crate::motion()) replaces that. [`forces`](crate::forces()) adds the forces of that motion. After
/// construction nothing allocates.
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
    pub(crate) bodies: Vec<BodyState>,
    pub(crate) joint_torques: Vec<f64>,
    /// Whether the forces belong to the motion.
    pub(crate) has_forces: bool,
}

impl Workspace {
    /// Allocates the state of a robot: at rest at joint positions zero, its base frame at the inertial frame.
    #[must_use]
    pub fn new(robot: &Manipulator) -> Self {
        let base = FrameMotion::at_rest(Isometry3::identity());
        let still = BodyState {
            origin: base,
            from_parent: Vector3::zeros(),
            a: Vector3::zeros(),
            center: Vector3::zeros(),
            center_velocity: Vector3::zeros(),
            center_acceleration: Vector3::zeros(),
            axis: Vector3::zeros(),
            force: Vector3::zeros(),
            moment: Vector3::zeros(),
        };
        let mut bodies = vec![still; robot.bodies.len()];
        let zeros = vec![0.0; robot.dof()];
        let at_rest = JointMotion {
            position: &zeros,
            velocity: &zeros,
            acceleration: &zeros,
        };
        move_bodies(&robot.bodies, &mut bodies, &base, at_rest);
        Self {
            robot: robot.clone(),
            bodies,
            joint_torques: zeros,
            has_forces: false,
        }
    }

    /// Returns the robot whose state this is.
    #[must_use]
    pub fn robot(&self) -> &Manipulator {
        &self.robot
    }

    /// Returns the motion of a frame, expressed in the inertial frame.
    #[must_use]
    pub fn frame_motion(&self, frame: FrameId) -> FrameMotion {
        let link = self.robot.link(frame);
        self.bodies[link.body].origin.of_fixed(&link.body_from_link)
    }

    /// Returns `world_from_frame`, the pose of a frame in the inertial frame.
    #[must_use]
    pub fn pose(&self, frame: FrameId) -> Isometry3<f64> {
        let link = self.robot.link(frame);
        self.bodies[link.body].origin.pose * link.body_from_link
    }

    /// Returns the joint torques (forces of prismatic joints) that [`forces`](crate::forces()) computed, N m or N, in the
    /// order of [`Manipulator::joint_names`]. Each acts along the joint's axis on the link that the joint moves. The
    /// torque of a mimic joint counts towards the joint it follows, times its multiplier.
    ///
    /// # Errors
    /// Returns [`StateError::NoForces`] if the forces of the present motion have not been computed.
    pub fn joint_torques(&self) -> Result<&[f64], StateError> {
        self.check_forces()?;
        Ok(&self.joint_torques)
    }

    /// Returns the wrench that the environment must exert on the base for the motion, in the inertial frame, about the
    /// base frame's origin. It is zero for a free-floating robot that moves under its own joint torques only.
    ///
    /// # Errors
    /// Returns [`StateError::NoForces`] if the forces of the present motion have not been computed.
    pub fn base_wrench(&self) -> Result<Wrench, StateError> {
        self.check_forces()?;
        Ok(Wrench {
            force: self.bodies[0].force,
            moment: self.bodies[0].moment,
        })
    }

    fn check_forces(&self) -> Result<(), StateError> {
        self.has_forces.then_some(()).ok_or(StateError::NoForces)
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
        for (coordinate, column) in self.jacobian_columns(frame) {
            columns[coordinate] += column;
        }
        Ok(())
    }

    /// Computes the regressor of the joint torques (forces of prismatic joints) for a body that is fixed to a frame: the
    /// torque that joint `j` must add to move the body is `rows[j] · π`, N m or N, with `π` the
    /// [`InertialParameters`] of the body in the frame. `gravity` is the gravitational acceleration in the inertial
    /// frame, m/s², pointing down. The row of a joint that does not move the frame is zero.
    ///
    /// Over all bodies of a robot, each in the frame of its first link, the products sum to
    /// [`joint_torques`](Self::joint_torques). The base moves no joint, so its parameters do not count; it may float.
    ///
    /// The cost is one pass over the bodies above the frame. Nothing is allocated, and [`forces`](crate::forces()) is not
    /// needed.
    ///
    /// # Errors
    /// Returns [`StateError::Length`] if `rows` does not have one entry for each independent joint.
    pub fn torque_regressor(
        &self,
        frame: FrameId,
        gravity: &Vector3<f64>,
        rows: &mut [SVector<f64, 10>],
    ) -> Result<(), StateError> {
        self.robot.check_count("the regressor", rows.len())?;
        rows.fill(SVector::zeros());
        let wrench = wrench_regressor(&self.frame_motion(frame).in_frame(gravity));
        for (coordinate, column) in self.jacobian_columns(frame) {
            rows[coordinate] += wrench.tr_mul(&column); // principle of virtual work, not in the paper
        }
        Ok(())
    }

    /// Column of a frame's Jacobian for each joint above it, with the index of the joint's coordinate, which mimic joints
    /// share.
    fn jacobian_columns(&self, frame: FrameId) -> impl Iterator<Item = (usize, Vector6<f64>)> + '_ {
        let world_from_frame = self.pose(frame);
        let frame_from_world = world_from_frame.rotation.inverse();
        let bodies = &self.robot.bodies;
        let upwards = std::iter::successors(Some(self.robot.link(frame).body), |&index| {
            Some(bodies[index].parent)
        });
        let joints = upwards.map_while(|index| Some((index, bodies[index].joint.as_ref()?)));
        joints.map(move |(index, joint)| {
            let state = &self.bodies[index];
            let arm = world_from_frame.translation.vector - state.origin.pose.translation.vector;
            let (linear, angular) = match joint.kind {
                JointKind::Revolute => (state.axis.cross(&arm), state.axis),
                JointKind::Prismatic => (state.axis, Vector3::zeros()),
            };
            let (linear, angular) = (frame_from_world * linear, frame_from_world * angular);
            let column = Vector6::new(
                linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
            );
            (joint.coordinate, column * joint.ratio)
        })
    }

    /// Returns the links below `frame` as one rigid body, expressed in that frame, at the present posture. It depends
    /// on the joints below the frame. Links that [`Manipulator::without_subtree`] has removed are included, so that the
    /// robot with and without its end-effector give the same.
    #[must_use]
    pub fn subtree_parameters(&self, frame: FrameId) -> InertialParameters {
        let frame_from_world = self.pose(frame).inverse();
        let below = &self.robot.links[self.robot.links_below(frame)];
        let in_frame = below.iter().map(|link| {
            let world_from_link = self.bodies[link.body].origin.pose * link.body_from_link;
            (link.parameters + link.removed).expressed_in(&(frame_from_world * world_from_link))
        });
        in_frame.sum()
    }
}

/// Computes the motion of every body, (1)-(20) of Hou et al. 2016, from the motion of the base frame and the joints,
/// and stores it in the workspace. Forces computed before become unavailable.
///
/// The cost is one pass over the bodies. Nothing is allocated.
///
/// # Errors
/// Returns [`StateError::Length`] if a slice does not have one entry for each independent joint. The workspace is then
/// unchanged.
pub fn motion(
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
) -> Result<(), StateError> {
    let Workspace { robot, bodies, .. } = workspace;
    robot.check_length("position", joints.position)?;
    robot.check_length("velocity", joints.velocity)?;
    robot.check_length("acceleration", joints.acceleration)?;
    move_bodies(&robot.bodies, bodies, base, joints);
    workspace.has_forces = false;
    Ok(())
}
