//! Errors of building a model and of using it.

use std::sync::Arc;

use thiserror::Error;

use crate::names::list_similar;
use crate::words::{abridged, counted};

/// Reason why a robot cannot be modelled. Each message names the link or joint at fault.
#[derive(Debug, Error)]
pub enum ModelError {
    /// The file cannot be read.
    #[error("cannot read the URDF `{path}`: {source}")]
    File {
        /// Path of the file, as given.
        path: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The text is not XML or not a URDF.
    #[error("not a URDF: {0}")]
    Syntax(String),
    /// A moving link and all links fixed to it have no mass. The fields are the link and its joint.
    #[error(
        "link `{0}` moves but has no mass: give it an <inertial> with a positive mass, or make joint `{1}` fixed"
    )]
    NoInertial(String, String),
    /// No link that moves has mass. The fields are the first of them and the joint that moves it.
    #[error(
        "no link that moves has a mass, from `{0}` on, which joint `{1}` moves: give each an <inertial> with a positive mass"
    )]
    MasslessChain(String, String),
    /// The base, named by the field, floats and has no mass.
    #[error("the floating base `{0}` has no mass: give it an <inertial>, or fix the base")]
    MasslessBase(String),
    /// The mass of a link is not positive or not finite.
    #[error("link `{link}` has a mass of {mass_kg} kg: it must be positive and finite")]
    Mass {
        /// The link at fault.
        link: String,
        /// Its mass, kg.
        mass_kg: f64,
    },
    /// No rigid body has the inertia of a link.
    #[error(
        "link `{link}` has an impossible inertia: its principal moments {moments:?} kg m² must not be negative, and none may exceed the sum of the other two"
    )]
    Inertia {
        /// The link at fault.
        link: String,
        /// Principal moments about the centre of mass in ascending order, kg m².
        moments: [f64; 3],
    },
    /// A size of a collision shape of a link is missing or not positive.
    #[error("link `{link}` has a collision shape <{shape}> with a size that is not positive")]
    ShapeSize {
        /// The link at fault.
        link: String,
        /// Element of the shape, such as `box`.
        shape: String,
    },
    /// A number is infinite or NaN.
    #[error("{what} of `{name}` is not finite")]
    NotFinite {
        /// The quantity at fault.
        what: &'static str,
        /// The link or joint at fault.
        name: String,
    },
    /// The axis of a joint, named by the field, has length zero.
    #[error("joint `{0}` has an axis of length zero")]
    Axis(String),
    /// An attribute is not the finite numbers that it must be.
    #[error(
        "{kind} `{name}` has <{given}>: expected {expected} finite number{}",
        if *.expected == 1 { "" } else { "s" }
    )]
    Numbers {
        /// What is at fault: `link` or `joint`.
        kind: &'static str,
        /// Name of the link or joint.
        name: String,
        /// The element and its attribute, such as `origin xyz="0 0"`.
        given: String,
        /// How many numbers the attribute must have.
        expected: usize,
    },
    /// A joint has a type that the URDF format does not have.
    #[error(
        "joint `{joint}` is of type `{kind}`: expected revolute, continuous, prismatic, fixed, floating or planar"
    )]
    JointKind {
        /// The joint at fault.
        joint: String,
        /// Its type.
        kind: String,
    },
    /// A joint names a link that does not exist.
    #[error("joint `{joint}` names the link `{link}`, which the URDF does not have")]
    MissingLink {
        /// The joint at fault.
        joint: String,
        /// The link that it names.
        link: String,
    },
    /// A link, named by the field, has two parents or is its own ancestor.
    #[error("link `{0}` closes a loop: it is the child of more than one joint or its own ancestor")]
    Loop(String),
    /// More than one link, listed in the field, has no parent.
    #[error("the links {} have no parent: a robot has one root", abridged(.0))]
    Roots(Vec<String>),
    /// A name is used twice. The fields are the kind of object and the name.
    #[error("the {0} name `{1}` is used twice")]
    Duplicate(&'static str, String),
    /// The robot does not have the requested link.
    #[error("the robot has no link `{name}`; it has: {known}")]
    UnknownFrame {
        /// The requested name.
        name: String,
        /// Names of the robot's links, as [`list_similar`] lists them.
        known: String,
    },
}

impl ModelError {
    pub(crate) fn unknown_frame<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Self {
        Self::UnknownFrame {
            name: name.to_owned(),
            known: list_similar(name, known),
        }
    }
}

/// Reason why a state does not fit the robot, or why a result does not exist yet.
#[derive(Debug, Error, PartialEq)]
pub enum StateError {
    /// A slice does not have one entry for each independent joint.
    #[error("{what} has {given} entries, but the robot has {}: {}", counted(*.expected, "joint"), joints.join(", "))]
    Length {
        /// The quantity at fault, for instance `position`.
        what: &'static str,
        /// Number of entries given.
        given: usize,
        /// Number of entries required.
        expected: usize,
        /// Names of the joints in their order. An error allocates nothing.
        joints: Arc<Vec<String>>,
    },
    /// A part of a [`StateSeries`](crate::StateSeries) has neither the entries of all states nor
    /// the entries of one state for all of them.
    #[error("{what} has {given} entries, but {count} states with {each} each need {} (or {each}, the same for all of them)", each * count)]
    Series {
        /// The quantity at fault, for instance `position`.
        what: &'static str,
        /// Number of entries given.
        given: usize,
        /// Number of entries of one state.
        each: usize,
        /// Number of states.
        count: usize,
    },
    /// A regressor has not one row for each independent joint and each body that a joint moves.
    #[error(
        "the regressor has {given} rows, but the joints and the bodies that they move need {expected}"
    )]
    Rows {
        /// Number of rows given.
        given: usize,
        /// Number of rows required.
        expected: usize,
    },
    /// The forces of the workspace's motion have not been computed.
    #[error("the forces of this motion have not been computed: call `forces` after `motion`")]
    NoForces,
}
