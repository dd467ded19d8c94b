//! Errors of a calibration and of what is identified with it.

use tactid_dynamics::words::three_digits;
use tactid_dynamics::{ModelError, StateError};
use tactid_identify::IdentifyError;
use thiserror::Error;

/// Why an arm cannot be calibrated, or a calibration cannot be used.
#[derive(Debug, Error)]
pub enum CalibrateError {
    /// The robot, a sample, a setting or the length of the recordings does not allow it.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The caller stopped the work.
    #[error("the calibration was interrupted")]
    Interrupted,
    /// The recordings determine nothing, or their efforts do not fit the motion.
    #[error("{0}")]
    Data(String),
    /// Gains are far from what was known of them before the calibration.
    #[error("{}", unexpected(joint.as_deref(), *gain, *std_dev))]
    GainsUnexpected {
        /// Name of the joint; `None` where the gains of all joints are far off by the same factor.
        joint: Option<String>,
        /// The gain of the joint, or the geometric mean of all gains, relative to the given ones.
        gain: f64,
        /// Standard deviation that was given, a fraction.
        std_dev: f64,
        /// Gains of all joints, relative to the given ones: those that were found, and for the
        /// others their geometric mean.
        gains: Vec<f64>,
    },
    /// A recording without payload, which should update a calibration, shows one.
    #[error(
        "the unloaded recording holds a payload of {} ± {} kg: give one of the empty arm",
        three_digits(*mass_kg),
        three_digits(*half_width_kg)
    )]
    UnloadedHolds {
        /// Mass of the payload, kg.
        mass_kg: f64,
        /// Half width of its 95 % interval, kg.
        half_width_kg: f64,
    },
    /// An unloaded recording cannot be used beside the other ones.
    #[error("{0}")]
    Unloaded(String),
    /// The robot cannot be calibrated, or a calibration or a recording is of another robot or has
    /// other settings.
    #[error("{0}")]
    Robot(String),
    /// The data of a calibration do not fit together.
    #[error("`{field}` of the calibration is not valid: {reason}")]
    Field {
        /// Name of the field.
        field: &'static str,
        /// What is wrong, as a phrase.
        reason: String,
    },
}

impl CalibrateError {
    /// Returns the name of the setting that causes or resolves the error; `None` where there is
    /// none.
    #[must_use]
    pub fn option(&self) -> Option<&'static str> {
        match self {
            Self::Identify(error) => error.option(),
            _ => None,
        }
    }

    /// Returns the error of a calibration of another robot, which names the first `joint`, `link`
    /// or `tool` (`what`) that differs; a name is empty where there is none.
    #[must_use]
    pub fn other_robot(what: &str, expected: &str, found: &str) -> Self {
        let expected = match expected {
            "" => format!("no further {what}"),
            name => format!("the {what} `{name}`"),
        };
        let found = match found {
            "" => "none".to_owned(),
            name => format!("`{name}`"),
        };
        Self::Robot(format!(
            "the calibration is of {expected}, where the robot has {found}: use a calibration of this robot to this tip"
        ))
    }

    /// Returns the error of equations that cannot be solved, since numbers of the recordings are
    /// too large.
    pub(crate) fn unsolvable() -> Self {
        Self::Data(
            "the arm cannot be calibrated: check the units of positions, velocities and efforts"
                .to_owned(),
        )
    }

    /// Returns the error of recordings without efforts.
    pub(crate) fn no_efforts() -> Self {
        Self::Data("the samples have no joint efforts, which a calibration needs".to_owned())
    }
}

impl From<ModelError> for CalibrateError {
    fn from(error: ModelError) -> Self {
        Self::Identify(error.into())
    }
}

impl From<StateError> for CalibrateError {
    fn from(error: StateError) -> Self {
        Self::Identify(error.into())
    }
}

/// Says which gains are far from the given ones, and what to check.
fn unexpected(joint: Option<&str>, gain: f64, std_dev: f64) -> String {
    let (gain, std_dev) = (three_digits(gain), three_digits(std_dev));
    match joint {
        Some(joint) => format!(
            "the gain of `{joint}` comes out as {gain}, where 1 ± {std_dev} was expected: give the effort gain of this \
             joint, or check that it is this joint's effort, that masses are in kg and centres of mass in m, and the \
             direction of gravity"
        ),
        None => format!(
            "the gains of all joints are about {gain} times what was expected: check that the masses of the payloads are \
             in kg, that the recordings without payload hold none, and the effort gains"
        ),
    }
}
