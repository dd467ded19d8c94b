//! The robot of a URDF as the rigid bodies that physics moves: what fixed joints hold together is one body.

use std::collections::HashMap;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use tactid_dynamics::{
    BaseKind, InertialParameters, Manipulator, MassProperties, symmetric_matrix,
};
use urdf_rs::{Geometry, JointType};

use crate::SimError;
use crate::experiment::BaseProperties;

/// The robot that is built in: `robots/tactid.urdf`.
pub const BUILT_IN_URDF: &str = include_str!("../robots/tactid.urdf");

/// A box fixed to a body.
#[derive(Clone, Debug)]
pub(crate) struct BoxShape {
    pub body_from_box: Isometry3<f64>,
    pub half_size: Vector3<f64>,
}

/// How a body moves with respect to its parent.
#[derive(Clone, Debug)]
pub(crate) struct MovingJoint {
    pub name: String,
    pub prismatic: bool,
    /// In the body's frame.
    pub axis: Unit<Vector3<f64>>,
    pub parent: usize,
    /// The body's frame at joint position zero.
    pub parent_from_body: Isometry3<f64>,
    pub limits: Option<(f64, f64)>,
}

/// A moving link and all that is fixed to it. Its frame is the link's; the base's stands at its centre of mass.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// `None` for the base.
    pub joint: Option<MovingJoint>,
    /// In the body's frame.
    pub mass: MassProperties,
    pub boxes: Vec<BoxShape>,
}

/// Where a link stands on its body.
#[derive(Clone, Debug)]
pub(crate) struct LinkFrame {
    pub name: String,
    pub body: usize,
    pub body_from_link: Isometry3<f64>,
    /// The link above it, and this link seen from there, where a fixed joint holds it.
    pub fixed_to: Option<(String, Isometry3<f64>)>,
    /// The link above it, where a moving joint carries it.
    pub carried_by: Option<String>,
}

/// The robot, its bodies ordered parents first, depth first.
#[derive(Clone, Debug)]
pub(crate) struct Robot {
    /// The description that is true of these bodies.
    pub urdf: String,
    pub bodies: Vec<Body>,
    pub links: Vec<LinkFrame>,
}

impl Robot {
    /// Reads `xml`; `base` replaces the mass properties of the root link.
    pub(crate) fn from_urdf(xml: &str, base: Option<&BaseProperties>) -> Result<Self, SimError> {
        let (mut urdf, mut text) = (parse(xml)?, xml.to_owned());
        // The dynamics crate knows every way in which a URDF can be wrong.
        let model = Manipulator::from_urdf(xml, BaseKind::Floating)?;
        let root = model.frame_name(model.base_frame()).to_owned();
        if let Some(base) = base {
            replace_inertial(&mut urdf, &root, base);
            text = urdf_rs::write_to_string(&urdf).map_err(|e| SimError::Robot(e.to_string()))?;
        }
        let mut robot = Self {
            urdf: text,
            bodies: Vec::new(),
            links: Vec::new(),
        };
        Reader::new(&urdf).read(&root, &mut robot)?;
        Ok(robot)
    }

    pub(crate) fn link(&self, name: &str) -> Result<&LinkFrame, SimError> {
        self.links.iter().find(|l| l.name == name).ok_or_else(|| {
            let known: Vec<_> = self.links.iter().map(|l| l.name.as_str()).collect();
            SimError::Robot(format!(
                "there is no link `{name}`; the robot has {}",
                known.join(", ")
            ))
        })
    }

    /// The bodies that joints move, with their joints, in the order of the joint vector.
    pub(crate) fn joints(&self) -> impl Iterator<Item = (usize, &MovingJoint)> {
        self.bodies
            .iter()
            .enumerate()
            .filter_map(|(index, body)| body.joint.as_ref().map(|joint| (index, joint)))
    }
}

fn parse(xml: &str) -> Result<urdf_rs::Robot, SimError> {
    urdf_rs::read_from_string(xml).map_err(|e| SimError::Robot(format!("not a URDF: {e}")))
}

fn replace_inertial(urdf: &mut urdf_rs::Robot, root: &str, base: &BaseProperties) {
    let inertia = base.inertia_kg_m2;
    for link in urdf.links.iter_mut().filter(|link| link.name == root) {
        link.inertial.mass.value = base.mass_kg;
        link.inertial.origin = urdf_rs::Pose {
            xyz: urdf_rs::Vec3(base.center_of_mass_m),
            rpy: urdf_rs::Vec3([0.0; 3]),
        };
        let [ixx, ixy, ixz, iyy, iyz, izz] = inertia;
        link.inertial.inertia = urdf_rs::Inertia {
            ixx,
            ixy,
            ixz,
            iyy,
            iyz,
            izz,
        };
    }
}

fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(
        Translation3::from(Vector3::from(pose.xyz.0)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

/// A body while its fixed links are being gathered.
struct Gathered {
    joint: Option<MovingJoint>,
    inertia: InertialParameters,
    boxes: Vec<BoxShape>,
}

struct Reader<'a> {
    links: HashMap<&'a str, &'a urdf_rs::Link>,
    below: HashMap<&'a str, Vec<&'a urdf_rs::Joint>>,
    gathered: Vec<Gathered>,
}

impl<'a> Reader<'a> {
    fn new(urdf: &'a urdf_rs::Robot) -> Self {
        let mut below: HashMap<_, Vec<_>> = HashMap::new();
        for joint in &urdf.joints {
            below
                .entry(joint.parent.link.as_str())
                .or_default()
                .push(joint);
        }
        Self {
            links: urdf.links.iter().map(|l| (l.name.as_str(), l)).collect(),
            below,
            gathered: Vec::new(),
        }
    }

    fn read(mut self, root: &'a str, robot: &mut Robot) -> Result<(), SimError> {
        self.gathered.push(Gathered {
            joint: None,
            inertia: InertialParameters::zero(),
            boxes: Vec::new(),
        });
        let frame = LinkFrame {
            name: root.to_owned(),
            body: 0,
            body_from_link: Isometry3::identity(),
            fixed_to: None,
            carried_by: None,
        };
        self.visit(root, frame, robot)?;
        for body in self.gathered {
            let mass = body.inertia.mass_properties().ok_or_else(|| {
                SimError::Robot("a moving body without mass".to_owned()) // named by the dynamics crate before
            })?;
            robot.bodies.push(Body {
                joint: body.joint,
                mass,
                boxes: body.boxes,
            });
        }
        move_base_to_center_of_mass(robot);
        Ok(())
    }

    /// Adds a link to its body, then all below it, depth first in the file's order.
    fn visit(
        &mut self,
        name: &'a str,
        frame: LinkFrame,
        robot: &mut Robot,
    ) -> Result<(), SimError> {
        let (body, body_from_link) = (frame.body, frame.body_from_link);
        if let Some(link) = self.links.get(name) {
            let gathered = &mut self.gathered[body];
            gathered.inertia = gathered.inertia + inertia(link).expressed_in(&body_from_link);
            gathered.boxes.extend(boxes(link, &body_from_link));
        }
        robot.links.push(frame);
        for joint in self.below.get(name).cloned().unwrap_or_default() {
            let child = joint.child.link.as_str();
            let link_from_child = isometry(&joint.origin);
            let frame = if joint.joint_type == JointType::Fixed {
                LinkFrame {
                    name: child.to_owned(),
                    body,
                    body_from_link: body_from_link * link_from_child,
                    fixed_to: Some((name.to_owned(), link_from_child)),
                    carried_by: None,
                }
            } else {
                let joint = moving_joint(joint, body, body_from_link * link_from_child)?;
                self.gathered.push(Gathered {
                    joint: Some(joint),
                    inertia: InertialParameters::zero(),
                    boxes: Vec::new(),
                });
                LinkFrame {
                    name: child.to_owned(),
                    body: self.gathered.len() - 1,
                    body_from_link: Isometry3::identity(),
                    fixed_to: None,
                    carried_by: Some(name.to_owned()),
                }
            };
            self.visit(child, frame, robot)?;
        }
        Ok(())
    }
}

fn moving_joint(
    joint: &urdf_rs::Joint,
    parent: usize,
    parent_from_body: Isometry3<f64>,
) -> Result<MovingJoint, SimError> {
    if joint.mimic.is_some() {
        return Err(SimError::Robot(format!(
            "joint `{}` mimics another, which the simulation does not do: drive it by itself or make it fixed",
            joint.name
        )));
    }
    let axis = Unit::try_new(Vector3::from(joint.axis.xyz.0), 1e-9).ok_or_else(|| {
        SimError::Robot(format!("joint `{}` has an axis of length 0", joint.name))
    })?;
    let limited =
        joint.joint_type != JointType::Continuous && joint.limit.lower < joint.limit.upper;
    Ok(MovingJoint {
        name: joint.name.clone(),
        prismatic: joint.joint_type == JointType::Prismatic,
        axis,
        parent,
        parent_from_body,
        limits: limited.then_some((joint.limit.lower, joint.limit.upper)),
    })
}

fn inertia(link: &urdf_rs::Link) -> InertialParameters {
    let i = &link.inertial.inertia;
    let about_com = MassProperties {
        mass_kg: link.inertial.mass.value,
        center_of_mass: Vector3::zeros(),
        inertia: symmetric_matrix([i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz]),
    };
    InertialParameters::from(about_com).expressed_in(&isometry(&link.inertial.origin))
}

fn boxes(link: &urdf_rs::Link, body_from_link: &Isometry3<f64>) -> Vec<BoxShape> {
    link.collision
        .iter()
        .filter_map(|collision| match &collision.geometry {
            Geometry::Box { size } => Some(BoxShape {
                body_from_box: body_from_link * isometry(&collision.origin),
                half_size: Vector3::from(size.0) * 0.5,
            }),
            _ => None,
        })
        .collect()
}

/// Rapier integrates the root of a multibody wrongly unless its frame stands at its centre of mass.
fn move_base_to_center_of_mass(robot: &mut Robot) {
    let shift = -robot.bodies[0].mass.center_of_mass;
    let new_from_old = Isometry3::translation(shift.x, shift.y, shift.z);
    robot.bodies[0].mass.center_of_mass = Vector3::zeros();
    for shape in &mut robot.bodies[0].boxes {
        shape.body_from_box = new_from_old * shape.body_from_box;
    }
    for joint in robot.bodies.iter_mut().filter_map(|b| b.joint.as_mut()) {
        if joint.parent == 0 {
            joint.parent_from_body = new_from_old * joint.parent_from_body;
        }
    }
    for link in robot.links.iter_mut().filter(|l| l.body == 0) {
        link.body_from_link = new_from_old * link.body_from_link;
    }
}
