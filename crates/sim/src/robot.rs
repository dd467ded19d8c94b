//! The robot of a URDF as the rigid bodies that the physics engine moves. Links joined by fixed
//! joints are one body.

use nalgebra::{Isometry3, Matrix3, Unit, Vector3};
use tactid_dynamics::{
    BaseKind, BodyView, JointKind, JointView, LinkView, Manipulator, MassProperties, Urdf,
    urdf_rs::Geometry,
};

use crate::SimError;

/// URDF of the built-in robot, `robots/tactid.urdf`.
pub const BUILT_IN_URDF: &str = include_str!("../robots/tactid.urdf");

/// A box that is fixed to a body.
#[derive(Clone, Debug)]
pub(crate) struct BoxShape {
    /// Pose of the box's centre in the body's frame.
    pub body_from_box: Isometry3<f64>,
    /// Half the lengths of the sides, m.
    pub half_size: Vector3<f64>,
}

/// The joint that moves a body relative to its parent.
#[derive(Clone, Debug)]
pub(crate) struct MovingJoint {
    pub name: String,
    pub prismatic: bool,
    /// Axis, expressed in the body's frame.
    pub axis: Unit<Vector3<f64>>,
    /// Index of the parent body.
    pub parent: usize,
    /// Pose of the body's frame in the parent's at joint position zero.
    pub parent_from_body: Isometry3<f64>,
    /// Lower and upper limit of the position, rad or m.
    pub limits: Option<(f64, f64)>,
}

/// A moving link with all links fixed to it. Its frame is the link's, except that the frame of a
/// floating base is at the base's centre of mass.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// Joint that moves the body; `None` for the base.
    pub joint: Option<MovingJoint>,
    /// Mass properties in the body's frame; zero for a fixed base without mass.
    pub mass: MassProperties,
    pub boxes: Vec<BoxShape>,
}

/// A link and its pose on its body.
#[derive(Clone, Debug)]
pub(crate) struct LinkFrame {
    pub name: String,
    /// Index of the body that the link is fixed to.
    pub body: usize,
    pub body_from_link: Isometry3<f64>,
    /// Parent link and the pose of this link in its frame, if a fixed joint connects them.
    pub fixed_to: Option<(String, Isometry3<f64>)>,
    /// Parent link, if a moving joint connects them.
    pub carried_by: Option<String>,
}

/// The robot: bodies and links in depth-first order, the base and the root link first.
#[derive(Clone, Debug)]
pub(crate) struct Robot {
    /// URDF of the robot with the experiment's base.
    pub urdf: String,
    pub base: BaseKind,
    pub bodies: Vec<Body>,
    pub links: Vec<LinkFrame>,
}

impl Robot {
    /// Builds the robot of a URDF; `base_mass` replaces the mass properties of the root link.
    ///
    /// # Errors
    /// Returns [`SimError::Model`] for a URDF that `tactid_dynamics` refuses or with bodies that
    /// cannot exist, and [`SimError::Robot`] for a mimic joint.
    pub(crate) fn from_urdf(
        xml: &str,
        base: BaseKind,
        base_mass: Option<&MassProperties>,
    ) -> Result<Self, SimError> {
        let mut urdf = Urdf::from_xml(xml)?;
        if let Some(mass) = base_mass {
            let root = urdf.root_link().to_owned();
            urdf.set_mass_properties(&root, mass)?;
        }
        let mut joints = urdf.robot().joints.iter();
        if let Some(joint) = joints.find(|joint| joint.mimic.is_some()) {
            return Err(SimError::Robot(format!(
                "joint `{}` mimics another, which the simulation does not support: drive it by itself or make it fixed",
                joint.name
            )));
        }
        let model = urdf.manipulator(base)?;
        model.check_bodies()?;
        let mut robot = Self {
            urdf: urdf.xml().to_owned(),
            base,
            bodies: bodies(&model),
            links: links(&model),
        };
        for link in model.links() {
            for shape in urdf.collision_boxes(link.name)? {
                if let Ok(Geometry::Box { size }) = shape.geometry {
                    robot.bodies[link.body].boxes.push(BoxShape {
                        body_from_box: link.body_from_link * shape.link_from_shape,
                        half_size: 0.5 * Vector3::from(*size),
                    });
                }
            }
        }
        if base == BaseKind::Floating {
            move_base_to_center_of_mass(&mut robot);
        }
        Ok(robot)
    }

    /// Returns the link with a name, or `None` if the robot does not have it.
    pub(crate) fn link(&self, name: &str) -> Option<&LinkFrame> {
        self.links.iter().find(|link| link.name == name)
    }

    /// Returns the name of the link that a body's joint moves; empty for the base.
    pub(crate) fn moved_link(&self, body: usize) -> &str {
        let mut links = self.links.iter();
        let link = links.find(|link| link.body == body && link.carried_by.is_some());
        link.map_or("", |link| link.name.as_str())
    }

    /// Returns index and joint of each body that a joint moves, in the order of the joint vector.
    pub(crate) fn joints(&self) -> impl Iterator<Item = (usize, &MovingJoint)> {
        self.bodies
            .iter()
            .enumerate()
            .filter_map(|(index, body)| body.joint.as_ref().map(|joint| (index, joint)))
    }
}

/// Returns the bodies of a robot, without their boxes.
fn bodies(model: &Manipulator) -> Vec<Body> {
    let massless = MassProperties {
        mass_kg: 0.0,
        center_of_mass: Vector3::zeros(),
        inertia: Matrix3::zeros(),
    };
    let body = |body: BodyView<'_>| Body {
        joint: body.joint.map(|joint| moving_joint(&joint)),
        mass: body.parameters.mass_properties().unwrap_or(massless),
        boxes: Vec::new(),
    };
    model.bodies().map(body).collect()
}

fn moving_joint(joint: &JointView<'_>) -> MovingJoint {
    MovingJoint {
        name: joint.name.to_owned(),
        prismatic: joint.kind == JointKind::Prismatic,
        axis: joint.axis,
        parent: joint.parent,
        parent_from_body: joint.parent_from_body,
        limits: joint.limits,
    }
}

/// Returns the links of a robot, each with its relation to its parent link.
fn links(model: &Manipulator) -> Vec<LinkFrame> {
    let views: Vec<LinkView<'_>> = model.links().collect();
    let frame = |link: &LinkView<'_>| {
        let parent = link.parent.map(|parent| &views[parent]);
        let (fixed, moving) = match parent {
            Some(parent) if parent.body == link.body => (Some(parent), None),
            other => (None, other),
        };
        LinkFrame {
            name: link.name.to_owned(),
            body: link.body,
            body_from_link: link.body_from_link,
            fixed_to: fixed.map(|parent| {
                let parent_from_link = parent.body_from_link.inv_mul(&link.body_from_link);
                (parent.name.to_owned(), parent_from_link)
            }),
            carried_by: moving.map(|parent| parent.name.to_owned()),
        }
    };
    views.iter().map(frame).collect()
}

/// Moves the base's frame to the base's centre of mass, because Rapier integrates the root of a
/// multibody wrongly elsewhere.
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
