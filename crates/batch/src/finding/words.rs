//! The findings of an identification in words.

use std::fmt;

use tactid_dynamics::words::{at_most, counted, general, listed, with_interval};
use tactid_dynamics::{Notice, Reader};
use tactid_identify::Sampling;
use tactid_identify::checks::{
    EffortsBeyondLimits, PositionJumps, PositionsBeyondLimits, TwistAxes, TwistContradiction,
    VelocityCause, VelocityContradiction,
};

use super::Finding;
use super::assumption_words::wrong_assumption;
use super::load_words::{
    constant_channels, efforts_unmeasured, gravity, negative_mass, saturated, unexplained,
};
use super::run_words::runs_disagree;

/// Ratio of a given mass to that of the data from which to which it looks like grams.
const THOUSAND: std::ops::Range<f64> = 500.0..2000.0;

/// Says what was noticed, with options as the reader would write them.
pub(super) fn sentences(finding: &Finding, reader: Reader) -> String {
    match finding {
        Finding::VelocitiesContradicted(found) => velocities(found),
        Finding::PositionsBeyondLimits(beyond) => positions(beyond),
        Finding::EffortsBeyondLimits(beyond) => efforts(beyond, reader),
        Finding::TwistContradicted {
            source,
            contradiction,
        } => twist(source, contradiction),
        Finding::EffortsUnmeasured { source, joints } => efforts_unmeasured(source, joints, reader),
        Finding::Saturated { source, saturation } => saturated(source, saturation),
        Finding::ConstantChannels { .. } => constant_channels(finding, reader),
        Finding::AnglesContinued { joints, count } => format!(
            "The positions of {} start again after a turn, {}: they were continued.",
            listed(joints),
            counted(*count as usize, "time")
        ),
        Finding::PositionsJump(jumps) => jump(jumps, reader),
        Finding::NoEquations(sampling) => no_equations(sampling, reader),
        Finding::GravityContradicted {
            better,
            residual_ratio,
            method,
        } => gravity(better, *residual_ratio, *method, reader),
        Finding::TooFewWindows {
            windows,
            least_windows,
        } => format!(
            "The residuals exceed the noise, and the recording is too short to show whether the model or the noise is \
             wrong: it fills {}, and {least_windows} can show it. Do not use the values; record a longer motion.",
            counted(*windows, "window")
        ),
        Finding::WrongAssumption(found) => wrong_assumption(found, reader),
        Finding::LoadUnexplained(load) => unexplained(load, reader),
        Finding::NothingHeld { .. }
        | Finding::NegativeMass { .. }
        | Finding::KnownBodiesTooHeavy { .. }
        | Finding::MassContradicted { .. }
        | Finding::KnownMassNotKept { .. } => finding.of_mass(reader),
        Finding::Inconsistent {
            distance,
            within_box,
        } => inconsistent(*distance, *within_box, reader),
        Finding::RunsDisagree(found) => runs_disagree(found),
        Finding::OtherLoad(found) => found.words(),
        Finding::Outliers { outliers, windows } => outlying_windows(*outliers, *windows),
        Finding::PosesAtRest(_)
        | Finding::OutlyingPose(_)
        | Finding::CenterFarAway(_)
        | Finding::TooFewPoses { .. }
        | Finding::ConsistsOfRests(_)
        | Finding::WeightOrOffset { .. } => finding.of_rests(reader),
        Finding::Model(finding) => finding.words(reader),
    }
}

impl Finding {
    /// States wrenches with the opposite sign, that of wrenches which act on the sensor.
    pub fn negate_wrenches(&mut self) {
        if let Self::WrongAssumption(found) = self {
            found.negate_wrenches();
        }
    }

    /// Says what was noticed about the mass; nothing for other findings.
    fn of_mass(&self, reader: Reader) -> String {
        match self {
            Self::NothingHeld {
                mass_kg,
                std_dev_kg,
            } => format!(
                "Nothing is held, or too little for this recording: the mass is {} kg. If \
                 something is, check the units of the load and the order of its channels.",
                with_interval(*mass_kg, *std_dev_kg)
            ),
            Self::NegativeMass { method, or_gravity } => {
                negative_mass(*method, *or_gravity, reader)
            }
            Self::KnownBodiesTooHeavy {
                known_bodies_kg,
                load_kg,
            } => too_heavy(*known_bodies_kg, *load_kg, reader),
            Self::MassContradicted {
                known_mass_kg,
                found_kg,
                std_dev_kg,
                distance,
                ..
            } => format!(
                "The given mass is {} kg, but the data alone give {} kg, {} standard deviations \
                 away: check the given mass, which is in kg{}, gravity, and the gains and offsets \
                 of the sensors.",
                general(*known_mass_kg, 6),
                with_interval(*found_kg, *std_dev_kg),
                at_most(*distance, 1),
                as_grams(*known_mass_kg, *found_kg)
            ),
            Self::KnownMassNotKept {
                known_mass_kg,
                estimated_kg,
                within_box,
                ..
            } => format!(
                "The given mass is {} kg, but the result has {} kg: no physically consistent body \
                 of the given mass{} explains the data.",
                general(*known_mass_kg, 6),
                general(*estimated_kg, 4),
                if *within_box { " within the box" } else { "" }
            ),
            _ => String::new(),
        }
    }
}

fn too_heavy(known_bodies_kg: f64, load_kg: f64, reader: Reader) -> String {
    // Online there is no known tool.
    let tool = match reader {
        Reader::Online => String::new(),
        _ => format!(" the mass of {},", reader.option("known_tool")),
    };
    format!(
        "The known bodies weigh {} kg, but the whole load only {} kg: check{tool} the links below \
         the tip in the URDF, and the gains of the sensors.",
        general(known_bodies_kg, 4),
        general(load_kg, 4)
    )
}

fn outlying_windows(outliers: usize, windows: usize) -> String {
    let (are, them, have) = match outliers {
        1 => ("is an outlier", "it", "has"),
        _ => ("are outliers", "them", "have"),
    };
    format!(
        "{outliers} of {} {are}, as an impact causes {them}, and {have} next to no weight.",
        counted(windows, "window")
    )
}

impl fmt::Display for Finding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.words(Reader::Rust))
    }
}

fn velocities(found: &VelocityContradiction) -> String {
    if !found.are_measured() {
        return format!(
            "The velocities of {} are exactly zero at the beginning of the recording, although these \
             joints move: they are not measured, and those of all joints were derived from the \
             positions.",
            listed(&found.joints)
        );
    }
    let cause = match (found.cause, &found.other) {
        (Some(VelocityCause::OppositeSign), _) => "They have the opposite sign.".to_owned(),
        (Some(VelocityCause::Degrees), _) => {
            "They are in degrees per second, but must be in rad/s.".to_owned()
        }
        (Some(VelocityCause::PositionsInDegrees), _) => {
            "The positions are in degrees, but must be in rad.".to_owned()
        }
        (Some(VelocityCause::OtherJoint), Some(other)) => {
            format!("They are those of {other}: check the order of the joints.")
        }
        (Some(VelocityCause::OtherJoint | VelocityCause::NotMeasured) | None, _) => {
            "Check their units and signs, and the order of the joints.".to_owned()
        }
    };
    format!(
        "The velocities of {} are not the derivatives of the positions (rms difference {:.0} % of \
         the motion). {cause}",
        listed(&found.joints),
        100.0 * found.relative_difference
    )
}

fn positions(beyond: &PositionsBeyondLimits) -> String {
    let advice = if beyond.are_degrees {
        "They are in degrees, but must be in rad (and the velocities in rad/s)."
    } else {
        "Check their units, the order of the joints, and that the URDF is that of this robot."
    };
    format!(
        "The positions of {} are beyond the limits of the URDF: {} reaches {}, and its limits are \
         {} and {}. {advice}",
        listed(&beyond.joints),
        first(&beyond.joints),
        general(beyond.position, 4),
        general(beyond.lower, 4),
        general(beyond.upper, 4)
    )
}

fn jump(jumps: &PositionJumps, reader: Reader) -> String {
    let PositionJumps {
        source,
        joints,
        count,
        samples,
        time_s,
        change,
        duration_s,
    } = jumps;
    let first = format!(
        "that of {} by {} within {} ms at {time_s:.3} s",
        first(joints),
        general(*change, 3),
        general(1e3 * duration_s, 3)
    );
    if !jumps.are_of_two_sources() {
        return format!(
            "The positions of {} jump faster than any joint moves ({first}): check what the \
             recording contains at this time.",
            listed(joints)
        );
    }
    let cause = match reader {
        Reader::Online => "two sources are mixed in them: push those of one robot alone".to_owned(),
        _ if source.starts_with('/') => format!(
            "two publishers write to {source}. Record that of the robot's driver alone, and stop \
             the other one, such as a joint_state_publisher"
        ),
        _ => format!("the samples of two sources are mixed in `{source}`: give those of one alone"),
    };
    format!(
        "The positions of {} jump {count} times in {samples} samples, faster than any joint moves \
         ({first}): {cause}.",
        listed(joints)
    )
}

fn efforts(beyond: &EffortsBeyondLimits, reader: Reader) -> String {
    let placeholders = if beyond.limits_are_equal {
        " The limits of the URDF are all the same, and may be placeholders."
    } else {
        ""
    };
    let gains = match reader {
        Reader::Online => String::new(),
        _ => format!(" ({})", reader.option("effort_gain")),
    };
    format!(
        "The efforts of {} are far beyond the limits of the URDF: that of {} is {} on average, and \
         its limit is {}. They must be torques in N m, or forces in N: check their unit and the \
         gains{gains}.{placeholders}",
        listed(&beyond.joints),
        first(&beyond.joints),
        general(beyond.effort, 4),
        general(beyond.limit, 4)
    )
}

fn first(names: &[String]) -> &str {
    names.first().map_or("", String::as_str)
}

fn twist(source: &str, found: &TwistContradiction) -> String {
    let cause = match found.better_axes {
        Some(TwistAxes::Body) => {
            "It is in the axes of the moving body, but must be in those of the world; or the \
             quaternion of the pose is not in the order x, y, z, w."
        }
        Some(TwistAxes::World) => {
            "It is in the axes of the world, but the twist of an odometry message must be in those \
             of its child frame."
        }
        None => "Check its units, signs and axes; it may also be zero because it is not measured.",
    };
    format!(
        "{source}: the twist is not the derivative of the pose (rms difference {:.0} % of the \
         motion). {cause}",
        100.0 * found.relative_difference
    )
}

fn no_equations(sampling: &Sampling, reader: Reader) -> String {
    let nothing = "Nothing is known of the payload";
    let Sampling {
        samples,
        rejected,
        gaps,
        max_gap_s,
        period_s,
        window_s,
        min_samples,
    } = *sampling;
    if rejected > samples {
        return format!(
            "{nothing}: {rejected} of {} samples were rejected, because a value is not finite or \
             their time is not later than the one before.",
            samples + rejected
        );
    }
    if 2 * gaps > samples {
        return format!(
            "{nothing}: of {samples} samples, {gaps} came more than {} s after the one before, and \
             {} bridges no more. Times must be in seconds.",
            general(max_gap_s, 6),
            reader.option("max_gap_s")
        );
    }
    let window = general(window_s, 3);
    if window_s < f64::from(min_samples) * period_s {
        return format!(
            "{nothing}: there is a sample every {} ms, which is too slow for the cutoff. A window \
             of {window} s needs at least {min_samples} samples: push samples at a higher rate, or \
             lower {}.",
            general(1e3 * period_s, 3),
            reader.option("cutoff_hz")
        );
    }
    format!("{nothing} after {samples} samples: the first window of {window} s is not complete.")
}

/// Says that a given mass looks like one in grams.
fn as_grams(known_mass_kg: f64, found_kg: f64) -> String {
    if THOUSAND.start * found_kg < known_mass_kg && known_mass_kg < THOUSAND.end * found_kg {
        format!(
            " (as grams it would be {} kg)",
            general(known_mass_kg / 1000.0, 6)
        )
    } else {
        String::new()
    }
}

fn inconsistent(distance: f64, within_box: bool, reader: Reader) -> String {
    let (within, the_box) = if within_box {
        (" within the box", ", the box")
    } else {
        ("", "")
    };
    let widened = match reader {
        Reader::Online => "",
        _ => ", and the intervals are widened until it is plausible",
    };
    format!(
        "No physically consistent body{within} explains the data within their noise. The result is \
         the nearest one, {} standard deviations away{widened}: check the frames{the_box}, gravity, \
         the offsets of the sensors, the known tool if one is given ({}), and whether a controller \
         subtracts a payload from the wrenches ({}).",
        at_most(distance, 1),
        reader.option("known_tool"),
        reader.option("wrench_is")
    )
}

#[cfg(test)]
mod tests {
    use tactid_dynamics::Severity;

    use super::*;
    use crate::finding::{CHANNELS, Hypothesis, WrongAssumption};
    use tactid_identify::Method;

    /// A caller of the crate reads a sentence with the names of fields, and a user of the command
    /// one with flags.
    #[test]
    fn a_finding_is_a_sentence_for_its_reader() {
        let finding = Finding::NegativeMass {
            method: Method::Tactile,
            or_gravity: true,
        };
        assert_eq!(
            finding.to_string(),
            "The identified mass is negative: the opposite sign of the wrench \
             (`wrench_acts_on` (sensor), or payload where sensor is given), or of gravity \
             (`gravity`), would explain the data."
        );
        assert!(
            finding
                .words(Reader::CommandLine)
                .contains("(`--wrench-acts-on sensor`, ")
        );
        assert_eq!(finding.severity(), Severity::Contradicts);
    }

    /// A wrong assumption contradicts where it certainly changes the mass or the centre of mass by
    /// much, or a value by more than its interval, and one that is taken into account is a note.
    #[test]
    fn a_certain_and_large_change_contradicts() {
        for (mass_change, shift_m, value_change, is_applied, expected) in [
            (0.6, 0.0, 0.9, false, Severity::Contradicts),
            (0.04, 0.0, 0.9, false, Severity::Doubts),
            (0.04, 0.0, 1.1, false, Severity::Contradicts),
            (0.0, 0.012, 0.9, false, Severity::Contradicts),
            (0.0, 0.008, 0.9, false, Severity::Doubts),
            (0.6, 0.012, 1.1, true, Severity::Notes),
        ] {
            let finding = Finding::WrongAssumption(WrongAssumption {
                cause: Hypothesis::Offset,
                runner_up: None,
                names: CHANNELS.map(str::to_owned).to_vec(),
                values: vec![12.0, 0.0, 0.0, 0.1, 0.0, 0.0],
                std_devs: vec![0.1; 6],
                assumed: vec![0.0; 6],
                frame: "tool0".into(),
                along_m_s2: None,
                residual_ratio: 0.1,
                mass_kg: 2.0,
                mass_std_dev_kg: 0.01,
                mass_change,
                shift_m,
                value_change,
                is_applied,
            });
            assert_eq!(finding.severity(), expected, "{mass_change} {shift_m}");
        }
    }
}
