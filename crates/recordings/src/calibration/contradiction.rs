//! Assumptions of a calibration that its recordings contradict, as its file has them.

use serde::{Deserialize, Serialize};
use tactid_calibrate::{Assumption, Contradiction};

/// A [`Contradiction`] by the `kind` of its finding.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum StoredContradiction {
    GravityTilted {
        joint: String,
        size: f64,
        std_dev: f64,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shown: Option<[f64; 3]>,
    },
    JointZeroOff(OfJoint),
    GainContradicted(OfJoint),
    PayloadComContradicted {
        joint: String,
        size: f64,
        std_dev: f64,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shown: Option<[f64; 3]>,
        payload: usize,
    },
    GainImprobable {
        joint: String,
        size: f64,
        std_dev: f64,
        prior_std_dev: f64,
    },
}

/// What the recordings show in place of one number of a joint.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OfJoint {
    joint: String,
    size: f64,
    std_dev: f64,
}

impl StoredContradiction {
    pub(super) fn of(contradiction: &Contradiction) -> Self {
        let Contradiction {
            assumption,
            size,
            std_dev,
            joint,
            shown,
        } = contradiction.clone();
        match assumption {
            Assumption::Gravity => Self::GravityTilted {
                joint,
                size,
                std_dev,
                shown,
            },
            Assumption::JointZero => Self::JointZeroOff(OfJoint {
                joint,
                size,
                std_dev,
            }),
            Assumption::Gains => Self::GainContradicted(OfJoint {
                joint,
                size,
                std_dev,
            }),
            Assumption::PayloadCenter { payload } => Self::PayloadComContradicted {
                joint,
                size,
                std_dev,
                shown,
                payload,
            },
            Assumption::GainPrior { prior_std_dev } => Self::GainImprobable {
                joint,
                size,
                std_dev,
                prior_std_dev,
            },
        }
    }

    pub(super) fn report(self) -> Contradiction {
        let (assumption, joint, size, std_dev, shown) = match self {
            Self::GravityTilted {
                joint,
                size,
                std_dev,
                shown,
            } => (Assumption::Gravity, joint, size, std_dev, shown),
            Self::JointZeroOff(of) => (Assumption::JointZero, of.joint, of.size, of.std_dev, None),
            Self::GainContradicted(of) => (Assumption::Gains, of.joint, of.size, of.std_dev, None),
            Self::PayloadComContradicted {
                joint,
                size,
                std_dev,
                shown,
                payload,
            } => {
                let assumption = Assumption::PayloadCenter { payload };
                (assumption, joint, size, std_dev, shown)
            }
            Self::GainImprobable {
                joint,
                size,
                std_dev,
                prior_std_dev,
            } => {
                let assumption = Assumption::GainPrior { prior_std_dev };
                (assumption, joint, size, std_dev, None)
            }
        };
        Contradiction {
            assumption,
            size,
            std_dev,
            joint,
            shown,
        }
    }
}
