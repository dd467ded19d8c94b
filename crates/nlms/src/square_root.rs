//! Least squares in square-root information form: a QR decomposition that grows by rows.

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

/// Weight of the initial value of a parameter relative to the size of its column, the root of the
/// rounding error: small enough to leave no trace beyond rounding in a direction that the rows
/// excite, large enough to hold at its initial value a direction that only rounding excites.
const START_WEIGHT: f64 = 1.5e-8;

/// Weight of the initial value of a parameter with a column of zeros: any weight leaves the
/// parameter at its initial value.
const UNSEEN_WEIGHT: f64 = 1e-100;

/// Ratio of a diagonal entry of `R` to the size of its column below which it is rounding.
const ROUNDING: f64 = 1e-12;

/// Squared lengths for which the sums of squares in a Householder reflection neither overflow nor
/// lose digits to underflow.
const SAFE_SQUARES: Range<f64> = 1e-150..1e150;

/// Upper triangular `R`, vector `z` and scalar `s` with `|A x - b|² = |R x - z|² + s` for every
/// `x`, where `A x = b` are all rows so far.
#[derive(Clone, Debug)]
pub(crate) struct SquareRootInformation<const N: usize> {
    /// `Rᵀ`, so that a row of `R` is contiguous. `RᵀR` is the information matrix. An entry of the
    /// diagonal is positive, or the whole row of `R` is zero.
    lower: SMatrix<f64, N, N>,
    /// `z`, the targets transformed like the rows.
    transformed_target: SVector<f64, N>,
    /// `s`, the sum of squared residuals at the least-squares solution.
    pub(crate) residual_squares: f64,
}

impl<const N: usize> SquareRootInformation<N> {
    /// Returns the form without rows.
    pub(crate) fn new() -> Self {
        Self {
            lower: SMatrix::zeros(),
            transformed_target: SVector::zeros(),
            residual_squares: 0.0,
        }
    }

    /// Returns the same form with one more row for each parameter, which says with a small weight
    /// that the parameter has its initial value: `R` is then regular. The weight is relative to the
    /// column of the parameter, so that the units of the parameters do not matter.
    pub(crate) fn regularised(&self, start: &SVector<f64, N>) -> Self {
        let mut rows: [_; N] = std::array::from_fn(|k| {
            let size = self.column_size(k);
            let weight = if size > 0.0 {
                START_WEIGHT * size
            } else {
                UNSEEN_WEIGHT
            };
            let mut row = SVector::zeros();
            row[k] = weight;
            (row, weight * start[k])
        });
        let mut regular = self.clone();
        regular.update_all(&mut rows);
        regular
    }

    /// Size of the column of a parameter in `R`, its largest entry: between its length over `√N`
    /// and its length.
    fn column_size(&self, parameter: usize) -> f64 {
        self.lower.row(parameter).amax()
    }

    /// Returns whether the rows determine every parameter.
    pub(crate) fn is_regular(&self) -> bool {
        (0..N).all(|k| self.lower[(k, k)] > ROUNDING * self.column_size(k))
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
            let diagonal = self.lower[(k, k)];
            let length = diagonal.hypot(row[k]);
            let (cosine, sine) = (diagonal / length, row[k] / length);
            for column in k..N {
                let (above, below) = (self.lower[(column, k)], row[column]);
                self.lower[(column, k)] = cosine * above + sine * below;
                row[column] = cosine * below - sine * above;
            }
            let above = self.transformed_target[k];
            self.transformed_target[k] = cosine * above + sine * target;
            target = cosine * target - sine * above;
        }
        self.residual_squares += target * target;
    }

    /// Updates with several rows by Householder reflections, each of which eliminates one entry of
    /// all rows (Golub and Van Loan, *Matrix Computations*, algorithm 5.1.1): `N²`
    /// multiplications per row and `N` square roots in total. The rows serve as scratch memory.
    pub(crate) fn update_all(&mut self, rows: &mut [(SVector<f64, N>, f64)]) {
        if rows.is_empty() {
            return;
        }
        for k in 0..N {
            // The entries before `k` are zero. Where their number is a constant, the compiler
            // unrolls the sums over the others.
            let is_eliminated = match k / 2 {
                0 => self.eliminate(k, 0, rows),
                1 => self.eliminate(k, 2, rows),
                2 => self.eliminate(k, 4, rows),
                3 => self.eliminate(k, 6, rows),
                4 => self.eliminate(k, 8, rows),
                pairs => self.eliminate(k, 2 * pairs, rows),
            };
            if !is_eliminated {
                // Givens rotations form no squares of entries.
                rows.iter()
                    .for_each(|(row, target)| self.update(row, *target));
                return;
            }
        }
        self.residual_squares += rows.iter().map(|(_, target)| target * target).sum::<f64>();
    }

    /// Reflects row `k` of `R` and the rows such that entry `k` of the rows vanishes. The rows'
    /// entries before `first`, at most `k`, are zero. Returns `false`, and changes nothing, where
    /// the squares of the entries are out of range.
    #[inline(always)]
    fn eliminate(&mut self, k: usize, first: usize, rows: &mut [(SVector<f64, N>, f64)]) -> bool {
        // Products of entry k of the rows with all others: nothing here waits for the length below.
        let (products, target_product) = products(rows, k, first);
        let (diagonal, row_squares) = (self.lower[(k, k)], products[k]);
        let square = diagonal * diagonal + row_squares;
        if square == 0.0 && rows.iter().all(|(row, _)| row[k] == 0.0) {
            return true;
        }
        if !SAFE_SQUARES.contains(&square) {
            return false;
        }
        if row_squares <= f64::EPSILON.powi(2) * square {
            rows.iter_mut().for_each(|(row, _)| row[k] = 0.0);
        } else {
            // The Householder vector is diagonal - length, and below it column k of the rows. Of
            // its reflection only the last step waits for the root: a division by it is a product
            // with length / square.
            let inverse_row_squares = row_squares.recip();
            let inverse_square = square.recip();
            let length = square.sqrt();
            let inverse_length = length * inverse_square;
            // Returns an entry of row k of R, reflected, and the multiple of column k that its
            // column of the rows loses.
            let reflect = |above: f64, product: f64| {
                let ratio = product * inverse_row_squares;
                (
                    (diagonal * above + product) * inverse_length,
                    ratio + (diagonal * ratio - above) * inverse_length,
                )
            };
            let mut multiples = products;
            let above = &mut self.lower.as_mut_slice()[k * N + first..(k + 1) * N];
            let multiples = &mut multiples.as_mut_slice()[first..];
            for (multiple, above) in multiples.iter_mut().zip(above) {
                (*above, *multiple) = reflect(*above, *multiple);
            }
            self.lower[(k, k)] = length;
            multiples[k - first] = 1.0; // But for rounding it is one: entry k of the rows vanishes exactly.
            let target_above = &mut self.transformed_target[k];
            let target_multiple;
            (*target_above, target_multiple) = reflect(*target_above, target_product);
            for (row, target) in &mut *rows {
                let entry = row[k];
                add_scaled(&mut row.as_mut_slice()[first..], -entry, multiples);
                *target -= target_multiple * entry;
            }
        }
        true
    }

    /// Returns the least-squares solution `R⁻¹ z` in `N²/2` multiplications. `R` must be regular.
    pub(crate) fn solve(&self) -> SVector<f64, N> {
        let mut parameters = self.transformed_target;
        self.lower.tr_solve_lower_triangular_mut(&mut parameters);
        parameters
    }

    /// Returns the inverse of the information matrix, `R⁻¹ R⁻ᵀ`, in about `N³` multiplications. `R`
    /// must be regular.
    pub(crate) fn inverse_information(&self) -> SMatrix<f64, N, N> {
        let mut inverse = SMatrix::<f64, N, N>::identity();
        self.lower.tr_solve_lower_triangular_mut(&mut inverse);
        inverse * inverse.transpose()
    }

    /// Returns `R`.
    pub(crate) fn root(&self) -> SMatrix<f64, N, N> {
        self.lower.transpose()
    }

    /// Returns `z`.
    pub(crate) fn transformed_target(&self) -> SVector<f64, N> {
        self.transformed_target
    }
}

/// Returns the sums over the rows of entry `k` times the entries from `first` on, and times the
/// target. Rows are summed in pairs, since an addition has to wait for the one before it.
#[inline(always)]
fn products<const N: usize>(
    rows: &[(SVector<f64, N>, f64)],
    k: usize,
    first: usize,
) -> (SVector<f64, N>, f64) {
    let (mut sums, mut target_sum) = (SVector::<f64, N>::zeros(), 0.0);
    let (pairs, single) = rows.as_chunks::<2>();
    for [(a, target_a), (b, target_b)] in pairs {
        let (entry_a, entry_b) = (a[k], b[k]);
        let both = a.as_slice()[first..].iter().zip(&b.as_slice()[first..]);
        for (sum, (a, b)) in sums.as_mut_slice()[first..].iter_mut().zip(both) {
            *sum += entry_a * a + entry_b * b;
        }
        target_sum += entry_a * target_a + entry_b * target_b;
    }
    for (row, target) in single {
        add_scaled(
            &mut sums.as_mut_slice()[first..],
            row[k],
            &row.as_slice()[first..],
        );
        target_sum += row[k] * target;
    }
    (sums, target_sum)
}

/// Adds `factor` times some values.
#[inline(always)]
fn add_scaled(sums: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    use proptest::prelude::*;

    use super::*;

    fn filled(entries: &[f64]) -> SquareRootInformation<3> {
        let mut filled = SquareRootInformation::new();
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
            start.lower *= size;
            start.transformed_target *= size;
            let (mut one, mut all) = (start.clone(), start);
            let mut rows: Vec<_> = entries[4 * 8..]
                .chunks(4)
                .map(|row| (Vector3::new(row[0], row[1], row[2]) * size, row[3] * size))
                .collect();
            rows.iter().for_each(|(row, target)| one.update(row, *target));
            all.update_all(&mut rows);
            let difference = (one.lower - all.lower).abs().max() / one.lower.abs().max()
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
            let (root, target) = (filled.root(), filled.transformed_target);
            prop_assert!((root.transpose() * root - matrix).norm() < 1e-9 * matrix.norm());
            prop_assert!((root.transpose() * target - vector).norm() < 1e-9 * matrix.norm());
            let squares = target.norm_squared() + filled.residual_squares;
            prop_assert!((squares - scalar).abs() < 1e-9 * scalar);
        }
    }
}
