//! Findings about the load in words: its sign, what is not measured of it, and what the model does
//! not explain.

use tactid_dynamics::Reader;
use tactid_dynamics::words::{decimals_of, general, listed, percent};
use tactid_identify::Method;
use tactid_identify::checks::Saturation;

use super::{Finding, UnexplainedLoad};

/// Fraction of the load above which a residual is hardly ever friction.
const LARGEST_FRICTION: f64 = 0.7;

/// What a method measures of the payload.
fn load_of(method: Method) -> &'static str {
    match method {
        Method::Tactile => "wrench",
        Method::Effort => "effort",
        Method::JointSensing | Method::Combined { .. } => "load",
    }
}

pub(super) fn gravity(
    better: &[f64; 3],
    residual_ratio: f64,
    method: Method,
    reader: Reader,
) -> String {
    let what = if better.iter().any(|&entry| entry != 0.0) {
        "Another gravity"
    } else {
        "No gravity at all"
    };
    // Without the sign of zero.
    let [x, y, z] = better.map(|entry| general(entry + 0.0, 6));
    format!(
        "{what}, ({x}, {y}, {z}) m/s², explains the {} far better than the given one (with \
         this, residuals are {} of those without): check {} and the axes of the world.",
        load_of(method),
        percent(residual_ratio),
        reader.option("gravity")
    )
}

pub(super) fn negative_mass(method: Method, or_gravity: bool, reader: Reader) -> String {
    let gravity = || reader.option("gravity");
    if method == Method::Effort {
        // The torque of the links is in the efforts, so that a sign is only one cause.
        let mut sign = "the opposite sign of the effort".to_owned();
        if reader == Reader::Online {
            sign += " (negate `effort` before `push`)";
        } else if or_gravity {
            // With a calibration, where the sign of gravity is known, this option is refused.
            sign += &format!(" ({} with a minus sign)", reader.option("effort_gain"));
        }
        if or_gravity {
            sign += &format!(" or of gravity ({})", gravity());
            sign += &format!(
                ", motor currents whose gains are not given, efforts without the arm's own part ({})",
                reader.option("efforts_are")
            );
        }
        return format!(
            "The identified mass is negative. Possible causes are {sign}, another order of the \
             joints, and a body at or below the tip that the URDF has and the robot does not."
        );
    }
    let hint = if method == Method::Tactile {
        format!(" ({})", other_body(reader))
    } else {
        String::new()
    };
    let or_gravity = if or_gravity {
        format!(", or of gravity ({}),", gravity())
    } else {
        String::new()
    };
    format!(
        "The identified mass is negative: the opposite sign of the {}{hint}{or_gravity} would \
         explain the data.",
        load_of(method)
    )
}

/// Says by which option the wrenches act on the other body.
pub(super) fn other_body(reader: Reader) -> String {
    let sensor = reader.choice("wrench_acts_on", "sensor");
    format!("{sensor}, or payload where sensor is given")
}

pub(super) fn unexplained(load: &UnexplainedLoad, reader: Reader) -> String {
    let UnexplainedLoad {
        residual_rms,
        load_rms,
        noise_rms,
        ..
    } = *load;
    let what = match &load.joint {
        Some(joint) => format!("the effort of {joint}"),
        None => "the load".to_owned(),
    };
    // A channel that measures nothing at all has no load.
    let share = if load_rms == 0.0 {
        format!("{what}, which is zero")
    } else {
        format!("{:.0} % of {what}", 100.0 * residual_rms / load_rms)
    };
    let times = residual_rms / noise_rms.max(1e-300);
    let beyond = if times < 1e4 {
        format!("{times:.0} times the noise")
    } else {
        "far beyond the noise".to_owned()
    };
    let decimals = decimals_of(residual_rms);
    format!(
        "The model does not explain {share} (rms {residual_rms:.decimals$} of \
         {load_rms:.decimals$} {}, {beyond}), and the intervals do not contain this error. {}",
        load.unit,
        reason(load, reader)
    )
}

/// Returns the usual reasons of a load that is not explained.
fn reason(load: &UnexplainedLoad, reader: Reader) -> String {
    let text = match load.method {
        Method::Tactile => {
            "Check the frame of the sensor and how it is mounted, the tip, gravity and the pose of \
             the base, and the order, signs and units of the joints."
        }
        Method::JointSensing => {
            "Check the inertias of the links, the frame of the base's motion, and whether anything \
             outside acts on the robot."
        }
        Method::Combined { .. } => {
            "Identify from each source alone to see which one contradicts the model; with efforts, \
             friction in the joints is the usual reason."
        }
        Method::Effort if load.joint.is_some() => {
            "Check the order of the joints (two joints with large errors are often exchanged), \
             their signs and units, and that the calibration is of this robot. Friction that has \
             changed is usually smaller: warm the gears, or calibrate anew."
        }
        // Of a load of zero, too.
        Method::Effort if load.residual_rms > LARGEST_FRICTION * load.load_rms => {
            "Friction of a geared arm can be as large as its load. Calibrate the arm with a \
             recording without payload (`tactid calibrate`), which finds friction and corrects the \
             links. If that does not help, check the order of the joints, their signs and units, \
             and the gains of the efforts."
        }
        Method::Effort if load.has_unloaded => {
            "The unloaded recording does not remove it: check that both recordings have the same \
             speed and temperature, and the gains of the efforts."
        }
        Method::Effort => {
            let remedy = match reader {
                Reader::Online => {
                    "subtract the efforts of the same motion without the payload before `push`"
                        .to_owned()
                }
                _ => format!(
                    "use {}, a recording of the same motion without the payload",
                    reader.option("unloaded")
                ),
            };
            return format!(
                "Friction in the joints is the usual reason, then wrong inertias of the links or \
                 gains of the efforts: {remedy}."
            );
        }
    };
    text.to_owned()
}

/// Says which channels never change, and whether they are left out.
pub(super) fn constant_channels(finding: &Finding, reader: Reader) -> String {
    let Finding::ConstantChannels {
        source,
        frame,
        channels,
        is_zero,
        is_left_out,
        without_moments,
        since_s,
        ..
    } = finding
    else {
        return String::new();
    };
    if let Some(since_s) = since_s {
        return format!(
            "{source}: the wrench in `{frame}` is exactly constant from {since_s:.3} s on, although \
             the joints move: the sensor, or its driver, has stopped. Leave out what follows ({}).",
            reader.option("end_s")
        );
    }
    if *is_left_out {
        let were = if channels.len() > 1 { "were" } else { "was" };
        let when = if *is_zero {
            "in all samples"
        } else {
            "in the beginning, but not later"
        };
        return format!(
            "{source}: {} in `{frame}` measured nothing (zero, or no number, {when}), and {were} \
             left out{}.",
            listed(channels),
            if *without_moments {
                ", and all other moments with them, because those about the tip are not known"
            } else {
                ""
            }
        );
    }
    let value = if *is_zero { "zero" } else { "constant" };
    let (are, them) = if channels.len() > 1 {
        ("are", "them")
    } else {
        ("is", "it")
    };
    format!(
        "{source}: {} in `{frame}` {are} exactly {value} in all samples, as of a sensor that does \
         not measure {them}. The estimate takes {them} for measured.",
        listed(channels)
    )
}

/// Says which joints have efforts that nobody measured.
pub(super) fn efforts_unmeasured(source: &str, joints: &[String], reader: Reader) -> String {
    let (efforts, they, them) = if joints.len() > 1 {
        ("efforts", "are", "them")
    } else {
        ("effort", "is", "it")
    };
    let instead = match reader {
        Reader::Online => String::new(),
        _ => format!(", or identify from wrenches ({})", reader.option("method")),
    };
    format!(
        "{source}: the {efforts} of {} (`effort`) {they} exactly zero in all samples of a motion, \
         as of a driver that does not measure {them}. The estimate takes {them} for measured: \
         record the efforts of all joints that move the tip{instead}.",
        listed(joints)
    )
}

/// Says which channels are at a limit, and how often.
pub(super) fn saturated(source: &str, saturation: &Saturation) -> String {
    let Saturation {
        channels,
        limits,
        fractions,
    } = saturation;
    let each = channels.iter().zip(limits).zip(fractions);
    let each: Vec<String> = each
        .map(|((channel, limit), fraction)| {
            let (limit, share) = (general(*limit, 4), percent(*fraction));
            let at_limit = match channel.split_once(' ') {
                Some(("force", _)) => format!("{channel} at {limit} N"),
                Some(("moment", _)) => format!("{channel} at {limit} N m"),
                _ => format!("the effort of {channel} at {limit}"),
            };
            format!("{at_limit} in {share}")
        })
        .collect();
    format!(
        "{source} is saturated: {} of the samples, and never beyond, while others change. What \
         exceeds the range of a sensor or a drive is not measured, and the values may be wrong by \
         more than their intervals: move more slowly, with less load, or with a larger range.",
        listed(&each)
    )
}
