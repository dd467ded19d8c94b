//! Steps of an interior-point method: a few improve a motion within its limits in milliseconds.
//!
//! A design solves a conic program in each step, which costs tens of milliseconds for the limits of
//! several payloads. Here the limits are logarithmic barriers, and a step is one of Newton's
//! method: the normal equations have as many unknowns as the motion has variables.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::ExcitationError;
use crate::cones::LinearCone;
use crate::search::{Linear, Point, Search};
use crate::subproblem::{PENALTY, along};

/// Weights of the barriers that are tried in each step, in units of the logarithm of an interval.
const BARRIERS: [f64; 4] = [0.1, 0.03, 0.01, 0.003];

/// Sharpness of the smooth maximum of the functions: the largest and those within 1/20 of it, in
/// units of the logarithm.
const SHARPNESS: f64 = 20.0;

/// Curvature along each variable, which makes a step unique.
const CURVATURE: f64 = 1e-3;

/// Radius, in units of the variables' scales, within which limits are kept.
const RADIUS: f64 = 0.3;

/// Fraction of the way to the nearest limit that a step may go.
const TO_BOUNDARY: f64 = 0.9;

/// Halvings of a step until it is an improvement.
const HALVINGS: usize = 4;

/// Least slack of a limit for which the barrier is computed.
const LEAST_SLACK: f64 = 1e-4;

/// Least head of a cone for which the barrier is computed. A negative one, of bodies that touch or
/// a payload that pulls off a pad, would have the mirrored barrier, which pushes further out.
const LEAST_HEAD: f64 = 1e-2;

/// Limits along the motion in linear form, and their barrier.
struct Barrier<'a> {
    cones: &'a [LinearCone],
    /// Values of the joints' limits, which must stay between -1 and 1, and their gradients.
    joints: Vec<(f64, Vec<(usize, f64)>)>,
    gradient: DVector<f64>,
    hessian: DMatrix<f64>,
}

impl<'a> Barrier<'a> {
    fn new(search: &Search, values: &[f64], cones: &'a [LinearCone]) -> Self {
        let count = search.scales.len();
        let scaled = |terms: &[(usize, f64)]| {
            let terms = terms.iter();
            terms.map(|(k, f)| (*k, f * search.scales[*k])).collect()
        };
        let rows = search.rows.iter();
        let joints: Vec<(f64, Vec<(usize, f64)>)> = rows
            .map(|row| (row.value(values), scaled(&row.terms)))
            .collect();
        let mut gradient = DVector::<f64>::zeros(count);
        let mut hessian = DMatrix::<f64>::zeros(count, count);
        for (value, terms) in &joints {
            let slack = (1.0 - value * value).max(LEAST_SLACK);
            let curvature = 4.0 * value * value / (slack * slack) + 2.0 / slack;
            for (a, f) in terms {
                gradient[*a] += 2.0 * value * f / slack;
                for (b, g) in terms {
                    hessian[(*a, *b)] += curvature * f * g;
                }
            }
        }
        // A row for each rank of the Hessian: their product is one fast multiplication.
        let mut ranks: Vec<f64> = Vec::new();
        for cone in cones {
            let (head, tail) = (cone.value.head.max(LEAST_HEAD), &cone.value.tail);
            let squares: f64 = tail.iter().map(|x| x * x).sum();
            let slack = (head * head - squares).max(LEAST_SLACK);
            // -ln(h² - |t|²) has the gradient -2 (h ∇h - Σ t ∇t) / s.
            let mut inward: Vec<f64> = cone.head.iter().map(|x| head * x).collect();
            for (value, row) in tail.iter().zip(&cone.tail) {
                let weight = (2.0 / slack).sqrt();
                ranks.extend(row.iter().map(|x| weight * x));
                for (sum, x) in inward.iter_mut().zip(row) {
                    *sum -= value * x;
                }
            }
            ranks.extend(inward.iter().map(|x| 2.0 / slack * x));
            for (sum, x) in gradient.iter_mut().zip(&inward) {
                *sum -= 2.0 / slack * x;
            }
        }
        let ranks = DMatrix::from_vec(count, ranks.len() / count, ranks);
        hessian += &ranks * ranks.transpose();
        Self {
            cones,
            joints,
            gradient,
            hessian,
        }
    }

    /// Returns the largest multiple of a step, at most one, that stays within all limits.
    fn longest(&self, step: &[f64]) -> f64 {
        let mut longest: f64 = 1.0 / TO_BOUNDARY;
        for (value, terms) in &self.joints {
            let change: f64 = terms.iter().map(|(k, f)| f * step[*k]).sum();
            if change != 0.0 {
                longest = longest.min(((1.0 - value * change.signum()) / change.abs()).max(0.0));
            }
        }
        for cone in self.cones {
            longest = longest.min(to_boundary(cone, step));
        }
        TO_BOUNDARY * longest
    }
}

/// Returns the multiple of a step at which a cone's limit is reached.
fn to_boundary(cone: &LinearCone, step: &[f64]) -> f64 {
    let (head, tail) = (cone.value.head, &cone.value.tail);
    let along_head = along(&cone.head, step);
    // (h + a dh)² = |t + a dt|²
    let (mut a, mut b, mut c) = (along_head * along_head, head * along_head, head * head);
    for (value, row) in tail.iter().zip(&cone.tail) {
        let change = along(row, step);
        a -= change * change;
        b -= value * change;
        c -= value * value;
    }
    if head <= 0.0 || c <= 0.0 {
        // The limit is exceeded already: the merit decides about the step.
        return f64::INFINITY;
    }
    // The positive root of a x² + 2 b x + c, in a form without cancellation.
    let root = (b * b - a * c).max(0.0).sqrt();
    let denominator = root - b;
    if denominator > 0.0 {
        c / denominator
    } else {
        f64::INFINITY
    }
}

/// The smooth maximum of the functions.
struct Objective {
    gradient: DVector<f64>,
    hessian: DMatrix<f64>,
}

impl Objective {
    fn new(functions: &[(f64, Vec<f64>)], count: usize) -> Self {
        let largest = functions.iter().map(|(f, _)| *f);
        let largest = largest.fold(f64::NEG_INFINITY, f64::max);
        let weights = functions
            .iter()
            .map(|(f, _)| (SHARPNESS * (f - largest)).exp());
        let sum: f64 = weights.clone().sum();
        let mut gradient = DVector::zeros(count);
        let mut hessian = DMatrix::zeros(count, count);
        for ((_, slopes), weight) in functions.iter().zip(weights) {
            let slopes = DVector::from_column_slice(slopes);
            gradient.axpy(weight / sum, &slopes, 1.0);
            hessian.ger(SHARPNESS * weight / sum, &slopes, &slopes, 1.0);
        }
        hessian.ger(-SHARPNESS, &gradient, &gradient, 1.0);
        Self { gradient, hessian }
    }
}

/// Improves a motion, which should be within its limits, by up to so many steps.
pub(super) fn improve(
    search: &mut Search,
    mut point: Point,
    iterations: usize,
) -> Result<Point, ExcitationError> {
    // Derivatives change little within a plan, and computing them costs as much as twenty motions.
    let mut linear = search.linearise(&point)?;
    for _ in 0..iterations {
        let Some(step) = best_step(search, &point, &linear) else {
            break;
        };
        let Some(better) = improved(search, &point, &step)? else {
            break;
        };
        point = better;
        let samples = search.sampler.sample(&point.values, false)?;
        linear = search.linear(&point, samples.with_slopes_of(linear.samples));
    }
    Ok(point)
}

/// Returns the step that promises most among those with barriers of different weights.
fn best_step(search: &Search, point: &Point, linear: &Linear) -> Option<Vec<f64>> {
    let count = search.scales.len();
    let linearised = |cone: &crate::cones::Cone| {
        cone.linearised(&search.sampler, &linear.samples, &search.scales, RADIUS)
    };
    let cones: Vec<LinearCone> = search.cones.iter().flat_map(linearised).collect();
    let barrier = Barrier::new(search, &point.values, &cones);
    let objective = Objective::new(&linear.functions, count);
    let mut best: Option<(f64, Vec<f64>)> = None;
    for weight in BARRIERS {
        let mut hessian = &objective.hessian + &barrier.hessian * weight;
        for k in 0..count {
            hessian[(k, k)] += CURVATURE;
        }
        let Some(factor): Option<Cholesky<f64, Dyn>> = hessian.cholesky() else {
            continue;
        };
        let mut step = factor.solve(&-(&objective.gradient + &barrier.gradient * weight));
        step *= barrier.longest(step.as_slice());
        let step = step.as_slice().to_vec();
        let after = linear.functions.iter().map(|(f, g)| f + along(g, &step));
        let excess = cones.iter().map(|cone| cone.excess_after(&step));
        // What a search minimises, to first order.
        let after = after.fold(f64::NEG_INFINITY, f64::max) + PENALTY * excess.fold(0.0, f64::max);
        if best.as_ref().is_none_or(|(least, _)| after < *least) {
            best = Some((after, step));
        }
    }
    best.map(|(_, step)| step)
}

/// Returns the motion after a step, or after a shorter one, if it is better.
fn improved(
    search: &mut Search,
    point: &Point,
    step: &[f64],
) -> Result<Option<Point>, ExcitationError> {
    let mut length = 1.0;
    for _ in 0..HALVINGS {
        let pairs = point.values.iter().zip(step).zip(&search.scales);
        let values = pairs.map(|((x, d), scale)| x + length * d * scale);
        let candidate = search.point(values.collect())?;
        if let Some(candidate) = candidate.filter(|new| new.merit() < point.merit()) {
            return Ok(Some(candidate));
        }
        length *= 0.5;
    }
    Ok(None)
}
