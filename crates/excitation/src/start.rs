//! The posture at the beginning of a motion, as a request gives it.

use std::collections::BTreeMap;

use serde::Deserialize;
use tactid_dynamics::words::{abridged, general};
use tactid_dynamics::{JointKind, Manipulator};
use tactid_options::{Kind, Value, read_as};

use crate::ExcitationError;

/// By how much a position may be beyond its limit, rad or m: a start may be given with as many
/// digits as the URDF has for its limits.
const ROUNDING: f64 = 1e-9;

/// Positions of joints at the beginning of a motion, rad or m.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Start {
    /// One for each joint, or one for each joint that moves the tip.
    Positions(Vec<f64>),
    /// Positions of some joints, by their names; the others have the default.
    Named(BTreeMap<String, f64>),
}

impl Value for Start {
    read_as!(Kind::Posture, Self);
}

/// Returns the positions of all joints at the beginning. Default: zero, or the middle of a range
/// that excludes it.
///
/// # Errors
/// Returns [`ExcitationError::Option`] for a joint that does not exist, another number of
/// positions, a position beyond its limits, or a tip that no joint moves, and
/// [`ExcitationError::Identify`] if the robot has no such tip.
pub(crate) fn posture(
    given: Option<&Start>,
    robot: &Manipulator,
    tip: &str,
) -> Result<Vec<f64>, ExcitationError> {
    let (all, tip_frame) = (0..robot.dof(), robot.frame(tip)?);
    let moving: Vec<usize> = all.clone().filter(|&k| robot.moves(k, tip_frame)).collect();
    if moving.is_empty() {
        return Err(ExcitationError::unmoved(tip));
    }
    let rest = |joint| match robot.joint_limits(joint) {
        Some((low, high)) if low > 0.0 || high < 0.0 => 0.5 * (low + high),
        _ => 0.0,
    };
    let mut start: Vec<f64> = all.map(rest).collect();
    match given {
        None => return Ok(start),
        Some(Start::Named(named)) => {
            for (name, position) in named {
                let joint = robot.joint_index(name).ok_or_else(|| {
                    let joints = abridged(robot.joint_names());
                    error(format!("`start` has {name}, but the joints are {joints}"))
                })?;
                start[joint] = *position;
            }
        }
        Some(Start::Positions(positions)) => {
            if positions.len() == moving.len() {
                for (joint, position) in moving.into_iter().zip(positions) {
                    start[joint] = *position;
                }
            } else if positions.len() == start.len() {
                start.copy_from_slice(positions);
            } else {
                return Err(wrong_count(positions.len(), moving.len(), start.len(), tip));
            }
        }
    }
    for (joint, &position) in start.iter().enumerate() {
        check_limits(robot, joint, position)?;
    }
    Ok(start)
}

fn wrong_count(given: usize, moving: usize, dof: usize, tip: &str) -> ExcitationError {
    let every = if moving == dof {
        String::new()
    } else {
        format!(", or {dof}, one for each joint")
    };
    error(format!(
        "`start` has {given} positions: expected {moving}, one for each joint that moves {tip}{every}"
    ))
}

/// Checks that a position is within the limits of its joint, and recognises degrees.
fn check_limits(robot: &Manipulator, joint: usize, position: f64) -> Result<(), ExcitationError> {
    let Some((low, high)) = robot.joint_limits(joint) else {
        return Ok(());
    };
    let is_within = (low - ROUNDING..=high + ROUNDING).contains(&position);
    if is_within || !position.is_finite() {
        return Ok(());
    }
    let is_angle = robot.joint_kind(joint) != Some(JointKind::Prismatic);
    let unit = if is_angle { "rad" } else { "m" };
    let radians = position.to_radians();
    let [shown, low_shown, high_shown] = [position, low, high].map(|each| general(each, 6));
    let degrees = if is_angle && (low..=high).contains(&radians) {
        format!("; {shown}° would be {} rad", general(radians, 4))
    } else {
        String::new()
    };
    let name = &robot.joint_names()[joint];
    Err(error(format!(
        "`start`: the position of {name} is {shown} {unit}, outside of its limits of {low_shown} to {high_shown} \
         {unit}{degrees}"
    )))
}

fn error(what: String) -> ExcitationError {
    ExcitationError::Option {
        option: "start",
        what,
    }
}
