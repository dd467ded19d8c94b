//! Why a motion cannot be designed.

use tactid_dynamics::{ModelError, StateError};
use tactid_identify::IdentifyError;

use crate::limits::Limit;
use crate::untested::UntestedLinks;

/// Why a motion cannot be designed.
#[derive(Debug, thiserror::Error)]
pub enum ExcitationError {
    /// The robot lacks a link or a mass, a slice does not fit it, or the equations cannot be
    /// formed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// A number is out of range.
    #[error("`{name}` is {given}; expected {expected}")]
    Value {
        /// Name of the field of the problem.
        name: String,
        /// Its value.
        given: f64,
        /// What is valid.
        expected: String,
    },
    /// An option does not fit the robot or another option.
    #[error("{what}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// What is wrong with it, and what would be right.
        what: String,
    },
    /// The URDF does not limit the velocity of a joint.
    #[error("the URDF has no positive velocity limit for joint {joint}: add one to its <limit>")]
    NoVelocityLimit {
        /// Name of the joint.
        joint: String,
    },
    /// A limit is exceeded where the robot does not even move, or where it moves by hardly
    /// anything.
    #[error("no motion is possible: {} {at}", exceeded(.limit, *.used))]
    Impossible {
        /// The limit.
        limit: Limit,
        /// Fraction of the limit that is used: infinite where the payload pulls off a pad.
        used: f64,
        /// Where: at the start, at the end, on the way there, or in every motion that was tried.
        at: &'static str,
    },
    /// Collision shapes of links that the motion could bring into contact are left out.
    #[error(
        "{0}; {remedy}, or accept a motion that may run the robot through itself with `collisions` (false)",
        remedy = .0.remedy()
    )]
    Untested(UntestedLinks),
    /// The motion is shorter than what the filter needs.
    #[error(
        "a motion of {duration_s} s is too short: the averaging window is {window_s:.3} s long"
    )]
    TooShort {
        /// Duration of the motion, s.
        duration_s: f64,
        /// Length of a window, s.
        window_s: f64,
    },
    /// The averaging window of the filter is shorter than a few samples, which no duration changes.
    #[error(
        "the averaging window of {window_s:.3} s, for a cutoff of {cutoff_hz} Hz, has too few samples at {rate_hz} Hz: \
         raise `sample_rate`, or lower the cutoff"
    )]
    TooFewSamples {
        /// Length of a window, s.
        window_s: f64,
        /// Cutoff of the filter, Hz.
        cutoff_hz: f64,
        /// Rate of the samples, Hz.
        rate_hz: f64,
    },
    /// No motion that was tried determines all ten values.
    #[error("no motion of these joints within the limits determines all ten values of the payload")]
    NotObservable,
    /// No motion of the longest duration reaches the targets.
    #[error(
        "no motion of up to {longest_s} s was found that reaches the targets: the interval of {value} is {ratio:.2} times \
         its target{}", .binding.as_ref().map(|limit| format!(", and {limit} binds")).unwrap_or_default()
    )]
    OutOfReach {
        /// Longest duration that was tried, s.
        longest_s: f64,
        /// The value whose interval is the largest relative to its target.
        value: &'static str,
        /// Ratio of that interval to its target.
        ratio: f64,
        /// A limit that binds the longest motion.
        binding: Option<Limit>,
    },
    /// The caller stopped the design.
    #[error("the design was interrupted")]
    Interrupted,
    /// The conic solver failed.
    #[error("the conic solver failed: {0}")]
    Solver(String),
}

impl ExcitationError {
    /// Returns the error of an end-effector frame that no joint moves.
    pub(crate) fn unmoved(tip: &str) -> Self {
        Self::Option {
            option: "tip",
            what: format!(
                "`tip` is {tip}, which no joint moves: expected a link at the end of the arm"
            ),
        }
    }

    /// Returns the name of the option that causes or resolves the error; `None` where there is
    /// none.
    #[must_use]
    pub fn option(&self) -> Option<&'static str> {
        match self {
            Self::Identify(error) => error.option(),
            Self::Option { option, .. } => Some(option),
            Self::Value { name, .. } => option_of(name),
            Self::Untested(_) => Some("collisions"),
            Self::TooFewSamples { .. } => Some("sample_rate"),
            _ => self.remedy().map(|(option, _)| option),
        }
    }

    /// Returns the message for a reader who gives options and no fields of a problem: with the
    /// option that gives a number, or that lets a motion be possible, and what it does.
    #[must_use]
    pub fn by_option(&self) -> String {
        match self {
            Self::Value {
                name,
                given,
                expected,
            } => format!("{} is {given}; expected {expected}", place(name)),
            _ => match self.remedy() {
                Some((_, does)) => format!("{self}; {does}"),
                None => self.to_string(),
            },
        }
    }

    /// Returns the option that lets a motion be possible, and what it does.
    fn remedy(&self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::TooShort { .. } => Some(("duration", "`duration` sets it")),
            Self::Impossible { limit, .. }
            | Self::OutOfReach {
                binding: Some(limit),
                ..
            } => Some(limit.remedy()),
            _ => None,
        }
    }
}

impl From<ModelError> for ExcitationError {
    fn from(error: ModelError) -> Self {
        Self::Identify(error.into())
    }
}

impl From<StateError> for ExcitationError {
    fn from(error: StateError) -> Self {
        Self::Identify(error.into())
    }
}

/// Returns the option that a field of the problem is from.
fn option_of(field: &str) -> Option<&'static str> {
    Some(match field.split(['.', '[']).next()? {
        "start" => "start",
        "duration_s" => "duration",
        "rate_hz" => "sample_rate",
        "base_noise" => "base_noise",
        "longest_s" => "longest",
        "wrench" => "wrench_limit",
        "grip" => "grip",
        "payloads" => "payload",
        "payload_box" => "payload_box",
        "workspace" if field.contains("keep_out") => "keep_out",
        "workspace" => "workspace",
        "base" if field.ends_with("position_m") => "base_position",
        "base" => "base_attitude",
        "limits" if field.contains("acceleration") => "acceleration",
        "limits" if field.contains("velocity") => "limit_scale",
        _ => return None,
    })
}

/// Returns the option of a field with the place within it, such as `[2] (joint_3)` or `.friction`;
/// the field where no option gives it.
fn place(field: &str) -> String {
    match (option_of(field), field.find(['.', '['])) {
        (None, _) => field.to_owned(),
        (Some(option), None) => format!("`{option}`"),
        (Some(option), Some(at)) => format!("`{option}`: {}", &field[at..]),
    }
}

/// Returns how a limit is exceeded.
fn exceeded(limit: &Limit, used: f64) -> String {
    match limit {
        Limit::Grip(pad) if used.is_infinite() => format!("the payload pulls off pad {pad}"),
        Limit::Distance(first, second) if used.is_infinite() => {
            format!("{first} and {second} touch")
        }
        Limit::Distance(..) => {
            format!("{limit} is {:.3} times the least one allowed", used.recip())
        }
        _ => format!("{limit} is {used:.3} times its limit"),
    }
}
