//! Motion of every body, (1)-(20), and the memory that computations use.

use nalgebra::{Isometry3, Vector3, Vector6};

use crate::manipulator::{FrameId, JointKind, Manipulator};
use crate::{FrameMotion, InertialParameters, StateError};

/// One body's motion and load in the inertial frame.
#[derive(Clone, Debug)]
pub(crate) struct BodyState {
    /// Of the body's frame: `p`, `ṗ`, `p̈`, `ω`, `ω̇`.
    pub(crate) origin: FrameMotion,
    /// From the parent's origin to this one's, `a + b` of the parent. Kept, as is `a`, so that no
    /// moment is taken over the difference of two positions far from the inertial frame's origin.
    pub(crate) from_parent: Vector3<f64>,
    /// `a`: from the origin to the centre of mass.
    pub(crate) a: Vector3<f64>,
    /// `r`, `ṙ`, `r̈` of the centre of mass.
    pub(crate) center: Vector3<f64>,
    pub(crate) center_velocity: Vector3<f64>,
    pub(crate) center_acceleration: Vector3<f64>,
    /// `z`: the joint's axis.
    pub(crate) axis: Vector3<f64>,
    /// `f`: force on the body from its parent, N.
    pub(crate) force: Vector3<f64>,
    /// `n`: moment on the body from its parent about the body's origin `p`, N m.
    pub(crate) moment: Vector3<f64>,
}

/// What computations over one [`Manipulator`] need of memory: allocated once, then used again.
///
/// It also serves that robot [with a payload](Manipulator::with_payload) or [without its
/// end-effector](Manipulator::without_subtree), which have the same bodies, once [`motion`] has been
/// computed for them. A robot with more bodies than it was made for panics.
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
/// motion(&robot, &mut workspace, &base, held_still)?;
/// forces(&robot, &mut workspace, &Vector3::new(0.0, 0.0, -9.81));
/// // The weight 0.5 m out along x turns the arm about +y, so the joint holds it with -y.
/// assert!((workspace.joint_torques()[0] + 2.0 * 9.81 * 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Workspace {
    pub(crate) bodies: Vec<BodyState>,
    pub(crate) joint_torques: Vec<f64>,
}

impl Workspace {
    /// Memory for one robot.
    #[must_use]
    pub fn new(robot: &Manipulator) -> Self {
        let still = BodyState {
            origin: FrameMotion::at_rest(Isometry3::identity()),
            from_parent: Vector3::zeros(),
            a: Vector3::zeros(),
            center: Vector3::zeros(),
            center_velocity: Vector3::zeros(),
            center_acceleration: Vector3::zeros(),
            axis: Vector3::zeros(),
            force: Vector3::zeros(),
            moment: Vector3::zeros(),
        };
        Self {
            bodies: vec![still; robot.bodies.len()],
            joint_torques: vec![0.0; robot.dof()],
        }
    }

    /// The motion of a frame of the robot that was last moved by [`motion`].
    #[must_use]
    pub fn frame_motion(&self, robot: &Manipulator, frame: FrameId) -> FrameMotion {
        let frame = &robot.frames[frame.0];
        self.bodies[frame.body]
            .origin
            .of_fixed(&frame.body_from_frame)
    }

    /// `world_from_frame` at the last [`motion`].
    #[must_use]
    pub fn pose(&self, robot: &Manipulator, frame: FrameId) -> Isometry3<f64> {
        let frame = &robot.frames[frame.0];
        self.bodies[frame.body].origin.pose * frame.body_from_frame
    }
}

/// Position, velocity and acceleration of the joints, each in the order of
/// [`Manipulator::joint_names`]: rad, rad/s, rad/s², or m, m/s, m/s² for a prismatic joint.
#[derive(Clone, Copy, Debug)]
pub struct JointMotion<'a> {
    /// `θ`.
    pub position: &'a [f64],
    /// `θ̇`.
    pub velocity: &'a [f64],
    /// `θ̈`.
    pub acceleration: &'a [f64],
}

/// Computes how every body moves, (1)-(20), from the motion of the base's frame and the joints.
///
/// Cost: one pass over the bodies, no allocation.
///
/// # Errors
/// Where a slice does not have one entry for each joint.
pub fn motion(
    robot: &Manipulator,
    workspace: &mut Workspace,
    base: &FrameMotion,
    joints: JointMotion<'_>,
) -> Result<(), StateError> {
    robot.check_length("position", joints.position)?;
    robot.check_length("velocity", joints.velocity)?;
    robot.check_length("acceleration", joints.acceleration)?;
    for (index, body) in robot.bodies.iter().enumerate() {
        let (before, after) = workspace.bodies.split_at_mut(index);
        let state = &mut after[0];
        match &body.joint {
            None => state.origin = *base,
            Some(joint) => {
                let at = |values: &[f64]| joint.ratio * values[joint.coordinate];
                let parent = &before[body.parent];
                let transform = joint.transform(at(joints.position) + joint.offset);
                move_body(state, parent, &transform);
                state.axis = state.origin.pose * joint.axis.into_inner();
                let (velocity, acceleration) = (at(joints.velocity), at(joints.acceleration));
                add_joint_motion(state, parent, joint.kind, velocity, acceleration);
            }
        }
        move_center(state, &body.center_of_mass);
    }
    Ok(())
}

/// The body's frame as if its joint stood still, stepping from the parent's centre of mass.
fn move_body(state: &mut BodyState, parent: &BodyState, parent_from_body: &Isometry3<f64>) {
    let (w, dw) = (
        parent.origin.angular_velocity,
        parent.origin.angular_acceleration,
    );
    state.origin.pose = parent.origin.pose * parent_from_body;
    state.from_parent = parent.origin.pose * parent_from_body.translation.vector;
    let b = state.from_parent - parent.a;
    state.origin.angular_velocity = w;
    state.origin.angular_acceleration = dw;
    state.origin.velocity = parent.center_velocity + w.cross(&b); // (3), (6), (9)
    state.origin.acceleration = parent.center_acceleration + dw.cross(&b) + w.cross(&w.cross(&b)); // (13), (16), (19)
}

fn add_joint_motion(
    state: &mut BodyState,
    parent: &BodyState,
    kind: JointKind,
    velocity: f64,
    acceleration: f64,
) {
    let w = parent.origin.angular_velocity;
    let relative_velocity = state.axis * velocity;
    let relative_acceleration = state.axis * acceleration;
    match kind {
        JointKind::Revolute => {
            state.origin.angular_velocity += relative_velocity; // (2), (5), (8)
            // (12), (15), (18); the transport term ω × ω* is missing in print.
            state.origin.angular_acceleration +=
                relative_acceleration + w.cross(&relative_velocity);
        }
        JointKind::Prismatic => {
            // The paper has revolute joints only: the origin slides, with its Coriolis term.
            state.origin.velocity += relative_velocity;
            state.origin.acceleration += relative_acceleration + w.cross(&relative_velocity) * 2.0;
        }
    }
}

fn move_center(state: &mut BodyState, center_of_mass: &Vector3<f64>) {
    let origin = &state.origin;
    let (w, dw) = (&origin.angular_velocity, &origin.angular_acceleration);
    let a = origin.pose * center_of_mass;
    state.a = a;
    state.center = origin.pose.translation.vector + a;
    state.center_velocity = origin.velocity + w.cross(&a); // (1), (4), (7), (10)
    state.center_acceleration = origin.acceleration + dw.cross(&a) + w.cross(&w.cross(&a)); // (11), (14), (17), (20)
}

impl Workspace {
    /// The columns of the geometric Jacobian of a frame, one a joint: the frame's velocity and angular
    /// velocity, expressed in the frame itself, for a unit velocity of the joint. Zero for a joint that
    /// does not move the frame.
    ///
    /// Transposed it brings a wrench at the frame to the joints: `τ_j = J_jᵀ [f; n]` is what joint `j`
    /// must add where that wrench is exerted **on** a body held in the frame.
    ///
    /// Cost: one pass over the bodies above the frame, no allocation.
    ///
    /// # Panics
    /// Where `columns` does not have one entry for each joint.
    pub fn jacobian(&self, robot: &Manipulator, frame: FrameId, columns: &mut [Vector6<f64>]) {
        assert_eq!(columns.len(), robot.dof(), "one column for each joint");
        columns.fill(Vector6::zeros());
        let world_from_frame = self.pose(robot, frame);
        let frame_from_world = world_from_frame.rotation.inverse();
        let mut index = robot.frames[frame.0].body;
        while let Some(joint) = &robot.bodies[index].joint {
            let state = &self.bodies[index];
            let arm = world_from_frame.translation.vector - state.origin.pose.translation.vector;
            let (linear, angular) = match joint.kind {
                JointKind::Revolute => (state.axis.cross(&arm), state.axis),
                JointKind::Prismatic => (state.axis, Vector3::zeros()),
            };
            let column = &mut columns[joint.coordinate];
            let mut upper = column.fixed_rows_mut::<3>(0);
            upper += frame_from_world * linear * joint.ratio;
            let mut lower = column.fixed_rows_mut::<3>(3);
            lower += frame_from_world * angular * joint.ratio;
            index = robot.bodies[index].parent;
        }
    }
}

impl Manipulator {
    /// Whether a joint, by its place in `q`, moves a frame.
    #[must_use]
    pub fn moves(&self, joint: usize, frame: FrameId) -> bool {
        let mut index = self.frames[frame.0].body;
        while let Some(above) = &self.bodies[index].joint {
            if above.coordinate == joint {
                return true;
            }
            index = self.bodies[index].parent;
        }
        false
    }

    /// The links below `frame` as one body, in that frame, at the posture of the workspace: what
    /// [`Self::without_subtree`] takes off. It changes with joints below the frame.
    #[must_use]
    pub fn subtree_parameters(&self, workspace: &Workspace, frame: FrameId) -> InertialParameters {
        let frame_from_world = workspace.pose(self, frame).inverse();
        self.links_below(frame)
            .map(|link| {
                let world_from_link = workspace.pose(self, FrameId(link));
                self.frames[link]
                    .parameters
                    .expressed_in(&(frame_from_world * world_from_link))
            })
            .sum()
    }
}
