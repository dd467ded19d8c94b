//! Whether a robot can rest where a motion starts and ends.

use tactid_identify::equations::window;

use crate::ExcitationError;
use crate::cones::cones;
use crate::dense::DenseMotion;
use crate::joint_rows::ROUNDING;
use crate::limits::Margin;
use crate::motion::JointStates;
use crate::plant::Plant;
use crate::problem::Problem;
use crate::variables::End;

/// Checks that the robot can rest where the motion starts and ends, and that the motion is long enough.
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
    let cones = cones(problem, plant);
    for (at, posture) in places {
        let dense = DenseMotion::of_states(plant, vec![JointStates::at_rest(posture)], 0.0)?;
        let margins = dense.margins(problem, &cones, joints);
        let exceeded = margins
            .into_iter()
            .find(|margin| margin.used > 1.0 + ROUNDING);
        if let Some(Margin { limit, used, .. }) = exceeded {
            return Err(ExcitationError::Impossible { limit, used, at });
        }
    }
    Ok(())
}
