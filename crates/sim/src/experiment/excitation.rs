//! What moves the joints of an experiment.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::ActiveExcitation;

/// Motion of the joints: cosines, a designed motion, or motions that are planned while the payload
/// is identified.
///
/// With cosines each joint starts at rest and is driven with the acceleration
/// `amplitude · cos(2π · frequency · t)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct Excitation {
    /// What the joints follow. Mode, command noise and list of joints belong to cosines alone.
    pub kind: ExcitationKind,
    /// A designed motion, relative to the experiment's file: its folder, its log, or a CSV file
    /// with the columns `time_s`, and `q_NAME` (rad or m) and `qd_NAME` (rad/s or m/s) for each
    /// joint of the arm. Default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// What is known of the payload, the targets and the limits with the kind
    /// [`Active`](ExcitationKind::Active), which without this table has its defaults. Default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub active: Option<ActiveExcitation>,
    /// Order in which the joints are driven.
    pub mode: ExcitationMode,
    /// Standard deviation of the white noise on each commanded acceleration, as a fraction of its
    /// amplitude, with a new value in every step.
    pub command_noise: f64,
    /// The joints that are driven, in this order. All other joints are held still.
    pub joints: Vec<JointExcitation>,
}

impl Default for Excitation {
    fn default() -> Self {
        let joint = |name: &str| JointExcitation {
            name: name.to_owned(),
            amplitude_rad_s2: default_amplitude(),
            frequency_hz: default_frequency(),
        };
        Self {
            kind: ExcitationKind::default(),
            file: None,
            active: None,
            mode: ExcitationMode::default(),
            command_noise: 0.01,
            joints: ["joint_3", "joint_5", "joint_6"].map(joint).to_vec(),
        }
    }
}

/// What the joints follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExcitationKind {
    /// Accelerations that are cosines of time, joint by joint.
    #[default]
    Cosine,
    /// The positions in the file of a designed motion.
    Designed,
    /// Motions that are planned one after another from what the fingers have measured so far, until
    /// all ten values are within their targets. Each plan takes no simulated time.
    Active,
}

/// Order in which the joints are driven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExcitationMode {
    /// One after another, each for an equal fraction of the duration.
    #[default]
    Sequence,
    /// All at once for the whole duration.
    Together,
}

/// Motion of one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct JointExcitation {
    /// Name of the joint in the URDF.
    pub name: String,
    /// Amplitude of the acceleration, rad/s² (m/s² for a prismatic joint).
    #[serde(default = "default_amplitude")]
    pub amplitude_rad_s2: f64,
    /// Frequency, Hz.
    #[serde(default = "default_frequency")]
    pub frequency_hz: f64,
}

fn default_amplitude() -> f64 {
    1.0
}

fn default_frequency() -> f64 {
    0.2
}
