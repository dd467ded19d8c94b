//! Why recordings cannot calibrate an arm: units of positions and of efforts.

use tactid_batch::Finding as DataFinding;
use tactid_calibrate::CalibrateError;
use tactid_dynamics::words::three_digits;
use tactid_identify::checks::PositionsBeyondLimits;

use crate::{Finding, RecordingError};

/// Mean factor on the gains from which on masses in grams are likelier than efforts in another
/// unit: a motor behind its gear has up to 100 N m per ampere.
const FACTOR_OF_GRAMS: f64 = 300.0;

/// Checks that positions are not in degrees: sines of other angles explain nothing, which the fit
/// itself does not always notice.
pub(super) fn check_radians(findings: &[Finding]) -> Result<(), RecordingError> {
    match wrong_positions(findings).filter(|beyond| beyond.are_degrees) {
        Some(beyond) => Err(do_not_fit(beyond)),
        None => Ok(()),
    }
}

/// Returns the positions that are beyond their limits.
pub(super) fn wrong_positions(findings: &[Finding]) -> Option<&PositionsBeyondLimits> {
    findings.iter().find_map(|finding| match finding {
        Finding::Data(DataFinding::PositionsBeyondLimits(beyond)) => Some(beyond),
        _ => None,
    })
}

/// Returns the error that positions beyond their limits are, where this is why efforts cannot be
/// explained.
pub(super) fn do_not_fit(beyond: &PositionsBeyondLimits) -> RecordingError {
    let joint = beyond.joints.first().map_or("", String::as_str);
    let [position, lower, upper] = [beyond.position, beyond.lower, beyond.upper].map(three_digits);
    let advice = if beyond.are_degrees {
        "they seem to be degrees, but must be in rad"
    } else {
        "check their units, the order of the joints and the URDF"
    };
    RecordingError::data(format!(
        "the efforts do not fit the positions, which are beyond the limits of the URDF: `{joint}` reaches {position} of \
         {lower} to {upper}; {advice}"
    ))
}

/// Returns whether gains, relative to the given ones, look like masses in grams and not like
/// efforts in another unit.
pub(super) fn are_of_grams(gains: &[f64]) -> bool {
    geometric_mean(gains) >= FACTOR_OF_GRAMS
}

/// Returns the error of gains that are far from the given ones, with the gains that fit, N m or N
/// for one unit of the recorded value.
pub(super) fn needs_rough_gains(error: &CalibrateError, gains: &[f64]) -> RecordingError {
    let gains: Vec<String> = gains
        .iter()
        .map(|&gain| three_digits(gain).to_string())
        .collect();
    RecordingError::Calibration {
        what: format!(
            "{error}; where efforts are not torques, such as currents, rough gains must be given first: `effort_gain` {}",
            gains.join(",")
        ),
        option: Some("effort_gain"),
    }
}

fn geometric_mean(numbers: &[f64]) -> f64 {
    let logarithms = numbers.iter().map(|number| number.abs().ln());
    (logarithms.sum::<f64>() / numbers.len() as f64).exp()
}
