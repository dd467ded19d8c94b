//! Findings about a recording in words.

use std::fmt;

use tactid_dynamics::words::{
    HALF_WIDTH_95, at_most, decimals_of, general, listed, percent, two_figures,
};
use tactid_dynamics::{Notice, Reader, Severity, Subject};

use super::{ArmChanged, Finding, NotUsedBecause};

impl Notice for Finding {
    fn severity(&self) -> Severity {
        match self {
            Self::Data(finding) => finding.severity(),
            Self::CalibrationContradicted(contradiction) => contradiction.severity(),
            Self::JointZeroMoved { .. }
            | Self::AxesContradicted { .. }
            | Self::PointContradicted { .. }
            | Self::EffortContentContradicted { .. }
            | Self::OrientationContradicted { .. }
            | Self::ForcesAndMomentsExchanged { .. }
            | Self::ShapeContradicted { .. }
            | Self::JointSignContradicted { .. }
            | Self::JointsExchanged { .. } => Severity::Contradicts,
            // An arm without masses in its URDF needs less than it is measured to need.
            Self::UnloadedEffortsScaled {
                ratios,
                has_gains: false,
                ..
            } if ratios.iter().all(|ratio| ratio.abs() < 1.0) => Severity::Contradicts,
            Self::FrictionChanged(changed) if changed.has_other_friction() => Severity::Contradicts,
            Self::GainsChanged(changed) if changed.has_other_gains() => Severity::Contradicts,
            Self::UnloadedEffortsScaled { .. }
            | Self::RecordingCalibrated { .. }
            | Self::HeavyLoad { .. }
            | Self::TopicSilent { .. }
            | Self::TopicsNotUsed { .. }
            | Self::LiveRestarted { .. }
            | Self::ContactThroughout { .. } => Severity::Doubts,
            _ => Severity::Notes,
        }
    }

    fn subject(&self) -> Subject {
        match self {
            Self::Data(finding) => finding.subject(),
            Self::CalibrationContradicted(_)
            | Self::JointZeroMoved { .. }
            | Self::AxesContradicted { .. }
            | Self::PointContradicted { .. }
            | Self::EffortContentContradicted { .. }
            | Self::OrientationContradicted { .. }
            | Self::ForcesAndMomentsExchanged { .. }
            | Self::ShapeContradicted { .. }
            | Self::JointSignContradicted { .. }
            | Self::JointsExchanged { .. }
            | Self::UnloadedEffortsScaled { .. }
            | Self::RecordingCalibrated { .. } => Subject::Assumption,
            Self::HeavyLoad { .. } | Self::ContactThroughout { .. } => Subject::Measurements,
            Self::EffortNoisier { .. } | Self::FrictionChanged(_) | Self::GainsChanged(_) => {
                Subject::Consequence
            }
            _ => Subject::Result,
        }
    }

    fn words(&self, reader: Reader) -> String {
        match self {
            Self::Data(finding) => finding.words(reader),
            Self::EffortNoisier { .. }
            | Self::FrictionChanged(_)
            | Self::GainsChanged(_)
            | Self::JointUncalibrated { .. }
            | Self::CalibrationContradicted(_) => self.of_calibration(reader),
            Self::JointZeroMoved { .. }
            | Self::UnloadedLeftOut { .. }
            | Self::RecordingCalibrated { .. } => self.of_other_recordings(reader),
            Self::DelayCorrected { .. } | Self::DelayDoubtful { .. } => self.of_delay(reader),
            Self::OptionNotUsed { .. }
            | Self::AccelerationNotUsed { .. }
            | Self::JointsRenamed { .. }
            | Self::ToolUncertaintyAssumed { .. } => self.of_options(reader),
            Self::FrameFollowed { .. }
            | Self::AxesAssumed { .. }
            | Self::TopicRecognized { .. }
            | Self::AxesContradicted { .. }
            | Self::PointContradicted { .. }
            | Self::EffortContentContradicted { .. }
            | Self::OrientationContradicted { .. }
            | Self::ForcesAndMomentsExchanged { .. }
            | Self::HeavyLoad { .. }
            | Self::JointSignContradicted { .. }
            | Self::ShapeContradicted { .. }
            | Self::UnloadedEffortsScaled { .. }
            | Self::JointsExchanged { .. } => self.of_readings(reader),
            Self::FrameAssumed { .. }
            | Self::ForcesSummed { .. }
            | Self::WrenchesSummed { .. }
            | Self::UnknownJoints { .. }
            | Self::AbsentJoints { .. }
            | Self::LateStart { .. }
            | Self::EarlyEnd { .. } => self.of_streams(),
            Self::TopicSilent { .. }
            | Self::TopicsNotUsed { .. }
            | Self::LiveRestarted { .. }
            | Self::ContactThroughout { .. } => self.of_contacts_and_topics(reader),
            Self::StampsMissing { topics, clock_rate } => {
                let rate = if *clock_rate == 1.0 {
                    String::new()
                } else {
                    let rate = general(*clock_rate, 2);
                    format!(", which runs at {rate} times the rate of the recorder's")
                };
                format!(
                    "{} {} no stamps: their times are those of logging, brought to the clock of the \
                     stamps of other topics{rate}.",
                    listed(topics),
                    if topics.len() == 1 { "has" } else { "have" }
                )
            }
            Self::NoStamps => {
                "The messages have no stamps: their times are those of logging.".to_owned()
            }
        }
    }
}

impl NotUsedBecause {
    /// Says why an option has no effect.
    fn words(self) -> String {
        let plain = match self {
            Self::Method(method) => {
                return format!(
                    "it is about measurements that the {method} method does not use with this \
                     recording"
                );
            }
            Self::OtherMotion => "the motion is measured by another topic",
            Self::GravityIsMeasured => "the accelerations of the inertial unit contain gravity",
            Self::MassUnknown => "the measurements do not determine the mass",
        };
        plain.to_owned()
    }
}

impl Finding {
    /// Says what was noticed about options, and about what an option would change; nothing for
    /// other findings.
    fn of_options(&self, reader: Reader) -> String {
        match self {
            Self::OptionNotUsed { option, because } => {
                format!(
                    "The option {} has no effect: {}.",
                    reader.option(option),
                    because.words()
                )
            }
            Self::AccelerationNotUsed {
                topic,
                explains_better,
                residual_ratio,
                power_ratio,
            } => {
                let why = if *explains_better {
                    "explain the wrench better"
                } else {
                    "have less noise"
                };
                format!(
                    "{topic} is not used: accelerations derived from the velocities {why} \
                     (residuals {} as large, power {}). Give {} to use it.",
                    percent(*residual_ratio),
                    percent(*power_ratio),
                    reader.option("acceleration_topic")
                )
            }
            Self::ToolUncertaintyAssumed { std_dev } => format!(
                "The known tool has no uncertainty of its own: a standard deviation of {} of its values is assumed and is \
                 part of the intervals. {} gives another one, and an earlier result as {} has its own.",
                percent(*std_dev),
                reader.option("known_tool_std_dev"),
                reader.option("known_tool")
            ),
            Self::JointsRenamed { names } => {
                let pairs = names
                    .iter()
                    .map(|(recorded, joint)| format!("{recorded} is {joint}"));
                format!(
                    "No joint in the log has the name of one in the URDF, so joints were matched \
                     behind their prefixes: {}; {} names them.",
                    listed(&pairs.collect::<Vec<_>>()),
                    reader.option("rename_joints")
                )
            }
            _ => String::new(),
        }
    }

    /// Says what was noticed about topics and joints; nothing for other findings.
    fn of_streams(&self) -> String {
        match self {
            Self::FrameAssumed { topic, frame } => {
                format!("{topic} names no frame: its wrenches are taken to be in `{frame}`.")
            }
            Self::ForcesSummed { topics } => format!(
                "The log has no wrenches: those of {} are the sums of the forces at their points.",
                topics.join(" and ")
            ),
            Self::WrenchesSummed { topics } => {
                format!("The wrenches of {} are summed.", topics.join(" and "))
            }
            Self::UnknownJoints { joints } => format!(
                "Joints that the URDF does not have, or that do not move in it, were left out: {}.",
                joints.join(", ")
            ),
            Self::AbsentJoints { joints } => format!(
                "Joints that the log does not have, and that do not move the tool, were taken to \
                 be at zero: {}.",
                joints.join(", ")
            ),
            Self::LateStart { topic, late_s } => format!(
                "{topic} begins {late_s:.3} s after the others: what came before was left out."
            ),
            Self::EarlyEnd {
                topic,
                end_s,
                early_s,
            } => format!(
                "{topic} ends at {end_s:.3} s, {early_s:.3} s before the others: what came after \
                 was left out."
            ),
            _ => String::new(),
        }
    }

    /// Says what was noticed about the delay of the wrenches; nothing for other findings.
    fn of_delay(&self, reader: Reader) -> String {
        match self {
            Self::DelayDoubtful {
                delay_s,
                residual_ratio,
                is_at_end,
            } => {
                let why = if *is_at_end {
                    "but it is as long as any that is searched for".to_owned()
                } else {
                    format!(
                        "but only a little (its residuals are {} as large)",
                        percent(*residual_ratio)
                    )
                };
                format!(
                    "A delay of the wrenches, stamped {} than the motion, would fit better, {why}: \
                     it was not corrected. Check whether all sensors of the payload were recorded, \
                     and the frames and signs; {} sets a delay.",
                    shift(*delay_s, 0),
                    reader.option("delay_s")
                )
            }
            Self::DelayCorrected {
                applied_s,
                estimated_s,
                std_dev_s,
            } => {
                let half_width_ms = 1e3 * HALF_WIDTH_95 * std_dev_s;
                let decimals = decimals_of(half_width_ms);
                format!(
                    "The wrenches are stamped {} than the motion: this delay was corrected \
                     (estimated {:.decimals$} ± {half_width_ms:.decimals$} ms).",
                    shift(*applied_s, decimals),
                    1e3 * estimated_s * applied_s.signum()
                )
            }
            _ => String::new(),
        }
    }

    /// Says what was noticed about a recording that is identified with a calibration; nothing for
    /// other findings.
    fn of_calibration(&self, reader: Reader) -> String {
        match self {
            Self::EffortNoisier {
                joints,
                noise_ratios,
            } => {
                let ratios: Vec<String> = noise_ratios.iter().map(|&r| ratio(r)).collect();
                let (subject, count) = if joints.len() == 1 {
                    (format!("The effort of {} is", listed(joints)), "counts")
                } else {
                    (format!("The efforts of {} are", listed(joints)), "count")
                };
                format!(
                    "{subject} {} times as noisy as at the calibration, and {count} less; what the \
                     model does not explain may make the values wrong by more than their \
                     intervals. Check temperature, wear and what else has changed, and calibrate \
                     anew.",
                    listed(&ratios)
                )
            }
            Self::FrictionChanged(changed) => changed.friction(),
            Self::GainsChanged(changed) => changed.gains(),
            Self::JointUncalibrated { joint } => format!(
                "{joint} moves, but did not move when the arm was calibrated: its friction is not \
                 known, and its effort counts little. Record a motion of this joint in both \
                 directions, and calibrate anew."
            ),
            Self::CalibrationContradicted(contradiction) => {
                let verdict = match contradiction.severity() {
                    Severity::Contradicts => "contradicted by its own recordings",
                    _ => "doubtful",
                };
                let words = contradiction.words(reader);
                format!("The calibration is {verdict}. {words}")
            }
            _ => String::new(),
        }
    }

    /// Says what was noticed about the recordings beside the one that is identified; nothing for
    /// other findings.
    fn of_other_recordings(&self, reader: Reader) -> String {
        match self {
            Self::JointZeroMoved {
                joint,
                size,
                std_dev,
            } => format!(
                "The data fit better if the zero of {joint} has moved since the calibration: with \
                 positions of {} ± {} rad {}, {} standard deviations from none. The intervals do \
                 not contain such an error. Check the order of the joints and the zero of this \
                 one: set it as it was, or calibrate anew.",
                general(size.abs(), 2),
                two_figures(HALF_WIDTH_95 * std_dev),
                if *size > 0.0 { "more" } else { "less" },
                at_most(size.abs() / std_dev, 1)
            ),
            Self::UnloadedLeftOut { noise_ratio } => format!(
                "The unloaded recording was left out: with it the efforts would fit {} times \
                 worse. Friction differs between the two recordings, or they are of different \
                 robots. Record the unloaded motion at the same temperature, or identify without \
                 {}.",
                ratio(*noise_ratio),
                reader.option("unloaded")
            ),
            Self::RecordingCalibrated { is_loaded } => {
                let held = if *is_loaded {
                    "with the payload that was given for it"
                } else {
                    "without a payload"
                };
                format!(
                    "This recording calibrated the arm {held}: the result repeats what was given, \
                     and is no check of it. Identify another recording."
                )
            }
            _ => String::new(),
        }
    }
}

/// Says by how much stamps are later than the motion, or earlier.
fn shift(delay_s: f64, decimals: usize) -> String {
    let direction = if delay_s >= 0.0 { "later" } else { "earlier" };
    format!("{:.decimals$} ms {direction}", 1e3 * delay_s.abs())
}

/// Returns a ratio with one decimal, or none where it is large.
fn ratio(ratio: f64) -> String {
    at_most(ratio, usize::from(ratio < 10.0))
}

impl ArmChanged {
    fn friction(&self) -> String {
        let (is_of_arm, cause) = if self.has_other_friction() {
            (
                false,
                "Neither temperature nor wear does that: check that the calibration is of this \
                 robot, and the order, signs and units of the joints; the intervals do not contain \
                 such an error.",
            )
        } else {
            (true, "Temperature and wear do that.")
        };
        self.words("Friction differs", cause, is_of_arm)
    }

    fn gains(&self) -> String {
        let (is_of_arm, cause) = if self.has_other_gains() {
            (
                false,
                "No temperature does that: check that the calibration is of this very robot, not \
                 of another one of its type, and gravity, the mounting, the zeros and the order of \
                 the joints and the units; the intervals do not contain such an error.",
            )
        } else {
            (
                true,
                "Temperature changes gains by a few percent; the zero of a joint that has moved, \
                 and the calibration of another robot, look the same.",
            )
        };
        self.words("The gains of the efforts differ", cause, is_of_arm)
    }

    /// Says how much has changed, and what makes the result better.
    fn words(&self, subject: &str, cause: &str, is_of_arm: bool) -> String {
        // Beyond 100 % the number only shows that the model does not hold.
        let size = if self.change > 1.0 {
            "more than 100 %".to_owned()
        } else {
            format!("about {} %", two_figures(100.0 * self.change))
        };
        let mut most = format!("most at {}", self.joint);
        if self.joint_change.abs() <= 1.0 {
            let sign = if self.joint_change < 0.0 { '-' } else { '+' };
            most += &format!(", {sign}{} %", two_figures(100.0 * self.joint_change.abs()));
        }
        let advice = match (self.has_unloaded, is_of_arm) {
            (false, _) => "Record an unloaded motion of the same day, or calibrate anew.",
            (true, true) => "The unloaded recording has updated the calibration.",
            (true, false) => {
                "The unloaded recording has updated the calibration. Check that it is of this \
                 robot, and identify without it."
            }
        };
        format!("{subject} from the calibration by {size} ({most}). {cause} {advice}")
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.words(Reader::Rust))
    }
}
