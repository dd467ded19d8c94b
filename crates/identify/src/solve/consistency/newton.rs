//! The interior-point method: damped Newton steps for a distance plus a barrier.

use super::super::subspace::Vector;

/// Factor on the barrier's weight once the Newton steps for the present weight have become short.
pub(super) const WEIGHT_FACTOR: f64 = 0.05;

/// Half the squared length of a Newton step, in the barrier's own metric, below which it is short.
const SHORT_STEP: f64 = 0.05;

/// Relative gap of [`solve`] to the least squared distance.
pub(super) const GAP: f64 = 1e-9;

/// Bound on the Newton steps of [`solve`]. It is never reached, because each weight takes a few.
const MAX_STEPS: usize = 200;

/// Shortest step of the line search, relative to the Newton step.
const MIN_STEP: f64 = 1e-12;

/// Fraction of the predicted decrease that a step must reach (Armijo's condition).
const SUFFICIENT_DECREASE: f64 = 0.1;

/// A squared distance with a barrier around the set in which it is minimised.
pub(super) trait Objective {
    /// Returns half the squared distance from the estimate, in squared standard deviations.
    fn distance(&self, at: &Vector) -> f64;

    /// Returns the distance plus `weight` times the barrier; `None` outside the set.
    fn value(&self, at: &Vector, weight: f64) -> Option<f64>;

    /// Returns the Newton step for the distance plus `weight` times the barrier, and the rate of
    /// decrease along it.
    fn newton_step(&self, at: &Vector, weight: f64) -> Option<(Vector, f64)>;
}

/// Where a Newton step has led.
pub(super) enum Progress {
    /// The minimum for the present barrier weight is still far.
    Far,
    /// The minimum for the present barrier weight is near.
    Near,
    /// The line search found no lower point along the step.
    Blocked,
    /// Rounding prevents a step: the boundary of the set is reached to the last digits.
    Stuck,
}

/// Takes one Newton step, halved until it ends inside the set at a lower value, or until rounding
/// would hide a lower one: of precise estimates, the barrier has few digits near the boundary.
pub(super) fn advance(objective: &impl Objective, at: &mut Vector, weight: f64) -> Progress {
    let Some((step, slope)) = objective.newton_step(at, weight) else {
        return Progress::Stuck;
    };
    let Some(value) = objective.value(at, weight) else {
        return Progress::Stuck;
    };
    let mut fraction = 1.0;
    let mut has_moved = false;
    while !has_moved && fraction > MIN_STEP {
        let decreased = value - SUFFICIENT_DECREASE * fraction * slope;
        if fraction < 1.0 && decreased == value {
            break;
        }
        let tried = *at + fraction * step;
        let reached = objective.value(&tried, weight);
        if reached.is_some_and(|reached| reached <= decreased) {
            *at = tried;
            has_moved = true;
        }
        fraction *= 0.5;
    }
    if slope < SHORT_STEP * weight {
        Progress::Near
    } else if has_moved {
        Progress::Far
    } else {
        Progress::Blocked
    }
}

/// Returns the minimum of the distance, from a start inside the set. `barriers` is the number of
/// barriers: the gap to the least distance is this times the weight.
pub(super) fn solve(objective: &impl Objective, start: Vector, barriers: usize) -> Vector {
    let mut at = start;
    let mut weight = objective.distance(&at).max(f64::MIN_POSITIVE);
    for _ in 0..MAX_STEPS {
        match advance(objective, &mut at, weight) {
            Progress::Far => {}
            Progress::Near | Progress::Blocked
                if barriers as f64 * weight < GAP * objective.distance(&at) =>
            {
                break;
            }
            Progress::Near | Progress::Blocked => weight *= WEIGHT_FACTOR,
            Progress::Stuck => break,
        }
    }
    at
}
