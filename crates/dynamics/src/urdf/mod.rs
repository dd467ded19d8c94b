//! Construction of a [`Manipulator`] from a URDF, and what else a program needs from the same file.

mod names;
mod tree;

use std::path::Path;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use urdf_rs::{Geometry, JointType};

use crate::manipulator::{BaseKind, Manipulator, check_body};
use crate::{InertialParameters, MassProperties, ModelError, symmetric_entries, symmetric_matrix};
use names::without_prefixed_names;
use tree::Tree;

/// A box that is fixed to a link, from a `<collision>` element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollisionBox {
    /// Pose of the box's centre in the link's frame.
    pub link_from_box: Isometry3<f64>,
    /// Half the lengths of the box's sides, m.
    pub half_size: Vector3<f64>,
}

/// A URDF whose links and joints form one tree.
///
/// This is the only reader of URDFs: [`Manipulator::from_urdf`] and the simulator use it, so that both accept the same
/// files. Mesh files need not exist. Names with an XML prefix, as in `drake:acceleration`, are ignored whether or not
/// the prefix is declared, as ROS tools do.
///
/// ```
/// use tactid_dynamics::{BaseKind, Urdf};
///
/// let urdf = Urdf::from_xml(r#"<robot name="pendulum">
///   <link name="base"/>
///   <link name="arm"><inertial><mass value="2"/>
///     <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
///   <joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/>
///     <limit lower="-1" upper="2" effort="10" velocity="1" drake:acceleration="5"/></joint>
/// </robot>"#)?;
/// assert_eq!(urdf.root_link(), "base");
/// assert_eq!(urdf.joint_limits("hinge"), Some((-1.0, 2.0)));
/// assert_eq!(urdf.manipulator(BaseKind::Fixed)?.mass(), 2.0);
/// # Ok::<(), tactid_dynamics::ModelError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Urdf {
    description: urdf_rs::Robot,
    root: String,
}

impl Urdf {
    /// Reads the text of a URDF.
    ///
    /// # Errors
    /// Returns [`ModelError::Syntax`] for text that is not a URDF, and [`ModelError::Duplicate`],
    /// [`ModelError::MissingLink`], [`ModelError::Loop`] or [`ModelError::Roots`] for links that do not form one tree.
    pub fn from_xml(xml: &str) -> Result<Self, ModelError> {
        let description = urdf_rs::read_from_string(&without_prefixed_names(xml)?)
            .map_err(|error| ModelError::Syntax(error.to_string()))?;
        let root = Tree::new(&description)?.root()?.to_owned();
        Ok(Self { description, root })
    }

    /// Reads a URDF file.
    ///
    /// # Errors
    /// Returns [`ModelError::File`] if the file cannot be read, and the errors of [`Self::from_xml`].
    pub fn from_file(path: &Path) -> Result<Self, ModelError> {
        let xml = std::fs::read_to_string(path).map_err(|source| ModelError::File {
            path: path.display().to_string(),
            source,
        })?;
        Self::from_xml(&xml)
    }

    /// Returns the text of the URDF. It has the same links and joints as the text that was read, but no prefixed names.
    ///
    /// # Errors
    /// Returns [`ModelError::Syntax`] if the description cannot be written as XML.
    pub fn to_xml(&self) -> Result<String, ModelError> {
        urdf_rs::write_to_string(&self.description)
            .map_err(|error| ModelError::Syntax(error.to_string()))
    }

    /// Returns the name of the root link.
    #[must_use]
    pub fn root_link(&self) -> &str {
        &self.root
    }

    /// Builds the model of the whole robot. A link without `<inertial>` has no mass, see [`Manipulator::check_masses`].
    ///
    /// # Errors
    /// Returns a [`ModelError`] that names the link or joint at fault: an impossible mass, inertia, axis or joint type, a
    /// number that is not finite, or a mimic joint that cannot be honoured.
    pub fn manipulator(&self, base_kind: BaseKind) -> Result<Manipulator, ModelError> {
        Tree::new(&self.description)?.build(base_kind, &self.root)
    }

    /// Builds the model of the link `base` and of all links below it. `base` becomes the base of the robot.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`] for an unknown link, and the errors of [`Self::manipulator`].
    pub fn manipulator_below(
        &self,
        base_kind: BaseKind,
        base: &str,
    ) -> Result<Manipulator, ModelError> {
        Tree::new(&self.description)?.build(base_kind, base)
    }

    /// Replaces the mass properties of a link, expressed in the link's frame.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`] for an unknown link, and [`ModelError::Mass`], [`ModelError::Inertia`] or
    /// [`ModelError::NotFinite`] for an impossible body.
    pub fn set_mass_properties(
        &mut self,
        link: &str,
        body: &MassProperties,
    ) -> Result<(), ModelError> {
        check_body(link, &(*body).into())?;
        let inertial = &mut self.link_mut(link)?.inertial;
        inertial.mass.value = body.mass_kg;
        inertial.origin = urdf_rs::Pose {
            xyz: urdf_rs::Vec3(body.center_of_mass.into()),
            rpy: urdf_rs::Vec3([0.0; 3]),
        };
        let [ixx, ixy, ixz, iyy, iyz, izz] = symmetric_entries(&body.inertia);
        inertial.inertia = urdf_rs::Inertia {
            ixx,
            ixy,
            ixz,
            iyy,
            iyz,
            izz,
        };
        Ok(())
    }

    /// Returns the boxes among the collision shapes of a link. Other shapes are skipped.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`] for an unknown link, [`ModelError::NotFinite`] for a pose or size that is not
    /// finite, and [`ModelError::BoxSize`] for a side that is not positive.
    pub fn collision_boxes(&self, link: &str) -> Result<Vec<CollisionBox>, ModelError> {
        let mut boxes = Vec::new();
        for collision in &self.link(link)?.collision {
            let Geometry::Box { size } = &collision.geometry else {
                continue;
            };
            let half_size = Vector3::from(size.0) * 0.5;
            if !half_size.iter().all(|side| side.is_finite()) {
                return Err(not_finite("the size of a collision box", link));
            }
            if half_size.min() <= 0.0 {
                return Err(ModelError::BoxSize(link.to_owned()));
            }
            boxes.push(CollisionBox {
                link_from_box: isometry(&collision.origin, "the collision origin", link)?,
                half_size,
            });
        }
        Ok(boxes)
    }

    /// Returns the lower and upper limit of a joint's position, rad or m, or `None` for a joint that is unknown,
    /// continuous or fixed, or whose lower limit is not below the upper one.
    #[must_use]
    pub fn joint_limits(&self, joint: &str) -> Option<(f64, f64)> {
        let mut joints = self.description.joints.iter();
        let joint = joints.find(|known| known.name == joint)?;
        let limited = matches!(joint.joint_type, JointType::Revolute | JointType::Prismatic);
        let (lower, upper) = (joint.limit.lower, joint.limit.upper);
        (limited && lower < upper).then_some((lower, upper))
    }

    /// Returns the names of the joints that mimic another joint, in the order of the file.
    pub fn mimic_joints(&self) -> impl Iterator<Item = &str> {
        let joints = self.description.joints.iter();
        let mimics = joints.filter(|joint| joint.mimic.is_some());
        mimics.map(|joint| joint.name.as_str())
    }

    fn link(&self, name: &str) -> Result<&urdf_rs::Link, ModelError> {
        let links = &self.description.links;
        let found = links.iter().find(|link| link.name == name);
        found.ok_or_else(|| self.unknown(name))
    }

    fn link_mut(&mut self, name: &str) -> Result<&mut urdf_rs::Link, ModelError> {
        let error = self.unknown(name);
        let mut links = self.description.links.iter_mut();
        links.find(|link| link.name == name).ok_or(error)
    }

    fn unknown(&self, name: &str) -> ModelError {
        let links = self.description.links.iter();
        ModelError::unknown_frame(name, links.map(|link| link.name.as_str()))
    }
}

impl Manipulator {
    /// Builds a robot from the text of a URDF.
    ///
    /// # Errors
    /// Returns the errors of [`Urdf::from_xml`] and [`Urdf::manipulator`].
    pub fn from_urdf(xml: &str, base_kind: BaseKind) -> Result<Self, ModelError> {
        Urdf::from_xml(xml)?.manipulator(base_kind)
    }

    /// Builds a robot from a URDF file.
    ///
    /// # Errors
    /// Returns the errors of [`Urdf::from_file`] and [`Urdf::manipulator`].
    pub fn from_urdf_file(path: &Path, base_kind: BaseKind) -> Result<Self, ModelError> {
        Urdf::from_file(path)?.manipulator(base_kind)
    }

    /// Builds a robot from the text of a URDF: the link `base` and all links below it, or the whole robot for `None`.
    ///
    /// # Errors
    /// Returns the errors of [`Urdf::from_xml`] and [`Urdf::manipulator_below`].
    pub fn from_urdf_below(
        xml: &str,
        base_kind: BaseKind,
        base: Option<&str>,
    ) -> Result<Self, ModelError> {
        let urdf = Urdf::from_xml(xml)?;
        urdf.manipulator_below(base_kind, base.unwrap_or(urdf.root_link()))
    }
}

fn not_finite(what: &'static str, name: &str) -> ModelError {
    ModelError::NotFinite {
        what,
        name: name.to_owned(),
    }
}

/// Returns an `<origin>` as a transform; `what` and `name` identify it in an error.
fn isometry(
    origin: &urdf_rs::Pose,
    what: &'static str,
    name: &str,
) -> Result<Isometry3<f64>, ModelError> {
    let ([x, y, z], [roll, pitch, yaw]) = (origin.xyz.0, origin.rpy.0);
    if ![x, y, z, roll, pitch, yaw].iter().all(|v| v.is_finite()) {
        return Err(not_finite(what, name));
    }
    Ok(Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    ))
}

/// Returns the inertial parameters of a link in the link's frame; zero for a link without mass.
fn link_parameters(link: &urdf_rs::Link) -> Result<InertialParameters, ModelError> {
    let inertial = &link.inertial;
    let inertia = &inertial.inertia;
    let entries = [
        inertia.ixx,
        inertia.ixy,
        inertia.ixz,
        inertia.iyy,
        inertia.iyz,
        inertia.izz,
    ];
    let mass_kg = inertial.mass.value;
    // urdf-rs returns zeros for a link without <inertial>.
    if mass_kg == 0.0 && entries.iter().all(|&entry| entry == 0.0) {
        return Ok(InertialParameters::zero());
    }
    let link_from_inertial = isometry(&inertial.origin, "the inertial origin", &link.name)?;
    let body = InertialParameters::from(MassProperties {
        mass_kg,
        center_of_mass: Vector3::zeros(),
        inertia: symmetric_matrix(entries),
    });
    check_body(&link.name, &body)?;
    Ok(body.expressed_in(&link_from_inertial))
}
