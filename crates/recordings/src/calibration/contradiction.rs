//! Assumptions of a calibration that its recordings contradict, as its file has them.

use serde::{Deserialize, Serialize};
use tactid_identify::calibration::{Assumption, Contradiction};

/// A [`Contradiction`] by the `kind` of its finding.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum StoredContradiction {
    GravityTilted(Shown),
    JointZeroOff(Shown),
    GainContradicted(Shown),
    PayloadComContradicted {
        joint: String,
        size: f64,
        std_dev: f64,
        payload: usize,
    },
    GainImprobable {
        joint: String,
        size: f64,
        std_dev: f64,
        prior_std_dev: f64,
    },
}

/// What the recordings show in place of an assumption.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shown {
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
        } = contradiction.clone();
        let shown = Shown {
            joint,
            size,
            std_dev,
        };
        match assumption {
            Assumption::Gravity => Self::GravityTilted(shown),
            Assumption::JointZero => Self::JointZeroOff(shown),
            Assumption::Gains => Self::GainContradicted(shown),
            Assumption::PayloadCenter(payload) => Self::PayloadComContradicted {
                joint: shown.joint,
                size,
                std_dev,
                payload,
            },
            Assumption::GainPrior(prior_std_dev) => Self::GainImprobable {
                joint: shown.joint,
                size,
                std_dev,
                prior_std_dev,
            },
        }
    }

    pub(super) fn report(self) -> Contradiction {
        let of = |assumption, shown: Shown| Contradiction {
            assumption,
            size: shown.size,
            std_dev: shown.std_dev,
            joint: shown.joint,
        };
        match self {
            Self::GravityTilted(shown) => of(Assumption::Gravity, shown),
            Self::JointZeroOff(shown) => of(Assumption::JointZero, shown),
            Self::GainContradicted(shown) => of(Assumption::Gains, shown),
            Self::PayloadComContradicted {
                joint,
                size,
                std_dev,
                payload,
            } => Contradiction {
                assumption: Assumption::PayloadCenter(payload),
                size,
                std_dev,
                joint,
            },
            Self::GainImprobable {
                joint,
                size,
                std_dev,
                prior_std_dev,
            } => Contradiction {
                assumption: Assumption::GainPrior(prior_std_dev),
                size,
                std_dev,
                joint,
            },
        }
    }
}
