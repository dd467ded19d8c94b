//! Checks of numbers that people may have edited in the file of a calibration.

use nalgebra::DMatrix;
use tactid_calibrate::{Assumption, LinkDescription, MotionShortage};

use super::layout::Layout;
use crate::ArmCalibration;

/// Largest difference of `gain` from the inverse of `inverse_gain`, a fraction: the rounding of one
/// division.
const ROUNDING: f64 = 1e-12;

/// Largest difference of the length of a direction from one: what an edit by hand leaves.
const UNIT: f64 = 1e-6;

/// Why a text is no calibration.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) line: Option<usize>,
    pub(super) reason: String,
}

/// Checks that all numbers are in range, and that those which are derived from others fit them: an
/// edit of one of the two alone would have no effect.
pub(super) fn check_numbers(arm: &ArmCalibration, text: &str) -> Result<(), Fault> {
    check_whole(arm, text)?;
    check_joints(arm, text)?;
    check_links(arm, text)?;
    for (index, payload) in arm.report.payloads.iter().enumerate() {
        let place = Place::numbered(text, "payload", index);
        place.check("parameters", payload.as_vector().as_slice(), FINITE)?;
    }
    for (index, shortage) in arm.report.shortages.iter().enumerate() {
        let place = Place::numbered(text, "shortage", index);
        match shortage {
            MotionShortage::Still { max_velocity, .. } => {
                place.check("max_velocity", &[*max_velocity], NOT_NEGATIVE)?;
            }
            MotionShortage::Gain { std_dev, .. } => {
                place.check("std_dev", &[*std_dev], NOT_NEGATIVE)?;
            }
            MotionShortage::OneDirection { .. } => (),
        }
    }
    for (index, contradiction) in arm.report.contradictions.iter().enumerate() {
        let place = Place::numbered(text, "contradiction", index);
        place.check("size", &[contradiction.size], FINITE)?;
        place.check("std_dev", &[contradiction.std_dev], NOT_NEGATIVE)?;
        if let Assumption::GainPrior { prior_std_dev } = contradiction.assumption {
            place.check("prior_std_dev", &[prior_std_dev], POSITIVE)?;
        }
    }
    check_precision(arm, text)
}

/// Checks the keys before the first table.
fn check_whole(arm: &ArmCalibration, text: &str) -> Result<(), Fault> {
    let (model, report) = (&arm.model, &arm.report);
    let layout = Layout::of(model);
    let place = Place {
        text,
        kind: "",
        index: 0,
        name: "",
    };
    if layout.joints == 0 || layout.links == 0 {
        let reason = "a calibration has at least one [[joint]] and one [[link]]".to_owned();
        return Err(Fault { line: None, reason });
    }
    place.check("gravity_m_s2", model.gravity.as_slice(), FINITE)?;
    place.check("cutoff_hz", &[model.cutoff_hz], POSITIVE)?;
    place.check("friction_velocities", &model.friction_widths, POSITIVE)?;
    if let Err(error) = model.parameter_names() {
        return Err(place.fault("friction_velocities", &error.to_string()));
    }
    place.check("window_s", &[report.window_s], POSITIVE)?;
    let window_s = model.window_s();
    if (report.window_s / window_s - 1.0).abs() > ROUNDING {
        let reason = format!(
            "{} is not {window_s}, the length of a window that belongs to `cutoff_hz`",
            report.window_s
        );
        return Err(place.fault("window_s", &reason));
    }
    place.check("log_evidence", &[model.log_evidence], FINITE)?;
    place.check("delay_s", &[report.delay.delay_s], FINITE)?;
    let longest_s = model.longest_delay_s();
    place.check_within("delay_s", report.delay.delay_s, -longest_s, longest_s)?;
    place.check("delay_std_dev_s", &[report.delay.std_dev_s], NOT_NEGATIVE)?;
    place.check("delay_scale_s", &[layout.delay(&model.scales)], POSITIVE)
}

/// Checks the numbers of joints.
fn check_joints(arm: &ArmCalibration, text: &str) -> Result<(), Fault> {
    let layout = Layout::of(&arm.model);
    for (index, joint) in arm.report.joints.iter().enumerate() {
        let place = Place {
            text,
            kind: "joint",
            index,
            name: &joint.name,
        };
        let unknowns = layout.joint(&arm.model.parameters, index);
        let inverse_gain = unknowns.last().copied().unwrap_or(f64::NAN);
        let (noise, residual) = (&joint.noise, joint.residual_held_out);
        place.check("effort_gain", &[arm.effort_gain[index]], NOT_ZERO)?;
        place.check("gain", &[joint.gain], POSITIVE)?;
        place.check("gain_std_dev", &[joint.gain_std_dev], NOT_NEGATIVE)?;
        place.check("offset", &[joint.offset], FINITE)?;
        place.check("viscous", &[joint.viscous], FINITE)?;
        place.check("friction", &joint.friction, FINITE)?;
        place.check("load_friction", &[joint.load_friction], FINITE)?;
        place.check("payload_friction", &[joint.payload_friction], FINITE)?;
        place.check("rotor_inertia", &[joint.rotor_inertia], FINITE)?;
        place.check("inverse_gain", &[inverse_gain], POSITIVE)?;
        place.check(
            "scales",
            &layout.joint(&arm.model.scales, index),
            NOT_NEGATIVE,
        )?;
        place.check("noise_white", &[noise.white], POSITIVE)?;
        place.check("noise_slow", &[noise.slow], POSITIVE)?;
        place.check("noise_slow_time_s", &[noise.slow_time_s], POSITIVE)?;
        place.check("noise_standstill", &[noise.standstill], POSITIVE)?;
        place.check(
            "reference_torque",
            &[arm.model.reference_torques[index]],
            POSITIVE,
        )?;
        let largest = arm.model.largest_noise(index).unwrap_or(f64::NAN);
        for (key, number) in [
            ("noise_white", noise.white),
            ("noise_slow", noise.slow),
            ("noise_standstill", noise.standstill),
        ] {
            place.check_within(key, number, 0.0, largest)?;
        }
        place.check("max_velocity", &joint.max_velocity, NOT_NEGATIVE)?;
        place.check("residual_before", &[joint.residual_before], NOT_NEGATIVE)?;
        place.check("residual_after", &[joint.residual_after], NOT_NEGATIVE)?;
        // NaN where the windows are too few.
        let known = if residual.is_nan() { 0.0 } else { residual };
        place.check("residual_held_out", &[known], NOT_NEGATIVE)?;
        if (joint.gain * inverse_gain - 1.0).abs() > ROUNDING {
            let reason = format!("{} is not 1 / {inverse_gain}, the inverse gain", joint.gain);
            return Err(place.fault("gain", &reason));
        }
    }
    Ok(())
}

/// Checks the numbers of links, and that directions have the length one.
fn check_links(arm: &ArmCalibration, text: &str) -> Result<(), Fault> {
    let layout = Layout::of(&arm.model);
    for (index, link) in arm.report.links.iter().enumerate() {
        let place = Place {
            text,
            kind: "link",
            index,
            name: &link.name,
        };
        let LinkDescription {
            parent_from_link,
            axis,
            parameters,
        } = &arm.model.descriptions[index];
        let origin = parent_from_link.translation.vector;
        place.check("origin", origin.as_slice(), FINITE)?;
        place.check_unit("rotation", parent_from_link.rotation.coords.as_slice())?;
        place.check_unit("axis", axis.as_slice())?;
        place.check("without_tool", parameters.as_vector().as_slice(), FINITE)?;
        place.check("described", link.described.as_vector().as_slice(), FINITE)?;
        place.check("calibrated", link.calibrated.as_vector().as_slice(), FINITE)?;
        place.check("std_devs", &link.std_devs, NOT_NEGATIVE)?;
        place.check("scales", &layout.link(&arm.model.scales, index), POSITIVE)?;
    }
    Ok(())
}

/// Checks that the precision is that of a covariance. It is symmetric because the file has one
/// triangle.
fn check_precision(arm: &ArmCalibration, text: &str) -> Result<(), Fault> {
    let count = arm.model.parameters.len();
    let entry = |i: usize, k: usize| arm.model.precision[i * (i + 1) / 2 + k];
    let precision = DMatrix::from_fn(count, count, |i, k| entry(i.max(k), i.min(k)));
    if precision.cholesky().is_some() {
        return Ok(());
    }
    let header = text.lines().position(|line| line.trim() == "[precision]");
    Err(Fault {
        line: header.map(|number| number + 1),
        reason: "the precision is no inverse of a covariance: it is not positive definite"
            .to_owned(),
    })
}

/// Range of numbers: whether a number is in it, and the range in words.
type Range = (fn(f64) -> bool, &'static str);

const FINITE: Range = (f64::is_finite, "finite");
const POSITIVE: Range = (|x| x > 0.0 && x.is_finite(), "finite and more than zero");
const NOT_NEGATIVE: Range = (|x| x >= 0.0 && x.is_finite(), "finite and not negative");
const NOT_ZERO: Range = (|x| x != 0.0 && x.is_finite(), "finite and not zero");

/// A table of a file, or the keys before the first table.
pub(super) struct Place<'a> {
    pub(super) text: &'a str,
    /// Kind of the table, such as `joint`; empty for the keys before the first table.
    pub(super) kind: &'static str,
    /// Place of the table among those of its kind.
    pub(super) index: usize,
    /// Name that the table has; empty where it has none.
    pub(super) name: &'a str,
}

impl<'a> Place<'a> {
    /// Returns the place of a table without a name.
    pub(super) fn numbered(text: &'a str, kind: &'static str, index: usize) -> Self {
        Self {
            text,
            kind,
            index,
            name: "",
        }
    }

    fn check(&self, key: &str, numbers: &[f64], (is_valid, words): Range) -> Result<(), Fault> {
        match numbers.iter().find(|number| !is_valid(**number)) {
            Some(number) => Err(self.fault(key, &format!("{number} is not {words}"))),
            None => Ok(()),
        }
    }

    /// Checks that a number is in a range, with both ends.
    fn check_within(&self, key: &str, number: f64, least: f64, most: f64) -> Result<(), Fault> {
        // Written so that NaN is refused, too.
        if (least..=most).contains(&number) {
            return Ok(());
        }
        let reason = format!("{number} is not between {least:.4} and {most:.4}");
        Err(self.fault(key, &reason))
    }

    fn check_unit(&self, key: &str, numbers: &[f64]) -> Result<(), Fault> {
        let norm = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Written so that NaN is refused, too.
        if (norm - 1.0).abs() <= UNIT {
            return Ok(());
        }
        Err(self.fault(key, &format!("its length is {norm} instead of 1")))
    }

    /// Returns the fault of the value of a key.
    pub(super) fn fault(&self, key: &str, reason: &str) -> Fault {
        let Self { kind, name, .. } = self;
        let table = match (kind.is_empty(), name.is_empty()) {
            (true, _) => String::new(),
            (false, true) => format!(" of the {kind} {}", self.index + 1),
            (false, false) => format!(" of the {kind} `{name}`"),
        };
        Fault {
            line: self.line_of(key),
            reason: format!("`{key}`{table} is not valid: {reason}"),
        }
    }

    /// Returns the number of the line of a key; `None` where the table is not laid out as tactid
    /// writes it.
    fn line_of(&self, key: &str) -> Option<usize> {
        let header = format!("[[{}]]", self.kind);
        let lines = self.text.lines().enumerate();
        let first = if self.kind.is_empty() {
            0
        } else {
            let mut tables = lines.clone().filter(|(_, line)| line.trim() == header);
            tables.nth(self.index)?.0 + 1
        };
        let mut of_table = lines
            .skip(first)
            .take_while(|(_, line)| !line.trim_start().starts_with('['));
        of_table
            .find(|(_, line)| is_key(line, key))
            .map(|(number, _)| number + 1)
    }
}

/// Whether a line gives the value of a key.
fn is_key(line: &str, key: &str) -> bool {
    line.split_once('=')
        .is_some_and(|(name, _)| name.trim() == key)
}
