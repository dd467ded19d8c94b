//! How the estimate and its uncertainty came about over a recording.

use nalgebra::{SMatrix, SVector, SymmetricEigen};

use super::accumulation::Gram;
use super::fit::Fit;

use crate::equations::Equation;
use crate::equations::window::NOISE_CORRELATION;
use crate::result::HistoryPoint;
use crate::solve::BoundingBox;
use crate::solve::consistency::nearest_possible;
use crate::solve::subspace::{Directions, known as known_directions};
use crate::solve::uncertainty::{std_devs, values_of};

/// About how many points there are.
const POINTS: usize = 600;

/// The estimate after each part of the equations, with the weights of the fit over all of them.
/// `known` is taken off each.
pub(crate) fn history(
    equations: &[Equation],
    fit: &Fit,
    known: &SVector<f64, 10>,
    bounding_box: Option<&BoundingBox>,
) -> Vec<HistoryPoint> {
    let scales = fit.excitation.scales;
    let every = equations.len().div_ceil(POINTS).max(1);
    let mut gram = Gram::with_knowledge(fit);
    let mut points = Vec::new();
    for (k, equation) in equations.iter().enumerate() {
        gram.add(equation, k);
        if k % every != every - 1 && k + 1 != equations.len() {
            continue;
        }
        if let Some((values, std_devs)) = solve(&gram, &scales, known, bounding_box) {
            points.push(HistoryPoint {
                epoch: 0,
                time_s: equation.time_s,
                values,
                std_devs: Some(std_devs),
            });
        }
    }
    points
}

fn solve(
    gram: &Gram<'_>,
    scales: &SVector<f64, 10>,
    known: &SVector<f64, 10>,
    bounding_box: Option<&BoundingBox>,
) -> Option<([f64; 10], [f64; 10])> {
    let eigen = SymmetricEigen::new(gram.information);
    let directions = Directions::new(&eigen, *scales);
    let mut parameters = SVector::<f64, 10>::zeros();
    let mut covariance = SMatrix::<f64, 10, 10>::zeros();
    for (value, vector) in known_directions(&eigen) {
        parameters += vector * (vector.dot(&gram.target) / value);
        covariance.ger(NOISE_CORRELATION / value, &vector, &vector, 1.0);
    }
    let parameters = parameters.component_mul(scales) - known;
    let covariance = SMatrix::from_fn(|i, j| covariance[(i, j)] * scales[i] * scales[j]);
    let nearest = nearest_possible(&parameters, &covariance, scales, bounding_box);
    let parameters = nearest.map_or(parameters, |nearest| nearest.parameters);
    let values = values_of(&parameters)?;
    let std_devs = std_devs(&parameters, &covariance, scales, directions.unknown());
    Some((values, std_devs))
}
