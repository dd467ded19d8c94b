//! The possible body that explains the data best.

use std::ops::{Add, Mul, Sub};

use nalgebra::{SMatrix, SVector, SymmetricEigen};
use tactid_dynamics::InertialParameters;

use crate::solve::prior::BoundingBox;

type Parameters = SVector<f64, 10>;
type Information = SMatrix<f64, 10, 10>;

/// The barrier's weight falls by this factor once Newton's steps have become short.
const FALL: f64 = 0.05;

/// Half the squared length of a Newton step, in the barrier's own metric, that counts as short.
const SHORT: f64 = 0.05;

/// The result is this near to the least squared distance, relative to it.
const GAP: f64 = 1e-9;

/// The barrier's weight for an estimate that is followed, in squared deviations: with the four
/// eigenvalues of the pseudo-inertia, a tenth of a deviation.
const CLOSE: f64 = 2.5e-3;

/// The barrier's weight at most, for an estimate that is followed. At the weight `μ` the body is about
/// `2 √μ` deviations away: far from the estimate of few windows, which knows some directions to 1e5 kg m²
/// only. Without a bound a change of payload drove the body to 1e10 kg. In the mean over the first 0.2 s
/// after a change 1 to 1000 bring it near equally soon, and half the samples are far without a bound; below
/// 1000 an estimate that moves takes more than 30 steps at times.
const HEAVIEST: f64 = 1000.0;

/// The change of half the squared distance between body and estimate, in deviations, with which the estimate
/// counts as having jumped: from none to six deviations.
const JUMP: f64 = 18.0;

/// More steps are never needed: each fall takes a few.
const MOST_STEPS: usize = 200;

/// Variances smaller than this part of the largest belong to directions that are unknown.
const UNKNOWN: f64 = 1e-13;

/// An unknown direction resists as if its deviation were this many times the largest known one.
const SLACK: f64 = 1e3;

/// A possible body near an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest {
    pub(crate) parameters: Parameters,
    /// From the estimate, in standard deviations.
    pub(crate) distance: f64,
}

/// The parameters of a possible body that are nearest to an estimate, in units of its uncertainty.
///
/// Least `½ (π - π̂)ᵀ Σ⁻¹ (π - π̂)` where the pseudo-inertia has no negative eigenvalue (Wensing, Kim and
/// Slotine 2018, doi 10.1109/LRA.2017.2729659), and where the body fits into a box, if there is one: by
/// an interior-point method, Newton's steps with a barrier `-μ log` of the determinant and of each bound
/// (Boyd and Vandenberghe 2004, Convex Optimization, 11.3), which is within `μ` times their number (4 for
/// the determinant) of the least value, and always inside the set.
///
/// An estimate that is possible already stays as it is. `None` where the mass is not positive: no body
/// is near. In directions that are not known the result is free to follow. `scales` are units of the
/// parameters in which their deviations are of like size, so that what is very well known is told from
/// what is unknown. Some 0.1 ms.
pub(crate) fn nearest_possible(
    estimate: &Parameters,
    covariance: &Information,
    scales: &Parameters,
    bounding_box: Option<&BoundingBox>,
) -> Option<Nearest> {
    let body = InertialParameters::from_vector(*estimate);
    if body.mass() <= 0.0 || !estimate.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let bounds = bounding_box.map_or(vec![], |bounding| bounding.bounds().to_vec());
    if body.is_physical() && bounds.iter().all(|bound| bound.dot(estimate) >= 0.0) {
        return Some(Nearest {
            parameters: *estimate,
            distance: 0.0,
        });
    }
    let units = units(estimate);
    let target = estimate.component_div(&units);
    let problem = Problem {
        target,
        information: information(covariance, scales, &units),
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
        None => start(&target),
    };
    let inside = problem.solve(start);
    Some(Nearest {
        parameters: inside.component_mul(&units),
        distance: (2.0 * problem.distance(&inside)).sqrt(),
    })
}

/// The possible body nearest to an estimate that moves: one of Newton's steps at a time.
///
/// It is always inside the set, and within a tenth of a deviation of the nearest body once it has
/// settled. An estimate that is possible stays as it is, and is followed, for the next may not be.
#[derive(Clone, Debug)]
pub(crate) struct ProjectionTracker {
    problem: Problem,
    units: Parameters,
    estimate: Parameters,
    /// Whether the estimate itself is a possible body.
    is_possible: bool,
    /// In units; none before the first estimate of positive mass.
    inside: Option<Parameters>,
    weight: f64,
    is_settled: bool,
    /// Whether the estimate has jumped away, and the body has not reached the nearest one since.
    is_far: bool,
}

impl ProjectionTracker {
    pub(crate) fn new() -> Self {
        Self {
            problem: Problem {
                target: Parameters::zeros(),
                information: Information::identity(),
                bounds: Vec::new(),
            },
            units: Parameters::repeat(1.0),
            estimate: Parameters::zeros(),
            is_possible: false,
            inside: None,
            weight: CLOSE,
            is_settled: true,
            is_far: true,
        }
    }

    /// Follows another estimate, with the inverse of its covariance.
    pub(crate) fn aim(&mut self, estimate: &Parameters, information: &Information) {
        self.estimate = *estimate;
        self.is_possible = InertialParameters::from_vector(*estimate).is_physical();
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
            Information::from_fn(|i, j| information[(i, j)] * units[i] * units[j]);
        let (inside, distance) = match before {
            Some((inside, distance)) => (inside.component_div(&units), distance),
            None => (start(&self.problem.target), 0.0),
        };
        // The weight that the path has where the estimate has moved by so much.
        let moved = (self.problem.distance(&inside) - distance).abs();
        self.weight = self.weight.max(moved.min(HEAVIEST));
        self.is_far |= before.is_none() || moved > JUMP;
        self.units = units;
        self.inside = Some(inside);
        self.is_settled = false;
    }

    pub(crate) fn is_settled(&self) -> bool {
        self.is_settled
    }

    pub(crate) fn step(&mut self) {
        let Some(inside) = &mut self.inside else {
            return;
        };
        match self.problem.advance(inside, self.weight) {
            Advance::Far => {}
            Advance::Near | Advance::Blocked if self.weight > CLOSE => {
                self.weight = CLOSE.max(FALL * self.weight);
            }
            Advance::Near => (self.is_settled, self.is_far) = (true, false),
            Advance::Blocked | Advance::Stuck => self.is_settled = true,
        }
    }

    /// Whether the [body](Self::parameters) may be farther than a tenth of a deviation from the nearest
    /// consistent one, as it is for some steps after the estimate has jumped.
    pub(crate) fn is_far(&self) -> bool {
        self.is_far && !self.is_possible
    }

    /// The body as far as it has come; the estimate itself where no body is near, its mass not positive.
    pub(crate) fn parameters(&self) -> Parameters {
        match &self.inside {
            Some(inside) if !self.is_possible => inside.component_mul(&self.units),
            _ => self.estimate,
        }
    }
}

/// What became of a step.
enum Advance {
    /// The path is still far.
    Far,
    /// On the path.
    Near,
    /// No lower point was found along the step.
    Blocked,
    /// Rounding ends the path where the border is reached to the last digits.
    Stuck,
}

/// The nearest point of a convex set.
#[derive(Clone, Debug)]
struct Problem {
    target: Parameters,
    information: Information,
    /// Rows that are not negative on parameters.
    bounds: Vec<Parameters>,
}

impl Problem {
    /// From a point inside the set.
    fn solve(&self, start: Parameters) -> Parameters {
        let barriers = 4.0 + self.bounds.len() as f64;
        let mut inside = start;
        let mut weight = self.distance(&inside).max(f64::MIN_POSITIVE);
        for _ in 0..MOST_STEPS {
            match self.advance(&mut inside, weight) {
                Advance::Far => {}
                Advance::Near | Advance::Blocked
                    if barriers * weight < GAP * self.distance(&inside) =>
                {
                    break;
                }
                Advance::Near | Advance::Blocked => weight *= FALL,
                Advance::Stuck => break,
            }
        }
        inside
    }

    /// One of Newton's steps, half as far until it is inside, and lower.
    fn advance(&self, inside: &mut Parameters, weight: f64) -> Advance {
        let Some((step, slope)) = self.newton_step(inside, weight) else {
            return Advance::Stuck;
        };
        let Some(now) = self.value(inside, weight) else {
            return Advance::Stuck;
        };
        let mut part = 1.0;
        while part > 1e-12 {
            let tried = *inside + part * step;
            let there = self.value(&tried, weight);
            if there.is_some_and(|there| there <= now - 0.1 * part * slope) {
                *inside = tried;
                break;
            }
            part *= 0.5;
        }
        if slope < SHORT * weight {
            Advance::Near
        } else if part <= 1e-12 {
            Advance::Blocked
        } else {
            Advance::Far
        }
    }

    /// Half the squared distance from what is wanted.
    fn distance(&self, at: &Parameters) -> f64 {
        let off = at - self.target;
        0.5 * (self.information * off).dot(&off)
    }

    /// The distance with the barrier; `None` outside.
    fn value(&self, at: &Parameters, weight: f64) -> Option<f64> {
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

    /// Newton's step for the distance with the barrier, and how fast the value falls along it.
    fn newton_step(&self, inside: &Parameters, weight: f64) -> Option<(Parameters, f64)> {
        let pseudo = InertialParameters::from_vector(*inside).pseudo_inertia();
        let inverse = pseudo.cholesky()?.inverse();
        // Derivatives of the log of the determinant, tr(P⁻¹ dP) and tr(P⁻¹ dP P⁻¹ dP).
        let mut barrier = Parameters::from(traces(|i, j| inverse[(i, j)]));
        let mut curvature = Information::from_columns(&traces(|a, b| {
            let (a, b) = (inverse.column(a), inverse.column(b));
            Parameters::from(traces(|i, j| 0.5 * (a[i] * b[j] + b[i] * a[j])))
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

/// For each parameter, the trace of a symmetric matrix, given by its entries, times the parameter's
/// part in the pseudo-inertia.
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

/// By which each parameter is divided to be near one: the mass, and the size of a body of this mass
/// and inertia.
fn units(estimate: &Parameters) -> Parameters {
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

/// The inverse of the covariance in these units; what is unknown is told in the scales.
fn information(covariance: &Information, scales: &Parameters, units: &Parameters) -> Information {
    let scaled = Information::from_fn(|i, j| covariance[(i, j)] / (scales[i] * scales[j]));
    let mut eigen = SymmetricEigen::new(scaled);
    let largest = eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
    eigen.eigenvalues.apply(|variance| {
        *variance = if *variance > UNKNOWN * largest {
            1.0 / *variance
        } else {
            1.0 / (largest * SLACK * SLACK)
        };
    });
    let ratio = units.component_div(scales);
    let inverse = eigen.recompose();
    Information::from_fn(|i, j| inverse[(i, j)] * ratio[i] * ratio[j])
}

/// A body inside the set: the estimate with its pseudo-inertia's eigenvalues brought above zero.
fn start(target: &Parameters) -> Parameters {
    let pseudo = InertialParameters::from_vector(*target).pseudo_inertia();
    let mut eigen = SymmetricEigen::new(pseudo);
    let least = 1e-2 * eigen.eigenvalues.amax();
    eigen.eigenvalues.apply(|value| *value = value.max(least));
    *InertialParameters::from_pseudo_inertia(&eigen.recompose()).as_vector()
}

#[cfg(test)]
mod tests;
