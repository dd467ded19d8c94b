//! Limits of a motion, and how much of them it uses.

use std::fmt;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

/// Largest distance that is computed, m. Pairs that are further apart count as so far apart, and
/// most of them cost a comparison of boxes or the first steps of a search only. A least distance is
/// shorter, so that these pairs are far from it.
pub(crate) const REACH_M: f64 = 0.08;

/// One of the limits of a motion.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Limit {
    /// Position of a joint.
    Position(String),
    /// Velocity of a joint.
    Velocity(String),
    /// Acceleration of a joint.
    Acceleration(String),
    /// Torque of a joint, or force of a prismatic joint.
    Effort(String),
    /// One of the entries of the wrench on the payload in the tool frame, such as `force x`.
    Wrench(&'static str),
    /// Friction of the grip at one of the two pads: the grip's normal points towards pad 0.
    Grip(usize),
    /// Angle by which a free-floating base turns.
    BaseAttitude,
    /// Distance by which the origin of a free-floating base moves.
    BasePosition,
    /// Position of the tool or the payload, which the first entry names, in the box that it must
    /// stay in, along one of the box's axes: `x`, `y` or `z`.
    Workspace(&'static str, &'static str),
    /// Distance of two bodies, such as two links, which the entries name.
    Distance(String, String),
}

impl fmt::Display for Limit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Position(joint) => write!(formatter, "the position of joint {joint}"),
            Self::Velocity(joint) => write!(formatter, "the velocity of joint {joint}"),
            Self::Acceleration(joint) => write!(formatter, "the acceleration of joint {joint}"),
            Self::Effort(joint) => write!(formatter, "the effort of joint {joint}"),
            Self::Wrench(entry) => write!(formatter, "the {entry} on the payload"),
            Self::Grip(pad) => write!(formatter, "the friction of the grip at pad {pad}"),
            Self::BaseAttitude => formatter.write_str("the attitude of the base"),
            Self::BasePosition => formatter.write_str("the position of the base"),
            Self::Workspace(body, axis) => {
                write!(
                    formatter,
                    "the position of {body} along {axis} in the workspace"
                )
            }
            Self::Distance(first, second) => {
                write!(formatter, "the distance between {first} and {second}")
            }
        }
    }
}

impl Limit {
    /// Returns the option that relaxes the limit, or the load on it where the URDF alone sets it,
    /// with what to do.
    pub(crate) fn remedy(&self) -> (&'static str, &'static str) {
        match self {
            Self::Position(_) => ("start", "the URDF sets it: begin elsewhere (`start`)"),
            Self::Velocity(_) => ("limit_scale", "the URDF and `limit_scale` set it"),
            Self::Acceleration(_) => ("acceleration", "`acceleration` sets it"),
            Self::Effort(_) => (
                "start",
                "the URDF sets it: begin where less torque holds the payload (`start`), or expect a lighter one",
            ),
            Self::Wrench(_) => ("wrench_limit", "`wrench_limit` sets it"),
            Self::Grip(_) => ("grip", "`grip` sets it"),
            Self::BaseAttitude => ("base_attitude", "`base_attitude` sets it"),
            Self::BasePosition => ("base_position", "`base_position` sets it"),
            Self::Workspace(..) => ("workspace", "`workspace` sets it"),
            Self::Distance(_, second) if second.starts_with("the keep-out box") => (
                "keep_out",
                "`keep_out` gives the box; a start elsewhere may be farther from it",
            ),
            Self::Distance(_, second) if second == "the payload" => (
                "payload_box",
                "`payload_box` gives the box; a start elsewhere may keep it free",
            ),
            Self::Distance(..) => (
                "least_distance",
                "`least_distance` sets it; a start elsewhere may keep it",
            ),
        }
    }
}

/// Serialises a limit in words.
fn in_words<S: Serializer>(limit: &Limit, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(limit)
}

/// How much of one limit a motion uses.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Margin {
    /// Limit of which a fraction is used, such as `the velocity of joint joint_3`.
    #[serde(serialize_with = "in_words")]
    #[schemars(with = "String")]
    pub limit: Limit,
    /// Largest fraction of the limit that is used at any time, without a unit: 1 at the limit. Of a
    /// position, the fraction of the way from the middle of the range to its end. Of a grip,
    /// infinite where the payload pulls off the pad. Of a distance, the least one that is allowed
    /// over the distance, and infinite for bodies that touch; a distance counts as 0.08 m at most.
    pub used: f64,
    /// Time at which it is used, s.
    pub time_s: f64,
    /// Of a [`Limit::Distance`], the least distance of the two bodies, m: negative by the depth of
    /// penetration, 0.08 at most.
    pub distance_m: Option<f64>,
    /// Whether the limit is active: relaxing it allows smaller intervals. A limit on velocity or
    /// acceleration binds where a control point of the derivative reaches it, which the motion
    /// itself then nearly does.
    pub binds: bool,
}
