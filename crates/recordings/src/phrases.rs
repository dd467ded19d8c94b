//! Phrases within the messages of errors.

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

/// Lists topics with their frames.
pub(crate) fn list_sensors(sensors: &[(String, String)]) -> String {
    let named = sensors
        .iter()
        .map(|(topic, frame)| format!("{topic} in `{frame}`"));
    named.collect::<Vec<_>>().join(", ")
}
