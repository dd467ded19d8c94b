//! The products of windows that share samples, for stationary noise.

use nalgebra::DMatrix;

use super::{MeatEstimator, add};
use crate::fit::products::{Products, WIDTH, WideRow};
use crate::fit::vector_unit::Computation;

/// Sums over all windows for [`MeatEstimator`]'s meat of stationary noise: the products of the rows
/// of a window and of those of later windows, which the covariances of the residuals weight, with
/// its own rows.
#[derive(Clone, Copy)]
pub(super) struct ProductsOfNeighbours<'a> {
    pub(super) estimator: &'a MeatEstimator<'a>,
    /// Covariance of the residuals of two windows for each lag.
    pub(super) covariances: &'a [DMatrix<f64>],
}

impl Computation for ProductsOfNeighbours<'_> {
    type Output = [Products; 2];

    #[inline(always)]
    fn compute(self) -> [Products; 2] {
        let Self {
            estimator,
            covariances,
        } = self;
        let (mut same_window, mut neighbours) = (Products::zero(), Products::zero());
        let mut weighted = vec![[0.0; WIDTH]; estimator.channels];
        for k in 0..estimator.count() {
            weighted.fill([0.0; WIDTH]);
            add_weighted(&mut weighted, &covariances[0], estimator.entries(k));
            same_window.add(estimator.entries(k), &weighted, 1.0);
            weighted.fill([0.0; WIDTH]);
            let later = k + 1..estimator.count();
            for (covariance, later) in covariances[1..].iter().zip(later) {
                add_weighted(&mut weighted, covariance, estimator.entries(later));
            }
            neighbours.add(estimator.entries(k), &weighted, 1.0);
        }
        [same_window, neighbours]
    }
}

/// Adds a matrix over the channels times rows.
#[inline(always)]
fn add_weighted(sums: &mut [WideRow], matrix: &DMatrix<f64>, rows: &[WideRow]) {
    for (column, row) in matrix.column_iter().zip(rows) {
        for (sum, weight) in sums.iter_mut().zip(&column) {
            add(sum, row, *weight);
        }
    }
}
