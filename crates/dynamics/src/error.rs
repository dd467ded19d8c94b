use thiserror::Error;

/// Why a robot cannot be modelled. Each message names the link or joint at fault.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The file cannot be read.
    #[error("cannot read the URDF `{path}`: {source}")]
    File {
        /// As it was given.
        path: String,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// Not XML, or not a URDF.
    #[error("not a URDF: {0}")]
    Syntax(String),
    /// A moving link's bodies have no mass between them.
    #[error(
        "link `{0}` moves but has no mass: give it an <inertial> with a positive mass, or make joint `{1}` fixed"
    )]
    NoInertial(String, String),
    /// The base floats and has no mass.
    #[error("the floating base `{0}` has no mass: give it an <inertial>, or fix the base")]
    MasslessBase(String),
    /// A mass that no body has.
    #[error("link `{link}` has a mass of {mass_kg} kg: it must be positive and finite")]
    Mass {
        /// The link at fault.
        link: String,
        /// Its mass.
        mass_kg: f64,
    },
    /// An inertia that no body has.
    #[error(
        "link `{link}` has an impossible inertia: its principal moments {moments:?} kg m² must not be negative, and none may exceed the sum of the other two"
    )]
    Inertia {
        /// The link at fault.
        link: String,
        /// Ascending principal moments about the centre of mass.
        moments: [f64; 3],
    },
    /// A number that is not one.
    #[error("{what} of `{name}` is not finite")]
    NotFinite {
        /// Which property.
        what: &'static str,
        /// The link or joint at fault.
        name: String,
    },
    /// An axis without direction.
    #[error("joint `{0}` has an axis of length zero")]
    Axis(String),
    /// A joint type that tactid has no equations for.
    #[error(
        "joint `{joint}` is of type {kind}: only revolute, continuous, prismatic and fixed joints are supported"
    )]
    JointKind {
        /// The joint at fault.
        joint: String,
        /// Its type.
        kind: String,
    },
    /// A joint names a link that is not there.
    #[error("joint `{joint}` names the link `{link}`, which the URDF does not have")]
    MissingLink {
        /// The joint at fault.
        joint: String,
        /// The link it names.
        link: String,
    },
    /// Two parents, or a way back.
    #[error("link `{0}` closes a loop: it is the child of more than one joint or its own ancestor")]
    Loop(String),
    /// More than one link without a parent.
    #[error("the links {0:?} all have no parent: a robot has one root")]
    Roots(Vec<String>),
    /// The same name twice.
    #[error("the {0} name `{1}` is used twice")]
    Duplicate(&'static str, String),
    /// A mimic joint that cannot be honoured.
    #[error("joint `{joint}` mimics `{source_joint}`, {why}")]
    Mimic {
        /// The joint at fault.
        joint: String,
        /// The joint it wants to follow.
        source_joint: String,
        /// What is wrong with that.
        why: &'static str,
    },
    /// A base, tip or other frame that the robot does not have.
    #[error("the robot has no link `{name}`; it has: {known}")]
    UnknownFrame {
        /// The name asked for.
        name: String,
        /// Every name there is.
        known: String,
    },
}

impl ModelError {
    pub(crate) fn unknown_frame<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Self {
        Self::UnknownFrame {
            name: name.to_owned(),
            known: known.collect::<Vec<_>>().join(", "),
        }
    }
}

/// A state that does not fit the robot.
#[derive(Debug, Error, PartialEq)]
#[error("{what} has {given} entries, but the robot has {expected} joints: {joints}")]
pub struct StateError {
    /// Which of position, velocity or acceleration.
    pub what: &'static str,
    /// How many numbers were given.
    pub given: usize,
    /// How many there must be.
    pub expected: usize,
    /// The joints' names, in order.
    pub joints: String,
}
