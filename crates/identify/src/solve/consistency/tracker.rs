//! The projection of an estimate that changes, for the control loop.

use tactid_dynamics::InertialParameters;

use super::super::subspace::{Matrix, Vector};
use super::barrier::ConsistentSet;
use super::newton::{Objective, Progress, WEIGHT_FACTOR, advance};
use super::{interior_start, units};

/// Final barrier weight of a tracked projection, in squared standard deviations. With the four
/// eigenvalues of the pseudo-inertia it is a tenth of a standard deviation: `√(4 · 2.5e-3)`.
const TRACKED_WEIGHT: f64 = 2.5e-3;

/// Largest barrier weight of a tracked projection. At the weight `μ` the tracked parameters are
/// about `2 √μ` standard deviations away: far from the estimate of a few windows, which knows some
/// directions to 1e5 kg m² only. Without this bound a payload change moved the body to 1e10 kg. In
/// the mean over the first 0.2 s after a change, bounds from 1 to 1000 bring it near equally soon,
/// and twice as many samples are far without one; below 1000 an estimate that moves takes more than
/// 30 steps at times.
const MAX_WEIGHT: f64 = 1000.0;

/// Change of half the squared Mahalanobis distance between the tracked parameters and the estimate
/// from which on the estimate counts as having jumped: from none to six standard deviations.
const JUMP: f64 = 18.0;

/// Tracks the projection of an estimate that changes, one Newton step at a time, without
/// allocation.
///
/// The parameters are always consistent, and within a tenth of a standard deviation of the
/// projection once the tracker has settled. A consistent estimate is returned unchanged, but is
/// tracked nevertheless, because the next one may be inconsistent.
#[derive(Clone, Debug)]
pub(crate) struct ProjectionTracker {
    problem: Problem,
    units: Vector,
    estimate: Vector,
    /// Whether the estimate itself is consistent.
    is_consistent: bool,
    /// Tracked parameters in `units`; `None` before the first estimate of positive mass.
    inside: Option<Vector>,
    weight: f64,
    is_settled: bool,
    /// Whether the estimate has jumped, and the tracked parameters have not reached its projection
    /// since.
    is_far: bool,
}

impl ProjectionTracker {
    /// Creates a tracker of an estimate that is zero.
    pub(crate) fn new() -> Self {
        Self {
            problem: Problem {
                target: Vector::zeros(),
                information: Matrix::identity(),
                set: ConsistentSet::default(),
            },
            units: Vector::repeat(1.0),
            estimate: Vector::zeros(),
            is_consistent: false,
            inside: None,
            weight: TRACKED_WEIGHT,
            is_settled: true,
            is_far: true,
        }
    }

    /// Sets the estimate that is tracked, with the inverse of its covariance.
    pub(crate) fn set_estimate(&mut self, estimate: &Vector, information: &Matrix) {
        self.estimate = *estimate;
        self.is_consistent = InertialParameters::from_vector(*estimate).is_physical();
        if estimate[0] <= 0.0 || !estimate.iter().all(|entry| entry.is_finite()) {
            (self.inside, self.is_settled) = (None, true);
            return;
        }
        let before = self.inside.map(|inside| {
            let distance = self.problem.distance(&inside);
            (inside.component_mul(&self.units), distance)
        });
        let units = units(estimate);
        self.problem.target = estimate.component_div(&units);
        self.problem.information =
            Matrix::from_fn(|i, j| information[(i, j)] * units[i] * units[j]);
        let (inside, distance) = match before {
            Some((inside, distance)) => (inside.component_div(&units), distance),
            None => (interior_start(&self.problem.target), 0.0),
        };
        // The weight for which parameters on the central path are as far away as the estimate has
        // moved.
        let moved = (self.problem.distance(&inside) - distance).abs();
        self.weight = self.weight.max(moved.min(MAX_WEIGHT));
        self.is_far |= before.is_none() || moved > JUMP;
        self.units = units;
        self.inside = Some(inside);
        self.is_settled = false;
    }

    /// Whether further steps would not move the parameters.
    pub(crate) fn is_settled(&self) -> bool {
        self.is_settled
    }

    /// Takes one Newton step. Cost: a Cholesky factorisation of a 10x10 matrix, and of a 4x4 matrix
    /// for each trial of the line search.
    pub(crate) fn step(&mut self) {
        let Some(inside) = &mut self.inside else {
            return;
        };
        match advance(&self.problem, inside, self.weight) {
            Progress::Far => {}
            Progress::Near | Progress::Blocked if self.weight > TRACKED_WEIGHT => {
                self.weight = TRACKED_WEIGHT.max(WEIGHT_FACTOR * self.weight);
            }
            Progress::Near => (self.is_settled, self.is_far) = (true, false),
            Progress::Blocked | Progress::Stuck => self.is_settled = true,
        }
    }

    /// Whether the [tracked parameters](Self::parameters) may be farther than a tenth of a standard
    /// deviation from the projection, as they are for some steps after the estimate has jumped.
    pub(crate) fn is_far(&self) -> bool {
        self.is_far && !self.is_consistent
    }

    /// Whether the [parameters](Self::parameters) are the tracked ones, and not the estimate
    /// itself.
    pub(crate) fn moves_estimate(&self) -> bool {
        self.inside.is_some() && !self.is_consistent
    }

    /// Returns the tracked parameters, or the estimate itself where it is consistent or its mass is
    /// not positive.
    pub(crate) fn parameters(&self) -> Vector {
        match &self.inside {
            Some(inside) if !self.is_consistent => inside.component_mul(&self.units),
            _ => self.estimate,
        }
    }
}

/// The nearest consistent parameters, divided by units.
#[derive(Clone, Debug)]
struct Problem {
    /// The estimate.
    target: Vector,
    /// Inverse of the estimate's covariance.
    information: Matrix,
    set: ConsistentSet,
}

impl Objective for Problem {
    fn distance(&self, at: &Vector) -> f64 {
        let difference = at - self.target;
        0.5 * (self.information * difference).dot(&difference)
    }

    fn value(&self, at: &Vector, weight: f64) -> Option<f64> {
        Some(self.distance(at) - weight * self.set.log_barrier(at)?)
    }

    fn newton_step(&self, at: &Vector, weight: f64) -> Option<(Vector, f64)> {
        let (barrier, curvature) = self.set.derivatives(at)?;
        let gradient = self.information * (at - self.target) - weight * barrier;
        let step = -(self.information + weight * curvature)
            .cholesky()?
            .solve(&gradient);
        Some((step, -gradient.dot(&step)))
    }
}
