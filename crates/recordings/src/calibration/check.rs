//! Checks of numbers that people may have edited in the file of a calibration.

use tactid_identify::calibration::LinkDescription;

use super::arm::ArmCalibration;
use super::layout::Layout;

/// Largest difference of `gain` from the inverse of `inverse_gain`, a fraction: the rounding of one division.
const ROUNDING: f64 = 1e-12;

/// Largest difference of the length of a direction from one: what an edit by hand leaves.
const UNIT: f64 = 1e-6;

/// Why a text is no calibration.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) line: Option<usize>,
    pub(super) reason: String,
}

/// Checks that the numbers of joints, links and the delay are finite, and that those which are derived from others fit them: an edit
/// of one of the two alone would have no effect.
pub(super) fn check_numbers(arm: &ArmCalibration, text: &str) -> Result<(), Fault> {
    let layout = Layout::of(&arm.model);
    let delay_std_dev_s = arm.report.delay.std_dev_s;
    if !(delay_std_dev_s >= 0.0 && delay_std_dev_s.is_finite()) {
        let key = "delay_std_dev_s";
        return Err(Fault {
            line: text
                .lines()
                .position(|line| is_key(line, key))
                .map(|number| number + 1),
            reason: format!("`{key}` is not valid: {delay_std_dev_s} is no standard deviation"),
        });
    }
    for (index, joint) in arm.report.joints.iter().enumerate() {
        let place = Place {
            text,
            kind: "joint",
            index,
            name: &joint.name,
        };
        let unknowns = layout.joint(&arm.model.parameters, index);
        let inverse_gain = unknowns.last().copied().unwrap_or(f64::NAN);
        place.check_finite("gain", &[joint.gain])?;
        place.check_finite("gain_std_dev", &[joint.gain_std_dev])?;
        place.check_finite("offset", &[joint.offset])?;
        place.check_finite("viscous", &[joint.viscous])?;
        place.check_finite("friction", &joint.friction)?;
        place.check_finite("load_friction", &[joint.load_friction])?;
        place.check_finite("payload_friction", &[joint.payload_friction])?;
        place.check_finite("rotor_inertia", &[joint.rotor_inertia])?;
        place.check_finite("inverse_gain", &[inverse_gain])?;
        place.check_finite("scales", &layout.joint(&arm.model.scales, index))?;
        if (joint.gain * inverse_gain - 1.0).abs() > ROUNDING {
            let reason = format!("{} is not 1 / {inverse_gain}, the inverse gain", joint.gain);
            return Err(place.fault("gain", &reason));
        }
        if joint.gain_std_dev < 0.0 {
            return Err(place.fault("gain_std_dev", "it is negative"));
        }
    }
    check_links(arm, layout, text)
}

/// Checks that the numbers of links are finite, and that directions have the length one.
fn check_links(arm: &ArmCalibration, layout: Layout, text: &str) -> Result<(), Fault> {
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
        } = &link.description;
        place.check_finite("origin", parent_from_link.translation.vector.as_slice())?;
        place.check_unit("rotation", parent_from_link.rotation.coords.as_slice())?;
        place.check_unit("axis", axis.as_slice())?;
        place.check_finite("without_tool", parameters.as_vector().as_slice())?;
        place.check_finite("described", link.described.as_vector().as_slice())?;
        place.check_finite("calibrated", link.calibrated.as_vector().as_slice())?;
        place.check_finite("std_devs", &link.std_devs)?;
        place.check_finite("scales", &layout.link(&arm.model.scales, index))?;
    }
    Ok(())
}

/// The table of a joint or a link in a file.
struct Place<'a> {
    text: &'a str,
    /// `joint` or `link`.
    kind: &'static str,
    index: usize,
    name: &'a str,
}

impl Place<'_> {
    fn check_finite(&self, key: &str, numbers: &[f64]) -> Result<(), Fault> {
        match numbers.iter().find(|number| !number.is_finite()) {
            Some(number) => Err(self.fault(key, &format!("{number} is not finite"))),
            None => Ok(()),
        }
    }

    fn check_unit(&self, key: &str, numbers: &[f64]) -> Result<(), Fault> {
        let norm = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Written so that NaN is refused, too.
        if (norm - 1.0).abs() <= UNIT {
            return Ok(());
        }
        Err(self.fault(key, &format!("its length is {norm} instead of 1")))
    }

    fn fault(&self, key: &str, reason: &str) -> Fault {
        let Self { kind, name, .. } = self;
        Fault {
            line: self.line_of(key),
            reason: format!("`{key}` of the {kind} `{name}` is not valid: {reason}"),
        }
    }

    /// Returns the number of the line of a key; `None` where the table is not laid out as tactid writes it.
    fn line_of(&self, key: &str) -> Option<usize> {
        let header = format!("[[{}]]", self.kind);
        let lines = self.text.lines().enumerate();
        let mut tables = lines.clone().filter(|(_, line)| line.trim() == header);
        let (first, _) = tables.nth(self.index)?;
        let of_table = lines.skip(first + 1);
        let mut of_table = of_table.take_while(|(_, line)| !line.trim_start().starts_with('['));
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
