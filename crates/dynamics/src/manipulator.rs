//! The immutable model of a robot: a base and a tree of moving bodies.

use std::ops::Range;

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::{InertialParameters, ModelError, StateError};

/// Whether the base moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaseKind {
    /// A spacecraft, or anything else whose motion is measured.
    Floating,
    /// Bolted to the ground; its own mass does not matter.
    Fixed,
}

/// How a moving body may move against its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about the axis; position in rad. URDF's `revolute` and `continuous`.
    Revolute,
    /// Slides along the axis; position in m.
    Prismatic,
}

/// A joint: the one way in which a body moves against its parent.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) kind: JointKind,
    /// In the frame of the body it moves.
    pub(crate) axis: Unit<Vector3<f64>>,
    /// The moved body's frame in its parent body's, at position zero.
    pub(crate) parent_from_zero: Isometry3<f64>,
    /// Which entry of `q` moves it; a mimic joint shares its source's.
    pub(crate) coordinate: usize,
    /// Position = `ratio · q + offset`: 1 and 0, but for a mimic joint.
    pub(crate) ratio: f64,
    pub(crate) offset: f64,
}

impl Joint {
    /// `parent_from_body` at a joint position.
    pub(crate) fn transform(&self, position: f64) -> Isometry3<f64> {
        let moved = match self.kind {
            JointKind::Revolute => Isometry3::from_parts(
                Translation3::identity(),
                UnitQuaternion::from_axis_angle(&self.axis, position),
            ),
            JointKind::Prismatic => Isometry3::from_parts(
                Translation3::from(self.axis.into_inner() * position),
                UnitQuaternion::identity(),
            ),
        };
        self.parent_from_zero * moved
    }
}

/// A rigid body: a link and everything on fixed joints below it. Its frame is the link's.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) parent: usize,
    /// `None` for the base alone.
    pub(crate) joint: Option<Joint>,
    pub(crate) parameters: InertialParameters,
    pub(crate) mass_kg: f64,
    /// `a`: from the frame's origin to the centre of mass; zero where there is no mass.
    pub(crate) center_of_mass: Vector3<f64>,
    /// `I`: about the centre of mass.
    pub(crate) inertia: Matrix3<f64>,
}

impl Body {
    fn new(parent: usize, joint: Option<Joint>) -> Self {
        Self {
            parent,
            joint,
            parameters: InertialParameters::zero(),
            mass_kg: 0.0,
            center_of_mass: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        }
    }

    fn set_parameters(&mut self, parameters: InertialParameters) {
        self.parameters = parameters;
        if let Some(properties) = parameters.mass_properties() {
            self.mass_kg = properties.mass_kg;
            self.center_of_mass = properties.center_of_mass;
            self.inertia = properties.inertia;
        } else {
            self.mass_kg = 0.0;
            self.center_of_mass = Vector3::zeros();
            self.inertia = parameters.inertia_about_origin();
        }
    }
}

/// A named frame: a link of the URDF, fixed to one body.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) name: String,
    /// The frame above; its own index for the root.
    pub(crate) parent: usize,
    pub(crate) body: usize,
    pub(crate) body_from_frame: Isometry3<f64>,
    /// The link's own, in the link's frame.
    pub(crate) parameters: InertialParameters,
}

/// A frame of one [`Manipulator`], as [`Manipulator::frame`] finds it by name. It holds for that
/// robot, and for it with a payload or without its end-effector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameId(pub(crate) usize);

/// A base and a tree of links, as identification needs it: masses, joints and frames.
///
/// Immutable; what a computation needs of memory is in a [`Workspace`](crate::Workspace). Joints are
/// in the order in which they appear walking down the tree depth first, children in the order of
/// the file; match them by name.
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
    /// Parents before children; the base is the first.
    pub(crate) bodies: Vec<Body>,
    /// Depth first, the root link the first.
    pub(crate) frames: Vec<Frame>,
    pub(crate) joint_names: Vec<String>,
}

impl Manipulator {
    pub(crate) fn with_root(base_kind: BaseKind, root: &str, own: InertialParameters) -> Self {
        let mut robot = Self {
            base_kind,
            bodies: vec![Body::new(0, None)],
            frames: Vec::new(),
            joint_names: Vec::new(),
        };
        robot.add_frame(root, 0, 0, Isometry3::identity(), own);
        robot
    }

    pub(crate) fn add_body(&mut self, parent_body: usize, joint: Joint) -> usize {
        self.bodies.push(Body::new(parent_body, Some(joint)));
        self.bodies.len() - 1
    }

    pub(crate) fn add_frame(
        &mut self,
        name: &str,
        parent: usize,
        body: usize,
        body_from_frame: Isometry3<f64>,
        parameters: InertialParameters,
    ) -> usize {
        self.frames.push(Frame {
            name: name.to_owned(),
            parent,
            body,
            body_from_frame,
            parameters,
        });
        let lumped = self.bodies[body].parameters + parameters.expressed_in(&body_from_frame);
        self.bodies[body].set_parameters(lumped);
        self.frames.len() - 1
    }

    /// Whether the base moves.
    #[must_use]
    pub fn base_kind(&self) -> BaseKind {
        self.base_kind
    }

    /// How many independent joints there are: the length of `q`. Mimic joints do not count.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.joint_names.len()
    }

    /// The independent joints' names, in the order of `q`.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Where a joint stands in `q`; `None` for an unknown joint, and for one that is fixed or mimics.
    #[must_use]
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joint_names.iter().position(|known| known == name)
    }

    /// How a joint moves, by its place in `q`; `None` for a place beyond it.
    #[must_use]
    pub fn joint_kind(&self, place: usize) -> Option<JointKind> {
        let mut joints = self.bodies.iter().filter_map(|body| body.joint.as_ref());
        let found = joints.find(|joint| joint.coordinate == place && joint.ratio == 1.0);
        found.map(|joint| joint.kind)
    }

    /// The frame of a link.
    ///
    /// # Errors
    /// [`ModelError::UnknownFrame`], which lists the links there are.
    pub fn frame(&self, name: &str) -> Result<FrameId, ModelError> {
        let found = self.frames.iter().position(|frame| frame.name == name);
        found
            .map(FrameId)
            .ok_or_else(|| ModelError::unknown_frame(name, self.frame_names()))
    }

    /// The names of all links, the root first.
    pub fn frame_names(&self) -> impl Iterator<Item = &str> {
        self.frames.iter().map(|frame| frame.name.as_str())
    }

    /// The name of a frame of this robot.
    #[must_use]
    pub fn frame_name(&self, frame: FrameId) -> &str {
        &self.frames[frame.0].name
    }

    /// The frame of the root link, whose pose is the base's.
    #[must_use]
    pub fn base_frame(&self) -> FrameId {
        FrameId(0)
    }

    /// The transform `a_from_b` between two frames of one body; `None` where a joint lies between.
    #[must_use]
    pub fn fixed_transform(&self, a: FrameId, b: FrameId) -> Option<Isometry3<f64>> {
        let (a, b) = (&self.frames[a.0], &self.frames[b.0]);
        (a.body == b.body).then(|| a.body_from_frame.inverse() * b.body_from_frame)
    }

    /// Mass of everything, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.bodies.iter().map(|body| body.mass_kg).sum()
    }

    /// The robot with one more frame, `parent_from_frame` fixed to a link: a sensor that the URDF does
    /// not know.
    #[must_use]
    pub fn with_frame(
        &self,
        name: &str,
        parent: FrameId,
        parent_from_frame: &Isometry3<f64>,
    ) -> Self {
        let mut robot = self.clone();
        let above = &self.frames[parent.0];
        let body_from_frame = above.body_from_frame * parent_from_frame;
        let nothing = InertialParameters::zero();
        // It stands last, not in depth-first order, which only matters to links that weigh something.
        robot.add_frame(name, parent.0, above.body, body_from_frame, nothing);
        robot
    }

    /// A lone rigid body with one frame: for a sensor whose own motion is measured, without an arm.
    #[must_use]
    pub fn lone_body(name: &str) -> Self {
        Self::with_root(BaseKind::Floating, name, InertialParameters::zero())
    }

    /// The robot with a body attached rigidly to a frame; `payload` is in that frame.
    #[must_use]
    pub fn with_payload(&self, frame: FrameId, payload: &InertialParameters) -> Self {
        let mut robot = self.clone();
        let Frame {
            body,
            body_from_frame,
            ..
        } = self.frames[frame.0];
        robot.frames[frame.0].parameters = self.frames[frame.0].parameters + *payload;
        let lumped = self.bodies[body].parameters + payload.expressed_in(&body_from_frame);
        robot.bodies[body].set_parameters(lumped);
        robot
    }

    /// The robot with the masses of the links below `frame` (the frame's own link not included)
    /// taken off: what is known of it when the end-effector counts as unknown. Joints stay.
    #[must_use]
    pub fn without_subtree(&self, frame: FrameId) -> Self {
        let mut robot = self.clone();
        for index in self.links_below(frame) {
            robot.frames[index].parameters = InertialParameters::zero();
        }
        let mut lumped = vec![InertialParameters::zero(); robot.bodies.len()];
        for link in &robot.frames {
            lumped[link.body] =
                lumped[link.body] + link.parameters.expressed_in(&link.body_from_frame);
        }
        for (body, parameters) in robot.bodies.iter_mut().zip(lumped) {
            body.set_parameters(parameters);
        }
        robot
    }

    /// The indices of the frames below `frame`, itself not included.
    pub(crate) fn links_below(&self, frame: FrameId) -> Range<usize> {
        // Frames stand in depth-first order: what hangs below one follows it without a gap.
        let after = frame.0 + 1;
        let below = self.frames[after..].iter();
        let count = below.take_while(|link| link.parent >= frame.0).count();
        after..after + count
    }

    /// That a slice, called `what`, has one entry for each joint.
    ///
    /// # Errors
    /// Where it does not.
    pub fn check_length(&self, what: &'static str, given: &[f64]) -> Result<(), StateError> {
        if given.len() == self.dof() {
            return Ok(());
        }
        Err(StateError {
            what,
            given: given.len(),
            expected: self.dof(),
            joints: self.joint_names.join(", "),
        })
    }
}

/// A mass and an inertia that a body can have.
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
    match parameters.principal_moments() {
        Some(moments) if !parameters.is_physical_within(INERTIA_TOLERANCE) => {
            Err(ModelError::Inertia {
                link: link.to_owned(),
                moments: moments.into(),
            })
        }
        _ => Ok(()),
    }
}

/// By how much, relative to the largest moment, a written inertia may miss the triangle inequality:
/// robots are described with few digits, and a thin rod or plate lies on the border.
const INERTIA_TOLERANCE: f64 = 1e-3;
