//! What the motion of a calibration does not determine, as its file has it.

use serde::{Deserialize, Serialize};
use tactid_calibrate::MotionShortage;

/// The variants of [`MotionShortage`] by `kind`.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Shortage {
    Still { joint: String, max_velocity: f64 },
    OneDirection { joint: String, is_positive: bool },
    Gain { joint: String, std_dev: f64 },
}

impl Shortage {
    pub(super) fn of(shortage: &MotionShortage) -> Self {
        match shortage.clone() {
            MotionShortage::Still {
                joint,
                max_velocity,
            } => Self::Still {
                joint,
                max_velocity,
            },
            MotionShortage::OneDirection { joint, is_positive } => {
                Self::OneDirection { joint, is_positive }
            }
            MotionShortage::Gain { joint, std_dev } => Self::Gain { joint, std_dev },
        }
    }

    pub(super) fn report(self) -> MotionShortage {
        match self {
            Self::Still {
                joint,
                max_velocity,
            } => MotionShortage::Still {
                joint,
                max_velocity,
            },
            Self::OneDirection { joint, is_positive } => {
                MotionShortage::OneDirection { joint, is_positive }
            }
            Self::Gain { joint, std_dev } => MotionShortage::Gain { joint, std_dev },
        }
    }
}
