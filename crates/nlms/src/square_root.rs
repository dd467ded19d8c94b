//! Least squares in square-root information form: a QR decomposition that grows by rows.

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

/// Initial diagonal of `R`, in the unit of a row's entries: small enough to leave no trace in a
/// direction that rows of about unit size excite (1e-12 of their information), large enough to
/// hold every other direction at its initial value.
const INITIAL_DIAGONAL: f64 = 1e-6;

/// Squared lengths for which the sums of squares in a Householder reflection neither overflow nor
/// lose digits to underflow.
const SAFE_SQUARES: Range<f64> = 1e-250..1e250;

/// Upper triangular `R`, vector `z` and scalar `s` with `|A x - b|² = |R x - z|² + s` for every `x`,
/// where `A x = b` are all rows so far.
#[derive(Clone, Debug)]
pub(crate) struct SquareRootInformation<const N: usize> {
    /// `R`, with a positive diagonal: `RᵀR` is the information matrix.
    root: SMatrix<f64, N, N>,
    /// `z`, the targets transformed like the rows.
    transformed_target: SVector<f64, N>,
    /// `s`, the sum of squared residuals at the least-squares solution.
    residual_squares: f64,
}

impl<const N: usize> SquareRootInformation<N> {
    /// Returns the form without rows, with a weight on `parameters` that shows only in directions
    /// that no row excites. `R` is regular, and stays so because updates never shrink its diagonal.
    pub(crate) fn starting_at(parameters: &SVector<f64, N>) -> Self {
        let root = SMatrix::identity() * INITIAL_DIAGONAL;
        Self {
            root,
            transformed_target: root * parameters,
            residual_squares: 0.0,
        }
    }

    /// Updates with one row by Givens rotations (Golub and Van Loan, *Matrix Computations*, section
    /// 6.5): `2 N²` multiplications and `N` square roots.
    pub(crate) fn update(&mut self, row: &SVector<f64, N>, target: f64) {
        let (mut row, mut target) = (*row, target);
        for k in 0..N {
            if row[k] == 0.0 {
                continue;
            }
            // Rotates row k of R and the new row such that entry k of the new row vanishes.
            let diagonal = self.root[(k, k)];
            let length = diagonal.hypot(row[k]);
            let (cosine, sine) = (diagonal / length, row[k] / length);
            for column in k..N {
                let (above, below) = (self.root[(k, column)], row[column]);
                self.root[(k, column)] = cosine * above + sine * below;
                row[column] = cosine * below - sine * above;
            }
            let above = self.transformed_target[k];
            self.transformed_target[k] = cosine * above + sine * target;
            target = cosine * target - sine * above;
        }
        self.residual_squares += target * target;
    }

    /// Updates with several rows by Householder reflections, each of which eliminates one entry of
    /// all rows (Golub and Van Loan, *Matrix Computations*, algorithm 5.1.1): `2 N²`
    /// multiplications per row and `N` square roots in total. The rows serve as scratch memory.
    pub(crate) fn update_all(&mut self, rows: &mut [(SVector<f64, N>, f64)]) {
        for k in 0..N {
            let diagonal = self.root[(k, k)];
            let row_squares: f64 = rows.iter().map(|(row, _)| row[k] * row[k]).sum();
            let square = diagonal * diagonal + row_squares;
            if !SAFE_SQUARES.contains(&square) {
                // Givens rotations form no squares of entries.
                rows.iter()
                    .for_each(|(row, target)| self.update(row, *target));
                return;
            }
            if row_squares > f64::EPSILON.powi(2) * square {
                self.reflect(k, rows, row_squares, square.sqrt());
            }
            rows.iter_mut().for_each(|(row, _)| row[k] = 0.0);
        }
        self.residual_squares += rows.iter().map(|(_, target)| target * target).sum::<f64>();
    }

    /// Reflects row `k` of `R` and the rows such that entry `k` of the rows vanishes and the diagonal
    /// becomes `length`. `row_squares` is the sum of the squared entries `k` of the rows.
    fn reflect(
        &mut self,
        k: usize,
        rows: &mut [(SVector<f64, N>, f64)],
        row_squares: f64,
        length: f64,
    ) {
        // First entry of the Householder vector, diagonal - length, written without cancellation.
        // Its other entries are column k of the rows.
        let first = -row_squares / (self.root[(k, k)] + length);
        let scale = -(first * length).recip();
        let mut above = self.root.row(k).transpose();
        let (mut projection, mut target_projection) =
            (above * first, self.transformed_target[k] * first);
        for (row, target) in &*rows {
            projection.axpy(row[k], row, 1.0);
            target_projection += target * row[k];
        }
        projection *= scale;
        target_projection *= scale;
        above.axpy(-first, &projection, 1.0);
        above[k] = length;
        self.root.set_row(k, &above.transpose());
        self.transformed_target[k] -= target_projection * first;
        for (row, target) in rows {
            let entry = row[k];
            row.axpy(-entry, &projection, 1.0);
            *target -= target_projection * entry;
        }
    }

    /// Returns the least-squares solution `R⁻¹ z` in `N²/2` multiplications.
    pub(crate) fn solve(&self) -> SVector<f64, N> {
        let mut parameters = self.transformed_target;
        self.root.solve_upper_triangular_mut(&mut parameters);
        parameters
    }

    /// Returns the inverse of the information matrix, `R⁻¹ R⁻ᵀ`, in about `N³` multiplications.
    pub(crate) fn inverse_information(&self) -> SMatrix<f64, N, N> {
        let mut inverse = SMatrix::<f64, N, N>::identity();
        self.root.solve_upper_triangular_mut(&mut inverse);
        inverse * inverse.transpose()
    }

    pub(crate) fn root(&self) -> &SMatrix<f64, N, N> {
        &self.root
    }

    pub(crate) fn residual_squares(&self) -> f64 {
        self.residual_squares
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    use proptest::prelude::*;

    use super::*;

    fn filled(entries: &[f64]) -> SquareRootInformation<3> {
        let mut filled = SquareRootInformation::starting_at(&Vector3::zeros());
        for row in entries.chunks(4) {
            filled.update(&Vector3::new(row[0], row[1], row[2]), row[3]);
        }
        filled
    }

    proptest! {
        /// Several rows at once give the same as one after another, also where squares of the
        /// entries are out of range.
        #[test]
        fn several_rows_at_once_equal_single_rows(
            entries in proptest::collection::vec(-5.0..5.0f64, 4 * 20),
            size in proptest::sample::select(vec![1.0, 1e-160, 1e-120, 1e120]),
        ) {
            let mut start = filled(&entries[..4 * 8]);
            start.root *= size;
            start.transformed_target *= size;
            let (mut one, mut all) = (start.clone(), start);
            let mut rows: Vec<_> = entries[4 * 8..]
                .chunks(4)
                .map(|row| (Vector3::new(row[0], row[1], row[2]) * size, row[3] * size))
                .collect();
            rows.iter().for_each(|(row, target)| one.update(row, *target));
            all.update_all(&mut rows);
            let difference = (one.root - all.root).abs().max() / one.root.abs().max()
                + (one.transformed_target - all.transformed_target).abs().max()
                    / one.transformed_target.abs().max();
            prop_assert!(difference < 1e-12, "{difference:e}");
            if size == 1.0 {
                let difference = (one.residual_squares - all.residual_squares).abs();
                prop_assert!(difference < 1e-12 * one.residual_squares, "{difference:e}");
            }
        }

        /// The form holds `AᵀA`, `Aᵀb` and `bᵀb`.
        #[test]
        fn holds_the_moments(entries in proptest::collection::vec(-5.0..5.0f64, 4 * 20)) {
            let filled = filled(&entries);
            let (mut matrix, mut vector, mut scalar) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
            for row in entries.chunks(4) {
                let entries = Vector3::new(row[0], row[1], row[2]);
                matrix += entries * entries.transpose();
                vector += entries * row[3];
                scalar += row[3] * row[3];
            }
            let (root, target) = (filled.root, filled.transformed_target);
            prop_assert!((root.transpose() * root - matrix).norm() < 1e-9 * matrix.norm());
            prop_assert!((root.transpose() * target - vector).norm() < 1e-9 * matrix.norm());
            let squares = target.norm_squared() + filled.residual_squares;
            prop_assert!((squares - scalar).abs() < 1e-9 * scalar);
        }
    }
}
