//! How the estimate and its uncertainty came about over a recording.

use nalgebra::{DMatrix, SMatrix, SVector, SymmetricEigen};

use super::outcome::HistoryPoint;
use crate::equation::Equation;
use crate::fit::{self, Directions, Fit};
use crate::physical::nearest_possible;
use crate::uncertainty::{deviations, values_of};
use crate::window::NOISE_CORRELATION;

/// About how many points there are.
const POINTS: usize = 600;

/// The estimate after each part of the equations, with the weights of the fit over all of them.
/// `known` is taken off each.
pub(crate) fn history(
    equations: &[Equation],
    fit: &Fit,
    known: &SVector<f64, 10>,
) -> Vec<HistoryPoint> {
    let scales = fit.excitation.scales;
    let every = equations.len().div_ceil(POINTS).max(1);
    let mut gram = SMatrix::<f64, 10, 10>::zeros();
    let mut target = SVector::<f64, 10>::zeros();
    let mut points = Vec::new();
    let mut block = DMatrix::zeros(fit.noise.channels(), 11);
    for (k, (equation, weight)) in equations.iter().zip(&fit.weights).enumerate() {
        // What the motion's noise adds is taken off, as in the fit.
        for (rows, sign) in [(&equation.rows, 1.0), (&equation.differences, -1.0)] {
            for (channel, row) in rows.iter().enumerate() {
                let scaled = row.regressor.component_mul(&scales);
                let mut entries = block.view_mut((channel, 0), (1, 10));
                entries.copy_from(&scaled.transpose());
                block[(channel, 10)] = row.wanted;
            }
            fit.noise.whiten(&mut block);
            let (rows, wanted) = (block.fixed_columns::<10>(0), block.column(10));
            gram.gemm_tr(sign * weight, &rows, &rows, 1.0);
            target.gemv_tr(sign * weight, &rows, &wanted, 1.0);
        }
        if k % every != every - 1 && k + 1 != equations.len() {
            continue;
        }
        if let Some((values, deviations)) = solve(&gram, &target, &scales, known) {
            points.push(HistoryPoint {
                epoch: 0,
                time_s: equation.time_s,
                values,
                deviations: Some(deviations),
            });
        }
    }
    points
}

fn solve(
    gram: &SMatrix<f64, 10, 10>,
    target: &SVector<f64, 10>,
    scales: &SVector<f64, 10>,
    known: &SVector<f64, 10>,
) -> Option<([f64; 10], [f64; 10])> {
    let eigen = SymmetricEigen::new(*gram);
    let directions = Directions::new(&eigen, *scales);
    let mut parameters = SVector::<f64, 10>::zeros();
    let mut covariance = SMatrix::<f64, 10, 10>::zeros();
    for (value, vector) in fit::known(&eigen) {
        parameters += vector * (vector.dot(target) / value);
        covariance.ger(NOISE_CORRELATION / value, &vector, &vector, 1.0);
    }
    let parameters = parameters.component_mul(scales) - known;
    let covariance = SMatrix::from_fn(|i, j| covariance[(i, j)] * scales[i] * scales[j]);
    let parameters =
        nearest_possible(&parameters, &covariance).map_or(parameters, |nearest| nearest.parameters);
    let values = values_of(&parameters)?;
    let deviations = deviations(&parameters, &covariance, scales, directions.unknown());
    Some((values, deviations))
}
