//! Construction of a [`Manipulator`] from a URDF, and what else a program needs from the same file.

mod build;
mod element;
mod ignored;
mod inertial;
mod mimic;
mod numbers;
mod shapes;
mod tree;

use std::{collections::HashMap, path::Path};

use nalgebra::{Isometry3, Vector3};

use crate::manipulator::{BaseKind, Manipulator, check_body};
use crate::{MassProperties, ModelError, read_text};
use build::build;
use element::{Element, parse, syntax};
use shapes::shape_of;
use tree::{Tree, position_limits, positive_limit};

pub use shapes::{CollisionGeometry, CollisionShape};

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
/// the prefix is declared, as ROS tools do. What is wrong with masses, inertias and optional elements prevents no model:
/// [`Manipulator::findings`] reports it.
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
/// assert_eq!((urdf.velocity_limit("hinge"), urdf.effort_limit("hinge")), (Some(1.0), Some(10.0)));
/// assert_eq!(urdf.manipulator(BaseKind::Fixed)?.mass(), 2.0);
/// # Ok::<(), tactid_dynamics::ModelError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Urdf {
    text: String,
    /// The element `<robot>` of the text.
    robot: Element,
    root: String,
    /// Index of each link's element among the children of `robot`.
    links: HashMap<String, usize>,
    /// Index of each joint's element among the children of `robot`.
    joints: HashMap<String, usize>,
}

impl Urdf {
    /// Reads the text of a URDF.
    ///
    /// # Errors
    /// Returns [`ModelError::Syntax`] for text that is not a URDF, and [`ModelError::Duplicate`],
    /// [`ModelError::MissingLink`], [`ModelError::Loop`] or [`ModelError::Roots`] for links that do not form one tree.
    pub fn from_xml(xml: &str) -> Result<Self, ModelError> {
        let text = xml.trim_start_matches('\u{feff}').to_owned();
        let robot = parse(&text)?;
        if robot.name != "robot" {
            let message = format!("the root element is <{}>, not <robot>", robot.name);
            return Err(syntax(&text, robot.span.start, &message));
        }
        let root = Tree::new(&text, &robot)?.root()?;
        let root = root.ok_or_else(|| no_link(&robot))?.to_owned();
        Ok(Self {
            links: indices(&robot, "link"),
            joints: indices(&robot, "joint"),
            text,
            robot,
            root,
        })
    }

    /// Reads a URDF file.
    ///
    /// # Errors
    /// Returns [`ModelError::File`] if the file cannot be read, and the errors of [`Self::from_xml`].
    pub fn from_file(path: &Path) -> Result<Self, ModelError> {
        let xml = read_text(path).map_err(|source| ModelError::File {
            path: path.display().to_string(),
            source,
        })?;
        Self::from_xml(&xml)
    }

    /// Returns the text of the URDF.
    #[must_use]
    pub fn xml(&self) -> &str {
        &self.text
    }

    /// Returns the name of the root link.
    #[must_use]
    pub fn root_link(&self) -> &str {
        &self.root
    }

    /// Builds the model of the whole robot. A link without `<inertial>` has no mass, see [`Manipulator::findings`].
    ///
    /// # Errors
    /// Returns a [`ModelError`] that names the joint at fault: an axis of length zero, a type that the format does not have,
    /// or a pose or axis that is not finite numbers.
    pub fn manipulator(&self, base_kind: BaseKind) -> Result<Manipulator, ModelError> {
        self.manipulator_below(base_kind, &self.root)
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
        build(&self.tree()?, base_kind, base)
    }

    /// Replaces the mass properties of a link, expressed in the link's frame. The rest of the text stays as it is.
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
        let element = self.link(link)?;
        let mut text = self.text.clone();
        for old in element.children.iter().rev() {
            if old.name == "inertial" {
                text.replace_range(old.span.clone(), "");
            }
        }
        let (inertial, end) = (inertial::to_xml(body), element.tag.end);
        if element.tag == element.span {
            // `<link .../>` becomes `<link ...>...</link>`.
            text.replace_range(end - 2..end, &format!(">{inertial}</link>"));
        } else {
            text.insert_str(end, &inertial);
        }
        *self = Self::from_xml(&text)?;
        Ok(())
    }

    /// Returns the shapes of the `<collision>` elements of a link, in the order of the file.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`] for an unknown link, [`ModelError::Numbers`] for a pose or size that is not
    /// finite numbers, and [`ModelError::ShapeSize`] for a size that is not positive.
    pub fn collision_shapes(&self, link: &str) -> Result<Vec<CollisionShape>, ModelError> {
        let collisions = self.link(link)?.children("collision");
        collisions
            .map(|collision| CollisionShape::of(collision, link))
            .collect()
    }

    /// Returns the boxes among the collision shapes of a link. Other shapes are skipped.
    ///
    /// # Errors
    /// Returns the errors of [`Self::collision_shapes`] for the link's boxes.
    pub fn collision_boxes(&self, link: &str) -> Result<Vec<CollisionBox>, ModelError> {
        let mut boxes = Vec::new();
        let is_box =
            |element: &&Element| shape_of(element).is_some_and(|shape| shape.name == "box");
        for collision in self.link(link)?.children("collision").filter(is_box) {
            let shape = CollisionShape::of(collision, link)?;
            if let CollisionGeometry::Box { half_size } = shape.geometry {
                boxes.push(CollisionBox {
                    link_from_box: shape.link_from_shape,
                    half_size,
                });
            }
        }
        Ok(boxes)
    }

    /// Returns the lower and upper limit of a joint's position, rad or m, or `None` for a joint that is unknown,
    /// continuous or fixed, or whose limits are not two finite numbers of which the lower comes first.
    #[must_use]
    pub fn joint_limits(&self, joint: &str) -> Option<(f64, f64)> {
        position_limits(self.joint(joint)?)
    }

    /// Returns the largest speed of a joint, rad/s or m/s, or `None` for a joint that is unknown or for which the file
    /// has no positive finite number.
    #[must_use]
    pub fn velocity_limit(&self, joint: &str) -> Option<f64> {
        positive_limit(self.joint(joint)?, "velocity")
    }

    /// Returns the largest effort of a joint, N m or N, or `None` for a joint that is unknown or for which the file has no
    /// positive finite number.
    #[must_use]
    pub fn effort_limit(&self, joint: &str) -> Option<f64> {
        positive_limit(self.joint(joint)?, "effort")
    }

    /// Returns the names of the joints that mimic another joint, in the order of the file.
    pub fn mimic_joints(&self) -> impl Iterator<Item = &str> {
        let joints = self.robot.children("joint");
        let mimics = joints.filter(|joint| joint.child("mimic").is_some());
        mimics.filter_map(|joint| joint.attribute("name"))
    }

    /// Returns the element of a link.
    fn link(&self, name: &str) -> Result<&Element, ModelError> {
        let place = self.links.get(name);
        let element = place.and_then(|&index| self.robot.children.get(index));
        element.ok_or_else(|| {
            let links = self.robot.children("link");
            ModelError::unknown_frame(name, links.filter_map(|link| link.attribute("name")))
        })
    }

    /// Returns the element of a joint.
    fn joint(&self, name: &str) -> Option<&Element> {
        self.robot.children.get(*self.joints.get(name)?)
    }

    fn tree(&self) -> Result<Tree<'_>, ModelError> {
        Tree::new(&self.text, &self.robot)
    }
}

/// Returns the index of each named element of a kind among the children of `<robot>`.
fn indices(robot: &Element, kind: &str) -> HashMap<String, usize> {
    let children = robot.children.iter().enumerate();
    let of_kind = children.filter(|(_, element)| element.name == kind);
    let named = of_kind.filter_map(|(index, one)| Some((one.attribute("name")?.to_owned(), index)));
    named.collect()
}

/// Returns the error for an element `<robot>` without links.
fn no_link(robot: &Element) -> ModelError {
    let is_macro = |element: &Element| element.name.starts_with("xacro:");
    let message = if robot.children.iter().any(is_macro) {
        "there is no link, but there are xacro macros: expand them with `xacro`"
    } else {
        "there is no link"
    };
    ModelError::Syntax(message.to_owned())
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
