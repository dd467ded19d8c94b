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
    /// A bounding box without room, or with a corner that is not finite.
    #[error(
        "the bounding box goes from {min} to {max} m along {axis}: it must end beyond where it begins"
    )]
    Box {
        /// Which axis of the tool frame.
        axis: &'static str,
        /// Where it begins, m.
        min: f64,
        /// Where it ends, m.
        max: f64,
    },
    /// A known mass, a bounding box, unknown offsets or the like with the paper's filter.
    #[error("{0} needs least squares: the paper's filter has ten parameters and nothing else")]
    KnowledgeNeedsLeastSquares(&'static str),
    /// Noise that is given neither once nor for each.
    #[error("{name} has {given} entries: give one for all, or one for each of the {expected} {of}")]
    NoiseCount {
        /// Which setting.
        name: &'static str,
        /// How many entries it has.
        given: usize,
        /// What there is one of for each.
        of: &'static str,
        /// How many there are.
        expected: usize,
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
    /// The paper's filter, which takes the three rows of a force or a moment, on a way with others.
    #[error(
        "the {0} way has other rows than forces and moments, which the paper's filter cannot \
             take: use least squares"
    )]
    NeedsLeastSquares(&'static str),
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
    /// Nothing in the log tells a load.
    #[error(
        "the log has neither a wrench (type geometry_msgs/msg/WrenchStamped) nor joint states with an effort: nothing tells the load; its topics are: {0}"
    )]
    NoLoad(String),
    /// An inertial unit that is not in the base's own frame.
    #[error(
        "{topic} is in the frame `{frame}`, but an inertial unit on a moving base must be in the \
         base's own, `{base}`: bring it there, or leave out --imu"
    )]
    ImuFrame {
        /// Its topic.
        topic: String,
        /// Its frame.
        frame: String,
        /// The base's.
        base: String,
    },
    /// The observer stopped the work before there was anything to tell.
    #[error("interrupted before the recording was read")]
    Interrupted,
    /// A log without a message.
    #[error("there is no message in {path}{damage}")]
    Empty {
        /// The log.
        path: String,
        /// Why, if that is known.
        damage: String,
    },
    /// A topic that was asked for and is not there, or of another type.
    #[error("the log has no topic {topic} of type {type_name}; its topics are: {topics}")]
    NoSuchTopic {
        /// What was asked for.
        topic: String,
        /// The ROS 2 type it would have.
        type_name: &'static str,
        /// What the log has.
        topics: String,
    },
    /// More topics fit than can be used together.
    #[error("the log has several topics of {what}: {topics}; choose with {option}")]
    SeveralTopics {
        /// What they all are.
        what: &'static str,
        /// All of them.
        topics: String,
        /// The option of the command line that chooses.
        option: &'static str,
    },
    /// Neither the log nor the request describes the robot.
    #[error("the log has no robot description: give a URDF with --urdf; its topics are: {0}")]
    NoUrdf(String),
    /// Nothing says how the wrench's sensor moves.
    #[error(
        "the log has wrenches but no motion: neither joint states, nor odometry of the sensor, nor an IMU; its topics are: {0}"
    )]
    NoMotion(String),
    /// A frame that is neither a link nor fixed to one.
    #[error(
        "the frame `{frame}` of {whose} is neither a link nor fixed to one by /tf_static; the links are: {links}"
    )]
    UnknownFrame {
        /// The frame.
        frame: String,
        /// The topic that names it.
        whose: String,
        /// What there is.
        links: String,
    },
    /// A joint that moves the tool and is not in the log.
    #[error("joint `{joint}` of the URDF is not in the log, whose joints are: {joints}")]
    MissingJoint {
        /// The joint.
        joint: String,
        /// What the log has.
        joints: String,
    },
    /// Gains that do not fit the joints.
    #[error("{given} effort gains for {count} joints: give one a joint, in the order {joints}")]
    EffortGains {
        /// How many were given.
        given: usize,
        /// How many joints there are.
        count: usize,
        /// The robot's joints.
        joints: String,
    },
    /// A bare recording where no efforts are used.
    #[error("a bare recording is taken off the joint efforts: it needs the effort way")]
    BareNeedsEffort,
    /// A bare recording of another motion.
    #[error(
        "the bare recording has another motion: joint `{joint}` differs by {rms:.3} {unit} rms, where {allowed} {unit} is allowed"
    )]
    OtherMotion {
        /// The joint that differs most.
        joint: String,
        /// Its unit.
        unit: &'static str,
        /// rad or m.
        rms: f64,
        /// rad or m.
        allowed: f64,
    },
    /// Too little was recorded without a gap.
    #[error(
        "too few windows: {windows} of {window_s:.3} s without a gap were found; record longer, or raise the cutoff"
    )]
    TooShort {
        /// Windows that were found.
        windows: usize,
        /// Their length, s.
        window_s: f64,
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
    #[error("the log holds no stretch of time in which all of these are there: {0}")]
    NoOverlap(String),
}
