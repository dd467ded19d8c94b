//! Whether a robot can rest where a motion starts and ends.

use tactid_identify::equations::window;

use crate::ExcitationError;
use crate::cones::cones;
use crate::dense::DenseMotion;
use crate::joint_rows::ROUNDING;
use crate::limits::{Limit, Margin};
use crate::motion::JointStates;
use crate::plant::Plant;
use crate::problem::Problem;
use crate::variables::End;

/// Checks that the robot can rest at both ends of the motion, and that it is long enough.
pub(crate) fn check_rest(
    problem: &Problem,
    plant: &mut Plant,
    joints: &[usize],
) -> Result<(), ExcitationError> {
    let window_s = window::length_s(problem.sensing.equations.cutoff_hz);
    if problem.duration_s <= window_s {
        return Err(ExcitationError::TooShort {
            duration_s: problem.duration_s,
            window_s,
        });
    }
    let mut places = vec![("at the start", &problem.start)];
    if let End::At(end) = &problem.end {
        places.push(("at the end", end));
    }
    for (at, posture) in places {
        let exceeded = exceeded(problem, plant, joints, posture)?
            .into_iter()
            .next();
        if let Some(Margin { limit, used, .. }) = exceeded {
            return Err(ExcitationError::Impossible { limit, used, at });
        }
    }
    Ok(())
}

/// Checks that tool and bodies may be where they start. Other limits depend on the payload.
pub(crate) fn check_places(problem: &Problem, joints: &[usize]) -> Result<(), ExcitationError> {
    let mut plant = Plant::new(problem)?;
    let exceeded = exceeded(problem, &mut plant, joints, &problem.start)?;
    let is_place = |limit: &Limit| matches!(limit, Limit::Workspace(..) | Limit::Distance(..));
    let of_place = exceeded.into_iter().find(|margin| is_place(&margin.limit));
    match of_place {
        Some(Margin { limit, used, .. }) => {
            let at = "at the start";
            Err(ExcitationError::Impossible { limit, used, at })
        }
        None => Ok(()),
    }
}

/// Returns the margins of the limits that a robot at rest exceeds.
fn exceeded(
    problem: &Problem,
    plant: &mut Plant,
    joints: &[usize],
    posture: &[f64],
) -> Result<Vec<Margin>, ExcitationError> {
    let cones = cones(problem, plant);
    let dense = DenseMotion::of_states(plant, vec![JointStates::at_rest(posture)], 0.0)?;
    let mut margins = dense.margins(problem, &cones, joints);
    margins.retain(|margin| margin.used > 1.0 + ROUNDING);
    Ok(margins)
}
