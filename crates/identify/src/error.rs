use tactid_dynamics::words::three_digits;
use tactid_dynamics::{ModelError, StateError};
use tactid_nlms::SettingError;
use thiserror::Error;

/// Why a payload cannot be identified.
///
/// The kind is for programs; the message says what is wrong, where, and what would be right. It
/// names [`option`](Self::option) in code quotes.
#[derive(Debug, Error)]
pub enum IdentifyError {
    /// The model of the robot is invalid, or has no link for the tool or a sensor.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A slice of a sample does not fit the robot.
    #[error(transparent)]
    State(#[from] StateError),
    /// A setting is out of range, or does not fit the robot or another setting.
    #[error("{what}")]
    Option {
        /// Name of the setting: a field of the settings that contain it.
        option: &'static str,
        /// What is wrong with it, and what would be right.
        what: String,
    },
    /// The robot or its sensors do not have what the method needs.
    #[error("{0}; `method` chooses the method")]
    Method(String),
    /// A sample does not have one wrench for each sensor.
    #[error("a sample has {given} wrenches, but there are {expected} sensors")]
    Wrenches {
        /// Number of wrenches of the sample.
        given: usize,
        /// Number of sensors.
        expected: usize,
    },
    /// There is no pose with measurements.
    #[error("no pose has a wrench and an attitude that can be used")]
    NoPose,
    /// There are too few windows, or most have too few samples: the recording is too short, or the
    /// cutoff does not suit its length or its sample rate.
    #[error("{0}; `cutoff_hz` sets the cutoff")]
    TooLittle(String),
}

impl IdentifyError {
    /// Returns the name of the setting that causes or resolves the error; `None` where there is
    /// none.
    #[must_use]
    pub fn option(&self) -> Option<&'static str> {
        match self {
            Self::Option { option, .. } => Some(option),
            Self::Method(_) => Some("method"),
            Self::TooLittle(_) => Some("cutoff_hz"),
            Self::Model(_) | Self::State(_) | Self::Wrenches { .. } | Self::NoPose => None,
        }
    }

    /// Returns the error of a number of a setting that is out of range.
    #[must_use]
    pub fn out_of_range(option: &'static str, given: f64, expected: &str) -> Self {
        let what = format!("`{option}` is {}, but must be {expected}", digits(given));
        Self::Option { option, what }
    }

    /// Returns the error of a setting that is given neither once for all nor once for each of so
    /// many sensors or joints (`of`, in the plural).
    #[must_use]
    pub fn miscounted(option: &'static str, given: usize, expected: usize, of: &str) -> Self {
        let what = format!(
            "`{option}` has {given} entries: give one for all, or one for each of the {expected} {of}"
        );
        Self::Option { option, what }
    }

    /// Returns the error of a recording with fewer windows than an estimate needs.
    #[must_use]
    pub fn too_few_windows(windows: usize, window_s: f64) -> Self {
        Self::TooLittle(format!(
            "too few windows: {windows} of {} s without a gap were found; record longer, or raise the cutoff",
            three_digits(window_s)
        ))
    }
}

impl From<SettingError> for IdentifyError {
    fn from(error: SettingError) -> Self {
        Self::Option {
            option: error.name,
            what: error.to_string(),
        }
    }
}

/// Returns all digits of a number for a message, with an exponent where it is very large or very
/// small.
fn digits(value: f64) -> String {
    let size = value.abs();
    if value.is_finite() && size != 0.0 && !(1e-5..1e16).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}
