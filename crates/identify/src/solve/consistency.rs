//! Projection of an estimate onto physically consistent parameters.
//!
//! Parameters are physically consistent where some distribution of positive mass has them: the pseudo-inertia,
//! a 4x4 matrix that is linear in the parameters, has no negative eigenvalue (Wensing, Kim and Slotine 2018,
//! doi 10.1109/LRA.2017.2729659). The projection of an estimate `π̂` minimises
//! `½ (π - π̂)ᵀ Σ⁻¹ (π - π̂)` over these parameters: the nearest body in units of the uncertainty.
//!
//! It is computed by an interior-point method: Newton's method on the distance plus a barrier, minus `μ` times
//! the log of the pseudo-inertia's determinant and of the slack of each bound (Boyd and Vandenberghe 2004,
//! Convex Optimization, 11.3). The minimum for a barrier weight `μ` is within `μ` times the number of barriers
//! (4 for the determinant) of the least value, and always inside the set.

use std::ops::{Add, Mul, Sub};

use nalgebra::{SVector, SymmetricEigen};
use tactid_dynamics::InertialParameters;

use super::prior::BoundingBox;
use super::subspace::{Matrix, VARIANCE_RATIO, Vector};

/// Factor on the barrier's weight once the Newton steps for the present weight have become short.
const WEIGHT_FACTOR: f64 = 0.05;

/// Half the squared length of a Newton step, in the barrier's own metric, below which it is short.
const SHORT_STEP: f64 = 0.05;

/// Relative gap of [`project`] to the least squared distance.
const GAP: f64 = 1e-9;

/// Final barrier weight of a tracked projection, in squared standard deviations. With the four eigenvalues of
/// the pseudo-inertia it is a tenth of a standard deviation: `√(4 · 2.5e-3)`.
const TRACKED_WEIGHT: f64 = 2.5e-3;

/// Largest barrier weight of a tracked projection. At the weight `μ` the tracked parameters are about `2 √μ`
/// standard deviations away: far from the estimate of a few windows, which knows some directions to 1e5 kg m²
/// only. Without this bound a payload change moved the body to 1e10 kg. In the mean over the first 0.2 s after
/// a change, bounds from 1 to 1000 bring it near equally soon, and twice as many samples are far without one;
/// below 1000 an estimate that moves takes more than 30 steps at times.
const MAX_WEIGHT: f64 = 1000.0;

/// Change of half the squared Mahalanobis distance between the tracked parameters and the estimate from which
/// on the estimate counts as having jumped: from none to six standard deviations.
const JUMP: f64 = 18.0;

/// Bound on the Newton steps of [`project`]. It is never reached, because each weight takes a few.
const MAX_STEPS: usize = 200;

/// Shortest step of the line search, relative to the Newton step.
const MIN_STEP: f64 = 1e-12;

/// Fraction of the predicted decrease that a step must reach (Armijo's condition).
const SUFFICIENT_DECREASE: f64 = 0.1;

/// Standard deviation of an unobservable direction relative to the largest of the observable ones.
const UNOBSERVABLE_STD_DEV: f64 = 1e3;

/// Physically consistent parameters near an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Projection {
    pub(crate) parameters: Vector,
    /// Mahalanobis distance from the estimate, in standard deviations.
    pub(crate) distance: f64,
}

/// Projects an estimate onto the parameters of physically consistent bodies that fit into a box, if there is
/// one.
///
/// A consistent estimate is returned unchanged. `None` where the mass is not positive: then no body is near. In
/// unobservable directions the result moves freely. `scales` are units of the parameters in which their
/// standard deviations are of similar size, so that small variances are distinguished from unobservable
/// directions. Cost: some 0.1 ms.
pub(crate) fn project(
    estimate: &Vector,
    covariance: &Matrix,
    scales: &Vector,
    bounding_box: Option<&BoundingBox>,
) -> Option<Projection> {
    let body = InertialParameters::from_vector(*estimate);
    if body.mass() <= 0.0 || !estimate.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let bounds = bounding_box.map_or(vec![], |bounding| bounding.bounds().to_vec());
    if body.is_physical() && bounds.iter().all(|bound| bound.dot(estimate) >= 0.0) {
        return Some(Projection {
            parameters: *estimate,
            distance: 0.0,
        });
    }
    let units = units(estimate);
    let target = estimate.component_div(&units);
    let problem = Problem {
        target,
        information: information_of(covariance, scales, &units),
        bounds: bounds
            .iter()
            .map(|bound| bound.component_mul(&units))
            .collect(),
    };
    let start = match bounding_box {
        Some(bounding) => bounding
            .filled(body.mass())
            .as_vector()
            .component_div(&units),
        None => interior_start(&target),
    };
    let inside = problem.solve(start);
    Some(Projection {
        parameters: inside.component_mul(&units),
        distance: (2.0 * problem.distance(&inside)).sqrt(),
    })
}

/// Tracks the projection of an estimate that changes, one Newton step at a time, without allocation.
///
/// The parameters are always consistent, and within a tenth of a standard deviation of the projection once the
/// tracker has settled. A consistent estimate is returned unchanged, but is tracked nevertheless, because the
/// next one may be inconsistent.
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
    /// Whether the estimate has jumped, and the tracked parameters have not reached its projection since.
    is_far: bool,
}

impl ProjectionTracker {
    /// Creates a tracker of an estimate that is zero.
    pub(crate) fn new() -> Self {
        Self {
            problem: Problem {
                target: Vector::zeros(),
                information: Matrix::identity(),
                bounds: Vec::new(),
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
        // The weight for which parameters on the central path are as far away as the estimate has moved.
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

    /// Takes one Newton step. Cost: a Cholesky factorisation of a 10x10 matrix, and of a 4x4 matrix for each
    /// trial of the line search.
    pub(crate) fn step(&mut self) {
        let Some(inside) = &mut self.inside else {
            return;
        };
        match self.problem.advance(inside, self.weight) {
            Progress::Far => {}
            Progress::Near | Progress::Blocked if self.weight > TRACKED_WEIGHT => {
                self.weight = TRACKED_WEIGHT.max(WEIGHT_FACTOR * self.weight);
            }
            Progress::Near => (self.is_settled, self.is_far) = (true, false),
            Progress::Blocked | Progress::Stuck => self.is_settled = true,
        }
    }

    /// Whether the [tracked parameters](Self::parameters) may be farther than a tenth of a standard deviation
    /// from the projection, as they are for some steps after the estimate has jumped.
    pub(crate) fn is_far(&self) -> bool {
        self.is_far && !self.is_consistent
    }

    /// Returns the tracked parameters, or the estimate itself where it is consistent or its mass is not
    /// positive.
    pub(crate) fn parameters(&self) -> Vector {
        match &self.inside {
            Some(inside) if !self.is_consistent => inside.component_mul(&self.units),
            _ => self.estimate,
        }
    }
}

/// Where a Newton step has led.
enum Progress {
    /// The minimum for the present barrier weight is still far.
    Far,
    /// The minimum for the present barrier weight is near.
    Near,
    /// The line search found no lower point along the step.
    Blocked,
    /// Rounding prevents a step: the boundary of the set is reached to the last digits.
    Stuck,
}

/// The nearest point of a convex set, in parameters divided by units.
#[derive(Clone, Debug)]
struct Problem {
    /// The estimate.
    target: Vector,
    /// Inverse of the estimate's covariance.
    information: Matrix,
    /// Rows whose products with the parameters must not be negative.
    bounds: Vec<Vector>,
}

impl Problem {
    /// Returns the nearest point, from a start inside the set.
    fn solve(&self, start: Vector) -> Vector {
        let barriers = 4.0 + self.bounds.len() as f64;
        let mut inside = start;
        let mut weight = self.distance(&inside).max(f64::MIN_POSITIVE);
        for _ in 0..MAX_STEPS {
            match self.advance(&mut inside, weight) {
                Progress::Far => {}
                Progress::Near | Progress::Blocked
                    if barriers * weight < GAP * self.distance(&inside) =>
                {
                    break;
                }
                Progress::Near | Progress::Blocked => weight *= WEIGHT_FACTOR,
                Progress::Stuck => break,
            }
        }
        inside
    }

    /// Takes one Newton step, halved until it ends inside the set at a lower value.
    fn advance(&self, inside: &mut Vector, weight: f64) -> Progress {
        let Some((step, slope)) = self.newton_step(inside, weight) else {
            return Progress::Stuck;
        };
        let Some(value) = self.value(inside, weight) else {
            return Progress::Stuck;
        };
        let mut fraction = 1.0;
        while fraction > MIN_STEP {
            let tried = *inside + fraction * step;
            let decreased = value - SUFFICIENT_DECREASE * fraction * slope;
            if self
                .value(&tried, weight)
                .is_some_and(|tried| tried <= decreased)
            {
                *inside = tried;
                break;
            }
            fraction *= 0.5;
        }
        if slope < SHORT_STEP * weight {
            Progress::Near
        } else if fraction <= MIN_STEP {
            Progress::Blocked
        } else {
            Progress::Far
        }
    }

    /// Returns half the squared Mahalanobis distance from the target.
    fn distance(&self, at: &Vector) -> f64 {
        let difference = at - self.target;
        0.5 * (self.information * difference).dot(&difference)
    }

    /// Returns the distance plus the barrier; `None` outside the set.
    fn value(&self, at: &Vector, weight: f64) -> Option<f64> {
        let pseudo = InertialParameters::from_vector(*at).pseudo_inertia();
        let mut barrier = pseudo.cholesky()?.determinant().ln();
        for bound in &self.bounds {
            let slack = bound.dot(at);
            if slack <= 0.0 {
                return None;
            }
            barrier += slack.ln();
        }
        Some(self.distance(at) - weight * barrier)
    }

    /// Returns the Newton step for the distance plus the barrier, and the rate of decrease along it.
    fn newton_step(&self, inside: &Vector, weight: f64) -> Option<(Vector, f64)> {
        let pseudo = InertialParameters::from_vector(*inside).pseudo_inertia();
        let inverse = pseudo.cholesky()?.inverse();
        // Derivatives of the log of the determinant: tr(P⁻¹ dP) and -tr(P⁻¹ dP P⁻¹ dP).
        let mut barrier = Vector::from(traces(|i, j| inverse[(i, j)]));
        let mut curvature = Matrix::from_columns(&traces(|a, b| {
            let (a, b) = (inverse.column(a), inverse.column(b));
            Vector::from(traces(|i, j| 0.5 * (a[i] * b[j] + b[i] * a[j])))
        }));
        for bound in &self.bounds {
            let relative = bound / bound.dot(inside);
            barrier += relative;
            curvature += relative * relative.transpose();
        }
        let gradient = self.information * (inside - self.target) - weight * barrier;
        let step = -(self.information + weight * curvature)
            .cholesky()?
            .solve(&gradient);
        Some((step, -gradient.dot(&step)))
    }
}

/// Returns for each parameter the trace of a symmetric matrix, given by its entries, times the derivative of
/// the pseudo-inertia with respect to the parameter.
fn traces<T>(entry: impl Fn(usize, usize) -> T) -> [T; 10]
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
{
    let diagonal = [entry(0, 0), entry(1, 1), entry(2, 2)];
    let half = (diagonal[0] + diagonal[1] + diagonal[2]) * 0.5;
    [
        entry(3, 3),
        entry(0, 3) * 2.0,
        entry(1, 3) * 2.0,
        entry(2, 3) * 2.0,
        half - diagonal[0],
        entry(0, 1) * -2.0,
        entry(0, 2) * -2.0,
        half - diagonal[1],
        entry(1, 2) * -2.0,
        half - diagonal[2],
    ]
}

/// Returns units in which the parameters of an estimate are near one: its mass, and powers of the size of a body
/// with this mass and inertia.
fn units(estimate: &Vector) -> Vector {
    let mass = estimate[0];
    let trace = estimate[4].abs() + estimate[7].abs() + estimate[9].abs();
    let length = (trace / mass).sqrt().max(1e-6);
    let moment = mass * length;
    let inertia = moment * length;
    SVector::from_fn(|k, _| match k {
        0 => mass,
        1..=3 => moment,
        _ => inertia,
    })
}

/// Returns the inverse of a covariance, in these units. Directions without variance in scaled parameters are
/// unobservable, and get the standard deviation of [`UNOBSERVABLE_STD_DEV`].
fn information_of(covariance: &Matrix, scales: &Vector, units: &Vector) -> Matrix {
    let scaled = Matrix::from_fn(|i, j| covariance[(i, j)] / (scales[i] * scales[j]));
    let mut eigen = SymmetricEigen::new(scaled);
    let largest = eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
    eigen.eigenvalues.apply(|variance| {
        *variance = if *variance > VARIANCE_RATIO * largest {
            1.0 / *variance
        } else {
            1.0 / (largest * UNOBSERVABLE_STD_DEV * UNOBSERVABLE_STD_DEV)
        };
    });
    let ratio = units.component_div(scales);
    let inverse = eigen.recompose();
    Matrix::from_fn(|i, j| inverse[(i, j)] * ratio[i] * ratio[j])
}

/// Returns consistent parameters near an estimate: its pseudo-inertia with the eigenvalues raised above zero.
fn interior_start(target: &Vector) -> Vector {
    let pseudo = InertialParameters::from_vector(*target).pseudo_inertia();
    let mut eigen = SymmetricEigen::new(pseudo);
    let least = 1e-2 * eigen.eigenvalues.amax();
    eigen.eigenvalues.apply(|value| *value = value.max(least));
    *InertialParameters::from_pseudo_inertia(&eigen.recompose()).as_vector()
}

#[cfg(test)]
mod tests;
