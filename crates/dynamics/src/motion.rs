//! Motion of every body from the motion of the base and the joints, (1)-(20).

use nalgebra::{Isometry3, Vector3};

use crate::FrameMotion;
use crate::manipulator::{Body, JointKind};

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

/// Motion of one body and the wrench on it. All vectors are expressed in the inertial frame.
#[derive(Clone, Debug)]
pub(crate) struct BodyState {
    /// `p`, `ṗ`, `p̈`, `ω`, `ω̇`: motion of the body's frame.
    pub(crate) origin: FrameMotion,
    /// Vector from the parent's origin to the body's origin, `a + b` of the parent, m. It is kept, as is `a`, so that no
    /// moment is computed from the difference of two positions far from the inertial frame's origin.
    pub(crate) from_parent: Vector3<f64>,
    /// `a`: vector from the body's origin to its centre of mass, m.
    pub(crate) a: Vector3<f64>,
    /// `r`: position of the centre of mass, m.
    pub(crate) center: Vector3<f64>,
    /// `ṙ`: velocity of the centre of mass, m/s.
    pub(crate) center_velocity: Vector3<f64>,
    /// `r̈`: acceleration of the centre of mass, m/s².
    pub(crate) center_acceleration: Vector3<f64>,
    /// `z`: unit vector along the joint's axis.
    pub(crate) axis: Vector3<f64>,
    /// `f`: force on the body from its parent, N.
    pub(crate) force: Vector3<f64>,
    /// `n`: moment on the body from its parent about the body's origin `p`, N m.
    pub(crate) moment: Vector3<f64>,
}

/// Moves the bodies, parents first. Each slice of `joints` has one entry for each independent joint.
pub(crate) fn move_bodies(
    bodies: &[Body],
    states: &mut [BodyState],
    base: &FrameMotion,
    joints: JointMotion<'_>,
) {
    for (index, body) in bodies.iter().enumerate() {
        let (before, after) = states.split_at_mut(index);
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
}

/// Moves the body's frame as if its joint stood still, from the parent's centre of mass.
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

/// Adds the motion of the joint itself: `velocity` and `acceleration` in rad/s and rad/s², or m/s and m/s².
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
            // (12), (15), (18); the printed equations omit the transport term ω × ω*.
            state.origin.angular_acceleration +=
                relative_acceleration + w.cross(&relative_velocity);
        }
        JointKind::Prismatic => {
            // The paper has revolute joints only. A prismatic joint moves the origin, with the Coriolis term 2 ω × v.
            state.origin.velocity += relative_velocity;
            state.origin.acceleration += relative_acceleration + w.cross(&relative_velocity) * 2.0;
        }
    }
}

/// Moves the centre of mass, given in the body's frame, with the body's frame.
fn move_center(state: &mut BodyState, center_of_mass: &Vector3<f64>) {
    let origin = &state.origin;
    let (w, dw) = (&origin.angular_velocity, &origin.angular_acceleration);
    let a = origin.pose * center_of_mass;
    state.a = a;
    state.center = origin.pose.translation.vector + a;
    state.center_velocity = origin.velocity + w.cross(&a); // (1), (4), (7), (10)
    state.center_acceleration = origin.acceleration + dw.cross(&a) + w.cross(&w.cross(&a)); // (11), (14), (17), (20)
}
