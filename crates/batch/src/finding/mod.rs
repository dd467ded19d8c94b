//! What an identification noticed about the data, for a program to match.

mod assumption_words;
mod load_words;
mod other_load;
mod rest_words;
mod resting_poses;
mod run_words;
mod words;
mod wrong_assumption;

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::{ModelFinding, Notice, Reader, Severity, Subject};
pub(crate) use tactid_identify::checks::WRENCH_CHANNELS as CHANNELS;
use tactid_identify::checks::{
    EffortsBeyondLimits, PositionJumps, PositionsBeyondLimits, Saturation, TwistContradiction,
    VelocityContradiction,
};
use tactid_identify::solve::LEVER_ARM_M;
use tactid_identify::{Method, Sampling};

pub use self::other_load::OtherLoad;
pub use self::resting_poses::{FarCenter, NextAttitude, OutlyingPose, RestingPoses, Rests};
pub use self::run_words::{distance_of_runs, p_equals, probability};
pub use self::wrong_assumption::{Hypothesis, WrongAssumption};

/// Returns the unit of a channel of a wrench, by its name.
fn unit_of(channel: &str) -> &'static str {
    if channel.starts_with("force") {
        "N"
    } else {
        "N m"
    }
}

/// Fraction of the load from which what the model leaves unexplained shows the result to be wrong:
/// friction of a geared arm rarely exceeds it.
const LARGEST_UNEXPLAINED: f64 = 0.3;

/// Standard deviations from which on a given mass is that of another body, or in another unit: no
/// noise and no usual error of a sensor is as large.
const LARGEST_DISTANCE_OF_MASS: f64 = 100.0;

/// Standard deviations from the nearest body that can exist from which the result is wrong. A slim
/// rod, on the border of what can exist, is 15 away by 0.02 rad of a joint, which leaves mass and
/// centre of mass right, and 27 by a mounting of the sensor that is turned by 2 degrees
/// (`bench/contradicted.py`).
const LARGEST_DISTANCE_OF_BODY: f64 = 25.0;

/// Relative change of the mass by wrong assumptions from which the result is wrong. Gains of 5 %,
/// drifts of 1 N and mountings of 2 degrees change it by up to 4 % (`bench/contradicted.py`).
pub(crate) const LARGEST_MASS_CHANGE: f64 = 0.05;

/// Shift of the centre of mass by wrong assumptions, m, from which the result is wrong. Where
/// changes are smaller in both measures, the centre of mass is right to 4 mm
/// (`bench/contradicted.py`).
pub(crate) const LARGEST_SHIFT_M: f64 = 0.01;

/// Residual with a cause relative to that without it, above which most of it has another cause.
pub(crate) const MOST_LEFT: f64 = 0.5;

/// Distance in standard deviations from which a contradiction is reported.
pub const CONTRADICTION: f64 = 5.0;

/// How much of the load the model leaves unexplained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnexplainedLoad {
    /// The joint whose effort is not explained, with a calibration; `None` for all channels of the
    /// unit.
    pub joint: Option<String>,
    /// Unit of the channels with the largest unexplained fraction.
    pub unit: Cow<'static, str>,
    /// Rms of measured less predicted load, in the unit.
    pub residual_rms: f64,
    /// Rms of the measured load, in the unit.
    pub load_rms: f64,
    /// Rms noise of the measurements, from the differences of neighbouring samples, in the unit.
    pub noise_rms: f64,
    /// The measurements that were used.
    pub method: Method,
    /// Whether the efforts of an unloaded recording were subtracted.
    #[serde(default)]
    pub has_unloaded: bool,
}

impl UnexplainedLoad {
    /// Returns whether so much is unexplained that the result is wrong.
    fn contradicts(&self) -> bool {
        let largest = match self.method {
            // Nothing rubs on a sensor of wrenches. Gains of 5 %, drifts of 1 N and mountings of 2
            // degrees leave less than a third of this (`bench/contradicted.py`). A moment may be
            // small beside a force that is right.
            Method::Tactile if self.unit == "N" => 2.0 * LARGEST_MASS_CHANGE,
            _ => LARGEST_UNEXPLAINED,
        };
        self.residual_rms > largest * self.load_rms
    }
}

/// How several recordings of one payload differ by more than their noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Disagreement {
    /// Number of recordings.
    pub runs: usize,
    /// Name of each recording.
    pub recordings: Vec<String>,
    /// Name of the recording that differs most from the others; none for two recordings.
    pub run: Option<String>,
    /// Whether the other recordings agree among themselves; false for two recordings.
    pub others_agree: bool,
    /// Distance of all parameters of the recordings from the combined ones: the weighted sum of its
    /// squares, without a unit.
    pub chi_square: f64,
    /// Degrees of freedom of the chi-square, without a unit.
    pub degrees_of_freedom: f64,
    /// Degrees of freedom from which the noise was estimated, without a unit; infinite where it is
    /// known.
    #[serde(deserialize_with = "infinite_if_none")]
    pub noise_degrees_of_freedom: f64,
    /// Probability of at least this chi-square if noise were the only difference between the
    /// recordings, without a unit.
    pub p_value: f64,
    /// Name of the value whose differences alone are the least probable, of
    /// [`VALUE_NAMES`](tactid_identify::VALUE_NAMES).
    pub least_probable: Cow<'static, str>,
    /// Probability of the differences of this value alone, without a unit.
    pub least_p_value: f64,
    /// Name of the value with the largest difference between this recording and the others, or
    /// between the second of two recordings and the first, of [`VALUE_NAMES`](tactid_identify::VALUE_NAMES).
    pub value: Option<Cow<'static, str>>,
    /// This difference, in the unit of the value.
    pub difference: Option<f64>,
    /// The value of the others, in the unit of the value.
    pub of_others: Option<f64>,
    /// The difference in standard deviations of the noise within the recordings, without a unit,
    /// with its sign.
    pub sigmas: Option<f64>,
    /// Whether the recordings together leave the mass uncertain: that contradicts the result.
    #[serde(default)]
    pub is_mass_uncertain: bool,
}

impl Disagreement {
    /// Returns the disagreement with other names of the recordings.
    #[must_use]
    pub fn with_names(self, names: Vec<String>) -> Self {
        let named = |run: &String| self.recordings.iter().position(|known| known == run);
        let run = self.run.as_ref().and_then(named);
        Self {
            run: run.and_then(|run| names.get(run).cloned()),
            recordings: names,
            ..self
        }
    }
}

/// Reads a number that JSON does not have as one that is absent.
fn infinite_if_none<'de, D: serde::Deserializer<'de>>(reader: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(reader)?.unwrap_or(f64::INFINITY))
}

/// An observation about the data or the robot's description that concerns the assumptions of an
/// identification. Nothing is corrected silently: each finding is for the user to decide on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Finding {
    /// The measured velocities of joints are not the derivatives of their positions.
    VelocitiesContradicted(VelocityContradiction),
    /// Joint positions are beyond the limits of the robot's description.
    PositionsBeyondLimits(PositionsBeyondLimits),
    /// Most efforts of joints are far beyond the limits of the robot's description.
    EffortsBeyondLimits(EffortsBeyondLimits),
    /// Joints that move the tip have efforts of exactly zero in all samples.
    EffortsUnmeasured {
        /// Name of the array or the topic of the efforts.
        source: String,
        /// Names of the joints.
        joints: Vec<String>,
    },
    /// Channels of a wrench sensor, or efforts, are at a limit in many samples and beyond it in none.
    Saturated {
        /// Name of the array or the topic of the channels.
        source: String,
        /// The channels, their limits, and how often they are at them.
        #[serde(flatten)]
        saturation: Saturation,
    },
    /// The twist of the base, or of a sensor without a robot, is not the derivative of its pose.
    TwistContradicted {
        /// Name of the array or the topic of the twist.
        source: String,
        /// By how much they differ, and the axes in which the twist would fit the pose.
        #[serde(flatten)]
        contradiction: TwistContradiction,
    },
    /// Some channels of a wrench sensor have the same value in all samples, or all from a time on.
    ConstantChannels {
        /// Name of the array or the topic of the wrenches.
        source: String,
        /// Frame of the sensor.
        frame: String,
        /// The channels, such as `force x`.
        channels: Vec<Cow<'static, str>>,
        /// Whether all of these values are zero.
        is_zero: bool,
        /// Whether the channels were left out, as those of a sensor that does not measure them;
        /// otherwise the estimate takes them for measured.
        #[serde(default)]
        is_left_out: bool,
        /// Whether other moments, of this sensor or of others, were left out with these, because
        /// the moments about the tip are not known without them.
        #[serde(default)]
        without_moments: bool,
        /// Time on the recording's clock from which on all channels are constant although the
        /// joints move, s; `None` for channels that are so in all samples.
        #[serde(default)]
        since_s: Option<f64>,
        /// Whether these are at least half of the samples: the result is wrong then.
        #[serde(default)]
        is_most: bool,
    },
    /// Positions of joints start again after a turn, and were continued.
    AnglesContinued {
        /// Names of the joints.
        joints: Vec<String>,
        /// Number of times that one of them started again.
        count: u64,
    },
    /// Positions of joints jump faster than any joint moves.
    PositionsJump(PositionJumps),
    /// Not a single window of the averages was filled, so that nothing is known.
    NoEquations(Sampling),
    /// Another gravity explains the load far better than the given one.
    GravityContradicted {
        /// The better gravitational acceleration in world axes, m/s²: none at all, the opposite, or
        /// that on Earth.
        better: [f64; 3],
        /// Residual with the better gravity, relative to that with the given one, without a unit:
        /// the geometric mean over the directions of the channels.
        residual_ratio: f64,
        /// The measurements that were used.
        method: Method,
    },
    /// The residuals exceed the noise, but too few windows were averaged to show why. The intervals
    /// may be far too narrow.
    TooFewWindows {
        /// Number of windows.
        windows: usize,
        /// Number of windows that can show it.
        least_windows: usize,
    },
    /// The mass of the payload is zero within its uncertainty.
    NothingHeld {
        /// Identified mass of the load beyond the known bodies, kg; it may be negative.
        mass_kg: f64,
        /// Its standard deviation, kg.
        std_dev_kg: f64,
    },
    /// The mass of the whole load comes out negative: the load has the opposite sign.
    NegativeMass {
        /// The measurements that were used.
        method: Method,
        /// Whether gravity of the opposite sign would explain the data just as well.
        or_gravity: bool,
    },
    /// The known bodies weigh more than the whole load that contains them, so that the mass of the
    /// payload comes out negative.
    KnownBodiesTooHeavy {
        /// Mass of the known bodies: the known tool, and the links below the tool where the method
        /// includes them, kg.
        known_bodies_kg: f64,
        /// Mass of the whole load from the data alone, kg.
        load_kg: f64,
    },
    /// The data contradict an assumption about the wrench sensor, gravity or the joints, and show
    /// what holds in its place.
    WrongAssumption(WrongAssumption),
    /// The model leaves much of the load unexplained, far more than the noise of the measurements:
    /// its error is not in the standard deviations. Usual reasons are friction in the joints where
    /// efforts are used, and otherwise a frame, a pose or an order of joints that is not that of
    /// the data.
    LoadUnexplained(UnexplainedLoad),
    /// The data contradict the known mass. It is not reported where a wrong sign, a wrong gravity
    /// or a known body that is too heavy is, because each of these contradicts the mass as well.
    MassContradicted {
        /// The known mass of the payload, kg.
        known_mass_kg: f64,
        /// Standard deviation of the known mass, kg; 0 for an exact mass.
        known_mass_std_dev_kg: f64,
        /// The mass from the data alone, kg.
        found_kg: f64,
        /// Standard deviation of the mass from the data alone, kg.
        std_dev_kg: f64,
        /// Distance between the two masses, in standard deviations of their difference, without a
        /// unit.
        distance: f64,
    },
    /// The result does not have the known mass, although the data do not contradict it: no
    /// physically consistent body of this mass, within the bounding box if one is given, explains
    /// the data.
    KnownMassNotKept {
        /// The known mass of the payload, kg.
        known_mass_kg: f64,
        /// Standard deviation of the known mass, kg; 0 for an exact mass.
        known_mass_std_dev_kg: f64,
        /// The mass of the result, kg.
        estimated_kg: f64,
        /// Whether the body also had to fit into a bounding box.
        within_box: bool,
    },
    /// No physically consistent body explains the data within their noise: there are other errors.
    /// The projection onto consistent parameters is returned. For recordings, the standard
    /// deviations are multiplied by half of `distance`, except that of a known mass; online they
    /// are not.
    Inconsistent {
        /// Mahalanobis distance of the returned body from the unconstrained estimate, in standard
        /// deviations, without a unit.
        distance: f64,
        /// Whether the body also had to fit into a bounding box.
        within_box: bool,
    },
    /// Several recordings of one payload differ by more than their noise. The combined intervals
    /// include what varies.
    RunsDisagree(Disagreement),
    /// In parts of the recording, the load is not that of the rest: something touched the payload,
    /// or it was another one.
    OtherLoad(OtherLoad),
    /// Some windows are outliers, for example because of an impact, and have next to no weight.
    Outliers {
        /// Number of outliers.
        outliers: usize,
        /// Number of windows.
        windows: usize,
    },
    /// The payload is identified from poses at rest, which show no inertia.
    PosesAtRest(RestingPoses),
    /// A pose at rest does not fit the others, as after a contact or a bump of the sensor.
    OutlyingPose(OutlyingPose),
    /// The centre of mass of poses at rest is farther away than that of anything that an arm holds:
    /// the moments are in another unit.
    CenterFarAway(FarCenter),
    /// Poses at rest show no mass, but are too few to show whether an assumption is wrong.
    TooFewPoses {
        /// Number of poses.
        poses: usize,
    },
    /// The recording consists of rests, with short moves between them.
    ConsistsOfRests(Rests),
    /// The motion hardly tells the weight of the payload from a zero of the sensor that was never
    /// set: gravity keeps its direction in the tool frame, as at rest in one attitude.
    WeightOrOffset {
        /// Whether the mass is known beside the zero, by the accelerations: the zero was then
        /// identified, too. Otherwise the mass is that of both.
        is_known: bool,
    },
    /// Something is wrong in the description of the robot. Masses and inertias are reported only
    /// where the method uses them.
    #[serde(untagged)]
    Model(ModelFinding),
}

impl Notice for Finding {
    fn severity(&self) -> Severity {
        let contradicts = match self {
            Self::VelocitiesContradicted(found) if !found.are_measured() => return Severity::Notes,
            Self::VelocitiesContradicted(_)
            | Self::ConstantChannels { is_most: true, .. }
            | Self::PositionsBeyondLimits(_)
            | Self::TwistContradicted { .. }
            | Self::EffortsUnmeasured { .. }
            | Self::GravityContradicted { .. }
            | Self::TooFewWindows { .. }
            | Self::CenterFarAway(_)
            | Self::NegativeMass { .. }
            | Self::KnownBodiesTooHeavy { .. } => true,
            Self::EffortsBeyondLimits(beyond) => !beyond.limits_are_equal,
            Self::Saturated { saturation, .. } => saturation.contradicts(),
            Self::LoadUnexplained(load) => load.contradicts(),
            Self::MassContradicted { distance, .. } => *distance > LARGEST_DISTANCE_OF_MASS,
            Self::Inconsistent { distance, .. } => *distance > LARGEST_DISTANCE_OF_BODY,
            Self::WrongAssumption(found) if found.is_applied => {
                return if found.runner_up.is_some() {
                    Severity::Doubts
                } else {
                    Severity::Notes
                };
            }
            Self::WrongAssumption(found) => found.contradicts(),
            Self::PositionsJump(jumps) => jumps.are_of_two_sources(),
            Self::WeightOrOffset { is_known: false } => true,
            Self::OtherLoad(found) => found.is_most(),
            Self::RunsDisagree(found) if found.is_mass_uncertain => true,
            Self::ConstantChannels {
                is_left_out: true, ..
            } => return Severity::Notes,
            Self::NothingHeld { .. }
            | Self::OutlyingPose(_)
            | Self::TooFewPoses { .. }
            | Self::KnownMassNotKept { .. }
            | Self::ConstantChannels { .. } => false,
            Self::NoEquations(_)
            | Self::RunsDisagree(_)
            | Self::Outliers { .. }
            | Self::AnglesContinued { .. }
            | Self::PosesAtRest(_)
            | Self::ConsistsOfRests(_)
            | Self::WeightOrOffset { .. }
            | Self::Model(_) => return Severity::Notes,
        };
        if contradicts {
            Severity::Contradicts
        } else {
            Severity::Doubts
        }
    }

    fn subject(&self) -> Subject {
        match self {
            Self::VelocitiesContradicted(_)
            | Self::PositionsBeyondLimits(_)
            | Self::EffortsBeyondLimits(_)
            | Self::EffortsUnmeasured { .. }
            | Self::Saturated { .. }
            | Self::PositionsJump(_)
            | Self::CenterFarAway(_)
            | Self::TwistContradicted { .. } => Subject::Measurements,
            Self::ConstantChannels { since_s, .. } if since_s.is_some() => Subject::Measurements,
            Self::WeightOrOffset { is_known: false } => Subject::Measurements,
            Self::GravityContradicted { .. }
            | Self::WrongAssumption(_)
            | Self::TooFewPoses { .. } => Subject::Assumption,
            Self::LoadUnexplained(_) | Self::Inconsistent { .. } => Subject::Consequence,
            _ => Subject::Result,
        }
    }

    fn words(&self, reader: Reader) -> String {
        words::sentences(self, reader)
    }
}

/// Returns whether a distance from the tool frame, m, is certainly one at which an arm has no
/// sensor and holds nothing: beyond two lever arms, 2 m.
pub(crate) fn is_out_of_reach(distance_m: f64, half_width_m: f64) -> bool {
    distance_m - half_width_m > 2.0 * LEVER_ARM_M
}
