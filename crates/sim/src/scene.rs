//! The scene in Rapier: one multibody for spacecraft, arm and gripper, and the payload as a free
//! body between the pads.
//!
//! One call of [`Scene::step`] computes `v' = v + dt · a(x)`, `x' = x + dt · v'`.

mod build;
mod drives;
mod state;

use nalgebra::Vector3;
use rapier3d_f64::dynamics::{
    CCDSolver, ImpulseJointSet, IntegrationParameters, IslandManager, Multibody, MultibodyIndex,
    MultibodyJointSet, RigidBodyHandle, RigidBodySet, SoftBodySet, SpringCoefficients,
};
use rapier3d_f64::geometry::{BroadPhaseBvh, ColliderHandle, ColliderSet, NarrowPhase};
use rapier3d_f64::math::Vector;
use rapier3d_f64::pipeline::PhysicsPipeline;

use crate::contact::{ContactPoint, SlipAnchors, read_contacts};
use crate::convert::glam_vector;
use crate::robot::Robot;
use crate::roles::Roles;
use drives::Drives;

pub(crate) use state::{BodyState, State};

/// A body of the robot in Rapier.
struct Link {
    handle: RigidBodyHandle,
    /// Index in the multibody.
    id: usize,
    /// Index of its first generalized velocity.
    dof: usize,
}

/// The collision boxes of one finger.
struct Pad {
    /// Index in `links`.
    link: usize,
    colliders: Vec<ColliderHandle>,
}

/// All moving bodies and the solver that moves them.
pub(crate) struct Scene {
    robot: Robot,
    pipeline: PhysicsPipeline,
    parameters: IntegrationParameters,
    islands: IslandManager,
    broad_phase: BroadPhaseBvh,
    narrow_phase: NarrowPhase,
    bodies: RigidBodySet,
    colliders: ColliderSet,
    impulse_joints: ImpulseJointSet,
    multibody_joints: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    ccd: CCDSolver,
    multibody: MultibodyIndex,
    links: Vec<Link>,
    pads: [Pad; 2],
    payload: RigidBodyHandle,
    handle: ColliderHandle,
    anchors: SlipAnchors,
    /// Gravitational acceleration that acts in the next step, m/s².
    gravity: Vector,
    drives: Drives,
    roles: Roles,
}

/// Returns settings of the solver with which rigid pads hold a payload still, for steps of `dt` s.
fn integration_parameters(dt: f64) -> IntegrationParameters {
    IntegrationParameters {
        dt,
        // With a single substep the impulses that Rapier reports belong to the whole step, and a
        // drive's torque follows from the velocity at its end.
        num_solver_iterations: 1,
        // Any number from 2 to 10, and of the next from 6 to 30, gives the same identification
        // result within 0.01 %.
        num_internal_pgs_iterations: 4,
        num_internal_stabilization_iterations: 10,
        max_ccd_substeps: 0,
        // Recycled contacts keep the lever arms of old poses, with which the payload is lost.
        contact_recycling: false,
        // With the default a finger penetrates the handle by centimetres.
        contact_softness: SpringCoefficients::new(100.0, 1.0),
        warmstart_coefficient: 1.0,
        ..IntegrationParameters::default()
    }
}

impl Scene {
    fn articulation(&self) -> Option<&Multibody> {
        self.multibody_joints.get_multibody(self.multibody)
    }

    /// Sets the gravitational acceleration of the steps that follow, m/s².
    pub(crate) fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        self.gravity = glam_vector(gravity);
    }

    /// Moves both fingers at a speed, m/s. Positive values close the gripper, zero locks it.
    pub(crate) fn move_fingers(&mut self, speed: f64) {
        let dofs = [0, 1].map(|finger| self.links[self.pads[finger].link].dof);
        if let Some(multibody) = self.multibody_joints.get_multibody_mut(self.multibody) {
            for dof in dofs {
                multibody.generalized_velocity_mut()[dof] = speed;
            }
        }
    }

    /// Simulates one step.
    pub(crate) fn step(&mut self) {
        self.pipeline.step(
            self.gravity,
            &self.parameters,
            &mut self.islands,
            &mut self.broad_phase,
            &mut self.narrow_phase,
            &mut self.bodies,
            &mut self.colliders,
            &mut self.impulse_joints,
            &mut self.multibody_joints,
            &mut self.soft_bodies,
            &mut self.ccd,
            &self.anchors,
            &(),
        );
        self.anchors.follow_slides(&self.bodies);
    }

    /// Reads the contacts of the last step by finger. `payload_before` is the payload's state at
    /// the start of the step, to which the lever arms refer.
    pub(crate) fn contacts(
        &self,
        payload_before: &BodyState,
        contacts: &mut [Vec<ContactPoint>; 2],
    ) {
        let center = payload_before.pose.translation.vector;
        for (pad, points) in self.pads.iter().zip(contacts) {
            points.clear();
            for &collider in &pad.colliders {
                if let Some(pair) = self.narrow_phase.contact_pair(collider, self.handle) {
                    read_contacts(pair, self.handle, &center, self.parameters.dt, points);
                }
            }
        }
    }

    /// Anchors the payload at its present pose in the grasp, where friction then holds it.
    pub(crate) fn anchor_grasp(&mut self) {
        self.anchors.hold(&self.bodies);
    }

    pub(crate) fn robot(&self) -> &Robot {
        &self.robot
    }

    pub(crate) fn roles(&self) -> &Roles {
        &self.roles
    }

    /// Returns the first generalized velocity of each joint of the arm.
    fn arm_dofs(&self) -> Vec<usize> {
        let arm = self.roles.arm.iter();
        arm.map(|&body| self.links[body].dof).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rapier3d_f64::math::Vector;

    use super::{Scene, State};
    use crate::Experiment;
    use crate::checks::momentum;

    /// A body without contacts keeps its angular momentum while its axis tumbles, so the gyroscopic
    /// term is integrated.
    #[test]
    fn a_free_payload_keeps_its_angular_momentum() {
        let experiment = Experiment::paper();
        let mut mass = experiment.payload.mass_properties();
        mass.center_of_mass = Vector3::zeros();
        let mut scene = Scene::new(&experiment).unwrap();
        let payload = scene.payload;
        let far = Vector::new(50.0, 0.0, 0.0);
        scene.bodies[payload].set_translation(far, true);
        scene.bodies[payload].set_angvel(Vector::new(0.5, 0.4, -0.3), true);
        let mut state = State::new(scene.robot().bodies.len());
        scene.read(&mut state);
        let (start, axis) = (
            momentum(&mass, &state.payload)[1],
            state.payload.angular_velocity,
        );
        for _ in 0..5000 {
            scene.step();
        }
        scene.read(&mut state);
        let change = momentum(&mass, &state.payload)[1] - start;
        assert!(change.norm() < 2e-3 * start.norm(), "{change}");
        let tumbled = state.payload.angular_velocity - axis;
        assert!(
            tumbled.norm() > 0.2 * axis.norm(),
            "it must have tumbled: {tumbled}"
        );
    }
}
