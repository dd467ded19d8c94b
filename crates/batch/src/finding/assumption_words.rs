//! Wrong assumptions in words.

use std::f64::consts::PI;

use tactid_dynamics::Reader;
use tactid_dynamics::words::{general, listed, percent, with_interval};
use tactid_identify::checks::MODEL_ERROR;
use tactid_identify::solve::HALF_WIDTH_95;

use super::load_words::other_body;
use super::{
    CHANNELS, CONTRADICTION, Hypothesis, MOST_LEFT, WrongAssumption, is_out_of_reach, unit_of,
};

/// Says which assumption the data contradict, what they show instead, and what to do.
pub(super) fn wrong_assumption(found: &WrongAssumption, reader: Reader) -> String {
    let mut sentences = vec![statement(found, reader)];
    if let Some(other) = found.runner_up {
        sentences.push(format!("The data cannot tell this from {}.", named(other)));
    }
    sentences.push(remedy(found, reader));
    sentences.retain(|sentence| !sentence.is_empty());
    sentences.join(" ")
}

/// Returns the name of a hypothesis in a sentence.
fn named(hypothesis: Hypothesis) -> &'static str {
    match hypothesis {
        Hypothesis::Offset => "a constant offset of the wrenches",
        Hypothesis::Weight => "a weight that was subtracted from the wrenches",
        Hypothesis::Gravity => "another direction of gravity",
        Hypothesis::SensorPlace => "another place of the sensor",
        Hypothesis::SensorRotation => "a rotation of the sensor",
        Hypothesis::AxisGains => "gains of the sensor's axes",
        Hypothesis::Delay => "a delay of the wrenches",
        Hypothesis::JointZeros => "zeros of joints that are off",
        Hypothesis::Axes => "exchanged axes of the sensor",
        Hypothesis::Saturation => "channels of the sensor that are at a limit",
    }
}

fn statement(found: &WrongAssumption, reader: Reader) -> String {
    let frame = &found.frame;
    let entries = |factor: f64| -> Vec<String> {
        let pairs = found.values.iter().zip(&found.std_devs);
        pairs
            .map(|(value, std_dev)| match *std_dev > 0.0 {
                true => with_interval(factor * value, factor * std_dev),
                false => general(factor * value + 0.0, 4),
            })
            .collect()
    };
    let rest = if found.residual_ratio > MOST_LEFT {
        ": something else is wrong, too"
    } else {
        ""
    };
    let explained = format!(
        "with this, residuals are {} of those without{rest}",
        percent(found.residual_ratio)
    );
    match found.cause {
        Hypothesis::Offset => offset(found, &entries(1.0), &explained, reader),
        Hypothesis::Weight => weight(found, &entries(1.0), &explained),
        Hypothesis::Gravity => gravity(found, &entries(1.0), &explained),
        Hypothesis::SensorPlace => format!(
            "The sensor is elsewhere: its origin is at ({}) mm in the frame {frame} ({explained}).",
            entries(1e3).join(", ")
        ),
        Hypothesis::SensorRotation => format!(
            "The sensor is turned: its axes are those of the frame {frame} turned by the rotation \
             vector ({}) degrees ({explained}).",
            entries(180.0 / PI).join(", ")
        ),
        Hypothesis::AxisGains => format!(
            "Gains of the sensor's axes differ ({explained}): {}.",
            listed(&far_from(found, 1.0, ""))
        ),
        Hypothesis::Delay => delay(found, &explained),
        Hypothesis::JointZeros => format!(
            "The zeros of joints are off ({explained}); true less measured position: {}.",
            listed(&far_from(found, 180.0 / PI, " degrees"))
        ),
        Hypothesis::Axes => axes(found, &explained),
        Hypothesis::Saturation => saturation(found, &explained),
    }
}

/// Says which offset the wrenches have.
fn offset(found: &WrongAssumption, entries: &[String], explained: &str, reader: Reader) -> String {
    let whose = match reader {
        Reader::Online => "pushed",
        _ => "recorded",
    };
    let (force, moment) = entries.split_at(entries.len().min(3));
    let have = if found.is_applied {
        "have"
    } else {
        "seem to have"
    };
    format!(
        "The wrenches {have} a constant offset: force ({}) N, moment ({}) N m, in the frame {} and \
         with the sign of the {whose} wrenches ({explained}).",
        force.join(", "),
        moment.join(", "),
        found.frame
    )
}

/// Says by how much the wrenches are later than the motion, or earlier.
fn delay(found: &WrongAssumption, explained: &str) -> String {
    let (Some(&delay_s), Some(&std_dev_s)) = (found.values.first(), found.std_devs.first()) else {
        return String::new();
    };
    let direction = if delay_s < 0.0 { "earlier" } else { "later" };
    let size = with_interval(delay_s.abs(), std_dev_s);
    format!("The wrenches are {direction} than the motion by {size} s ({explained}).")
}

/// Says which channels are cut off, and at which values.
fn saturation(found: &WrongAssumption, explained: &str) -> String {
    let ends = found.names.iter().zip(&found.values);
    let ends: Vec<String> = ends
        .map(|(name, limit)| format!("{name} at about {} {}", general(*limit, 2), unit_of(name)))
        .collect();
    format!("The sensor is saturated: {} ({explained}).", listed(&ends))
}

/// Says which channels are exchanged.
fn axes(found: &WrongAssumption, explained: &str) -> String {
    let are_all_opposite = are_all_opposite(found);
    let changed = found.names.iter().zip(&found.values).zip(CHANNELS);
    let changed: Vec<String> = changed
        .map(|((name, sign), channel)| (name, *sign < 0.0 && !are_all_opposite, channel))
        .filter(|(name, is_opposite, channel)| name != channel || *is_opposite)
        .map(|(name, is_opposite, channel)| {
            let sign = if is_opposite { "-" } else { "" };
            format!("{channel} is the recorded {sign}{name}")
        })
        .collect();
    match (are_all_opposite, changed.is_empty()) {
        (true, true) => {
            format!("All channels of the wrench have the opposite sign ({explained}).")
        }
        (true, false) => format!(
            "All channels of the wrench have the opposite sign, and axes are exchanged \
             ({explained}): {}.",
            listed(&changed)
        ),
        (false, _) => format!(
            "Axes of the wrench are exchanged or have the opposite sign ({explained}): {}.",
            listed(&changed)
        ),
    }
}

/// Returns whether all channels have the opposite sign.
fn are_all_opposite(found: &WrongAssumption) -> bool {
    found.values.iter().all(|sign| *sign < 0.0)
}

/// Says how the channels of a wrench are corrected.
fn of_axes(found: &WrongAssumption, reader: Reader) -> String {
    let places = "Bring the channels of the wrench to their places.";
    if !are_all_opposite(found) {
        return places.to_owned();
    }
    let sign = format!("State it by {}.", other_body(reader));
    let are_exchanged = found
        .names
        .iter()
        .zip(CHANNELS)
        .any(|(name, channel)| name != channel);
    if are_exchanged {
        format!("{sign} {places}")
    } else {
        sign
    }
}

/// Says which gravity explains the wrenches.
fn gravity(found: &WrongAssumption, entries: &[String], explained: &str) -> String {
    let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let (shown, given) = (&found.values, &found.assumed);
    // Within 5 % of the size, or 11 degrees.
    let sizes = (product(shown, shown) * product(given, given)).sqrt();
    let what = if product(shown, shown) < 0.0025 * product(given, given) {
        "No gravity at all,"
    } else if product(shown, given) < -0.98 * sizes {
        "Gravity of the opposite sign,"
    } else {
        "Another gravity,"
    };
    let what = if has_other_length(found) {
        let size = with_interval(length(shown), length(&found.std_devs));
        format!("Gravity of {size} m/s²")
    } else {
        format!("{what} ({}) m/s² in world axes,", entries.join(", "))
    };
    format!(
        "{what} explains the wrenches far better than the given one ({explained}), with a mass of {} \
         kg.",
        with_interval(found.mass_kg, found.mass_std_dev_kg)
    )
}

/// Says which weight was subtracted, or added.
fn weight(found: &WrongAssumption, entries: &[String], explained: &str) -> String {
    let (Some(&subtracted_kg), Some(&std_dev_kg), [_, center @ ..]) =
        (found.values.first(), found.std_devs.first(), entries)
    else {
        return String::new();
    };
    let done = if subtracted_kg < 0.0 {
        "added to"
    } else {
        "subtracted from"
    };
    let body = format!(
        "of {} kg at ({}) m",
        with_interval(subtracted_kg.abs(), std_dev_kg),
        center.join(", ")
    );
    let mass_kg = with_interval(found.mass_kg, found.mass_std_dev_kg);
    let loads = format!(
        "the static load corresponds to {} kg, the dynamic load to {mass_kg} kg ({explained})",
        general(found.mass_kg - subtracted_kg, 3)
    );
    if let Some(payload) = configured(found) {
        let [configured_kg, x, y, z] = payload.map(|entry| general(entry, 4));
        let instead = if is_none(found) {
            "none".to_owned()
        } else {
            format!("one {body}")
        };
        return format!(
            "The weight that was subtracted from the wrenches is not that of the configured \
             payload, {configured_kg} kg at ({x}, {y}, {z}) m, but {instead}: {loads}."
        );
    }
    if let Some(along) = found.along_m_s2 {
        let [x, y, z] = along.map(|entry| general(entry + 0.0, 6));
        let along = format!(
            "along the assumed gravity, ({x}, {y}, {z}) m/s², although gravity is another one"
        );
        return if std_dev_kg.is_finite() && found.mass_std_dev_kg.is_finite() {
            format!(
                "The weight of a body seems to be {done} the wrenches, {body}, {along}; the mass of \
                 the load is then {mass_kg} kg ({explained})."
            )
        } else {
            format!(
                "The weight of a body seems to be subtracted from the wrenches {along}: at rest, \
                 nothing tells its mass from that of the load ({explained})."
            )
        };
    }
    format!("The weight of a body seems to be {done} the wrenches, {body}: {loads}.")
}

/// Returns the mass and the centre of mass of the payload that is known to be configured in the
/// controller.
fn configured(found: &WrongAssumption) -> Option<[f64; 4]> {
    let assumed = found.assumed.as_slice().try_into().ok();
    assumed.filter(|payload: &[f64; 4]| payload[0] != 0.0)
}

/// Returns whether the weight that was subtracted is none, up to errors of a sound sensor.
fn is_none(found: &WrongAssumption) -> bool {
    let masses_kg = [&found.values, &found.std_devs, &found.assumed].map(|each| each.first());
    let [Some(subtracted_kg), Some(std_dev_kg), Some(assumed_kg)] = masses_kg else {
        return false;
    };
    let error_kg = (HALF_WIDTH_95 * std_dev_kg).max(MODEL_ERROR * assumed_kg.abs());
    subtracted_kg.abs() <= error_kg
}

/// Says how a weight that was subtracted is accepted.
fn of_weight(found: &WrongAssumption, reader: Reader) -> String {
    // The numbers that are found are less precise than those of the controller.
    let payload = format!(
        "{} beside it, the payload as it is configured in the controller",
        reader.option("configured_payload")
    );
    let accepts = reader.choice("wrench_is", "without-weight");
    let controller = "A controller does so for its configured payload:";
    if configured(found).is_some() {
        let given = reader.option("configured_payload");
        return match reader {
            _ if is_none(found) => {
                let content = reader.option("wrench_is");
                format!("The wrenches are raw: leave out {given} and {content}.")
            }
            Reader::Online => format!("Give {given} as it is in the controller."),
            _ => format!(
                "Give {given} as it is in the controller; without it, {accepts} identifies this \
                 weight, too."
            ),
        };
    }
    if found.along_m_s2.is_some() {
        let mounting = "A controller does so that does not know how its base is mounted: state that \
                        there";
        let is_shown = found
            .std_devs
            .first()
            .is_some_and(|std_dev| std_dev.is_finite());
        return match reader {
            Reader::Online => format!("{mounting}."),
            _ if !is_shown => format!("{mounting}, and record again."),
            _ => format!(
                "{mounting}; or {} with {accepts} identifies gravity and this weight.",
                reader.choice("gravity", "unknown")
            ),
        };
    }
    match reader {
        Reader::Online => format!("{controller} {accepts} accepts it, with {payload}."),
        _ if found.values.first().is_some_and(|mass_kg| *mass_kg > 0.0) => format!(
            "{controller} {accepts} accepts it and identifies the weight, too; with {payload}, the \
             values are more precise."
        ),
        _ => format!("{accepts} identifies this weight, too."),
    }
}

/// Returns the values that are certainly not the assumed ones, each with its name.
fn far_from(found: &WrongAssumption, factor: f64, unit: &str) -> Vec<String> {
    let said = |least: f64| -> Vec<String> {
        let values = found.values.iter().zip(&found.std_devs);
        let named = values.zip(found.assumed.iter().zip(&found.names));
        named
            .filter(|((value, std_dev), (assumed, _))| {
                (*value - *assumed).abs() > least * **std_dev
            })
            .map(|((value, std_dev), (_, name))| {
                let value = with_interval(factor * value, factor * std_dev);
                format!("{name} {value}{unit}")
            })
            .collect()
    };
    let certain = said(CONTRADICTION);
    if certain.is_empty() {
        said(0.0)
    } else {
        certain
    }
}

/// Says what to do about gravity.
fn of_gravity(found: &WrongAssumption, reader: Reader) -> String {
    let option = reader.option("gravity");
    if has_other_length(found) {
        return format!("Check the length of {option}, which is 9.81 m/s² on Earth.");
    }
    let check = format!("Check {option} and the axes of the world: how the base is mounted.");
    if reader == Reader::Online {
        return check;
    }
    let unknown = reader.choice("gravity", "unknown");
    format!("{check} {unknown} identifies its direction together with the payload.")
}

/// Returns the length of a vector.
fn length(entries: &[f64]) -> f64 {
    entries.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns whether gravity has not the length of the assumed one, which its direction keeps.
fn has_other_length(found: &WrongAssumption) -> bool {
    let (shown, given) = (length(&found.values), length(&found.assumed));
    shown > 0.0 && (shown - given).abs() > MODEL_ERROR * given
}

/// Returns whether a place is certainly farther away than anything on an arm.
fn is_place_out_of_reach(found: &WrongAssumption) -> bool {
    is_out_of_reach(
        length(&found.values),
        HALF_WIDTH_95 * length(&found.std_devs),
    )
}

/// Says what to do.
fn remedy(found: &WrongAssumption, reader: Reader) -> String {
    let before = match reader {
        Reader::Online => " before `push`",
        _ => "",
    };
    let online = reader == Reader::Online;
    match found.cause {
        Hypothesis::Offset if found.is_applied => format!(
            "It is identified together with the payload, whose intervals contain its uncertainty; \
             {} turns this off.",
            reader.choice("wrench_offset", "no")
        ),
        Hypothesis::Offset => format!(
            "Subtract it from the wrenches{before} (tare the sensor), or let {} identify it \
             together with the payload.",
            reader.choice("wrench_offset", "yes")
        ),
        Hypothesis::Weight => of_weight(found, reader),
        Hypothesis::Gravity => of_gravity(found, reader),
        Hypothesis::SensorPlace if is_place_out_of_reach(found) => format!(
            "No sensor is that far away: the moments are too large for the forces, as of points or \
             lever arms in millimetres. Give lengths in m and moments in N m{}.",
            if online {
                String::new()
            } else {
                format!(
                    "; of a table, {} states other units",
                    reader.option("columns")
                )
            }
        ),
        Hypothesis::SensorPlace | Hypothesis::SensorRotation if online => {
            "Check the link of the sensor.".to_owned()
        }
        Hypothesis::SensorPlace | Hypothesis::SensorRotation => format!(
            "Check how the sensor is mounted; {} states where it is.",
            reader.option("sensor_frame")
        ),
        Hypothesis::AxisGains => "Check the calibration and the units of the sensor.".to_owned(),
        Hypothesis::Delay if online => {
            "Push the wrenches with the motion of their time.".to_owned()
        }
        Hypothesis::Delay => format!("State it by {}.", reader.option("delay_s")),
        Hypothesis::JointZeros => {
            "Check the zeros of these joints, and that the URDF is that of this robot.".to_owned()
        }
        Hypothesis::Axes => of_axes(found, reader),
        Hypothesis::Saturation => {
            "Move more slowly, with less load, or with a sensor of a larger range.".to_owned()
        }
    }
}
