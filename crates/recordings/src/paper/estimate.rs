//! The payload as the paper's filter knows it.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use tactid_dynamics::MassProperties;
use tactid_identify::serial::TenValues;
use tactid_identify::{Observability, VALUE_NAMES, serialize_body, serialize_composite};

/// A payload as the paper's filter identifies it: ten values without any uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PaperEstimate {
    /// Name of the frame in which the payload is expressed: the end-effector frame.
    pub frame: Arc<str>,
    /// Mass, centre of mass in `frame`, and inertia about the centre of mass along the axes of
    /// `frame`.
    #[serde(rename = "values", serialize_with = "serialize_body")]
    #[schemars(with = "TenValues<f64>")]
    pub body: MassProperties,
    /// Mass properties of the whole load as one body, in `frame`: gripper, payload and, where one
    /// is given, known tool; for the joint-sensing method only.
    #[serde(serialize_with = "serialize_composite")]
    #[schemars(with = "Option<TenValues<f64>>", extend("x-class" = "MassProperties"))]
    pub composite: Option<MassProperties>,
    /// Whether the motion excites each of [`VALUE_NAMES`]: identifiable where it does, unobservable
    /// where it does not.
    #[schemars(with = "TenValues<Observability>")]
    pub observability: [Observability; 10],
    /// Whether a body with these parameters can exist, within 1 % of its largest principal moment.
    pub is_physical: bool,
    /// Number of averaging windows of the last presentation.
    #[schemars(extend("default" = 0))]
    pub windows: u64,
    /// Number of samples that were rejected: not finite, or with derivatives that are not, or not
    /// later than the one before.
    #[schemars(extend("default" = 0))]
    pub rejected: u64,
    /// Number of gaps that were too long to be bridged.
    #[schemars(extend("default" = 0))]
    pub gaps: u64,
}

impl PaperEstimate {
    /// Returns the names of the values that the motion does not excite.
    pub fn unobservable(&self) -> impl Iterator<Item = &'static str> + '_ {
        let named = VALUE_NAMES.iter().zip(&self.observability);
        let unknown = named.filter(|(_, of)| **of == Observability::Unobservable);
        unknown.map(|(name, _)| *name)
    }
}
