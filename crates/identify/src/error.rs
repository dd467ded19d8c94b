use tactid_dynamics::{ModelError, StateError};
use tactid_logs::LogError;
use tactid_nlms::SettingError;
use thiserror::Error;

/// Why a payload cannot be identified.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The robot's model is at fault, or lacks the tool or a sensor's frame.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A sample does not fit the robot.
    #[error(transparent)]
    State(#[from] StateError),
    /// An estimator's setting is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A setting that no estimator has.
    #[error("{name} is {given}, but must be {wanted}")]
    Value {
        /// Which setting.
        name: &'static str,
        /// What was given.
        given: f64,
        /// What is possible.
        wanted: &'static str,
    },
    /// A sample with another number of wrenches than the identifier has sensors.
    #[error("a sample has {given} wrenches, but there are {expected} sensors")]
    WrenchCount {
        /// How many came.
        given: usize,
        /// How many sensors were named.
        expected: usize,
    },
    /// The tactile way without a sensor.
    #[error(
        "the tactile way needs at least one wrench: name a sensor, or use the joint-sensing way"
    )]
    NoWrench,
    /// The joint-sensing way on a base that cannot move.
    #[error(
        "the joint-sensing way needs a free-floating base: a fixed one takes up the momentum that it relies on"
    )]
    FixedBase,
    /// A topic that identification cannot do without.
    #[error("the log has no {what} (type {type_name}); its topics are: {topics}")]
    MissingTopic {
        /// What it is needed for.
        what: &'static str,
        /// The ROS 2 type it would have.
        type_name: &'static str,
        /// What the log has instead.
        topics: String,
    },
    /// More topics than one of a type of which one is needed.
    #[error("the log has several topics of type {type_name}: {topics}; one is needed")]
    SeveralTopics {
        /// The type.
        type_name: &'static str,
        /// All of them.
        topics: String,
    },
    /// A message that contradicts the robot.
    #[error("{topic} at {time_s:.3} s: {what}")]
    Message {
        /// Where it was read.
        topic: String,
        /// When, s on the log's clock.
        time_s: f64,
        /// What is wrong with it.
        what: String,
    },
    /// No moment at which all the streams were there.
    #[error("the log holds no two samples at which {0} are all there within a common time")]
    NoOverlap(String),
}
