//! Findings: what a reader of the result should know of the recording, for a program to match.

mod live_words;
mod reading_words;
mod words;

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_calibrate::Contradiction;
use tactid_identify::{EffortContent, Method};

use crate::OrientationReading;

/// Largest change of a joint's gain, a fraction, that may have its cause in the arm itself:
/// temperature changes gains by a few percent.
const LARGEST_CHANGE_OF_A_GAIN: f64 = 0.15;

/// Largest rms change of the friction, a fraction, that temperature and wear explain: a cold gear
/// has about half as much again as a warm one.
const LARGEST_CHANGE_OF_FRICTION: f64 = 0.6;

/// Something that a reader of the result should know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Finding {
    /// An option of the request has no effect.
    OptionNotUsed {
        /// Name of the field of [`Request`](crate::Request).
        option: Cow<'static, str>,
        /// The reason.
        #[serde(flatten)]
        because: NotUsedBecause,
    },
    /// Measured accelerations are not used, because those derived from the velocities are better.
    AccelerationNotUsed {
        /// Topic of the measured accelerations.
        topic: String,
        /// Whether the derived ones explain the wrench better; otherwise they have less noise.
        explains_better: bool,
        /// Residual with the derived accelerations, relative to that with the measured ones,
        /// without a unit.
        residual_ratio: f64,
        /// Power of the derived accelerations, relative to that of the measured ones, without a
        /// unit.
        power_ratio: f64,
    },
    /// A topic names no frame: its wrenches are taken to be in this one.
    FrameAssumed {
        /// Topic of the wrenches.
        topic: String,
        /// The assumed frame.
        frame: String,
    },
    /// A frame is in no description of the robot, but `/tf` shows the link that carries it.
    FrameFollowed {
        /// The frame.
        frame: String,
        /// The link.
        link: String,
        /// Mean origin of the frame in the frame of the link, m.
        origin_m: [f64; 3],
    },
    /// A topic is in a frame that does not move with the tool: its wrenches are taken to have the
    /// axes of this frame, and to be about the origin of another one.
    AxesAssumed {
        /// Topic of the wrenches.
        topic: String,
        /// The frame of the axes.
        axes: String,
        /// The frame whose origin the moments are about.
        point: String,
    },
    /// The name of a topic is that of a driver whose values need an option.
    TopicRecognized {
        /// The topic.
        topic: String,
        /// What the driver publishes there.
        content: Cow<'static, str>,
        /// Name of the field of [`Request`](crate::Request) that reads it rightly.
        option: Cow<'static, str>,
        /// Its value.
        value: String,
    },
    /// The wrenches have other axes than those that are assumed.
    AxesContradicted {
        /// The link whose axes they have, or `world`; the frame of the sensor for `None`.
        axes: Option<String>,
        /// Residual with these axes relative to that with the assumed ones, without a unit.
        residual_ratio: f64,
    },
    /// The moments of the wrenches are about another point than what is assumed.
    PointContradicted {
        /// The link about whose origin they are, and whose axes the wrenches have.
        frame: String,
        /// Residual with this point relative to that with the assumed one, without a unit.
        residual_ratio: f64,
    },
    /// The joint efforts contain something else than what is assumed.
    EffortContentContradicted {
        /// What they contain.
        content: EffortContent,
        /// Residual with this content relative to that with the assumed one, without a unit.
        residual_ratio: f64,
    },
    /// The log has no wrenches, but forces at points, whose sums are used.
    ForcesSummed {
        /// The topics.
        topics: Vec<String>,
    },
    /// The values of two or three joints are exchanged: the columns have another order than the
    /// joints.
    JointsExchanged {
        /// The joints: the values of each are given for the one before it, those of the first for
        /// the last.
        joints: Vec<String>,
        /// Residual with the exchanged values relative to that with the given ones, without a unit.
        residual_ratio: f64,
    },
    /// The values of a joint have the opposite sign of what the robot's description says.
    JointSignContradicted {
        /// The joint.
        joint: String,
        /// Residual with the opposite sign relative to that with the given one, without a unit.
        residual_ratio: f64,
    },
    /// The orientations of the tool, or of the base, are not what they are taken for.
    OrientationContradicted {
        /// What they are.
        reading: OrientationReading,
        /// Whether they are those of the base, `world_from_base`; otherwise they are those of the
        /// tool, `world_from_tool`.
        #[serde(default)]
        of_base: bool,
        /// Residual with this reading relative to that with the given one, without a unit.
        residual_ratio: f64,
    },
    /// Moments are in the places of forces, and forces in those of moments.
    ForcesAndMomentsExchanged {
        /// Residual with the exchanged values relative to that with the given ones, without a unit.
        residual_ratio: f64,
    },
    /// The mass from poses at rest is more than what most arms lift: the forces may be in another
    /// unit.
    HeavyLoad {
        /// Mass of the payload, kg.
        mass_kg: f64,
        /// Its standard deviation, kg.
        std_dev_kg: f64,
    },
    /// The wrenches of several topics are summed.
    WrenchesSummed {
        /// The topics.
        topics: Vec<String>,
    },
    /// No joint in the log has the name of one of the URDF, but their names are the same behind a
    /// prefix.
    JointsRenamed {
        /// For each of them the name in the log, and that in the URDF.
        names: Vec<(String, String)>,
    },
    /// Efforts of joints are far noisier than in the calibration of the arm. Their noise is
    /// enlarged by so much.
    EffortNoisier {
        /// The joints.
        joints: Vec<String>,
        /// Standard deviation of the noise of each, relative to that of the calibration, without a
        /// unit.
        noise_ratios: Vec<f64>,
    },
    /// Friction of the joints has changed since the calibration of the arm. The estimate takes it
    /// into account.
    FrictionChanged(ArmChanged),
    /// Gains of the joints have changed since the calibration of the arm. The estimate takes it
    /// into account.
    GainsChanged(ArmChanged),
    /// A joint moves that did not move in the recordings of the calibration: its friction is not
    /// known, and its effort counts little.
    JointUncalibrated {
        /// The joint.
        joint: String,
    },
    /// Joints in the log that the URDF does not have. They are left out.
    UnknownJoints {
        /// Their names.
        joints: Vec<String>,
    },
    /// Joints of the URDF that are not in the log and do not move the tool. They are taken to be at
    /// zero.
    AbsentJoints {
        /// Their names.
        joints: Vec<String>,
    },
    /// A topic begins long after the others: what came before is left out.
    LateStart {
        /// The topic.
        topic: String,
        /// Time after the first of the others, s.
        late_s: f64,
    },
    /// A topic ends long before the others: what came after is left out.
    EarlyEnd {
        /// The topic.
        topic: String,
        /// Time of its last message on the recording's clock, s.
        end_s: f64,
        /// Time before the last of the others, s.
        early_s: f64,
    },
    /// The recordings of the calibration contradict an assumption of it: the error is in the
    /// result, too.
    CalibrationContradicted(Contradiction),
    /// The zero of a joint has moved since the calibration, which the result does not contain.
    JointZeroMoved {
        /// The joint.
        joint: String,
        /// The true position less the measured one, rad or m.
        size: f64,
        /// Standard deviation of the size, rad or m.
        std_dev: f64,
    },
    /// The unloaded recording does not fit the other one, as that of another robot or of another
    /// temperature, and was left out.
    UnloadedLeftOut {
        /// Standard deviation of the residuals of the efforts with it, relative to that without it,
        /// without a unit.
        noise_ratio: f64,
    },
    /// The efforts of the unloaded arm are far from what its weight needs by the URDF: they are motor
    /// currents, or have another unit, and the load is wrong by the same ratio, or the masses of the
    /// URDF are wrong, which does not matter.
    UnloadedEffortsScaled {
        /// The joints that show it.
        joints: Vec<String>,
        /// Ratio of the recorded efforts, with their gains, to the needed ones of each of them,
        /// without a unit.
        ratios: Vec<f64>,
        /// Whether gains were given, so that the masses of the URDF are as likely to be wrong.
        has_gains: bool,
    },
    /// The recording is one of those that calibrated the arm: its payload was given, and the result
    /// repeats it.
    RecordingCalibrated {
        /// Whether it has a payload.
        is_loaded: bool,
    },
    /// The known tool is given without an uncertainty: one is assumed.
    ToolUncertaintyAssumed {
        /// Standard deviation of the values, relative to the largest of their kind, without a unit.
        std_dev: f64,
    },
    /// The measurements contradict the shape of the payload, which is not used.
    ShapeContradicted {
        /// Probability of at least this distance between both if the shape were that of the
        /// payload, without a unit.
        p_value: f64,
        /// Length of one unit of the file with which they agree, m; `None` where no usual one does.
        scale: Option<f64>,
        /// Whether the measurements contradict the shape only together with the known mass, which
        /// is then wrong.
        #[serde(default)]
        is_of_mass: bool,
    },
    /// The messages have no stamps: their times are those of logging.
    NoStamps,
    /// Topics have no stamps, but others have: the times of logging of their messages were brought
    /// to the clock of the stamps.
    StampsMissing {
        /// The topics without stamps.
        topics: Vec<String>,
        /// Rate of the clock of the stamps relative to that of logging, without a unit; 1 where
        /// they are the same but for an offset, and other than 1 in simulated time.
        clock_rate: f64,
    },
    /// A delay of the wrenches was corrected.
    DelayCorrected {
        /// The corrected delay, s; positive where the wrenches are stamped later than the motion.
        applied_s: f64,
        /// The delay as it was estimated, s.
        estimated_s: f64,
        /// Standard deviation of the estimated delay, s.
        std_dev_s: f64,
    },
    /// A long delay of the wrenches would explain them better, but is doubtful and was not
    /// corrected: it is at the end of the search, or the wrenches hardly fit the motion better with
    /// it.
    DelayDoubtful {
        /// The delay, s, at the end of the search only to within the time between two windows;
        /// positive where the wrenches are stamped later than the motion.
        delay_s: f64,
        /// Residual with the delay, relative to that without, without a unit.
        residual_ratio: f64,
        /// Whether the delay is at the end of the search.
        is_at_end: bool,
    },
    /// A topic that is used has no messages at the moment: its publisher has ended, or messages do
    /// not arrive.
    TopicSilent {
        /// The topic.
        topic: String,
        /// Time since its last message, s.
        silent_s: f64,
    },
    /// Topics of joint states or wrenches exist that the identification does not use, because it
    /// began before they did.
    TopicsNotUsed {
        /// The topics.
        topics: Vec<String>,
    },
    /// A live identification has started again, because messages no longer gave samples, as after a
    /// jump of a clock or with other joints.
    LiveRestarted {
        /// Number of times.
        count: u64,
    },
    /// The wrench of a contact is far from zero in almost all samples of a compensation: the payload
    /// may be another than the one that was given.
    ContactThroughout {
        /// Fraction of the samples, without a unit.
        fraction: f64,
    },
    /// What the data say about the assumptions of the identification.
    #[serde(untagged)]
    Data(tactid_batch::Finding),
}

/// How an arm has changed since its calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ArmChanged {
    /// Rms change of the joints, a fraction of what it was at the calibration, without a unit.
    pub change: f64,
    /// The joint that has changed most.
    pub joint: String,
    /// Its change, without a unit; positive where the quantity is larger now.
    pub joint_change: f64,
    /// Whether an unloaded recording updated the calibration.
    pub has_unloaded: bool,
}

/// Why an option of a request has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "because", content = "method", rename_all = "snake_case")]
pub enum NotUsedBecause {
    /// The method does not use the measurements that the option is about, with this recording.
    Method(Method),
    /// The motion is measured by another topic.
    OtherMotion,
    /// The accelerations of the inertial unit on the sensor contain gravity.
    GravityIsMeasured,
    /// The measurements do not determine the mass.
    MassUnknown,
}

impl NotUsedBecause {
    /// Returns the finding that an option has no effect.
    pub(crate) fn of(self, option: &'static str) -> Finding {
        Finding::OptionNotUsed {
            option: option.into(),
            because: self,
        }
    }
}

impl From<tactid_batch::Finding> for Finding {
    fn from(finding: tactid_batch::Finding) -> Self {
        Self::Data(finding)
    }
}

impl ArmChanged {
    /// Returns whether the friction differs by more than that of an arm changes.
    pub(super) fn has_other_friction(&self) -> bool {
        self.change > LARGEST_CHANGE_OF_FRICTION
    }

    /// Returns whether a gain differs by more than those of an arm change.
    pub(super) fn has_other_gains(&self) -> bool {
        self.joint_change.abs() > LARGEST_CHANGE_OF_A_GAIN
    }
}
