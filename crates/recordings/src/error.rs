use tactid_dynamics::ModelError;
use tactid_identify::IdentifyError;
use tactid_logs::LogError;
use thiserror::Error;

/// What a log has topics of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TopicKind {
    /// Joint states.
    Joints,
    /// Wrenches.
    Wrenches,
    /// Odometry of the base or of the sensor.
    Odometry,
    /// Measurements of an inertial unit.
    Imu,
    /// Accelerations of what the odometry moves.
    Acceleration,
}

/// Why a payload cannot be identified from a recording.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The identification refuses the robot, the settings or the samples.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A topic that the identification needs is missing.
    #[error("the log has no {what} (type {type_name}); its topics are: {topics}")]
    MissingTopic {
        /// What it is needed for.
        what: &'static str,
        /// The ROS 2 type it would have.
        type_name: &'static str,
        /// The topics of the log.
        topics: String,
    },
    /// Nothing in the log measures a load.
    #[error(
        "the log has neither a wrench (type geometry_msgs/msg/WrenchStamped) nor joint states with an effort: nothing measures the load; its topics are: {0}"
    )]
    NoLoad(String),
    /// An inertial unit that is not in the base's own frame.
    #[error(
        "{topic} is in the frame `{frame}`, but an inertial unit on a moving base must be in the \
         base's own, `{base}`: transform it, or do without it"
    )]
    ImuFrame {
        /// Its topic.
        topic: String,
        /// Its frame.
        frame: String,
        /// The base's frame.
        base: String,
    },
    /// The user interrupted the work before there was a result.
    #[error("interrupted before the recording was read")]
    Interrupted,
    /// A log without a message.
    #[error("there is no message in {path}{damage}")]
    Empty {
        /// The log.
        path: String,
        /// The reason, if it is known.
        damage: String,
    },
    /// A requested topic does not exist, or has another type.
    #[error("the log has no topic {topic} of type {type_name}; its topics are: {topics}")]
    NoSuchTopic {
        /// What the topic was requested for.
        kind: TopicKind,
        /// The requested topic.
        topic: String,
        /// The ROS 2 type it would have.
        type_name: &'static str,
        /// The topics of the log.
        topics: String,
    },
    /// More topics fit than can be used together.
    #[error("the log has several topics of {what}: {topics}; choose one")]
    SeveralTopics {
        /// What they all are.
        what: &'static str,
        /// All of them.
        topics: String,
        /// Which field of [`Topics`](crate::Topics) chooses.
        kind: TopicKind,
    },
    /// Neither the log nor the request describes the robot.
    #[error("the log has no robot description: give a URDF; its topics are: {0}")]
    NoUrdf(String),
    /// Nothing measures how the wrench's sensor moves.
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
        /// The links of the robot.
        links: String,
    },
    /// A joint that moves the tool and is not in the log.
    #[error("joint `{joint}` of the URDF is not in the log, whose joints are: {joints}")]
    MissingJoint {
        /// The joint.
        joint: String,
        /// The joints of the log.
        joints: String,
    },
    /// Gains that do not fit the joints.
    #[error(
        "{given} effort gains for {count} joints: give one for each joint, in the order {joints}"
    )]
    EffortGains {
        /// Number of gains.
        given: usize,
        /// Number of joints.
        count: usize,
        /// The robot's joints.
        joints: String,
    },
    /// An unloaded recording where no efforts are used.
    #[error(
        "an unloaded recording is subtracted from the joint efforts: it needs the effort method"
    )]
    UnloadedNeedsEffort,
    /// An unloaded recording of another motion.
    #[error(
        "the unloaded recording has another motion: joint `{joint}` differs by {rms:.3} {unit} rms, where {allowed} {unit} is allowed"
    )]
    OtherMotion {
        /// The joint that differs most.
        joint: String,
        /// Its unit.
        unit: &'static str,
        /// Its difference, rad or m.
        rms: f64,
        /// The allowed difference, rad or m.
        allowed: f64,
    },
    /// A topic exists but has no message.
    #[error("{0} is there, but has no message")]
    EmptyTopic(String),
    /// No time at which all streams have a value.
    #[error("there is no stretch of time in which all of these have values: {topics}")]
    NoOverlap {
        /// The topics.
        topics: String,
        /// What was wrong with their messages.
        faults: Vec<crate::DataFault>,
    },
    /// Arrays without a sample.
    #[error("`times_s` is empty: the arrays have no sample")]
    NoSamples,
    /// An array does not have the length that the others ask for.
    #[error("`{name}` has {given} entries, but must have {expected}")]
    ArrayLength {
        /// Name of the field of [`Arrays`](crate::Arrays).
        name: &'static str,
        /// Number of its entries.
        given: usize,
        /// Number of entries that it must have, with the factors of which it is the product.
        expected: String,
    },
    /// An array that the identification needs is empty.
    #[error("`{name}` is empty, but {reason}")]
    MissingArray {
        /// Name of the field of [`Arrays`](crate::Arrays).
        name: &'static str,
        /// Why it is needed.
        reason: &'static str,
    },
    /// An option that only a log can use was requested for arrays.
    #[error(
        "`{0}` of the request is for logs only: arrays have no topics, and bring their robot with them"
    )]
    NotForArrays(&'static str),
}

impl From<ModelError> for RecordingError {
    fn from(error: ModelError) -> Self {
        Self::Identify(error.into())
    }
}
