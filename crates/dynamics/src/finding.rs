//! What is wrong in the description of a robot without preventing a model of it.

/// A defect of a robot's description, and what the model assumes instead. Nothing else is changed: a number that is
/// not named by a finding is used as it is written.
#[derive(Clone, Debug, PartialEq)]
pub enum ModelFinding {
    /// No rigid body has the inertia of a link: a principal moment is negative, or larger than the sum of the other two.
    /// The inertia is used as it is written.
    ImpossibleInertia {
        /// Name of the link.
        link: String,
        /// Principal moments about the centre of mass in ascending order, kg m².
        moments: [f64; 3],
    },
    /// The mass of a link is negative, or zero although its inertia is not. Both are used as they are written.
    ImpossibleMass {
        /// Name of the link.
        link: String,
        /// The mass, kg.
        mass_kg: f64,
    },
    /// Attributes in the `<inertial>` of a link are missing or are not finite numbers. They count as zero.
    UnknownNumbers {
        /// Name of the link.
        link: String,
        /// The element with the attributes: `mass`, `inertia` or `origin`.
        element: &'static str,
        /// The attributes.
        attributes: Vec<&'static str>,
    },
    /// Bodies that move have no mass: neither the link that the joint moves, or that floats as the base, nor any link that
    /// is fixed to it. They are taken to be massless, as the virtual links between the joints of a compound joint are.
    Massless {
        /// Name of the first link of each body.
        links: Vec<String>,
    },
    /// A joint has more than one degree of freedom, which the model does not have. The joint is taken to be fixed at its
    /// zero position.
    JointTakenAsFixed {
        /// Name of the joint.
        joint: String,
        /// Its type: `floating` or `planar`, or `spherical`, which a program may use but no file.
        joint_type: &'static str,
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
        inside: &'static str,
        /// Names of the links or joints in which it occurs.
        owners: Vec<String>,
    },
}

impl ModelFinding {
    /// Returns whether the finding is about masses and inertias, which matter for forces and momentum only.
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// Part of a description that is ignored. Names with a prefix, such as `drake:acceleration`, belong to other programs
/// and are not reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum IgnoredPart {
    /// An element that the format does not have at this place.
    UnknownElement,
    /// A second element of which the format has one. The first one is used.
    RepeatedElement,
    /// An attribute that the format does not have.
    UnknownAttribute,
}
