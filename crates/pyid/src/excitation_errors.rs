//! From the errors of a design to Python's, which name the keywords of `tactid.design_excitation`.

use pyo3::prelude::*;
use tactid_excitation::{ExcitationError as Error, Limit, UntestedLinks};

use crate::errors::{ArgumentError, ExcitationError, IntoPyErr, ModelError, option_error};

impl IntoPyErr for Error {
    fn into_py_err(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::Model(error) => error.into_py_err(),
            Self::State(error) => error.into_py_err(),
            Self::Identify(error) => error.into_py_err(),
            Self::Value {
                name,
                given,
                expected,
            } => value_error(&name, given, &expected),
            Self::Option { name, reason } => option_error(reason, name),
            Self::FixedBase => option_error(
                "`base_attitude` bounds the motion of the base, but the base is fixed".to_owned(),
                "base_attitude",
            ),
            Self::NoVelocityLimit { joint } => ModelError::new_err(format!(
                "the URDF has no positive velocity limit for joint {joint}: add one to its <limit>"
            )),
            Self::UnknownNoise { channel } => option_error(
                format!(
                    "the noise of {channel} is unknown, so that no interval can be predicted: give `base_noise`"
                ),
                "base_noise",
            ),
            Self::TooFewSamples { .. } => ExcitationError::new_err((
                format!("{message}: raise `sample_rate`, or lower the cutoff"),
                "sample_rate",
            )),
            Self::NoMovingJoint { tool } => option_error(
                format!(
                    "`tip` is {tool}, which no joint moves: expected a link at the end of the arm"
                ),
                "tip",
            ),
            Self::Untested(links) => ExcitationError::new_err((untested(&links), "collisions")),
            Self::TooShort { .. } => with_remedy(&message, ("duration", "`duration` sets it")),
            Self::Impossible { limit, .. } => with_remedy(&message, remedy(&limit)),
            Self::OutOfReach {
                binding: Some(limit),
                ..
            } => with_remedy(&message, remedy(&limit)),
            _ => ExcitationError::new_err(message),
        }
    }
}

/// Says which links are not tested for collisions, and what to do.
fn untested(links: &UntestedLinks) -> String {
    let remedy = if links.0.is_empty() {
        "give a URDF with collision shapes"
    } else {
        "put the meshes, as STL or OBJ files, where the URDF names them (for package://, ROS_PACKAGE_PATH may name the \
         folder that contains the package)"
    };
    format!(
        "{links}; {remedy}, or accept a motion that may run the robot through itself with `collisions=False`"
    )
}

/// Adds the keyword that relaxes the limit or the duration which makes a motion impossible, and what it does.
fn with_remedy(message: &str, (keyword, does): (&'static str, &'static str)) -> PyErr {
    ExcitationError::new_err((format!("{message}; {does}"), keyword))
}

/// Returns the keyword that relaxes a limit, or the load on it where the URDF alone sets it, with what to do.
fn remedy(limit: &Limit) -> (&'static str, &'static str) {
    match limit {
        Limit::Position(_) => ("start", "the URDF sets it: begin elsewhere (`start`)"),
        Limit::Velocity(_) => ("limit_scale", "the URDF and `limit_scale` set it"),
        Limit::Acceleration(_) => ("acceleration", "`acceleration` sets it"),
        Limit::Effort(_) => (
            "start",
            "the URDF sets it: begin where less torque holds the payload (`start`), or expect a lighter one",
        ),
        Limit::Wrench(_) => ("wrench_limit", "`wrench_limit` sets it"),
        Limit::Grip(_) => ("grip", "`grip` sets it"),
        Limit::BaseAttitude => ("base_attitude", "`base_attitude` sets it"),
        Limit::BasePosition => ("base_position", "`base_position` sets it"),
        Limit::Workspace(..) => ("workspace", "`workspace` sets it"),
        Limit::Distance(_, second) if second.starts_with("the keep-out box") => (
            "keep_out",
            "`keep_out` gives the box; a start elsewhere may be farther from it",
        ),
        Limit::Distance(_, second) if second == "the payload" => (
            "payload_box",
            "`payload_box` gives the box; a start elsewhere may keep it free",
        ),
        Limit::Distance(..) => (
            "least_distance",
            "`least_distance` sets it; a start elsewhere may keep it",
        ),
    }
}

/// An error of a number that is out of range, with the keyword that gives it.
fn value_error(field: &str, given: f64, expected: &str) -> PyErr {
    let name = match field.split(['.', '[']).next().unwrap_or(field) {
        "start" => "start",
        "duration_s" => "duration",
        "rate_hz" => "sample_rate",
        "base_noise" => "base_noise",
        "longest_s" => "longest",
        "wrench" => "wrench_limit",
        "grip" => "grip",
        "payloads" => "payload",
        "payload_box" => "payload_box",
        "workspace" if field.contains("keep_out") => "keep_out",
        "workspace" => "workspace",
        "base" if field.ends_with("position_m") => "base_position",
        "base" => "base_attitude",
        "limits" if field.contains("acceleration") => "acceleration",
        "limits" if field.contains("velocity") => "limit_scale",
        _ => return ArgumentError::new_err(format!("{field} is {given}: expected {expected}")),
    };
    // The place within a keyword that takes several numbers, such as `[2] (joint_3)` or `.friction`.
    let place = field.find(['.', '[']).map_or("", |at| &field[at..]);
    option_error(
        format!("`{name}`: {place} is {given}; expected {expected}").replace(":  is", " is"),
        name,
    )
}
