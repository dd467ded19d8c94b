//! Phrases within the messages of errors.

use std::path::PathBuf;

use tactid_identify::checks::PositionsBeyondLimits;
use tactid_identify::three_digits;

/// Returns the place of a line behind the name of a file.
pub(crate) fn at_line(line: Option<usize>) -> String {
    line.map_or_else(String::new, |line| format!(":{line}"))
}

/// Says why an option cannot be combined with a calibration.
pub(crate) fn calibration_reason(option: &str) -> &'static str {
    match option {
        "method" => "is for the effort method",
        "estimator" => "needs least squares",
        "effort_noise" => "has the noise of the joint efforts",
        _ => "has its own",
    }
}

/// Returns a topic as it is, and the name of an array as code.
pub(crate) fn stream_name(name: &str) -> String {
    if name.starts_with('/') {
        name.to_owned()
    } else {
        format!("`{name}`")
    }
}

/// Lists topics with their frames.
pub(crate) fn list_sensors(sensors: &[(String, String)]) -> String {
    let named = sensors
        .iter()
        .map(|(topic, frame)| format!("{topic} in `{frame}`"));
    named.collect::<Vec<_>>().join(", ")
}

/// Says which joint is beyond its limits, and what to check.
pub(crate) fn positions(beyond: &PositionsBeyondLimits) -> String {
    let joint = beyond.joints.first().map_or("", String::as_str);
    let [position, lower, upper] = [beyond.position, beyond.lower, beyond.upper].map(three_digits);
    let advice = if beyond.are_degrees {
        "they seem to be degrees, but must be in rad"
    } else {
        "check their units, the order of the joints and the URDF"
    };
    format!("`{joint}` reaches {position} of {lower} to {upper}; {advice}")
}

/// Says that two recordings are the same.
pub(crate) fn given_twice([first, second]: &[PathBuf; 2]) -> String {
    let (first, second) = (first.display(), second.display());
    if first.to_string() == second.to_string() {
        format!("{first} is given twice")
    } else {
        format!("{first} and {second} are the same recording, which is given twice")
    }
}

/// Lists gains to three digits, as options of numbers have them.
pub(crate) fn gains(gains: &[f64]) -> String {
    let rounded: Vec<String> = gains
        .iter()
        .map(|&gain| three_digits(gain).to_string())
        .collect();
    rounded.join(",")
}

/// Returns what to check about a delay, s, that was given, and the conjunction before the last check.
pub(crate) fn given_delay(delay_s: f64) -> String {
    if delay_s == 0.0 {
        return "and ".to_owned();
    }
    format!("that the given delay of {delay_s} s is in seconds, and ")
}
