use tactid_dynamics::{ModelError, StateError};
use tactid_nlms::SettingError;
use thiserror::Error;

/// Why a payload cannot be identified.
#[derive(Debug, Error)]
pub enum IdentifyError {
    /// The robot's model is at fault, or lacks the tool or a sensor's frame.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A sample does not fit the robot.
    #[error(transparent)]
    State(#[from] StateError),
    /// A setting of an estimator is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A setting of the identification is out of range.
    #[error("{name} is {given}, but must be {expected}")]
    Value {
        /// Name of the setting.
        name: &'static str,
        /// The given value.
        given: f64,
        /// What is possible.
        expected: &'static str,
    },
    /// A bounding box has no volume, or a corner that is not finite.
    #[error(
        "the bounding box goes from {min} to {max} m along {axis}: it must end beyond where it begins"
    )]
    Box {
        /// Axis of the tool frame.
        axis: &'static str,
        /// Lower end of the box, m.
        min: f64,
        /// Upper end of the box, m.
        max: f64,
    },
    /// A known mass, a bounding box, unknown offsets or the like were given to the paper's filter.
    #[error("{0} needs least squares: the paper's filter has ten parameters and nothing else")]
    KnowledgeNeedsLeastSquares(&'static str),
    /// Noise is given neither once nor for each.
    #[error("{name} has {given} entries: give one for all, or one for each of the {expected} {of}")]
    NoiseCount {
        /// Name of the setting.
        name: &'static str,
        /// Number of its entries.
        given: usize,
        /// What there should be an entry for.
        of: &'static str,
        /// Number of those.
        expected: usize,
    },
    /// A sample has another number of wrenches than there are sensors.
    #[error("a sample has {given} wrenches, but there are {expected} sensors")]
    WrenchCount {
        /// Number of wrenches in the sample.
        given: usize,
        /// Number of sensors.
        expected: usize,
    },
    /// The tactile method has no sensor.
    #[error(
        "the tactile method needs at least one wrench: name a sensor, or use the joint-sensing method"
    )]
    NoWrench,
    /// The joint-sensing method on a base that cannot move.
    #[error(
        "the joint-sensing method needs a free-floating base: a fixed one takes up the momentum that it relies on"
    )]
    FixedBase,
    /// The paper's filter, which takes the three rows of a force or a moment, on a method with others.
    #[error(
        "the {0} method has other rows than forces and moments, which the paper's filter cannot \
             take: use least squares"
    )]
    NeedsLeastSquares(&'static str),
    /// Too few windows without a gap.
    #[error(
        "too few windows: {windows} of {window_s:.3} s without a gap were found; record longer, or raise the cutoff"
    )]
    TooFewWindows {
        /// Number of windows.
        windows: usize,
        /// Their length, s.
        window_s: f64,
    },
}
