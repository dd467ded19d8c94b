//! Findings: what a reader of the result should know of the recording, for a program to match.

use tactid_calibrate::{CalibratingRecording, Contradiction};
use tactid_identify::checks::TwistContradiction;
use tactid_identify::{Delay, Method};

/// Something that a reader of the result should know.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// What the data say about the assumptions of the identification.
    Data(tactid_identify::Finding),
    /// An option of the request has no effect.
    OptionNotUsed {
        /// Name of the field of [`Request`](crate::Request).
        option: &'static str,
        /// The reason.
        because: NotUsedBecause,
    },
    /// Measured accelerations are not used, because those derived from the velocities are better.
    AccelerationNotUsed {
        /// Topic of the measured accelerations.
        topic: String,
        /// Whether the derived ones explain the wrench better; otherwise they have less noise.
        explains_better: bool,
        /// Residual with the derived accelerations, relative to that with the measured ones.
        residual_ratio: f64,
        /// Power of the derived accelerations, relative to that of the measured ones.
        power_ratio: f64,
    },
    /// A topic names no frame: its wrenches are taken to be in this one.
    FrameAssumed {
        /// Topic of the wrenches.
        topic: String,
        /// The assumed frame.
        frame: String,
    },
    /// The wrenches of several topics are summed.
    WrenchesSummed {
        /// The topics.
        topics: Vec<String>,
    },
    /// No joint in the log has the name of one of the URDF, but their names are the same behind a prefix.
    JointsRenamed {
        /// For each of them the name in the log, and that in the URDF.
        names: Vec<(String, String)>,
    },
    /// The effort of a joint is far noisier than in the calibration of the arm. Its noise is enlarged by so much.
    EffortNoisier {
        /// The joint.
        joint: String,
        /// Standard deviation of the noise, relative to that of the calibration.
        noise_ratio: f64,
    },
    /// Friction or gains of the joints have changed since the calibration of the arm. The estimate takes it into account.
    ArmChanged(ArmChanged),
    /// A joint moves that did not move in the recordings of the calibration: its friction is not known, and its effort
    /// counts little.
    JointUncalibrated {
        /// The joint.
        joint: String,
    },
    /// Joints in the log that the URDF does not have. They are left out.
    UnknownJoints {
        /// Their names.
        joints: Vec<String>,
    },
    /// Joints of the URDF that are not in the log and do not move the tool. They are taken to be at zero.
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
    /// The measured twist of the base, or of a sensor without a robot, is not the derivative of its pose.
    TwistContradicted {
        /// Topic of the twist, or name of the field of [`Arrays`](crate::Arrays).
        source: String,
        /// By how much they differ, and the axes in which the twist would fit the pose.
        contradiction: TwistContradiction,
    },
    /// The recordings of the calibration contradict an assumption of it: the error is in the result, too.
    CalibrationContradicted(Contradiction),
    /// The zero of a joint has moved since the calibration, which the result does not contain: the true position less the measured
    /// one.
    JointZeroMoved(Contradiction),
    /// The unloaded recording does not fit the other one, as that of another robot or of another temperature, and was left out.
    UnloadedLeftOut {
        /// Standard deviation of the residuals of the efforts with it, relative to that without it.
        noise_ratio: f64,
    },
    /// The recording is one of those that calibrated the arm: its payload was given, and the result repeats it.
    RecordingCalibrated(CalibratingRecording),
    /// The messages have no stamps: their times are those of logging.
    NoStamps,
    /// A delay of the wrenches was corrected.
    DelayCorrected {
        /// The corrected delay, s; positive where the wrenches are stamped later than the motion.
        applied_s: f64,
        /// The delay as it was estimated.
        estimated: Delay,
    },
    /// A long delay of the wrenches would explain them better, but is doubtful and was not corrected: it is at the end
    /// of the search, or the wrenches hardly fit the motion better with it.
    DelayDoubtful {
        /// The delay, s, at the end of the search only to within the time between two windows; positive where the wrenches are stamped later than
        /// the motion.
        delay_s: f64,
        /// Residual with the delay, relative to that without.
        residual_ratio: f64,
        /// Whether the delay is at the end of the search.
        is_at_end: bool,
    },
    /// Some channels of a wrench sensor have the same value in all samples.
    ConstantChannels {
        /// Topic of the wrenches, or name of the field of [`Arrays`](crate::Arrays).
        source: String,
        /// Frame of the sensor.
        frame: String,
        /// The channels, such as `force x`.
        channels: Vec<&'static str>,
        /// Whether all of these values are zero.
        is_zero: bool,
    },
}

/// How an arm has changed since its calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmChanged {
    /// What has changed.
    pub quantity: ChangedQuantity,
    /// Rms change of the joints, a fraction of what it was at the calibration.
    pub change: f64,
    /// The joint that has changed most.
    pub joint: String,
    /// Its change; positive where the quantity is larger now.
    pub joint_change: f64,
    /// Whether an unloaded recording updated the calibration.
    pub has_unloaded: bool,
}

/// What of an arm has changed since its calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangedQuantity {
    /// Coulomb and viscous friction.
    Friction,
    /// Gains of the efforts.
    Gains,
}

/// Why an option of a request has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotUsedBecause {
    /// The method does not use the measurements that the option is about, with this recording.
    Method(Method),
    /// The motion is measured by another topic.
    OtherMotion,
    /// The accelerations of the inertial unit on the sensor contain gravity.
    GravityIsMeasured,
}

impl From<tactid_identify::Finding> for Finding {
    fn from(finding: tactid_identify::Finding) -> Self {
        Self::Data(finding)
    }
}
