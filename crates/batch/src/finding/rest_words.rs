//! Poses at rest in words.

use tactid_dynamics::Reader;
use tactid_dynamics::words::{counted, general, listed, percent};

use super::{FarCenter, Finding, NextAttitude, OutlyingPose, RestingPoses, Rests, unit_of};

impl Finding {
    /// Says what was noticed about poses at rest; nothing for other findings.
    pub(super) fn of_rests(&self, reader: Reader) -> String {
        match self {
            Self::PosesAtRest(found) => poses_at_rest(found),
            Self::OutlyingPose(found) => outlying(found),
            Self::CenterFarAway(found) => center_far_away(found, reader),
            Self::TooFewPoses { poses } => too_few_poses(*poses, reader),
            Self::ConsistsOfRests(found) => consists_of_rests(found),
            Self::WeightOrOffset { is_known } => weight_or_offset(*is_known, reader),
            _ => String::new(),
        }
    }
}

fn poses_at_rest(found: &RestingPoses) -> String {
    let attitudes = counted(found.attitudes, "attitude");
    let visited = if found.poses > found.attitudes {
        format!(" in {}", counted(found.poses, "pose"))
    } else {
        String::new()
    };
    let averaged = if found.samples > found.poses {
        format!(" (the means of {} samples)", found.samples)
    } else {
        String::new()
    };
    let noise = [(found.force_noise, "N"), (found.moment_noise, "N m")];
    let measured = noise.iter().filter(|(noise, _)| *noise > 0.0);
    let noise: Vec<String> = measured
        .map(|(noise, unit)| format!("{} {unit}", general(*noise, 2)))
        .collect();
    let next = found.next.as_ref();
    let next = next.map_or_else(String::new, |next| further(next, &found.frame));
    format!(
        "The payload is identified from {attitudes} at rest{visited}{averaged}; poses at rest never show \
         the inertia. The intervals follow from the noise between poses, {}.{next}",
        listed(&noise),
    )
}

fn center_far_away(found: &FarCenter, reader: Reader) -> String {
    format!(
        "The centre of mass is {} m away from the origin of the frame {}, farther than that of anything \
         that an arm holds: the moments are too large for the forces, as in N mm. Give forces in N and \
         moments in N m; of a table, {} states other units.",
        general(found.distance_m, 3),
        found.frame,
        reader.option("columns")
    )
}

fn too_few_poses(poses: usize, reader: Reader) -> String {
    format!(
        "{} {} too few to tell a load of zero from a wrong assumption, such as gravity in another \
         direction (a base on a wall) or orientations in another form: measure in four attitudes or \
         more, or state {}.",
        counted(poses, "pose"),
        if poses == 1 { "is" } else { "are" },
        reader.option("gravity")
    )
}

fn weight_or_offset(is_known: bool, reader: Reader) -> String {
    let zeroed = reader.choice("wrench_offset", "no");
    if is_known {
        format!(
            "The tool hardly turns to gravity: accelerations alone tell the weight of the payload from a zero \
             of the sensor that was never set. Both were identified, and the intervals contain what \
             each leaves open of the other. Tilt the tool; {zeroed} accepts a sensor that reads zero \
             without the payload."
        )
    } else {
        format!(
            "The recording keeps the tool in one attitude to gravity, in which the weight of the payload and a \
             zero of the sensor that was never set are one: the mass is that of both, or unknown \
             where the zero is identified, too. Record at least three attitudes; {zeroed} accepts a \
             sensor that reads zero without the payload."
        )
    }
}

fn consists_of_rests(found: &Rests) -> String {
    format!(
        "The recording consists of {} in {}, {} of its time. Rests show the mass and the centre of mass; \
         the inertia shows in the moves between them alone, if it does. The intervals follow from the \
         noise within the rests, and do not contain what differs between attitudes, such as a \
         hysteresis: the means of the rests as poses at rest show it.",
        counted(found.rests, "rest"),
        counted(found.attitudes, "attitude"),
        percent(found.fraction)
    )
}

fn outlying(found: &OutlyingPose) -> String {
    let (first, last) = (found.first_row, found.last_row);
    let pose = if first == last {
        format!("Row {first}")
    } else {
        format!("Pose {} (rows {first} to {last})", found.pose)
    };
    let unit = unit_of(&found.channel);
    let consequence = if found.is_left_out {
        "It was left out"
    } else {
        "Without it, the others do not determine as much, so that it was used"
    };
    format!(
        "{pose} does not fit the other poses: {} is {} {unit} away, {} standard deviations, as after a \
         contact or a bump of the sensor. {consequence}; measure it again.",
        found.channel,
        general(found.residual, 3),
        general(found.distance, 3)
    )
}

/// Says which further attitude would help most.
fn further(next: &NextAttitude, frame: &str) -> String {
    let axes = next.gravity.iter().zip(["x", "y", "z"]);
    let axes: Vec<String> = axes
        .filter(|(entry, _)| **entry != 0.0)
        .map(|(entry, axis)| format!("{}{axis}", if *entry > 0.0 { "+" } else { "-" }))
        .collect();
    let direction = match &axes[..] {
        [axis] => format!("along {axis}"),
        _ => format!("in the middle between {}", listed(&axes)),
    };
    let gain = if next.fraction == 0.0 {
        format!("it makes {} observable", next.value)
    } else {
        let narrower = 100.0 * (1.0 - next.fraction);
        format!(
            "the interval of {} becomes {narrower:.0} % narrower",
            next.value
        )
    };
    format!(" A further attitude with gravity {direction} of {frame} would help most: {gain}.")
}
