//! Least squares with a banded information matrix and a dense border of few columns.

use nalgebra::DMatrix;

/// Cholesky factor of a banded, positive definite matrix, and what it does to a border of columns
/// beside it. Cost: `n b²` for `n` unknowns with a half-bandwidth of `b`.
#[derive(Clone, Debug)]
pub(super) struct Bordered {
    /// Number of entries of a row of the lower triangle within the band, the diagonal among them.
    width: usize,
    /// Rows of the lower triangle, each from the first entry of the band to the diagonal.
    rows: Vec<f64>,
    /// Columns of the border, row by row.
    border: Vec<f64>,
    /// Number of columns of the border.
    columns: usize,
}

impl Bordered {
    /// Creates a matrix of zeros with so many unknowns, rows of the band of so many entries, and so
    /// many columns beside it.
    pub(super) fn zeros(unknowns: usize, width: usize, columns: usize) -> Self {
        Self {
            width,
            rows: vec![0.0; unknowns * width],
            border: vec![0.0; unknowns * columns],
            columns,
        }
    }

    /// Number of unknowns.
    fn unknowns(&self) -> usize {
        self.rows.len() / self.width
    }

    /// Adds a dense symmetric block to the matrix, and `of_border` to the border, both from the
    /// unknown `first` on.
    pub(super) fn add(&mut self, first: usize, block: &DMatrix<f64>, of_border: &DMatrix<f64>) {
        let size = block.nrows();
        for i in 0..size {
            let last = (first + i + 1) * self.width;
            let row = &mut self.rows[last - i - 1..last];
            for (entry, of_block) in row.iter_mut().zip(block.column(i).iter()) {
                *entry += of_block;
            }
            let begin = (first + i) * self.columns;
            let border = &mut self.border[begin..begin + self.columns];
            for (k, entry) in border.iter_mut().enumerate() {
                *entry += of_border[(i, k)];
            }
        }
    }

    /// Factors the matrix `A = L Lᵀ`, and replaces the border `G` by `L⁻¹ G`. `None` where the
    /// matrix is not positive definite.
    pub(super) fn factor(&mut self) -> Option<()> {
        let (width, columns) = (self.width, self.columns);
        for i in 0..self.unknowns() {
            let (before, row) = self.rows.split_at_mut(i * width);
            let row = &mut row[..width];
            let skipped = width.saturating_sub(i + 1);
            for at in skipped..width - 1 {
                let j = i + at + 1 - width;
                // Entries of the row j that are in the band of the row i, too.
                let shift = i - j;
                let other = &before[j * width..(j + 1) * width];
                let sum = dot(&other[shift + skipped..width - 1], &row[skipped..at]);
                row[at] = (row[at] - sum) / other[width - 1];
            }
            let square = row[width - 1] - dot(&row[skipped..width - 1], &row[skipped..width - 1]);
            if square.is_nan() || square <= row[width - 1] * f64::EPSILON {
                return None;
            }
            let diagonal = square.sqrt();
            row[width - 1] = diagonal;
            let (before, border) = self.border.split_at_mut(i * columns);
            let border = &mut border[..columns];
            for (at, entry) in row.iter().enumerate().take(width - 1).skip(skipped) {
                let j = i + at + 1 - width;
                let other = &before[j * columns..(j + 1) * columns];
                for (own, other) in border.iter_mut().zip(other) {
                    *own -= entry * other;
                }
            }
            border.iter_mut().for_each(|own| *own /= diagonal);
        }
        Some(())
    }

    /// Returns `Gᵀ A⁻¹ G` of a border that was [factored](Self::factor).
    pub(super) fn explained(&self) -> DMatrix<f64> {
        let columns = self.columns;
        let mut products = DMatrix::zeros(columns, columns);
        for row in self.border.chunks_exact(columns) {
            for i in 0..columns {
                for j in 0..columns {
                    products[(i, j)] += row[i] * row[j];
                }
            }
        }
        products
    }

    /// Returns `A⁻¹ G`, row by row, of a border that was [factored](Self::factor).
    pub(super) fn solution(mut self) -> Vec<f64> {
        let (width, columns) = (self.width, self.columns);
        for i in (0..self.unknowns()).rev() {
            let row = &self.rows[i * width..(i + 1) * width];
            let (before, own) = self.border.split_at_mut(i * columns);
            let own = &mut own[..columns];
            own.iter_mut().for_each(|entry| *entry /= row[width - 1]);
            let skipped = width.saturating_sub(i + 1);
            for (at, entry) in row.iter().enumerate().take(width - 1).skip(skipped) {
                let j = i + at + 1 - width;
                let other = &mut before[j * columns..(j + 1) * columns];
                for (other, own) in other.iter_mut().zip(own.iter()) {
                    *other -= entry * own;
                }
            }
        }
        self.border
    }
}

/// Returns the product of two vectors of the same length, in four sums that can be computed at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a
        .remainder()
        .iter()
        .zip(b.remainder())
        .map(|(a, b)| a * b)
        .sum();
    let mut sums = [0.0; 4];
    for (a, b) in a.zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    rest + (sums[0] + sums[2]) + (sums[1] + sums[3])
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    /// Overlapping blocks with a border give the solution of the dense matrix that they sum to.
    #[test]
    fn a_band_with_a_border_is_solved_as_the_dense_matrix() {
        let mut random = SmallRng::seed_from_u64(5);
        let (size, columns, step, blocks) = (6, 3, 2, 7);
        let unknowns = size + step * (blocks - 1);
        let mut system = Bordered::zeros(unknowns, size, columns);
        let mut dense = DMatrix::<f64>::zeros(unknowns, unknowns);
        let mut border = DMatrix::<f64>::zeros(unknowns, columns);
        for block in 0..blocks {
            let mut draw = |columns| {
                DMatrix::from_fn(size + 2, columns, |_, _| random.random_range(-1.0..1.0))
            };
            let (rows, targets) = (draw(size), draw(columns));
            let (square, product) = (rows.transpose() * &rows, rows.transpose() * &targets);
            system.add(step * block, &square, &product);
            let first = step * block;
            let mut place = dense.view_mut((first, first), (size, size));
            place += &square;
            let mut place = border.view_mut((first, 0), (size, columns));
            place += &product;
        }
        let inverse = dense.try_inverse().expect("positive definite");
        let expected = &inverse * &border;
        system.factor().expect("positive definite");
        let explained = border.transpose() * &expected;
        assert!((system.explained() - &explained).amax() < 1e-10 * explained.amax());
        let found = DMatrix::from_row_slice(unknowns, columns, &system.solution());
        assert!((found - &expected).amax() < 1e-9 * expected.amax());
    }

    /// A matrix that is not positive definite is refused.
    #[test]
    fn a_singular_matrix_has_no_factor() {
        let mut system = Bordered::zeros(2, 2, 1);
        system.add(0, &DMatrix::repeat(2, 2, 1.0), &DMatrix::repeat(2, 1, 1.0));
        assert!(system.factor().is_none());
    }
}
