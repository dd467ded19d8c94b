//! The text of a calibration: TOML that people can read, and numbers that come back bit by bit.

use std::fmt::Write;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tactid_batch::Delay;
use tactid_calibrate::{
    Calibration, CalibrationReport, EffortNoise, JointCalibration, MotionShortage,
};
use toml::{Spanned, Table};

use super::check::{Fault, Place, check_numbers};
use super::contradictions;
use super::layout::{Layout, OF_LINK};
use super::link::{Link, body};
use super::used::Used;
use crate::ArmCalibration;

/// Version of the layout: a change that breaks a reader increments it.
const VERSION: u32 = 5;

const HEADER: &str = "\
# Calibrated joint efforts of a robot arm. `tactid calibrate` wrote this file, and `tactid identify --calibration` reads it.
#
# Efforts of a joint are in its `unit`, angles in rad; a prismatic joint has N and m. For each joint:
#   effort_gain and gain multiply the recorded effort to the torque;
#   offset, viscous (unit s/rad), friction (one for each of friction_velocities) and rotor_inertia (kg m2 or kg) are those of
#   the effort before `gain`; load_friction is friction as a fraction of the torque of arm and payload, and payload_friction the
#   fraction of a payload's own torque that comes to it;
#   inverse_gain is the unknown behind `gain`; scales are the standard deviations of these unknowns before the calibration,
#   in the order offset, viscous, friction, load_friction, payload_friction, rotor_inertia, inverse_gain;
#   noise_* is that of window means; residuals are rms.
# Efforts lag the motion by delay_s; delay_scale_s is the standard deviation of this unknown before the calibration.
# The ten parameters of a link are the mass, kg, the first moments x, y, z, kg m, and the inertia xx, xy, xz, yy, yz, zz about
# the origin of the link's frame, kg m2, with all links fixed to it; without_tool has none of those beyond the tool.
# origin, m, and rotation (a quaternion x y z w) place its frame in that of the moving link before it, or of the base, and axis is
# that of its joint in its own frame: with without_tool they show whether a robot is this one.
# A [[contradiction]] is an assumption that the recordings contradict: `size` is its error (rad, a fraction of a gain, or m).
# The fingerprint of a [[recording]] shows where it is given again; paths are not stored.
# The rows of [precision] are the lower triangle of the inverse covariance of all unknowns, each divided by its scale: links,
# then every kind of unknown for all joints, then the delay.

";

/// What every version of the file has.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    version: u32,
    tool: String,
    gravity_m_s2: [f64; 3],
    cutoff_hz: f64,
    friction_velocities: Vec<f64>,
    windows: usize,
    window_s: f64,
    log_evidence: f64,
    delay_s: f64,
    delay_std_dev_s: f64,
    delay_scale_s: f64,
    #[serde(rename = "joint")]
    joints: Vec<Joint>,
    #[serde(rename = "link")]
    links: Vec<Link>,
    #[serde(rename = "payload", default, skip_serializing_if = "Vec::is_empty")]
    payloads: Vec<Payload>,
    #[serde(rename = "shortage", default, skip_serializing_if = "Vec::is_empty")]
    shortages: Vec<MotionShortage>,
    #[serde(
        rename = "contradiction",
        default,
        skip_serializing_if = "Vec::is_empty"
    )]
    contradictions: Vec<Table>,
    #[serde(rename = "recording")]
    recordings: Vec<Used>,
    #[serde(skip_serializing)]
    precision: Precision,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Joint {
    name: String,
    unit: String,
    effort_gain: f64,
    gain: f64,
    gain_std_dev: f64,
    offset: f64,
    viscous: f64,
    friction: Vec<f64>,
    load_friction: f64,
    payload_friction: f64,
    rotor_inertia: f64,
    inverse_gain: f64,
    scales: Vec<f64>,
    noise_white: f64,
    noise_slow: f64,
    noise_slow_time_s: f64,
    noise_standstill: f64,
    reference_torque: f64,
    max_velocity: [f64; 2],
    residual_before: f64,
    residual_after: f64,
    residual_held_out: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Payload {
    parameters: [f64; OF_LINK],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Precision {
    rows: Vec<Spanned<String>>,
}

/// Returns the text of a calibration.
pub(super) fn text(arm: &ArmCalibration) -> Result<String, toml::ser::Error> {
    let mut text = HEADER.to_owned();
    text += &toml::to_string(&File::of(arm)?)?;
    text += "\n[precision]\nrows = [\n";
    let mut numbers = arm.model.precision.iter();
    for row in 1..=arm.model.parameters.len() {
        let row: Vec<String> = numbers
            .by_ref()
            .take(row)
            .map(|x| format!("{x:?}"))
            .collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  \"{}\",", row.join(" "));
    }
    text += "]\n";
    Ok(text)
}

/// Reads the text of a calibration.
pub(super) fn parse(text: &str) -> Result<ArmCalibration, Fault> {
    let fault = |error: toml::de::Error| Fault {
        line: error.span().map(|span| line_of(text, span.start)),
        reason: in_plain_words(error.message()),
    };
    let versioned = toml::from_str(text).map_err(fault);
    let Versioned { version } = versioned.map_err(|fault| Fault {
        reason: format!("this is no file of a calibration: {}", fault.reason),
        ..fault
    })?;
    if version != VERSION {
        let reason = format!(
            "the calibration has the version {version}, but this tactid reads the version {VERSION}: calibrate anew"
        );
        return Err(Fault { line: None, reason });
    }
    let file: File = toml::from_str(text).map_err(fault)?;
    let arm = file.into_arm(text)?;
    check_numbers(&arm, text)?;
    Ok(arm)
}

/// Returns a message of the TOML reader with words in place of the names of Rust's types.
fn in_plain_words(message: &str) -> String {
    let whole = "expected a whole number that is not negative";
    let words = [
        ("expected usize", whole),
        ("expected u32", whole),
        ("expected f64", "expected a number"),
    ];
    let replaced = words.into_iter();
    replaced.fold(message.to_owned(), |message, (name, words)| {
        message.replace(name, words)
    })
}

fn line_of(text: &str, at: usize) -> usize {
    let before = text.as_bytes().iter().take(at);
    1 + before.filter(|byte| **byte == b'\n').count()
}

impl File {
    fn of(arm: &ArmCalibration) -> Result<Self, toml::ser::Error> {
        let (model, report) = (&arm.model, &arm.report);
        let layout = Layout::of(model);
        let joints = (0..layout.joints).map(|index| Joint::of(arm, layout, index));
        let links = report.links.iter().enumerate();
        let payloads = report.payloads.iter();
        Ok(Self {
            version: VERSION,
            tool: model.tool.clone(),
            gravity_m_s2: model.gravity.into(),
            cutoff_hz: model.cutoff_hz,
            friction_velocities: model.friction_widths.clone(),
            windows: report.windows,
            window_s: report.window_s,
            log_evidence: model.log_evidence,
            delay_s: layout.delay(&model.parameters),
            delay_std_dev_s: report.delay.std_dev_s,
            delay_scale_s: layout.delay(&model.scales),
            joints: joints.collect(),
            links: links
                .map(|(index, link)| Link::of(model, layout, index, link))
                .collect(),
            payloads: payloads
                .map(|payload| Payload {
                    parameters: (*payload.as_vector()).into(),
                })
                .collect(),
            shortages: report.shortages.clone(),
            contradictions: contradictions::tables(&report.contradictions)?,
            recordings: report.recordings.iter().map(Used::of).collect(),
            precision: Precision { rows: Vec::new() },
        })
    }

    fn layout(&self) -> Layout {
        Layout {
            links: self.links.len(),
            joints: self.joints.len(),
            frictions: self.friction_velocities.len(),
        }
    }

    fn into_arm(self, text: &str) -> Result<ArmCalibration, Fault> {
        let layout = self.layout();
        self.check_lengths(layout, text)?;
        let precision = self.precision.numbers(text, layout.unknowns())?;
        let joints = || self.joints.iter();
        let parameters = joints().map(Joint::parameters);
        let scales = joints().map(|joint| joint.scales.clone());
        let links = || self.links.iter();
        let model = Calibration {
            tool: self.tool.clone(),
            joints: joints().map(|joint| joint.name.clone()).collect(),
            links: links().map(Link::name).collect(),
            descriptions: links().map(Link::description).collect(),
            gravity: Vector3::from(self.gravity_m_s2),
            cutoff_hz: self.cutoff_hz,
            friction_widths: self.friction_velocities.clone(),
            parameters: layout.vector(links().map(Link::calibrated), parameters, self.delay_s),
            scales: layout.vector(links().map(Link::scales), scales, self.delay_scale_s),
            precision,
            noise: joints().map(Joint::noise).collect(),
            reference_torques: joints().map(|joint| joint.reference_torque).collect(),
            log_evidence: self.log_evidence,
        };
        let effort_gain = joints().map(|joint| joint.effort_gain).collect();
        let report = CalibrationReport {
            windows: self.windows,
            window_s: self.window_s,
            delay: Delay {
                delay_s: self.delay_s,
                std_dev_s: self.delay_std_dev_s,
            },
            links: links().map(Link::report).collect(),
            payloads: self
                .payloads
                .iter()
                .map(|payload| body(payload.parameters))
                .collect(),
            shortages: self.shortages,
            contradictions: contradictions::read(self.contradictions, text)?,
            recordings: self
                .recordings
                .iter()
                .enumerate()
                .map(|(index, used)| used.report(text, index))
                .collect::<Result<_, _>>()?,
            joints: self
                .joints
                .into_iter()
                .enumerate()
                .map(|(index, joint)| joint.report(text, index))
                .collect::<Result<_, _>>()?,
        };
        Ok(ArmCalibration {
            model,
            report,
            effort_gain,
        })
    }

    /// Checks the lengths of the lists of joints.
    fn check_lengths(&self, layout: Layout, text: &str) -> Result<(), Fault> {
        for (index, joint) in self.joints.iter().enumerate() {
            let lengths = [
                ("friction", joint.friction.len(), layout.frictions),
                ("scales", joint.scales.len(), layout.of_joint()),
            ];
            for (key, given, expected) in lengths {
                if given != expected {
                    let place = joint.place(text, index);
                    let reason = format!("it has {given} numbers, but must have {expected}");
                    return Err(place.fault(key, &reason));
                }
            }
        }
        Ok(())
    }
}

impl Joint {
    fn of(arm: &ArmCalibration, layout: Layout, index: usize) -> Self {
        let (model, found) = (&arm.model, &arm.report.joints[index]);
        let unknowns = layout.joint(&model.parameters, index);
        let (friction, rest) = unknowns[2..].split_at(layout.frictions);
        let noise = &model.noise[index];
        Self {
            name: found.name.clone(),
            unit: found.unit.to_owned(),
            effort_gain: arm.effort_gain[index],
            gain: found.gain,
            gain_std_dev: found.gain_std_dev,
            offset: unknowns[0],
            viscous: unknowns[1],
            friction: friction.to_vec(),
            load_friction: rest[0],
            payload_friction: rest[1],
            rotor_inertia: rest[2],
            inverse_gain: rest[3],
            scales: layout.joint(&model.scales, index),
            noise_white: noise.white,
            noise_slow: noise.slow,
            noise_slow_time_s: noise.slow_time_s,
            noise_standstill: noise.standstill,
            reference_torque: model.reference_torques[index],
            max_velocity: found.max_velocity,
            residual_before: found.residual_before,
            residual_after: found.residual_after,
            residual_held_out: found.residual_held_out,
        }
    }

    /// Returns the unknowns in the order of [`Layout::of_joint`].
    fn parameters(&self) -> Vec<f64> {
        let first = [self.offset, self.viscous];
        let last = [
            self.load_friction,
            self.payload_friction,
            self.rotor_inertia,
            self.inverse_gain,
        ];
        first
            .iter()
            .chain(&self.friction)
            .chain(&last)
            .copied()
            .collect()
    }

    fn noise(&self) -> EffortNoise {
        EffortNoise {
            white: self.noise_white,
            slow: self.noise_slow,
            slow_time_s: self.noise_slow_time_s,
            standstill: self.noise_standstill,
        }
    }

    /// Returns where the joint with an index stands in a text.
    fn place<'a>(&'a self, text: &'a str, index: usize) -> Place<'a> {
        Place {
            text,
            kind: "joint",
            index,
            name: &self.name,
        }
    }

    fn report(self, text: &str, index: usize) -> Result<JointCalibration, Fault> {
        let unit = match self.unit.as_str() {
            "N m" => "N m",
            "N" => "N",
            other => {
                let reason = format!("`{other}` is neither `N m` nor `N`");
                return Err(self.place(text, index).fault("unit", &reason));
            }
        };
        Ok(JointCalibration {
            unit,
            noise: self.noise(),
            name: self.name,
            gain: self.gain,
            gain_std_dev: self.gain_std_dev,
            offset: self.offset,
            viscous: self.viscous,
            friction: self.friction,
            load_friction: self.load_friction,
            payload_friction: self.payload_friction,
            rotor_inertia: self.rotor_inertia,
            max_velocity: self.max_velocity,
            residual_before: self.residual_before,
            residual_after: self.residual_after,
            residual_held_out: self.residual_held_out,
        })
    }
}

impl Precision {
    /// Returns the numbers of the lower triangle of `unknowns` rows, of which the first has one
    /// number.
    fn numbers(&self, text: &str, unknowns: usize) -> Result<Vec<f64>, Fault> {
        if self.rows.len() != unknowns {
            let rows = self.rows.len();
            return Err(Fault {
                line: self.rows.first().map(|row| line_of(text, row.span().start)),
                reason: format!("the precision has {rows} rows, but must have {unknowns}"),
            });
        }
        let mut all = Vec::with_capacity(unknowns * (unknowns + 1) / 2);
        for (index, row) in self.rows.iter().enumerate() {
            let numbers = row.get_ref().split_whitespace().map(str::parse::<f64>);
            let numbers: Vec<f64> = numbers
                .filter_map(Result::ok)
                .filter(|x| x.is_finite())
                .collect();
            let words = row.get_ref().split_whitespace().count();
            if (numbers.len(), words) != (index + 1, index + 1) {
                return Err(Fault {
                    line: Some(line_of(text, row.span().start)),
                    reason: format!(
                        "a row of the precision has {words} words of which {} are numbers, but must have {} numbers",
                        numbers.len(),
                        index + 1
                    ),
                });
            }
            all.extend(numbers);
        }
        Ok(all)
    }
}
