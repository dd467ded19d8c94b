//! Poses and velocities of all bodies, read from Rapier once in each step.

use nalgebra::{Isometry3, Vector3};

use super::Scene;
use crate::convert;

/// Pose and velocity of a body, expressed in the world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyState {
    /// Pose `world_from_body`.
    pub pose: Isometry3<f64>,
    /// Velocity of the centre of mass, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
}

impl BodyState {
    fn at_rest() -> Self {
        Self {
            pose: Isometry3::identity(),
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
        }
    }
}

/// Positions `x_k` and velocities `v_k` after step k. The velocities belong to the time half a step
/// before the positions.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// Positions of all joints, fingers included, in the order of the robot's bodies, rad or m.
    pub joint_position: Vec<f64>,
    /// Velocities of these joints, rad/s or m/s.
    pub joint_velocity: Vec<f64>,
    /// All bodies of the robot, the base first.
    pub bodies: Vec<BodyState>,
    /// The payload, with its frame at its centre of mass.
    pub payload: BodyState,
}

impl State {
    pub(crate) fn new(bodies: usize) -> Self {
        Self {
            joint_position: vec![0.0; bodies - 1],
            joint_velocity: vec![0.0; bodies - 1],
            bodies: vec![BodyState::at_rest(); bodies],
            payload: BodyState::at_rest(),
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        let finite = |v: &Vector3<f64>| v.iter().all(|x| x.is_finite());
        let body = |b: &BodyState| {
            finite(&b.pose.translation.vector) && finite(&b.velocity) && finite(&b.angular_velocity)
        };
        self.joint_velocity.iter().all(|x| x.is_finite())
            && self.bodies.iter().all(body)
            && body(&self.payload)
    }
}

impl Scene {
    /// Reads the present state.
    pub(crate) fn read(&self, state: &mut State) {
        if let Some(multibody) = self.articulation() {
            let velocity = multibody.generalized_velocity();
            for (index, (link, body)) in self.links.iter().zip(&mut state.bodies).enumerate() {
                body.pose = convert::pose(self.bodies[link.handle].position());
                // The velocities that Rapier stores with the links are one step old.
                let twist = multibody.body_jacobian(link.id) * velocity;
                body.velocity = twist.fixed_rows::<3>(0).into_owned();
                body.angular_velocity = twist.fixed_rows::<3>(3).into_owned();
                if index > 0 {
                    state.joint_velocity[index - 1] = velocity[link.dof];
                    state.joint_position[index - 1] =
                        self.joint_position(index, link.id, multibody);
                }
            }
        }
        let payload = &self.bodies[self.payload];
        state.payload = BodyState {
            pose: convert::pose(payload.position()),
            velocity: convert::vector(payload.linvel()),
            angular_velocity: convert::vector(payload.angvel()),
        };
    }

    /// Returns the positions of the arm's joints, rad or m.
    pub(super) fn arm_positions(&self) -> Vec<f64> {
        let arm = self.roles.arm.iter();
        let position = |&body: &usize| {
            let multibody = self.articulation();
            multibody.map_or(0.0, |m| self.joint_position(body, self.links[body].id, m))
        };
        arm.map(position).collect()
    }

    fn joint_position(
        &self,
        body: usize,
        link_id: usize,
        multibody: &rapier3d_f64::dynamics::Multibody,
    ) -> f64 {
        let prismatic = self.robot.bodies[body]
            .joint
            .as_ref()
            .is_some_and(|j| j.prismatic);
        // The z axis of a joint's frame is its axis: the third linear or angular coordinate.
        let coordinate = if prismatic { 2 } else { 5 };
        multibody
            .link(link_id)
            .map_or(0.0, |link| link.joint().coords()[coordinate])
    }
}
