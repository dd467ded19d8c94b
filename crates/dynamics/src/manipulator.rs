//! The immutable model of a robot: a base and a tree of moving bodies.

use std::sync::Arc;

use nalgebra::{Isometry3, Unit, Vector3};

use crate::inertia::impossible_moments;
use crate::{InertialParameters, ModelError, ModelFinding, StateError};

/// Whether the base of a robot moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaseKind {
    /// The base moves and its motion is measured, as on a spacecraft.
    Floating,
    /// The base is bolted to the ground. Its mass has no effect.
    Fixed,
}

impl BaseKind {
    /// Returns the gravitational acceleration that is assumed where none is given, in the inertial
    /// frame, m/s²: zero for a floating base, 9.81 along -z for a fixed one.
    #[must_use]
    pub fn default_gravity(self) -> Vector3<f64> {
        match self {
            Self::Floating => Vector3::zeros(),
            Self::Fixed => Vector3::new(0.0, 0.0, -9.81),
        }
    }
}

/// How a joint lets a body move relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// The body rotates about the axis by an angle, rad: URDF's `revolute` and `continuous`.
    Revolute,
    /// The body slides along the axis. The position is a distance in m.
    Prismatic,
}

/// A joint with one degree of freedom between a body and its parent.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) kind: JointKind,
    /// Axis of the joint, expressed in the frame of the body that it moves.
    pub(crate) axis: Unit<Vector3<f64>>,
    /// Pose of the moved body's frame in the parent body's frame at joint position zero.
    pub(crate) parent_from_zero: Isometry3<f64>,
    /// Index in `q` of the coordinate that moves the joint, for a mimic joint of the followed one.
    pub(crate) coordinate: usize,
    /// Joint position divided by coordinate: `position = ratio · q + offset`. It is 1 unless the
    /// joint mimics another.
    pub(crate) ratio: f64,
    /// Joint position at coordinate zero, rad or m. It is 0 unless the joint mimics another.
    pub(crate) offset: f64,
    /// Whether the joint follows another joint.
    pub(crate) is_mimic: bool,
    /// Lower and upper limit of the position, rad or m, where it is limited.
    pub(crate) limits: Option<(f64, f64)>,
    /// Largest speed, rad/s or m/s, where it is limited.
    pub(crate) velocity_limit: Option<f64>,
    /// Largest effort, N m or N, where it is limited.
    pub(crate) effort_limit: Option<f64>,
}

/// A rigid body: a link and all links that fixed joints attach to it, in the frame of the first.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// Index of the parent body; 0 for the base itself.
    pub(crate) parent: usize,
    /// Joint between the parent and the body; `None` for the base only.
    pub(crate) joint: Option<Joint>,
    /// Sum of the links' parameters, in the body's frame.
    pub(crate) parameters: InertialParameters,
}

impl Body {
    fn new(parent: usize, joint: Option<Joint>) -> Self {
        Self {
            parent,
            joint,
            parameters: InertialParameters::zero(),
        }
    }
}

/// A link: a named frame that is fixed to one body.
#[derive(Clone, Debug)]
pub(crate) struct Link {
    pub(crate) name: String,
    /// Position of the parent link in [`Manipulator::links`]; its own position for the root.
    pub(crate) parent: usize,
    /// Index of the body that the link is fixed to.
    pub(crate) body: usize,
    pub(crate) body_from_link: Isometry3<f64>,
    /// Parameters that count towards the body, in the link's frame.
    pub(crate) parameters: InertialParameters,
    /// Parameters that [`Manipulator::without_subtree`] has removed, in the link's frame.
    pub(crate) removed: InertialParameters,
}

/// Handle of a link's frame in a [`Manipulator`].
///
/// [`Manipulator::frame`] finds it by the link's name. It holds for that robot and for every robot
/// derived from it by [`with_frame`](Manipulator::with_frame),
/// [`with_payload`](Manipulator::with_payload), [`without_subtree`](Manipulator::without_subtree)
/// or [`locked_beyond`](Manipulator::locked_beyond). A method panics, or answers for another link,
/// where it is given the handle of an unrelated robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameId(usize);

/// Immutable model of a robot: a base and a tree of links with their masses, joints and frames.
///
/// Computations keep their state in a [`Workspace`](crate::Workspace). Links and joints are ordered
/// depth first, with children in the order of the URDF; match them by name.
///
/// ```
/// use tactid_dynamics::{BaseKind, Manipulator};
///
/// let urdf = r#"<robot name="pendulum">
///   <link name="base"/>
///   <link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
///     <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
///   <joint name="hinge" type="continuous">
///     <parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
/// </robot>"#;
/// let robot = Manipulator::from_urdf(urdf, BaseKind::Fixed)?;
/// assert_eq!(robot.joint_names(), ["hinge"]);
/// # Ok::<(), tactid_dynamics::ModelError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Manipulator {
    pub(crate) base_kind: BaseKind,
    /// Bodies in depth-first order, the base first.
    pub(crate) bodies: Vec<Body>,
    /// Links in depth-first order: parents precede children and each subtree is contiguous.
    pub(crate) links: Vec<Link>,
    /// Position in `links` of each [`FrameId`].
    positions: Vec<usize>,
    pub(crate) joint_names: Arc<Vec<String>>,
    /// What is wrong in the description, except for missing masses.
    pub(crate) findings: Vec<ModelFinding>,
}

impl Manipulator {
    /// Returns a robot of one link, with the frame of the base.
    pub(crate) fn with_root(base_kind: BaseKind, root: &str, own: InertialParameters) -> Self {
        let mut robot = Self {
            base_kind,
            bodies: vec![Body::new(0, None)],
            links: Vec::new(),
            positions: Vec::new(),
            joint_names: Arc::default(),
            findings: Vec::new(),
        };
        robot.insert_link(0, root, (0, 0), Isometry3::identity(), own);
        robot
    }

    /// Appends a body and returns its index. Bodies must be added in depth-first order.
    pub(crate) fn add_body(&mut self, parent_body: usize, joint: Joint) -> usize {
        self.bodies.push(Body::new(parent_body, Some(joint)));
        self.bodies.len() - 1
    }

    /// Appends a link and returns its position. Links must be added in depth-first order.
    pub(crate) fn add_link(
        &mut self,
        name: &str,
        parent: usize,
        body: usize,
        body_from_link: Isometry3<f64>,
        parameters: InertialParameters,
    ) -> usize {
        let position = self.links.len();
        self.insert_link(position, name, (parent, body), body_from_link, parameters);
        position
    }

    /// Inserts a link at a position after its parent, where `(parent, body)` are the parent link's
    /// position and the body's index, and adds its parameters to the body.
    pub(crate) fn insert_link(
        &mut self,
        position: usize,
        name: &str,
        (parent, body): (usize, usize),
        body_from_link: Isometry3<f64>,
        parameters: InertialParameters,
    ) {
        // Appending is the usual case and shifts nothing.
        if position < self.links.len() {
            let parents = self.links.iter_mut().map(|link| &mut link.parent);
            for shifted in parents.chain(&mut self.positions) {
                *shifted += usize::from(*shifted >= position);
            }
        }
        let link = Link {
            name: name.to_owned(),
            parent,
            body,
            body_from_link,
            parameters,
            removed: InertialParameters::zero(),
        };
        self.links.insert(position, link);
        self.positions.push(position);
        let lumped = self.bodies[body].parameters + parameters.expressed_in(&body_from_link);
        self.bodies[body].parameters = lumped;
    }

    /// Returns a floating rigid body with one frame and no mass: the model of a sensor with
    /// measured motion where there is no arm.
    #[must_use]
    pub fn lone_body(name: &str) -> Self {
        Self::with_root(BaseKind::Floating, name, InertialParameters::zero())
    }

    /// Returns whether the base moves.
    #[must_use]
    pub fn base_kind(&self) -> BaseKind {
        self.base_kind
    }

    /// Returns the number of independent joints, the length of `q`. Mimic joints do not count.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.joint_names.len()
    }

    /// Returns the names of the independent joints in the order of `q`.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Returns the index of a joint in `q`, or `None` for an unknown, fixed or mimic joint.
    #[must_use]
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joint_names.iter().position(|known| known == name)
    }

    /// Returns the kind of the joint with an index in `q`, or `None` for an index beyond it.
    #[must_use]
    pub fn joint_kind(&self, index: usize) -> Option<JointKind> {
        self.joint(index).map(|joint| joint.kind)
    }

    /// Returns the lower and upper limit of the position of the joint with an index in `q`, rad or
    /// m, or `None` where the description has no valid limits, as for a continuous joint.
    #[must_use]
    pub fn joint_limits(&self, index: usize) -> Option<(f64, f64)> {
        self.joint(index)?.limits
    }

    /// Returns the largest speed of the joint with an index in `q`, rad/s or m/s, or `None` where
    /// the description has no positive one.
    #[must_use]
    pub fn velocity_limit(&self, index: usize) -> Option<f64> {
        self.joint(index)?.velocity_limit
    }

    /// Returns the largest effort of the joint with an index in `q`, N m or N, or `None` where the
    /// description has no positive one.
    #[must_use]
    pub fn effort_limit(&self, index: usize) -> Option<f64> {
        self.joint(index)?.effort_limit
    }

    /// Returns the joint with an index in `q`.
    fn joint(&self, index: usize) -> Option<&Joint> {
        let mut joints = self.bodies.iter().filter_map(|body| body.joint.as_ref());
        joints.find(|joint| joint.coordinate == index && !joint.is_mimic)
    }

    /// Returns the frame of the link with a name.
    ///
    /// # Errors
    /// Returns [`ModelError::UnknownFrame`], which lists the existing links.
    pub fn frame(&self, name: &str) -> Result<FrameId, ModelError> {
        let is_named = |&position: &usize| self.links[position].name == name;
        let found = self.positions.iter().position(is_named);
        found
            .map(FrameId)
            .ok_or_else(|| ModelError::unknown_frame(name, self.frame_names()))
    }

    /// Returns the names of all links in depth-first order, the root first.
    pub fn frame_names(&self) -> impl Iterator<Item = &str> {
        self.links.iter().map(|link| link.name.as_str())
    }

    /// Returns the name of the link with a frame of this robot.
    #[must_use]
    pub fn frame_name(&self, frame: FrameId) -> &str {
        &self.link(frame).name
    }

    /// Returns the frame of the root link. Its pose is the pose of the base.
    #[must_use]
    pub fn base_frame(&self) -> FrameId {
        FrameId(0)
    }

    /// Returns the transform `a_from_b` between two frames of one body, or `None` for two bodies.
    #[must_use]
    pub fn fixed_transform(&self, a: FrameId, b: FrameId) -> Option<Isometry3<f64>> {
        let (a, b) = (self.link(a), self.link(b));
        (a.body == b.body).then(|| a.body_from_link.inverse() * b.body_from_link)
    }

    /// Returns whether one frame carries another: a joint lies between them, and moving the first
    /// moves the second.
    #[must_use]
    pub fn carries(&self, carrier: FrameId, carried: FrameId) -> bool {
        let (body, mut index) = (self.link(carrier).body, self.link(carried).body);
        // A body has a larger index than the one that carries it.
        while index > body {
            index = self.bodies[index].parent;
            if index == body {
                return true;
            }
        }
        false
    }

    /// Returns whether the joint with an index in `q` moves a frame.
    #[must_use]
    pub fn moves(&self, joint: usize, frame: FrameId) -> bool {
        let mut index = self.link(frame).body;
        while let Some(above) = &self.bodies[index].joint {
            if above.coordinate == joint {
                return true;
            }
            index = self.bodies[index].parent;
        }
        false
    }

    /// Returns the total mass of the robot, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.bodies.iter().map(|body| body.parameters.mass()).sum()
    }

    /// Returns the position in `links` of a frame's link.
    pub(crate) fn position(&self, frame: FrameId) -> usize {
        self.positions[frame.0]
    }

    /// Returns the link of a frame.
    pub(crate) fn link(&self, frame: FrameId) -> &Link {
        &self.links[self.position(frame)]
    }

    /// Checks that a slice has one entry for each independent joint; `what` names it in the error.
    ///
    /// # Errors
    /// Returns [`StateError::Length`] if it does not.
    #[inline]
    pub fn check_length(&self, what: &'static str, given: &[f64]) -> Result<(), StateError> {
        self.check_count(what, given.len())
    }

    /// Checks that there is one entry for each independent joint, as [`Self::check_length`] does.
    #[inline]
    pub(crate) fn check_count(&self, what: &'static str, given: usize) -> Result<(), StateError> {
        if given == self.dof() {
            return Ok(());
        }
        Err(StateError::Length {
            what,
            given,
            expected: self.dof(),
            joints: self.joint_names.clone(),
        })
    }
}

/// Returns for each body the index after the last one that it carries: these follow it in order.
pub(crate) fn subtree_ends(bodies: &[Body]) -> Vec<usize> {
    let mut ends: Vec<usize> = (1..=bodies.len()).collect();
    for (index, body) in bodies.iter().enumerate().rev() {
        ends[body.parent] = ends[body.parent].max(ends[index]);
    }
    ends
}

/// Checks that a link has a positive finite mass and an inertia that a rigid body can have.
///
/// # Errors
/// Returns [`ModelError::Mass`], [`ModelError::NotFinite`] or [`ModelError::Inertia`].
pub(crate) fn check_body(link: &str, parameters: &InertialParameters) -> Result<(), ModelError> {
    let mass_kg = parameters.mass();
    if !(mass_kg.is_finite() && mass_kg > 0.0) {
        return Err(ModelError::Mass {
            link: link.to_owned(),
            mass_kg,
        });
    }
    if parameters
        .as_vector()
        .iter()
        .any(|entry| !entry.is_finite())
    {
        return Err(ModelError::NotFinite {
            what: "the inertia",
            name: link.to_owned(),
        });
    }
    match impossible_moments(parameters) {
        Some(moments) => Err(ModelError::Inertia {
            link: link.to_owned(),
            moments,
        }),
        None => Ok(()),
    }
}
