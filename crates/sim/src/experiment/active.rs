//! Motions that are planned while the payload is identified.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Opposite corners of a box, m: the least and the largest coordinates.
pub type BoxCorners = [[f64; 3]; 2];

/// Bounds on the unknown payload, targets and limits of motions that are planned from what has been
/// identified so far.
///
/// Besides the fields, the URDF limits positions, velocities and efforts of the joints, and
/// friction limits the grip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct ActiveExcitation {
    /// Largest half width of the 95 % intervals, as a fraction of the largest value of its kind
    /// (mass, centre of mass, inertia): once all ten are within it, arm and run stop.
    pub within: f64,
    /// Least and largest mass that the payload can have, kg.
    pub mass_kg: [f64; 2],
    /// Largest distance of the payload's centre of mass from the origin of the tool frame, m.
    pub center_of_mass_m: f64,
    /// Half of the diagonal of the largest box that the payload can be, m.
    pub half_diagonal_m: f64,
    /// Largest acceleration of each joint, rad/s² (m/s² for a prismatic joint).
    pub acceleration_rad_s2: f64,
    /// Largest angle by which a floating base may turn from where it starts, degrees. Default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_attitude_deg: Option<f64>,
    /// Largest distance by which a floating base's origin may move from its start, m. Default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_position_m: Option<f64>,
    /// Fraction of the friction between pads and payload that motions may use.
    pub friction_used: f64,
    /// Cutoff of the low-pass through which the payload is identified while the arm moves, Hz.
    pub cutoff_hz: f64,
    /// Whether links keep a distance of 1 cm from each other, from the payload's box and from boxes
    /// to keep out of. Their shapes are the collision shapes of the URDF but for meshes, which the
    /// simulation does not read.
    pub collisions: bool,
    /// Box around the payload in the tool frame. Without it collisions of the payload are not
    /// tested, and only the origin of the tool frame stays in `workspace_m` and out of
    /// `keep_out_m`. Default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload_box_m: Option<BoxCorners>,
    /// Box in which tool and payload stay, in the frame of the base link. Default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workspace_m: Option<BoxCorners>,
    /// Boxes that neither links nor tool nor payload enter, by their names, in the frame of the
    /// base link. Default none.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub keep_out_m: BTreeMap<String, BoxCorners>,
}

impl Default for ActiveExcitation {
    fn default() -> Self {
        Self {
            within: 0.01,
            mass_kg: [5.0, 150.0],
            center_of_mass_m: 0.5,
            half_diagonal_m: 0.8,
            acceleration_rad_s2: 3.0,
            base_attitude_deg: None,
            base_position_m: None,
            friction_used: 0.7,
            cutoff_hz: 3.0,
            collisions: true,
            payload_box_m: None,
            workspace_m: None,
            keep_out_m: BTreeMap::new(),
        }
    }
}
