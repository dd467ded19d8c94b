use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// The measurements that the payload is identified from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The contact wrenches of the fingers or of a wrist sensor, (47)-(48) and (46): the payload
    /// alone.
    #[default]
    Tactile,
    /// The motion of the free-floating base and the links, (30) and (44): gripper and payload as
    /// one body, from which the known gripper is subtracted.
    JointSensing,
    /// The joint efforts beyond those that the arm itself needs, `Jᵀ [f_U; n_U]`: the payload
    /// alone. The arm and the gripper are known from the robot's description.
    Effort,
    /// All measurements together, each channel weighted by its own residuals: the wrenches of the
    /// sensors if there are any, the joint efforts if they are measured, and the momentum of a
    /// floating base on which nothing external acts. The payload alone.
    ///
    /// Each source must satisfy its model: joint friction, or a firing thruster, biases the whole
    /// estimate.
    Combined {
        /// Whether the joint efforts are measured.
        effort: bool,
    },
}

impl Method {
    /// One method of each name.
    const ALL: [Self; 4] = [
        Self::Tactile,
        Self::Effort,
        Self::JointSensing,
        Self::Combined { effort: true },
    ];

    /// Returns the name: `tactile`, `joint-sensing`, `effort` or `combined`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tactile => "tactile",
            Self::JointSensing => "joint-sensing",
            Self::Effort => "effort",
            Self::Combined { .. } => "combined",
        }
    }

    /// Returns whether the wrenches of sensors are used.
    #[must_use]
    pub fn uses_wrench(self) -> bool {
        matches!(self, Self::Tactile | Self::Combined { .. })
    }

    /// Returns whether the joint efforts are used.
    #[must_use]
    pub fn uses_effort(self) -> bool {
        matches!(self, Self::Effort | Self::Combined { effort: true })
    }
}

impl fmt::Display for Method {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl Serialize for Method {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Method {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let mut all = Self::ALL.into_iter();
        all.find(|method| method.name() == name)
            .ok_or_else(|| de::Error::custom(format!("`{name}` is no method")))
    }
}

impl JsonSchema for Method {
    fn schema_name() -> Cow<'static, str> {
        "Method".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "enum": Self::ALL})
    }
}
