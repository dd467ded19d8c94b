//! Why a motion cannot be designed.

use tactid_dynamics::{ModelError, StateError};
use tactid_identify::IdentifyError;

use crate::limits::Limit;
use crate::untested::UntestedLinks;

/// Why a motion cannot be designed.
#[derive(Debug, thiserror::Error)]
pub enum ExcitationError {
    /// The robot lacks a link or a mass.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A slice does not fit the robot.
    #[error(transparent)]
    State(#[from] StateError),
    /// The equations cannot be formed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// A number is out of range.
    #[error("`{name}` is {given}; expected {expected}")]
    Value {
        /// Name of the field.
        name: String,
        /// Its value.
        given: f64,
        /// What is valid.
        expected: String,
    },
    /// An option of a request does not fit the robot or the other options.
    #[error("{reason}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// What is wrong, with the name of the option unless it is about what the option gives.
        reason: String,
    },
    /// The base is fixed, so that its motion cannot be bounded.
    #[error("the motion of the base is bounded, but the base is fixed")]
    FixedBase,
    /// The URDF does not limit the velocity of a joint.
    #[error(
        "the URDF has no positive velocity limit for joint {joint}: set `JointLimits::velocity`"
    )]
    NoVelocityLimit {
        /// Name of the joint.
        joint: String,
    },
    /// The noise of a source is not known.
    #[error(
        "the noise of channel {channel} is unknown, so that no interval can be predicted: give `wrench_noise`, \
         `effort_noise` or `base_noise`"
    )]
    UnknownNoise {
        /// Name of the first channel without known noise.
        channel: String,
    },
    /// A limit is exceeded where the robot does not even move, or where it moves by hardly anything.
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
        "{0}: give meshes as STL or OBJ that can be read, or accept motions that are not tested by \
         `CollisionModel::accepting_untested`"
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
        "the averaging window of {window_s:.3} s, for a cutoff of {cutoff_hz} Hz, has too few samples at {rate_hz} Hz"
    )]
    TooFewSamples {
        /// Length of a window, s.
        window_s: f64,
        /// Cutoff of the filter, Hz.
        cutoff_hz: f64,
        /// Rate of the samples, Hz.
        rate_hz: f64,
    },
    /// The link of the tool is fixed to the base, so that no motion moves it.
    #[error("no joint moves `{tool}`")]
    NoMovingJoint {
        /// Name of the link.
        tool: String,
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
