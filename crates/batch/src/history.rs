//! The estimate and its uncertainty over the time of a recording.

use nalgebra::{SMatrix, SVector};
use tactid_identify::equations::Equation;
use tactid_identify::equations::window::NOISE_CORRELATION;
use tactid_identify::solve::{std_devs, values_of};
use tactid_identify::{BoundingBox, KnownBodies};

use crate::HistoryPoint;
use crate::diagnosis::nearest_consistent;
use crate::fit::Fit;
use crate::fit::normal_equations::NormalEquations;
use crate::solve::Posterior;

/// Most points of a history.
const MAX_POINTS: usize = 600;

/// Returns the estimate from the first windows alone, for growing numbers of windows, with the
/// robust weights and the noise of the fit to all of them. The `known` bodies are subtracted.
///
/// `of_result` are the standard deviations of the result, where the result is that of the same fit.
/// What they contain beside that noise widens those of all points by the same factors, so that the
/// last are those of the result.
pub(crate) fn history(
    equations: &[Equation],
    fit: &Fit,
    known: &KnownBodies,
    bounding_box: Option<&BoundingBox>,
    of_result: Option<&[f64; 10]>,
) -> Vec<HistoryPoint> {
    let stride = equations.len().div_ceil(MAX_POINTS).max(1);
    let mut normal_equations = NormalEquations::with_known_mass(fit);
    let mut points = Vec::new();
    for (k, equation) in equations.iter().enumerate() {
        normal_equations.add(equation, k);
        if k % stride != stride - 1 && k + 1 != equations.len() {
            continue;
        }
        if let Some((values, std_devs)) = solve(&normal_equations, fit, known, bounding_box) {
            points.push(HistoryPoint {
                time_s: equation.time_s,
                values,
                std_devs,
            });
        }
    }
    if let (Some(of_result), Some(last)) = (of_result, points.last().map(|last| last.std_devs)) {
        for (k, (of_result, last)) in of_result.iter().zip(last).enumerate() {
            let factor = of_result / last;
            // An exact mass has none, and an unobservable value may have none either.
            if factor.is_finite() && last.is_finite() {
                points
                    .iter_mut()
                    .for_each(|point| point.std_devs[k] *= factor);
            }
        }
    }
    points
}

/// Returns values and standard deviations; `None` for a mass of zero.
fn solve(
    normal_equations: &NormalEquations<'_>,
    fit: &Fit,
    known: &KnownBodies,
    bounding_box: Option<&BoundingBox>,
) -> Option<([f64; 10], [f64; 10])> {
    let scales = fit.scales();
    let spectrum = normal_equations.spectrum();
    let target = normal_equations.target();
    let mut parameters = SVector::<f64, 10>::zeros();
    let mut covariance = SMatrix::<f64, 10, 10>::zeros();
    for (information, direction) in spectrum.observable() {
        parameters += direction * (direction.dot(&target) / information);
        covariance.ger(NOISE_CORRELATION / information, &direction, &direction, 1.0);
    }
    let mut covariance = spectrum.across_unobservable(covariance);
    let of_gains = normal_equations.gain_errors(&spectrum);
    covariance += &of_gains * of_gains.transpose();
    let load = parameters.component_mul(scales);
    let of_load = SMatrix::from_fn(|i, j| covariance[(i, j)] * scales[i] * scales[j]);
    let (parameters, covariance) = known.payload(&load, &of_load, fit.known_mass);
    let consistent = nearest_consistent(parameters, &covariance, scales, bounding_box);
    let nearest = (consistent.parameters, consistent.widening);
    let null_space = spectrum.null_space_of(*scales, nearest.0[0], fit.reach_m);
    let load = (&load, &of_load, fit.known_mass);
    let found = Posterior::of_load(load, known, nearest, &null_space);
    let of_values = std_devs(&found.parameters, &found.covariance, &null_space);
    Some((values_of(&found.parameters)?, of_values.std_devs))
}
