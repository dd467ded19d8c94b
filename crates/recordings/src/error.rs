//! Errors of an identification from a recording.

use std::path::{Path, PathBuf};

use tactid_dynamics::ModelError;
use tactid_identify::checks::PositionsBeyondLimits;
use tactid_identify::{IdentifyError, three_digits};
use tactid_logs::LogError;
use thiserror::Error;

use crate::phrases::{
    at_line, calibration_reason, gains, given_delay, given_twice, list_sensors, positions,
    stream_name,
};
use crate::time_unit::{TimeUnit, rare_advice};
use crate::topic_kind::TopicKind;

/// Why a payload cannot be identified from a recording.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The robot, the settings or the samples do not allow an identification.
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
    /// Neither wrenches nor joint efforts measure the load.
    #[error(
        "the log has neither a wrench (type geometry_msgs/msg/WrenchStamped) nor joint states with an effort: nothing measures the load; its topics are: {0}"
    )]
    NoLoad(String),
    /// The inertial unit on a moving base does not measure in the base's own frame.
    #[error(
        "{topic} is in the frame `{frame}`, but an inertial unit on a moving base must be in the \
         base's own, `{base}`: transform its messages, or do not use it"
    )]
    ImuFrame {
        /// Topic of the inertial unit.
        topic: String,
        /// Frame of its messages.
        frame: String,
        /// Frame of the base.
        base: String,
    },
    /// Two of several recordings are the same, by their path or by their content.
    #[error("{}, but {because}", given_twice(paths))]
    SameRecording {
        /// Paths of both, or names of their arrays.
        paths: [PathBuf; 2],
        /// Why it may be given once only.
        because: &'static str,
    },
    /// Results to combine do not have something in common.
    #[error("{name} has another {what} than the first recording")]
    NotTheSame {
        /// What must be the same for all.
        what: &'static str,
        /// Name of the recording that differs.
        name: String,
    },
    /// The user interrupted the work before there was a result.
    #[error("interrupted before the recording was read")]
    Interrupted,
    /// The unloaded recording is a log that cannot be read.
    #[error("the unloaded recording cannot be read: {0}")]
    UnloadedLog(#[source] LogError),
    /// The log has no message.
    #[error("there is no message in {path}{damage}")]
    Empty {
        /// Path of the log.
        path: String,
        /// Where the log is damaged, if it is; begins with a colon.
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
    /// More topics have the right type than can be used together.
    #[error("the log has several topics of {what}: {topics}; choose one")]
    SeveralTopics {
        /// What all of them measure.
        what: &'static str,
        /// Their names.
        topics: String,
        /// What chooses among them: [`TopicKind::option`].
        kind: TopicKind,
    },
    /// Several sensors measure wrenches, but not as the fingers of one gripper do, so that nothing says whether their
    /// sum acts on the payload.
    #[error(
        "the log has several topics of wrenches: {}; they are summed where each is of another finger, a link that \
         joints beyond `{tip}` move; name the topic to use, or those whose sum acts on the payload",
        list_sensors(sensors)
    )]
    UnrelatedWrenches {
        /// The topics, each with the frame of its wrenches.
        sensors: Vec<(String, String)>,
        /// The end-effector frame.
        tip: String,
    },
    /// Neither the log nor the request describes the robot.
    #[error("the log has no robot description: give a URDF; its topics are: {0}")]
    NoUrdf(String),
    /// Nothing measures the motion of the wrench's sensor.
    #[error(
        "the log has wrenches but no motion: neither joint states, nor odometry of the sensor, nor an IMU; its topics are: {0}"
    )]
    NoMotion(String),
    /// A frame is neither a link of the robot nor fixed to one.
    #[error(
        "the frame `{frame}` of {} is neither a link nor fixed to one by /tf_static; the links are: {links}",
        topic.as_deref().unwrap_or("the end-effector")
    )]
    UnknownFrame {
        /// The frame.
        frame: String,
        /// The topic that names it; `None` for the end-effector.
        topic: Option<String>,
        /// The links of the robot.
        links: String,
    },
    /// The quaternion of the given frame of a sensor does not have the norm 1; its norm, to three digits.
    #[error(
        "the quaternion (qx, qy, qz, qw) of the sensor's frame has the norm {}, but must have the norm 1",
        three_digits(*.0)
    )]
    SensorFrameNorm(f64),
    /// The frame of one sensor is given, but there is another number of sensors.
    #[error("the frame of one wrench sensor is given, but there are {0} sensors")]
    SensorFrameForSeveral(usize),
    /// A joint that moves the tool is not in the log.
    #[error(
        "joint `{joint}` of the URDF is needed, but is not in the log, whose joints are: {joints}; record its joint \
         states, or make the joint fixed in the URDF"
    )]
    MissingJoint {
        /// The joint.
        joint: String,
        /// The joints of the log.
        joints: String,
    },
    /// The number of effort gains is not that of the joints.
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
    /// An unloaded recording is given, but another method than effort is used.
    #[error(
        "an unloaded recording is subtracted from the joint efforts, which needs the effort method: use this method, \
         or leave the unloaded recording out"
    )]
    UnloadedNeedsEffort,
    /// Several publishers in the unloaded recording have some of the joints each; their topics.
    #[error(
        "the joint states of the unloaded recording come from several publishers, but must come from one: record the \
         unloaded motion with one publisher of all joints; topics: {0}"
    )]
    SeveralUnloadedTopics(String),
    /// There is no shift in time with which the loaded and the unloaded recording overlap for long enough to compare
    /// them.
    #[error(
        "the loaded and the unloaded recording have too few joint states at the same points of the motion to be \
         compared: record the whole motion once more without the payload"
    )]
    NoSharedMotion,
    /// The unloaded recording has another motion.
    #[error(
        "the unloaded recording has another motion: joint `{joint}` differs by {rms:.3} {unit} rms, where {allowed} \
         {unit} is allowed; repeat the commanded motion of the loaded recording without the payload"
    )]
    OtherMotion {
        /// The joint that differs most.
        joint: String,
        /// Unit of its position, `rad` or `m`.
        unit: &'static str,
        /// Rms difference of its position, rad or m.
        rms: f64,
        /// The allowed difference, rad or m.
        allowed: f64,
    },
    /// A recording among several cannot be used.
    #[error("{}: {source}", path.display())]
    InRecording {
        /// Path of the recording.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<RecordingError>,
    },
    /// Neither an unloaded nor a loaded recording is given for a calibration.
    #[error("a calibration needs at least one recording, without a payload or with a known one")]
    NothingToCalibrate,
    /// Gains of efforts are far from what was known of them before a calibration.
    #[error(
        "{source}; where efforts are not torques, such as currents, rough effort gains must be given first: {}",
        gains(effort_gain)
    )]
    EffortGainsUnexpected {
        /// The gains that fit, of all joints of the robot in its order, N m or N for one unit of the recorded value.
        effort_gain: Vec<f64>,
        /// Which gains are unexpected.
        source: IdentifyError,
    },
    /// Joint positions are beyond the limits of the URDF, and the efforts do not fit them.
    #[error("the efforts do not fit the positions, which are beyond the limits of the URDF: {}", positions(.0))]
    PositionsBeyondLimits(PositionsBeyondLimits),
    /// A calibration has what its file cannot have.
    #[error("the calibration cannot be written as TOML: {0}")]
    CalibrationText(String),
    /// The file of a calibration cannot be read or written.
    #[error("cannot {action} the calibration {}: {source}", path.display())]
    CalibrationIo {
        /// `read` or `write`.
        action: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// What is wrong.
        source: std::io::Error,
    },
    /// The file of a calibration is not what [`ArmCalibration::write`](crate::ArmCalibration::write) writes.
    #[error("{}{}: {reason}", path.display(), at_line(*line))]
    CalibrationFile {
        /// Path of the file.
        path: PathBuf,
        /// Number of the line, from one, where it is known.
        line: Option<usize>,
        /// What is wrong.
        reason: String,
    },
    /// An option does not fit the others that are given, or needs one that is not.
    #[error("`{name}` {reason}")]
    OptionConflict {
        /// Name of the field of the request.
        name: &'static str,
        /// What is wrong with it.
        reason: std::borrow::Cow<'static, str>,
    },
    /// The request has an option that a calibration sets or excludes.
    #[error(
        "`{name}` cannot be given together with a calibration, which {}",
        calibration_reason(name)
    )]
    NotWithCalibration {
        /// Name of the field.
        name: &'static str,
    },
    /// A joint is to be renamed that is not in the log, or to one that the robot does not have.
    #[error("cannot rename the joint `{recorded}` to `{joint}`: {} has no such joint; its joints are: {joints}", if *.in_log { "the log" } else { "the robot" })]
    RenamedJoint {
        /// Name in the log.
        recorded: String,
        /// Name in the robot.
        joint: String,
        /// Whether it is missing in the log, and not in the robot.
        in_log: bool,
        /// The joints of the log or of the robot.
        joints: String,
    },
    /// Two joints of the log are to be renamed to the same joint of the robot.
    #[error("cannot rename both `{}` and `{}` to the joint `{joint}`", recorded[0], recorded[1])]
    RenamedTwice {
        /// Their names in the log.
        recorded: [String; 2],
        /// Name in the robot.
        joint: String,
    },
    /// A topic exists but has no message.
    #[error("{0} is in the log, but has no message: record it once more, or use another topic")]
    EmptyTopic(String),
    /// There is no time at which all streams have a value.
    #[error(
        "there is no stretch of time in which all of these have values: {}; check that they were recorded together, \
         {}that their stamps are those of one clock",
        topics.join(", "),
        given_delay(*delay_s)
    )]
    NoOverlap {
        /// Names of the topics, or of the arrays.
        topics: Vec<String>,
        /// Delay of the wrenches that the request gives, s; zero without one.
        delay_s: f64,
        /// Faults of their messages.
        faults: Vec<crate::DataFault>,
    },
    /// Most times do not increase.
    #[error(
        "{unordered} times of {} are not later than the ones before them, and {used} could be used: times must \
         increase",
        stream_name(name)
    )]
    TimesNotIncreasing {
        /// Topic, or name of the field of [`Arrays`](crate::Arrays).
        name: String,
        /// Number of times that do not increase.
        unordered: u64,
        /// Number of samples that were used.
        used: u64,
    },
    /// Most stamps are far from the times of logging.
    #[error(
        "{left_out} messages on {topic} with a stamp far from the time of logging were left out, and {used} samples could \
         be used: stamps must be seconds and nanoseconds of the clock of the recorder"
    )]
    FarStamps {
        /// Topic of the messages.
        topic: String,
        /// Number of messages that were left out.
        left_out: u64,
        /// Number of samples that were used.
        used: u64,
    },
    /// A damaged log gives too little for an estimate.
    #[error("{source}; the log is damaged: {damage}")]
    DamagedEarly {
        /// What there is too little of.
        source: Box<RecordingError>,
        /// Where the log is damaged, and what is wrong there.
        damage: String,
    },
    /// Gaps leave no stretch that is long enough for a window.
    #[error(
        "too few windows: gaps between samples that are longer than {} s, the longest time that is bridged, \
         leave no stretch long enough (number of gaps: {gaps}); samples come every {} s: bridge longer times",
        three_digits(*max_gap_s),
        three_digits(*period_s)
    )]
    TooManyGaps {
        /// Number of gaps.
        gaps: u64,
        /// Longest time between two samples that is bridged, s.
        max_gap_s: f64,
        /// Mean time between two samples of the slowest stream, s.
        period_s: f64,
    },
    /// Samples come too seldom for a window.
    #[error(
        "too few samples: they come every {} s, but a window of {} s needs {min_samples}; {}",
        three_digits(*period_s),
        three_digits(*window_s),
        rare_advice(*unit)
    )]
    RareSamples {
        /// Mean time between two samples of the slowest stream, s.
        period_s: f64,
        /// Length of a window, s.
        window_s: f64,
        /// Fewest samples of a window.
        min_samples: u32,
        /// The unit that the times seem to have instead of seconds.
        unit: Option<TimeUnit>,
    },
    /// The arrays have no sample.
    #[error("`time` is empty: there is no sample")]
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
    /// The robot does not have the end-effector frame.
    #[error(
        "the robot has no link `{tip}`, which is to be the end-effector frame; its links are: {links}"
    )]
    UnknownTip {
        /// The end-effector frame, as requested or by default.
        tip: String,
        /// The links of the robot.
        links: String,
    },
    /// A robot is given twice for arrays: as a model, and as the URDF of the request.
    #[error("`robot` and the request's `urdf` are both given: give one of them")]
    RobotTwice,
    /// The motion of a base is given for a robot whose base is fixed.
    #[error(
        "`{name}` is about a base that moves, but that of the robot is fixed: load the robot with \
         `BaseKind::Floating`; for a fixed base that is tilted, give gravity in the axes of the base"
    )]
    BaseIsFixed {
        /// Name of the field of [`Arrays`](crate::Arrays).
        name: &'static str,
    },
    /// The request for arrays has an option that only a log can use; the name of the field.
    #[error("`{0}` is for logs only; arrays bring their unloaded reference with them")]
    NotForArrays(&'static str),
}

impl From<ModelError> for RecordingError {
    fn from(error: ModelError) -> Self {
        Self::Identify(error.into())
    }
}

impl RecordingError {
    /// Names the recording, among several, that an error is about; an interruption is about none.
    pub(crate) fn in_recording(self, path: &Path) -> Self {
        match self {
            Self::Interrupted => self,
            other => Self::InRecording {
                path: path.to_owned(),
                source: Box::new(other),
            },
        }
    }
}
