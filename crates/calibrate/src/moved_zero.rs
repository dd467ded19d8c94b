//! A joint with a zero that has moved since the calibration, as the identification's efforts show.
//!
//! A moved zero changes the torques of the links, which payload, friction and gains partly absorb.
//! Each zero is therefore one more unknown beside every change of the arm that is compared, and the
//! best solution with it is compared with the best one without. It also counts only where it is far
//! from zero by its own standard deviation: efforts have errors that noise does not describe.

use std::ops::RangeInclusive;

use tactid_batch::distributions::f_p;

use super::change::Changes;
use super::contradiction::{Assumption, Contradiction, column_of_zero, sums};
use super::noise::EffortNoise;
use super::rows::Unknowns;
use super::solver::Problem;
use super::student::{DEGREES_OF_FREEDOM, WIDENING};

/// Prior standard deviation of a zero that has moved, rad: 3 degrees, a zero that was set by eye.
const ZERO_STD_DEV_RAD: f64 = 0.05;

/// Logarithm of the odds from which on a zero counts as moved, with equal odds for each joint: 150
/// times as probable as none.
const MIN_EVIDENCE: f64 = 5.0;

/// Probability of the size by chance below which it counts, as for a calibration's assumptions.
const PROBABILITY: f64 = 1e-3;

/// Angles that count, rad. A larger one is three times the prior standard deviation, and has
/// another cause, which the zero of some joint explains in part: with an unloaded recording of
/// another robot, or a wrong mass, it comes out as 0.16 to 0.19 rad.
const ANGLES_RAD: RangeInclusive<f64> = 0.005..=3.0 * ZERO_STD_DEV_RAD;

/// A zero as one more unknown of a solution.
#[derive(Clone, Copy)]
struct Found {
    joint: usize,
    log_evidence: f64,
    size: f64,
    variance: f64,
}

/// Returns the zero that explains the efforts best in place of a change of the arm, if they show
/// that one has moved. `at` are the unknowns about which the problem is linearised. `None` where
/// the recordings lack the derivatives with respect to zeros.
pub(crate) fn moved_zero(
    problem: &Problem<'_>,
    at: &Unknowns,
    noise: &[EffortNoise],
    changes: &Changes,
) -> Option<Contradiction> {
    let arm = &problem.blocks.first()?.recording.arm;
    let lacks_slopes = problem
        .blocks
        .iter()
        .any(|block| block.recording.arm.slopes == 0);
    if lacks_slopes {
        return None;
    }
    let sums = sums(problem, at, noise);
    let scores = sums.scores.column_sum();
    let data = problem.data_equations(at, noise);
    let mut without = f64::NEG_INFINITY;
    let mut best: Option<Found> = None;
    let revolute: Vec<usize> = (0..arm.joints.len())
        .filter(|&joint| arm.units[joint] == "N m")
        .collect();
    for (solution, _) in changes.solutions(problem, at, &data) {
        without = without.max(solution.log_evidence);
        for &joint in &revolute {
            let column = column_of_zero(joint);
            let coupling = sums.coupling.row(column).transpose();
            let absorbed = coupling.dot(&solution.factor.solve(&coupling));
            let information = sums.information[(column, column)] - absorbed;
            let precision = information + ZERO_STD_DEV_RAD.powi(-2);
            let score = scores[column] - coupling.dot(&solution.step);
            let ratio = ZERO_STD_DEV_RAD.powi(2) * precision;
            let found = Found {
                joint,
                log_evidence: solution.log_evidence
                    + 0.5 * (score.powi(2) / precision - ratio.ln()),
                size: score / precision,
                variance: 1.0 / precision,
            };
            // NaN is never more.
            if best.is_none_or(|best| found.log_evidence > best.log_evidence) {
                best = Some(found);
            }
        }
    }
    let best = best?;
    let evidence = best.log_evidence - without - (revolute.len() as f64).ln();
    let squares = best.size.powi(2) / best.variance;
    let probability = f_p(squares, 1.0, DEGREES_OF_FREEDOM);
    let is_moved = evidence > MIN_EVIDENCE
        && probability < PROBABILITY
        && ANGLES_RAD.contains(&best.size.abs());
    is_moved.then(|| Contradiction {
        assumption: Assumption::JointZero,
        size: best.size,
        std_dev: WIDENING * best.variance.sqrt(),
        joint: arm.joints[best.joint].clone(),
        shown: None,
    })
}
