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
use rapier3d_f64::pipeline::{ActiveHooks, PhysicsPipeline};
use tactid_dynamics::MassProperties;

use super::{DRIVE_DAMPING, Link, Pad, Scene, integration_parameters};
use crate::contact::SlipAnchors;
use crate::convert::{glam_matrix, glam_pose, glam_vector};
use crate::robot::{BoxShape, MovingJoint, Robot};
use crate::{BaseProperties, Experiment, SimError};

/// Collision group of the pads, which collide with the handle only.
const PADS: Group = Group::GROUP_1;
/// Collision group of the handle, which collides with the pads only.
const HANDLE: Group = Group::GROUP_2;

/// Distance of each pad from the handle before the gripper closes, m.
const CLEARANCE_M: f64 = 20e-6;

impl Scene {
    /// Builds the experiment's robot in its posture, at rest, with the base's centre of mass at the world's origin.
    ///
    /// # Errors
    /// Returns a fault of the robot, or [`SimError::Grasp`] if the fingers do not reach the handle.
    pub(crate) fn new(experiment: &Experiment) -> Result<Self, SimError> {
        let base = experiment
            .base
            .as_ref()
            .map(BaseProperties::mass_properties);
        let robot = Robot::from_urdf(&experiment.urdf()?, base.as_ref())?;
        let tool = robot.link(&experiment.robot.tool)?.clone();
        let fingers = fingers(&robot, experiment)?;
        let (mut bodies, mut multibody_joints) = (RigidBodySet::new(), MultibodyJointSet::new());
        let handles = insert_bodies(&robot, fingers, &mut bodies, &mut multibody_joints)?;
        let links = find_links(&handles, &multibody_joints)?;
        let multibody = multibody_joints
            .rigid_body_link(handles[0])
            .ok_or_else(|| SimError::Robot("no joint moves".to_owned()))?
            .multibody;
        let mut colliders = ColliderSet::new();
        let friction = experiment.gripper.friction;
        let pads = fingers.map(|link| {
            let shapes = robot.bodies[link].boxes.iter();
            let boxes = shapes.map(|shape| pad_or_handle(shape, PADS, HANDLE, friction));
            let insert = |pad| colliders.insert_with_parent(pad, handles[link], &mut bodies);
            let colliders = boxes.map(insert).collect();
            Pad { link, colliders }
        });
        let payload = bodies.insert(payload_body(&experiment.payload.mass_properties()));
        let handle = pad_or_handle(&handle_shape(experiment), HANDLE, PADS, friction);
        let handle = colliders.insert_with_parent(handle, payload, &mut bodies);
        let anchors = SlipAnchors::new(
            fingers.map(|link| handles[link]),
            payload,
            experiment.step_s,
        );
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
            drives: arm(&robot, fingers),
            robot,
        };
        scene.take_posture(experiment)?;
        let world_from_tool = scene.body_pose(tool.body) * tool.body_from_link;
        scene.place_payload(experiment, &world_from_tool);
        scene.close_to_clearance(experiment, &world_from_tool)?;
        Ok(scene)
    }

    fn body_pose(&self, body: usize) -> Isometry3<f64> {
        crate::convert::pose(self.bodies[self.links[body].handle].position())
    }

    fn take_posture(&mut self, experiment: &Experiment) -> Result<(), SimError> {
        let positions = experiment.posture.positions();
        if positions.len() != self.drives.len() {
            return Err(SimError::Robot(format!(
                "the posture has {} joint positions, but the arm has {} joints",
                positions.len(),
                self.drives.len()
            )));
        }
        let drives = self.drives.clone();
        for (&body, &position) in drives.iter().zip(&positions) {
            self.check_limits(body, position)?;
        }
        let dofs: Vec<_> = drives.iter().map(|&body| self.links[body].dof).collect();
        self.displace(&dofs, &positions);
        Ok(())
    }

    fn check_limits(&self, body: usize, position: f64) -> Result<(), SimError> {
        match &self.robot.bodies[body].joint {
            Some(MovingJoint {
                name,
                limits: Some((lower, upper)),
                ..
            }) if !(*lower..=*upper).contains(&position) => Err(SimError::Robot(format!(
                "joint `{name}` would begin at {position}, outside its limits {lower} to {upper}"
            ))),
            _ => Ok(()),
        }
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
        for &body in &self.drives {
            multibody.damping_mut()[self.links[body].dof] = DRIVE_DAMPING;
        }
    }

    /// Places the payload, whose frame is at its centre of mass with the axes of the tool frame.
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
        let fingers = self.finger_bodies();
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
            if self.check_limits(finger, *position).is_err() || *position < 0.0 {
                return Err(SimError::Grasp(format!(
                    "finger `{}` would have to begin at {:.4} m to touch the handle, outside its travel; change payload.handle",
                    joint.name, position
                )));
            }
        }
        let dofs = fingers.map(|finger| self.links[finger].dof);
        self.displace(&dofs, &positions);
        Ok(())
    }
}

/// Returns the largest coordinate of a box along the unit vector `direction`, m.
fn extent(shape: &BoxShape, world_from_body: &Isometry3<f64>, direction: &Vector3<f64>) -> f64 {
    let pose = world_from_body * shape.body_from_box;
    let along = pose.rotation.inverse() * direction;
    pose.translation.vector.dot(direction) + along.abs().dot(&shape.half_size)
}

fn fingers(robot: &Robot, experiment: &Experiment) -> Result<[usize; 2], SimError> {
    let find = |name: &String| {
        let (body, joint) = robot
            .joints()
            .find(|(_, joint)| joint.name == *name)
            .ok_or_else(|| SimError::Robot(format!("there is no finger joint `{name}`")))?;
        if !joint.prismatic {
            return Err(SimError::Robot(format!(
                "finger joint `{name}` is not prismatic"
            )));
        }
        if robot.bodies[body].boxes.is_empty() {
            return Err(SimError::Robot(format!(
                "the link of finger joint `{name}` has no collision box for a pad"
            )));
        }
        Ok(body)
    };
    let [left, right] = &experiment.robot.fingers;
    Ok([find(left)?, find(right)?])
}

/// Returns the indices of the bodies that the arm's joints move, without the fingers.
fn arm(robot: &Robot, fingers: [usize; 2]) -> Vec<usize> {
    let bodies = robot.joints().map(|(body, _)| body);
    bodies.filter(|body| !fingers.contains(body)).collect()
}

fn insert_bodies(
    robot: &Robot,
    fingers: [usize; 2],
    bodies: &mut RigidBodySet,
    joints: &mut MultibodyJointSet,
) -> Result<Vec<RigidBodyHandle>, SimError> {
    let mut handles: Vec<RigidBodyHandle> = Vec::with_capacity(robot.bodies.len());
    for (index, body) in robot.bodies.iter().enumerate() {
        let handle = bodies.insert(
            RigidBodyBuilder::dynamic()
                .can_sleep(false)
                .additional_mass_properties(rapier_mass(&body.mass)),
        );
        handles.push(handle);
        if let Some(joint) = &body.joint {
            let (parent, data) = (handles[joint.parent], rapier_joint(joint));
            // A finger is moved, not driven: no force of the payload opens it, and locked it is rigid.
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

/// Returns the joint for Rapier, with frames whose z axis is the joint's axis.
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
