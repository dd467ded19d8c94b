//! What is wrong in the description of a robot without preventing a model of it.

use std::borrow::Cow;
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::notice::{Notice, Reader, Severity};
use crate::words::{abridged, general, listed};

/// A defect of a robot's description, and what the model assumes instead. Nothing else is changed:
/// a number that is not named by a finding is used as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ModelFinding {
    /// No rigid body has the inertia of a link: a principal moment is negative, or larger than the
    /// sum of the other two. The inertia is used as it is written.
    ImpossibleInertia {
        /// Name of the link.
        link: String,
        /// Principal moments about the centre of mass in ascending order, kg m².
        moments: [f64; 3],
    },
    /// The mass of a link is negative, or zero although its inertia is not. Both are used as they
    /// are written.
    ImpossibleMass {
        /// Name of the link.
        link: String,
        /// The mass, kg.
        mass_kg: f64,
    },
    /// Attributes in the `<inertial>` of a link are missing or are not finite numbers. They count
    /// as zero.
    UnknownNumbers {
        /// Name of the link.
        link: String,
        /// The element with the attributes: `mass`, `inertia` or `origin`.
        element: Cow<'static, str>,
        /// The attributes.
        attributes: Vec<Cow<'static, str>>,
    },
    /// Bodies that move have no mass: neither the link that the joint moves, or that floats as the
    /// base, nor any link that is fixed to it. They are taken to be massless, as the virtual links
    /// between the joints of a compound joint are.
    Massless {
        /// Name of the first link of each body.
        links: Vec<String>,
    },
    /// A joint has more than one degree of freedom, which the model does not have. The joint is
    /// taken to be fixed at its zero position.
    JointTakenAsFixed {
        /// Name of the joint.
        joint: String,
        /// Its type: `floating` or `planar`, or `spherical`, which a program may use but no file.
        joint_type: Cow<'static, str>,
    },
    /// A joint cannot mimic the joint that it names, and is taken to move independently.
    MimicNotFollowed {
        /// Name of the joint.
        joint: String,
        /// Name of the joint that it names; empty if it names none.
        leader: String,
        /// The reason.
        because: MimicFault,
    },
    /// A part of the description is ignored.
    PartIgnored {
        /// What the part is.
        part: IgnoredPart,
        /// Name of the element or attribute.
        name: String,
        /// Element that contains it, such as `link`.
        inside: Cow<'static, str>,
        /// Names of the links or joints in which it occurs.
        owners: Vec<String>,
    },
}

impl ModelFinding {
    /// Returns whether the finding is about masses and inertias, which matter for forces and
    /// momentum only.
    #[must_use]
    pub fn concerns_masses(&self) -> bool {
        match self {
            Self::ImpossibleInertia { .. }
            | Self::ImpossibleMass { .. }
            | Self::UnknownNumbers { .. }
            | Self::Massless { .. } => true,
            Self::JointTakenAsFixed { .. }
            | Self::MimicNotFollowed { .. }
            | Self::PartIgnored { .. } => false,
        }
    }
}

/// Why a joint cannot mimic another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MimicFault {
    /// The description does not have the joint, or it is not below the base.
    NoSuchJoint,
    /// The joint is fixed.
    LeaderIsFixed,
    /// The joint mimics the one that follows it, directly or through others.
    Circular,
    /// The multiplier or the offset is not a finite number.
    Numbers,
}

/// Part of a description that is ignored. Names with a prefix, such as `drake:acceleration`, belong
/// to other programs and are not reported.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum IgnoredPart {
    /// An element that the format does not have at this place.
    UnknownElement,
    /// A second element of which the format has one. The first one is used.
    RepeatedElement,
    /// An attribute that the format does not have.
    UnknownAttribute,
}

impl Notice for ModelFinding {
    fn severity(&self) -> Severity {
        Severity::Notes
    }

    fn words(&self, _: Reader) -> String {
        match self {
            Self::ImpossibleInertia { link, moments } => {
                let [first, second, third] = moments.map(|moment| general(moment, 3));
                format!(
                    "Link `{link}`: no rigid body has its inertia, with the principal moments \
                     {first}, {second}, {third} kg m²: none may be negative, or exceed the sum of \
                     the other two. It was used as the URDF has it."
                )
            }
            Self::ImpossibleMass { link, mass_kg } => {
                let what = if *mass_kg == 0.0 {
                    "it has an inertia, but a mass of zero".to_owned()
                } else {
                    format!("its mass of {} kg is negative", general(*mass_kg, 6))
                };
                format!("Link `{link}`: {what}. It was used as the URDF has it.")
            }
            Self::UnknownNumbers {
                link,
                element,
                attributes,
            } => {
                let (are, each) = match attributes.len() {
                    0 | 1 => ("is no finite number", "it"),
                    _ => ("are no finite numbers", "each"),
                };
                format!(
                    "Link `{link}`: {} of <{element}> in its <inertial> {are}, or missing: {each} \
                     was taken to be zero.",
                    listed(attributes)
                )
            }
            Self::Massless { links } => massless(links),
            Self::JointTakenAsFixed { joint, joint_type } => format!(
                "Joint `{joint}` is of type {joint_type}, which has several degrees of freedom: it \
                 was taken to be fixed at zero."
            ),
            Self::MimicNotFollowed {
                joint,
                leader,
                because,
            } => not_followed(joint, leader, *because),
            Self::PartIgnored {
                part,
                name,
                inside,
                owners,
            } => ignored(*part, name, inside, owners),
        }
    }
}

/// Says why a joint does not follow the one that it names.
fn not_followed(joint: &str, leader: &str, because: MimicFault) -> String {
    if leader.is_empty() {
        return format!("Joint `{joint}` mimics no joint by name: it was taken to move by itself.");
    }
    let reason = match because {
        MimicFault::NoSuchJoint => "which the robot does not have",
        MimicFault::LeaderIsFixed => "which does not move",
        MimicFault::Circular => "which mimics it in turn",
        MimicFault::Numbers => "but its multiplier or offset is no finite number",
    };
    format!("Joint `{joint}` mimics `{leader}`, {reason}: it was taken to move by itself.")
}

/// Says which part was ignored, and where.
fn ignored(part: IgnoredPart, name: &str, inside: &str, owners: &[String]) -> String {
    let part = match part {
        IgnoredPart::UnknownElement => {
            format!("The element <{name}> in <{inside}>, which URDF does not have,")
        }
        IgnoredPart::RepeatedElement => format!("Every <{name}> in <{inside}> but the first"),
        IgnoredPart::UnknownAttribute => {
            format!("The attribute `{name}` of <{inside}>, which URDF does not have,")
        }
    };
    format!("{part} was ignored: in {}.", named(owners))
}

/// Says which moving bodies have no mass.
fn massless(links: &[String]) -> String {
    let [noun, moves, have, were, them] = if links.len() > 1 {
        ["Links", "move", "have", "were", "them"]
    } else {
        ["Link", "moves", "has", "was", "it"]
    };
    format!(
        "{noun} {} {moves} but {have} no mass, and {were} taken to be massless: right for virtual \
         links, as in a ball joint of three hinges; else give {them} an <inertial> in the URDF.",
        named(links)
    )
}

/// Lists names as code; of many only the first.
fn named(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    abridged(&names)
}

impl fmt::Display for ModelFinding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.words(Reader::Rust))
    }
}
