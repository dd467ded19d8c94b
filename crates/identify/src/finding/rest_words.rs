//! Poses at rest in words.

use tactid_dynamics::words::{counted, general, listed};

use super::RestingPoses;

pub(super) fn poses_at_rest(found: &RestingPoses) -> String {
    let attitudes = counted(found.attitudes, "attitude");
    let averaged = if found.samples > found.attitudes {
        format!(" (the means of {} samples)", found.samples)
    } else {
        String::new()
    };
    let noise = [(found.force_noise, "N"), (found.moment_noise, "N m")];
    let measured = noise.iter().filter(|(noise, _)| *noise > 0.0);
    let noise: Vec<String> = measured
        .map(|(noise, unit)| format!("{} {unit}", general(*noise, 2)))
        .collect();
    format!(
        "The payload is identified from {attitudes} at rest{averaged}, which never show the inertia. \
         The intervals follow from the noise between attitudes, {}. {}",
        listed(&noise),
        next(found)
    )
}

/// Says which further attitude would help most.
fn next(found: &RestingPoses) -> String {
    let axes = found.next_gravity.iter().zip(["x", "y", "z"]);
    let axes: Vec<String> = axes
        .filter(|(entry, _)| **entry != 0.0)
        .map(|(entry, axis)| format!("{}{axis}", if *entry > 0.0 { "+" } else { "-" }))
        .collect();
    let direction = match &axes[..] {
        [axis] => format!("along {axis}"),
        _ => format!("in the middle between {}", listed(&axes)),
    };
    let gain = if found.next_fraction == 0.0 {
        format!("it makes {} observable", found.next_value)
    } else {
        let narrower = 100.0 * (1.0 - found.next_fraction);
        format!(
            "the interval of {} becomes {narrower:.0} % narrower",
            found.next_value
        )
    };
    format!(
        "A further attitude with gravity {direction} of {} would help most: {gain}.",
        found.frame
    )
}
