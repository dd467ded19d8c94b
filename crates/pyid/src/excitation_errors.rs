//! From the errors of a design to Python's, which name the keywords of `tactid.design_excitation`.

use pyo3::prelude::*;
use tactid_excitation::{ExcitationError as Error, Limit};

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
                    "`tip` is {tool}, which no joint of the robot moves: expected a link at the end of the arm"
                ),
                "tip",
            ),
            Self::TooShort { .. } => with_remedy(&message, Some("duration")),
            Self::Impossible { limit, .. } => with_remedy(&message, keyword_of_limit(&limit)),
            Self::OutOfReach { binding, .. } => {
                with_remedy(&message, binding.as_ref().and_then(keyword_of_limit))
            }
            _ => ExcitationError::new_err(message),
        }
    }
}

/// Adds the keyword that relaxes the limit or the duration which makes a motion impossible.
fn with_remedy(message: &str, keyword: Option<&'static str>) -> PyErr {
    match keyword {
        Some(name) => ExcitationError::new_err((format!("{message}; `{name}` sets it"), name)),
        None => ExcitationError::new_err(message.to_owned()),
    }
}

/// Returns the keyword that sets a limit; `None` for those of the URDF alone.
fn keyword_of_limit(limit: &Limit) -> Option<&'static str> {
    match limit {
        Limit::Position(_) => Some("start"),
        Limit::Velocity(_) => Some("speed"),
        Limit::Acceleration(_) => Some("acceleration"),
        Limit::Wrench(_) => Some("wrench_limit"),
        Limit::Grip(_) => Some("grip"),
        Limit::BaseAttitude => Some("base_attitude"),
        Limit::BasePosition => Some("base_position"),
        Limit::Workspace(..) => Some("workspace"),
        Limit::Distance(_, second) if second.starts_with("the keep-out box") => Some("keep_out"),
        Limit::Distance(_, second) if second == "the payload" => Some("payload_box"),
        Limit::Distance(..) => Some("least_distance"),
        _ => None,
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
        "least_distance_m" => "least_distance",
        "base" if field.ends_with("position_m") => "base_position",
        "base" => "base_attitude",
        "limits" if field.contains("acceleration") => "acceleration",
        "limits" if field.contains("velocity") => "speed",
        _ => return ArgumentError::new_err(format!("{field} is {given}: expected {expected}")),
    };
    // The place within a keyword that takes several numbers, such as `[2] (joint_3)` or `.friction`.
    let place = field.find(['.', '[']).map_or("", |at| &field[at..]);
    option_error(
        format!("`{name}`: {place} is {given}; expected {expected}").replace(":  is", " is"),
        name,
    )
}
