//! Construction of the scene in Rapier, with the pads just clear of the handle.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d_f64::dynamics::{
    CCDSolver, GenericJoint, GenericJointBuilder, ImpulseJointSet, IslandManager, JointAxesMask,
    MassProperties as RapierMassProperties, MultibodyJointSet, RigidBodyBuilder, RigidBodyHandle,
    RigidBodySet, SoftBodySet,
};
use rapier3d_f64::geometry::{
    BroadPhaseBvh, Collider, ColliderBuilder, ColliderSet, Group, InteractionGroups,
    InteractionTestMode, NarrowPhase,
};
use rapier3d_f64::math::Vector;
use rapier3d_f64::pipeline::{ActiveHooks, PhysicsPipeline};
use tactid_dynamics::{BaseKind, MassProperties};

use super::drives::{DRIVE_DAMPING, Drives};
use super::{Link, Pad, Scene, integration_parameters};
use crate::contact::SlipAnchors;
use crate::convert::{glam_matrix, glam_pose, glam_vector};
use crate::robot::{BoxShape, MovingJoint, Robot};
use crate::roles::{exceeded, robot_with_roles};
use crate::{Experiment, SimError};

/// Collision group of the pads, which collide with the handle only.
const PADS: Group = Group::GROUP_1;
/// Collision group of the handle, which collides with the pads only.
const HANDLE: Group = Group::GROUP_2;

/// Distance of each pad from the handle before the gripper closes, m.
const CLEARANCE_M: f64 = 20e-6;

impl Scene {
    /// Builds the experiment's robot in its posture, at rest, with the frame of its base body at
    /// the world's origin. Gravity does not act before [`Scene::set_gravity`].
    ///
    /// # Errors
    /// Returns a fault of the robot, or [`SimError::Grasp`] if the fingers do not reach the handle.
    pub(crate) fn new(experiment: &Experiment) -> Result<Self, SimError> {
        let (robot, roles) = robot_with_roles(experiment)?;
        let fingers = roles.fingers;
        let (mut bodies, mut multibody_joints) = (RigidBodySet::new(), MultibodyJointSet::new());
        let handles = insert_bodies(&robot, fingers, &mut bodies, &mut multibody_joints)?;
        let multibody = multibody_joints
            .rigid_body_link(handles[0])
            .ok_or_else(|| SimError::Robot("no joint moves".to_owned()))?
            .multibody;
        if let Some(multibody) = multibody_joints.get_multibody_mut(multibody) {
            // Until then Rapier counts a fixed base among the degrees of freedom.
            multibody.forward_kinematics(&bodies, false);
        }
        let links = find_links(&handles, &multibody_joints)?;
        let mut colliders = ColliderSet::new();
        let friction = experiment.gripper.friction;
        let pads = insert_pads(
            &robot,
            fingers,
            &handles,
            friction,
            &mut colliders,
            &mut bodies,
        );
        let payload = bodies.insert(payload_body(&experiment.payload.mass_properties()));
        let handle = pad_or_handle(&handle_shape(experiment), HANDLE, PADS, friction);
        let handle = colliders.insert_with_parent(handle, payload, &mut bodies);
        let on_fingers = fingers.map(|link| handles[link]);
        let anchors = SlipAnchors::new(on_fingers, payload, experiment.step_s);
        let mut scene = Self {
            pipeline: PhysicsPipeline::new(),
            parameters: integration_parameters(experiment.step_s),
            islands: IslandManager::new(),
            broad_phase: BroadPhaseBvh::new(),
            narrow_phase: NarrowPhase::new(),
            bodies,
            colliders,
            impulse_joints: ImpulseJointSet::new(),
            multibody_joints,
            soft_bodies: SoftBodySet::new(),
            ccd: CCDSolver::new(),
            multibody,
            anchors,
            links,
            pads,
            payload,
            handle,
            gravity: Vector::ZERO,
            drives: Drives::new(experiment, roles.arm.len()),
            robot,
            roles,
        };
        scene.displace(&scene.arm_dofs(), &experiment.posture.positions());
        let tool = &scene.roles.tool;
        let world_from_tool = scene.body_pose(tool.body) * tool.body_from_link;
        scene.place_payload(experiment, &world_from_tool);
        scene.close_to_clearance(experiment, &world_from_tool)?;
        Ok(scene)
    }

    fn body_pose(&self, body: usize) -> Isometry3<f64> {
        crate::convert::pose(self.bodies[self.links[body].handle].position())
    }

    fn displace(&mut self, dofs: &[usize], by: &[f64]) {
        let Some(multibody) = self.multibody_joints.get_multibody_mut(self.multibody) else {
            return;
        };
        let mut displacement = vec![0.0; multibody.ndofs()];
        for (&dof, &by) in dofs.iter().zip(by) {
            displacement[dof] = by;
        }
        multibody.apply_displacements(&displacement);
        multibody.forward_kinematics(&self.bodies, false);
        multibody.update_rigid_bodies(&mut self.bodies, true);
        multibody.damping_mut().fill(0.0); // Rapier's default also damps the free base
        for &body in &self.roles.arm {
            multibody.damping_mut()[self.links[body].dof] = DRIVE_DAMPING;
        }
    }

    /// Places the payload with its frame at its centre of mass and the axes of the tool frame.
    fn place_payload(&mut self, experiment: &Experiment, world_from_tool: &Isometry3<f64>) {
        let [x, y, z] = experiment.payload.center_of_mass_m;
        let pose = world_from_tool * Isometry3::translation(x, y, z);
        self.bodies[self.payload].set_position(glam_pose(&pose), true);
    }

    /// Moves each finger so that its pad is just clear of the handle.
    fn close_to_clearance(
        &mut self,
        experiment: &Experiment,
        world_from_tool: &Isometry3<f64>,
    ) -> Result<(), SimError> {
        let [x, y, z] = experiment.payload.handle.center_m;
        let handle = BoxShape {
            body_from_box: world_from_tool * Isometry3::translation(x, y, z),
            half_size: Vector3::from(experiment.payload.handle.size_m) * 0.5,
        };
        let fingers = self.roles.fingers;
        let mut positions = [0.0; 2];
        for (&finger, position) in fingers.iter().zip(&mut positions) {
            let pose = self.body_pose(finger);
            let Some(joint) = &self.robot.bodies[finger].joint else {
                continue;
            };
            let closing = pose * joint.axis.into_inner();
            let pad_face = self.robot.bodies[finger]
                .boxes
                .iter()
                .map(|pad| extent(pad, &pose, &closing))
                .fold(f64::NEG_INFINITY, f64::max);
            let handle_face = -extent(&handle, &Isometry3::identity(), &-closing);
            *position = handle_face - pad_face - CLEARANCE_M;
            let limits = exceeded(&self.robot, finger, *position).map(|(_, limits)| limits);
            if limits.is_some() || *position < 0.0 {
                let (lower, upper) = limits.or(joint.limits).unwrap_or((0.0, f64::INFINITY));
                return Err(SimError::Grasp(format!(
                    "the finger of joint `{}` would have to begin at {position:.4} m to touch the handle, outside its \
                     travel of {:.4} to {upper:.4} m; change payload.handle",
                    joint.name,
                    lower.max(0.0)
                )));
            }
        }
        let dofs = fingers.map(|finger| self.links[finger].dof);
        self.displace(&dofs, &positions);
        Ok(())
    }
}

/// Adds the boxes of the fingers' links, which touch the handle only.
fn insert_pads(
    robot: &Robot,
    fingers: [usize; 2],
    handles: &[RigidBodyHandle],
    friction: f64,
    colliders: &mut ColliderSet,
    bodies: &mut RigidBodySet,
) -> [Pad; 2] {
    fingers.map(|link| {
        let shapes = robot.bodies[link].boxes.iter();
        let boxes = shapes.map(|shape| pad_or_handle(shape, PADS, HANDLE, friction));
        let insert = |pad| colliders.insert_with_parent(pad, handles[link], bodies);
        Pad {
            link,
            colliders: boxes.map(insert).collect(),
        }
    })
}

/// Returns the largest coordinate of a box along the unit vector `direction`, m.
fn extent(shape: &BoxShape, world_from_body: &Isometry3<f64>, direction: &Vector3<f64>) -> f64 {
    let pose = world_from_body * shape.body_from_box;
    let along = pose.rotation.inverse() * direction;
    pose.translation.vector.dot(direction) + along.abs().dot(&shape.half_size)
}

fn insert_bodies(
    robot: &Robot,
    fingers: [usize; 2],
    bodies: &mut RigidBodySet,
    joints: &mut MultibodyJointSet,
) -> Result<Vec<RigidBodyHandle>, SimError> {
    let mut handles: Vec<RigidBodyHandle> = Vec::with_capacity(robot.bodies.len());
    for (index, body) in robot.bodies.iter().enumerate() {
        let is_fixed = index == 0 && robot.base == BaseKind::Fixed;
        let builder = if is_fixed {
            RigidBodyBuilder::fixed()
        } else {
            RigidBodyBuilder::dynamic().additional_mass_properties(rapier_mass(&body.mass))
        };
        let handle = bodies.insert(builder.can_sleep(false));
        handles.push(handle);
        if let Some(joint) = &body.joint {
            let (parent, data) = (handles[joint.parent], rapier_joint(joint));
            // A finger is moved, not driven: no payload opens it, and locked it is rigid.
            let inserted = if fingers.contains(&index) {
                joints.insert_kinematic(parent, handle, data, true)
            } else {
                joints.insert(parent, handle, data, true)
            };
            inserted
                .ok_or_else(|| SimError::Robot(format!("joint `{}` closes a loop", joint.name)))?;
        }
    }
    Ok(handles)
}

fn find_links(
    handles: &[RigidBodyHandle],
    joints: &MultibodyJointSet,
) -> Result<Vec<Link>, SimError> {
    let link = |&handle: &RigidBodyHandle| {
        let id = joints.rigid_body_link(handle)?;
        let link = joints.get_multibody(id.multibody)?.link(id.id)?;
        Some(Link {
            handle,
            id: id.id,
            dof: link.assembly_id(),
        })
    };
    let links: Option<Vec<_>> = handles.iter().map(link).collect();
    links.ok_or_else(|| SimError::Robot("no joint moves".to_owned()))
}

/// Returns the joint for Rapier, with the joint's axis as the z axis of its frames.
fn rapier_joint(joint: &MovingJoint) -> GenericJoint {
    let body_from_joint = UnitQuaternion::rotation_between(&Vector3::z(), &joint.axis)
        .unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        });
    let body_from_joint = Isometry3::from_parts(Vector3::zeros().into(), body_from_joint);
    let free = if joint.prismatic {
        JointAxesMask::LIN_Z
    } else {
        JointAxesMask::ANG_Z
    };
    GenericJointBuilder::new(JointAxesMask::all() - free)
        .local_frame1(glam_pose(&(joint.parent_from_body * body_from_joint)))
        .local_frame2(glam_pose(&body_from_joint))
        .contacts_enabled(false)
        .build()
}

fn rapier_mass(mass: &MassProperties) -> RapierMassProperties {
    RapierMassProperties::with_inertia_matrix(
        glam_vector(&mass.center_of_mass),
        mass.mass_kg,
        glam_matrix(&mass.inertia),
    )
}

fn payload_body(mass: &MassProperties) -> RigidBodyBuilder {
    let about_com = MassProperties {
        center_of_mass: Vector3::zeros(),
        ..*mass
    };
    RigidBodyBuilder::dynamic()
        .can_sleep(false)
        .additional_mass_properties(rapier_mass(&about_com))
        .gyroscopic_forces_enabled(true)
}

/// Returns the handle in the payload's frame.
fn handle_shape(experiment: &Experiment) -> BoxShape {
    let handle = &experiment.payload.handle;
    let center =
        Vector3::from(handle.center_m) - Vector3::from(experiment.payload.center_of_mass_m);
    BoxShape {
        body_from_box: Isometry3::translation(center.x, center.y, center.z),
        half_size: Vector3::from(handle.size_m) * 0.5,
    }
}

fn pad_or_handle(shape: &BoxShape, own: Group, other: Group, friction: f64) -> Collider {
    let half = shape.half_size;
    ColliderBuilder::cuboid(half.x, half.y, half.z)
        .position(glam_pose(&shape.body_from_box))
        .density(0.0)
        .friction(friction)
        .collision_groups(InteractionGroups::new(own, other, InteractionTestMode::And))
        .active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS)
        .build()
}
