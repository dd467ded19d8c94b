//! Sums of products of rows of fixed width, in blocks that fit into registers.

use nalgebra::SMatrix;

/// Number of entries of a row: ten parameters, the delay, and a target or a residual.
pub(crate) const WIDTH: usize = 12;

/// A row of [`WIDTH`] entries.
pub(crate) type WideRow = [f64; WIDTH];

/// Rows and columns of a block of products.
const BLOCK: usize = 4;

/// The sum `Σ weight · leftᵀ right` over the windows of a fit, each with a row for each channel.
#[derive(Clone, Debug)]
pub(crate) struct Products {
    sums: [WideRow; WIDTH],
}

impl Products {
    /// Returns the sum over no windows.
    pub(crate) fn zero() -> Self {
        Self {
            sums: [[0.0; WIDTH]; WIDTH],
        }
    }

    /// Adds the products of a window's rows with others.
    #[inline(always)]
    pub(crate) fn add(&mut self, left: &[WideRow], right: &[WideRow], weight: f64) {
        for first in (0..WIDTH).step_by(BLOCK) {
            for other in (0..WIDTH).step_by(BLOCK) {
                self.add_block(left, right, weight, first, other);
            }
        }
    }

    /// Adds the products of a window's rows with themselves to the blocks on and below the
    /// diagonal. The blocks above are left as they are.
    #[inline(always)]
    pub(crate) fn add_lower(&mut self, rows: &[WideRow], weight: f64) {
        for first in (0..WIDTH).step_by(BLOCK) {
            for other in (0..=first).step_by(BLOCK) {
                self.add_block(rows, rows, weight, first, other);
            }
        }
    }

    /// Adds the products of [`BLOCK`] columns on the left, from `first` on, with as many on the
    /// right, from `other` on.
    #[inline(always)]
    fn add_block(
        &mut self,
        left: &[WideRow],
        right: &[WideRow],
        weight: f64,
        first: usize,
        other: usize,
    ) {
        let mut block = [[0.0; BLOCK]; BLOCK];
        for (left, right) in left.iter().zip(right) {
            for (sums, a) in block.iter_mut().zip(&left[first..first + BLOCK]) {
                for (sum, b) in sums.iter_mut().zip(&right[other..other + BLOCK]) {
                    *sum += a * b;
                }
            }
        }
        for (sums, block) in self.sums[first..first + BLOCK].iter_mut().zip(&block) {
            for (sum, product) in sums[other..other + BLOCK].iter_mut().zip(block) {
                *sum += weight * product;
            }
        }
    }

    /// Returns the sum of the products of two columns.
    pub(crate) fn entry(&self, i: usize, j: usize) -> f64 {
        self.sums[i][j]
    }

    /// Returns the sum of the products of two columns that are on or below the diagonal, or the one
    /// mirrored there.
    pub(crate) fn symmetric(&self, i: usize, j: usize) -> f64 {
        self.sums[i.max(j)][i.min(j)]
    }

    /// Returns the leading symmetric square of a sum of [`add_lower`](Self::add_lower).
    pub(crate) fn square<const N: usize>(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| self.symmetric(i, j))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    /// The sums are those of plain matrix products, on both sides of the diagonal.
    #[test]
    fn sums_are_those_of_matrix_products() {
        let mut random = SmallRng::seed_from_u64(1);
        let mut rows = |count: usize| -> Vec<WideRow> {
            let mut row = || std::array::from_fn(|_| random.random_range(-1.0..1.0));
            (0..count).map(|_| row()).collect()
        };
        let plain = |rows: &[WideRow]| DMatrix::from_fn(rows.len(), WIDTH, |i, k| rows[i][k]);
        let (mut products, mut squares) = (Products::zero(), Products::zero());
        let mut expected = DMatrix::<f64>::zeros(WIDTH, WIDTH);
        let mut of_squares = expected.clone();
        for (channels, weight) in [(6, 1.0), (1, 0.5), (13, -2.0)] {
            let (left, right) = (rows(channels), rows(channels));
            products.add(&left, &right, weight);
            squares.add_lower(&left, weight);
            expected += plain(&left).tr_mul(&plain(&right)) * weight;
            of_squares += plain(&left).tr_mul(&plain(&left)) * weight;
        }
        for (i, j) in (0..WIDTH).flat_map(|i| (0..WIDTH).map(move |j| (i, j))) {
            assert!((products.entry(i, j) - expected[(i, j)]).abs() < 1e-13);
            assert!((squares.symmetric(i, j) - of_squares[(i, j)]).abs() < 1e-13);
        }
        let square = squares.square::<10>();
        assert_eq!(square[(2, 7)], squares.entry(7, 2));
    }
}
