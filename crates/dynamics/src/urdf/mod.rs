//! Construction of a [`Manipulator`] from a URDF, and what else a program needs from the same file.

mod build;
mod element;
mod format;
mod inertial;
mod mimic;
mod pose;
mod preprocess;
mod shapes;
mod tree;

use std::{collections::HashMap, path::Path};

use crate::manipulator::{BaseKind, Manipulator, check_body};
use crate::{MassProperties, ModelError, read_text};
use build::build;
use preprocess::Repairs;
use shapes::shapes;
use tree::{Tree, names};

pub use shapes::CollisionShape;

/// A URDF with links and joints that form one tree.
///
/// This is the only reader of URDFs: [`Manipulator::from_urdf`] and the simulator use it, so that
/// both accept the same files. [`urdf_rs`] reads what a model needs, after a preprocessing that
/// bounds and repairs the document. Mesh files need not exist. Names with an XML prefix, as in
/// `drake:acceleration`, are ignored whether or not the prefix is declared, as ROS tools do. What
/// is wrong with masses, inertias and optional elements prevents no model:
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
/// let robot = urdf.manipulator(BaseKind::Fixed)?;
/// assert_eq!(robot.mass(), 2.0);
/// assert_eq!(robot.joint_limits(0), Some((-1.0, 2.0)));
/// assert_eq!((robot.velocity_limit(0), robot.effort_limit(0)), (Some(1.0), Some(10.0)));
/// # Ok::<(), tactid_dynamics::ModelError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Urdf {
    text: String,
    robot: urdf_rs::Robot,
    repairs: Repairs,
    root: String,
    /// Index of each link among the links of the robot.
    links: HashMap<String, usize>,
}

/// The text decides all else.
impl PartialEq for Urdf {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl Urdf {
    /// Reads the text of a URDF.
    ///
    /// # Errors
    /// Returns [`ModelError::Syntax`] for text that is not a URDF; [`ModelError::JointKind`] and
    /// [`ModelError::Numbers`], which name the joint, for a type that the format does not have and
    /// for a pose or axis that is not finite numbers; and [`ModelError::Duplicate`],
    /// [`ModelError::MissingLink`], [`ModelError::Loop`] or [`ModelError::Roots`] for links that do
    /// not form one tree.
    pub fn from_xml(xml: &str) -> Result<Self, ModelError> {
        let text = xml.trim_start_matches('\u{feff}').to_owned();
        let (robot, repairs) = preprocess::read(&text)?;
        let root = Tree::new(&robot)?.root()?.to_owned();
        let links = robot.links.iter().enumerate();
        let links = links.map(|(index, link)| (link.name.clone(), index));
        Ok(Self {
            links: links.collect(),
            text,
            robot,
            repairs,
            root,
        })
    }

    /// Reads a URDF file.
    ///
    /// # Errors
    /// Returns [`ModelError::File`] if the file cannot be read, and the errors of
    /// [`Self::from_xml`].
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

    /// Returns what urdf-rs has read: the links and joints without visuals, materials and what
    /// else no model needs. A number that is missing in an `<inertial>`, or unreadable, is NaN.
    #[must_use]
    pub fn robot(&self) -> &urdf_rs::Robot {
        &self.robot
    }

    /// Returns the name of the root link.
    #[must_use]
    pub fn root_link(&self) -> &str {
        &self.root
    }

    /// Builds the model of the whole robot. A link without `<inertial>` has no mass, see
    /// [`Manipulator::findings`].
    ///
    /// # Errors
    /// Returns [`ModelError::Axis`], which names the joint, for an axis of length zero.
    pub fn manipulator(&self, base_kind: BaseKind) -> Result<Manipulator, ModelError> {
        self.manipulator_below(base_kind, None)
    }

    /// Builds the model of the link `base` and of all links below it, or of the whole robot for
    /// `None`. `base` becomes the base of the robot.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`] for an unknown link, and the errors of
    /// [`Self::manipulator`].
    pub fn manipulator_below(
        &self,
        base_kind: BaseKind,
        base: Option<&str>,
    ) -> Result<Manipulator, ModelError> {
        let base = base.unwrap_or(&self.root);
        build(&Tree::new(&self.robot)?, &self.repairs, base_kind, base)
    }

    /// Replaces the mass properties of a link, expressed in the link's frame. The rest of the text
    /// stays as it is.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`] for an unknown link, and [`ModelError::Mass`],
    /// [`ModelError::Inertia`] or [`ModelError::NotFinite`] for an impossible body.
    pub fn set_mass_properties(
        &mut self,
        link: &str,
        body: &MassProperties,
    ) -> Result<(), ModelError> {
        check_body(link, &(*body).into())?;
        self.link(link)?;
        *self = Self::from_xml(&inertial::replace(&self.text, link, body)?)?;
        Ok(())
    }

    /// Returns the shapes of the `<collision>` elements of a link, in the order of the file, and
    /// after them those that the format does not have.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`] for an unknown link, [`ModelError::Numbers`] for a pose
    /// or size that is not finite numbers, and [`ModelError::ShapeSize`] for a size that is not
    /// positive.
    pub fn collision_shapes(&self, link: &str) -> Result<Vec<CollisionShape>, ModelError> {
        shapes(self.link(link)?, &self.repairs, |_| true)
    }

    /// Returns whether a link has a `<visual>` element; false for an unknown link.
    #[must_use]
    pub fn has_visual(&self, link: &str) -> bool {
        self.repairs
            .links
            .get(link)
            .is_some_and(|repair| repair.has_visual)
    }

    /// Returns the boxes among the collision shapes of a link. Other shapes are skipped.
    ///
    /// # Errors
    /// Returns the errors of [`Self::collision_shapes`] for the link's boxes.
    pub fn collision_boxes(&self, link: &str) -> Result<Vec<CollisionShape>, ModelError> {
        shapes(self.link(link)?, &self.repairs, |shape| shape == "box")
    }

    /// Returns the link with a name.
    fn link(&self, name: &str) -> Result<&urdf_rs::Link, ModelError> {
        let found = self.links.get(name);
        let found = found.and_then(|&index| self.robot.links.get(index));
        found.ok_or_else(|| ModelError::unknown_frame(name, names(&self.robot)))
    }
}

impl Manipulator {
    /// Builds a robot from links and joints that urdf-rs has read, or that a program has made: the
    /// link `base` and all links below it, or the whole robot for `None`. A number of an
    /// `<inertial>` that is not finite counts as zero, see [`Self::findings`].
    ///
    /// [`Self::from_urdf`] reads files that urdf-rs alone refuses, and quaternions to all digits.
    ///
    /// ```
    /// use tactid_dynamics::{BaseKind, Manipulator, urdf_rs};
    ///
    /// let robot = urdf_rs::read_from_string(r#"<robot name="pendulum">
    ///   <link name="base"/>
    ///   <link name="arm"><inertial><mass value="2"/>
    ///     <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
    ///   <joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/></joint>
    /// </robot>"#)?;
    /// assert_eq!(Manipulator::from_robot(&robot, BaseKind::Fixed, None)?.mass(), 2.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Returns the errors of [`Urdf::from_xml`] for links that do not form one tree, the errors of
    /// [`Urdf::manipulator_below`], and [`ModelError::NotFinite`] for a pose or axis of a joint.
    pub fn from_robot(
        robot: &urdf_rs::Robot,
        base_kind: BaseKind,
        base: Option<&str>,
    ) -> Result<Self, ModelError> {
        let tree = Tree::new(robot)?;
        let root = tree.root()?;
        build(&tree, &Repairs::default(), base_kind, base.unwrap_or(root))
    }

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
}
