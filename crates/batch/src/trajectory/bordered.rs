//! Least squares with a banded information matrix and a dense border of few columns.

use nalgebra::DMatrix;

/// A banded, positive definite matrix or its Cholesky factor, and a border of columns beside it.
/// Cost of the factor: `n b²` for `n` unknowns with a half-bandwidth of `b`.
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

    /// Adds a dense symmetric block to the matrix, from the unknown `first` on.
    pub(super) fn add(&mut self, first: usize, block: &DMatrix<f64>) {
        for i in 0..block.nrows() {
            let last = (first + i + 1) * self.width;
            let row = &mut self.rows[last - i - 1..last];
            for (entry, of_block) in row.iter_mut().zip(block.column(i).iter()) {
                *entry += of_block;
            }
        }
    }

    /// Adds to the border, from the unknown `first` on.
    pub(super) fn add_to_border(&mut self, first: usize, of_border: &DMatrix<f64>) {
        let rows = self.border[first * self.columns..].chunks_exact_mut(self.columns);
        for (row, of_border) in rows.zip(of_border.row_iter()) {
            for (entry, of_border) in row.iter_mut().zip(of_border.iter()) {
                *entry += of_border;
            }
        }
    }

    /// Factors the matrix `A = L Lᵀ`. `None` where it is not positive definite.
    pub(super) fn factor(&mut self) -> Option<()> {
        let width = self.width;
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
            row[width - 1] = square.sqrt();
        }
        Some(())
    }

    /// Returns the logarithm of the determinant of a matrix that was [factored](Self::factor).
    pub(super) fn log_determinant(&self) -> f64 {
        let roots = self.rows.iter().skip(self.width - 1).step_by(self.width);
        roots.map(|root| 2.0 * root.ln()).sum()
    }

    /// Returns `Gᵀ A⁻¹ G` and, row by row, `A⁻¹ G` for the border `G` beside a matrix that was
    /// [factored](Self::factor), and sets the border to zero.
    pub(super) fn solve(&mut self) -> (DMatrix<f64>, Vec<f64>) {
        let (width, columns) = (self.width, self.columns);
        for i in 0..self.unknowns() {
            let row = &self.rows[i * width..(i + 1) * width];
            let (before, own) = self.border.split_at_mut(i * columns);
            let own = &mut own[..columns];
            let skipped = width.saturating_sub(i + 1);
            let first = (i + skipped + 1 - width) * columns;
            let others = before[first..].chunks_exact(columns);
            for (entry, other) in row[skipped..width - 1].iter().zip(others) {
                for (own, other) in own.iter_mut().zip(other) {
                    *own -= entry * other;
                }
            }
            own.iter_mut().for_each(|own| *own /= row[width - 1]);
        }
        let half = DMatrix::from_column_slice(columns, self.unknowns(), &self.border);
        let explained = &half * half.transpose();
        for i in (0..self.unknowns()).rev() {
            let row = &self.rows[i * width..(i + 1) * width];
            let (before, own) = self.border.split_at_mut(i * columns);
            let own = &mut own[..columns];
            own.iter_mut().for_each(|entry| *entry /= row[width - 1]);
            let skipped = width.saturating_sub(i + 1);
            let first = (i + skipped + 1 - width) * columns;
            let others = before[first..].chunks_exact_mut(columns);
            for (entry, other) in row[skipped..width - 1].iter().zip(others) {
                for (other, own) in other.iter_mut().zip(own.iter()) {
                    *other -= entry * own;
                }
            }
        }
        let zeros = vec![0.0; self.border.len()];
        (explained, std::mem::replace(&mut self.border, zeros))
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
            system.add(step * block, &square);
            system.add_to_border(step * block, &product);
            let first = step * block;
            let mut place = dense.view_mut((first, first), (size, size));
            place += &square;
            let mut place = border.view_mut((first, 0), (size, columns));
            place += &product;
        }
        let inverse = dense.try_inverse().expect("positive definite");
        let expected = &inverse * &border;
        system.factor().expect("positive definite");
        // The border of a second solution is another one.
        for factor in [1.0, 2.0] {
            let (explained, solution) = system.solve();
            let products = border.transpose() * &expected * factor;
            assert!((explained - &products * factor).amax() < 1e-10 * products.amax());
            let found = DMatrix::from_row_slice(unknowns, columns, &solution);
            assert!((found - &expected * factor).amax() < 1e-9 * expected.amax());
            system.add_to_border(0, &(&border * 2.0));
        }
    }

    /// A matrix that is not positive definite is refused.
    #[test]
    fn a_singular_matrix_has_no_factor() {
        let mut system = Bordered::zeros(2, 2, 1);
        system.add(0, &DMatrix::repeat(2, 2, 1.0));
        assert!(system.factor().is_none());
    }
}
