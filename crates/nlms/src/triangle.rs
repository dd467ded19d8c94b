//! The triangle of a QR decomposition that grows by a row at a time.

use nalgebra::{SMatrix, SVector};

use crate::SettingError;

/// Weight of the start against one row of unit size: small enough to leave no trace in an excited
/// direction, large enough to hold a direction that no row excites where it started.
const WEAK: f64 = 1e-6;

/// Squares and what rounding is of them are in range.
const SAFE_SQUARES: std::ops::Range<f64> = 1e-250..1e250;

/// What least squares need of the rows so far: `R`, `z` and the residuals' squares, such that
/// `|A x - b|² = |R x - z|² + residual_squares` for every `x`.
#[derive(Clone, Debug)]
pub(crate) struct Triangle<const N: usize> {
    /// `R`, upper triangular with no negative diagonal: `RᵀR` is the information.
    root: SMatrix<f64, N, N>,
    /// `z` in `R x = z`.
    target: SVector<f64, N>,
    residual_squares: f64,
}

impl<const N: usize> Triangle<N> {
    /// Of no rows: singular until every direction has been excited.
    pub(crate) fn empty() -> Self {
        Self {
            root: SMatrix::zeros(),
            target: SVector::zeros(),
            residual_squares: 0.0,
        }
    }

    /// Of so weak a belief in `parameters` that it shows only where no row says anything. Never
    /// singular, now or later: turning rows in lets the diagonal only grow.
    pub(crate) fn weak(parameters: &SVector<f64, N>) -> Self {
        let root = SMatrix::identity() * WEAK;
        Self {
            root,
            target: root * parameters,
            residual_squares: 0.0,
        }
    }

    /// Of the belief in `parameters` whose information is `rootᵀ root`, triangular or not.
    pub(crate) fn of_belief(parameters: &SVector<f64, N>, root: &SMatrix<f64, N, N>) -> Self {
        let mut triangle = Self::empty();
        for row in root.row_iter() {
            triangle.turn_in(&row.transpose(), 0.0);
        }
        triangle.move_to(parameters);
        triangle
    }

    /// Takes one row in by Givens rotations: `2 N²` multiplications, `N` square roots.
    pub(crate) fn turn_in(&mut self, row: &SVector<f64, N>, wanted: f64) {
        let (mut row, mut wanted) = (*row, wanted);
        for k in 0..N {
            if row[k] == 0.0 {
                continue;
            }
            // Turns row k of the triangle and the new row so that the new one's entry k vanishes.
            let diagonal = self.root[(k, k)];
            let length = diagonal.hypot(row[k]);
            let (cosine, sine) = (diagonal / length, row[k] / length);
            for column in k..N {
                let (above, below) = (self.root[(k, column)], row[column]);
                self.root[(k, column)] = cosine * above + sine * below;
                row[column] = cosine * below - sine * above;
            }
            let above = self.target[k];
            self.target[k] = cosine * above + sine * wanted;
            wanted = cosine * wanted - sine * above;
        }
        self.residual_squares += wanted * wanted;
    }

    /// Takes several rows in with their wanted values, and uses them up: Householder's reflections turn
    /// an entry of all rows at once (Golub and Van Loan, *Matrix Computations*, algorithm 5.1.1). As many
    /// multiplications as one after another, but `N` square roots in all.
    pub(crate) fn turn_in_all(&mut self, rows: &mut [(SVector<f64, N>, f64)]) {
        for k in 0..N {
            let diagonal = self.root[(k, k)];
            let squares: f64 = rows.iter().map(|(row, _)| row[k] * row[k]).sum();
            let square = diagonal * diagonal + squares;
            if !SAFE_SQUARES.contains(&square) {
                // Single rotations bear any entry.
                rows.iter()
                    .for_each(|(row, wanted)| self.turn_in(row, *wanted));
                return;
            }
            if squares > f64::EPSILON.powi(2) * square {
                self.reflect(k, rows, squares, square.sqrt());
            }
            rows.iter_mut().for_each(|(row, _)| row[k] = 0.0);
        }
        self.residual_squares += rows.iter().map(|(_, wanted)| wanted * wanted).sum::<f64>();
    }

    /// Reflects row `k` of the triangle and the rows such that the rows' entries `k` vanish.
    fn reflect(
        &mut self,
        k: usize,
        rows: &mut [(SVector<f64, N>, f64)],
        squares: f64,
        length: f64,
    ) {
        // The reflection is by (own, column k of the rows); diagonal less length, without cancellation.
        let own = -squares / (self.root[(k, k)] + length);
        let scale = -(own * length).recip();
        let mut above = self.root.row(k).transpose();
        let (mut along, mut along_wanted) = (above * own, self.target[k] * own);
        for (row, wanted) in &*rows {
            along.axpy(row[k], row, 1.0);
            along_wanted += wanted * row[k];
        }
        along *= scale;
        along_wanted *= scale;
        above.axpy(-own, &along, 1.0);
        above[k] = length;
        self.root.set_row(k, &above.transpose());
        self.target[k] -= along_wanted * own;
        for (row, wanted) in rows {
            let entry = row[k];
            row.axpy(-entry, &along, 1.0);
            *wanted -= along_wanted * entry;
        }
    }

    /// Takes in all rows of another.
    pub(crate) fn take_in(&mut self, other: &Self) {
        for (row, &wanted) in other.root.row_iter().zip(&other.target) {
            self.turn_in(&row.transpose(), wanted);
        }
        self.residual_squares += other.residual_squares;
    }

    /// Takes the row in with `information` (a weight in the information) but lets its error move
    /// the parameters with `score` instead: `x ← x + (RᵀR)⁻¹ row score`, `R` being the new one.
    /// The residuals' squares are the caller's.
    pub(crate) fn move_along(&mut self, row: &SVector<f64, N>, information: f64, score: f64) {
        let weight = information.sqrt();
        let parameters = self.solve();
        let squares = self.residual_squares;
        self.turn_in(&(row * weight), weight * row.dot(&parameters));
        self.residual_squares = squares;
        self.target += self.whiten(row) * score;
    }

    /// Scales all rows: by less than one, they count less.
    pub(crate) fn scale(&mut self, by: f64) {
        self.root *= by;
        self.target *= by;
        self.residual_squares *= by * by;
    }

    /// The same information about other parameters.
    pub(crate) fn move_to(&mut self, parameters: &SVector<f64, N>) {
        self.target = self.root * parameters;
    }

    /// The least-squares solution. Meaningless while the triangle is singular.
    pub(crate) fn solve(&self) -> SVector<f64, N> {
        let mut parameters = self.target;
        self.root.solve_upper_triangular_mut(&mut parameters);
        parameters
    }

    /// `R⁻¹`, whose product with its transpose is the covariance of noise of one. Meaningless while
    /// the triangle is singular.
    pub(crate) fn inverse(&self) -> SMatrix<f64, N, N> {
        let mut inverse = SMatrix::identity();
        self.root.solve_upper_triangular_mut(&mut inverse);
        inverse
    }

    /// `R⁻ᵀ v`: the squared norm of a whitened row is the variance of what it predicts.
    pub(crate) fn whiten(&self, vector: &SVector<f64, N>) -> SVector<f64, N> {
        let mut whitened = *vector;
        self.root.tr_solve_upper_triangular_mut(&mut whitened);
        whitened
    }

    /// `R⁻ᵀ S R⁻¹` of a symmetric `S`.
    pub(crate) fn whiten_both_sides(&self, symmetric: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
        let mut whitened = *symmetric;
        self.root.tr_solve_upper_triangular_mut(&mut whitened);
        whitened.transpose_mut();
        self.root.tr_solve_upper_triangular_mut(&mut whitened);
        whitened
    }

    /// How a row departs from what the rows so far predict.
    pub(crate) fn innovation(&self, row: &SVector<f64, N>, wanted: f64) -> Innovation {
        Innovation {
            error: wanted - row.dot(&self.solve()),
            leverage: self.whiten(row).norm_squared(),
        }
    }

    pub(crate) fn root(&self) -> &SMatrix<f64, N, N> {
        &self.root
    }

    pub(crate) fn target(&self) -> &SVector<f64, N> {
        &self.target
    }

    pub(crate) fn set_target(&mut self, target: SVector<f64, N>) {
        self.target = target;
    }

    pub(crate) fn residual_squares(&self) -> f64 {
        self.residual_squares
    }

    pub(crate) fn residual_squares_mut(&mut self) -> &mut f64 {
        &mut self.residual_squares
    }
}

/// A triangle that grows, and what it was before the first row.
#[derive(Clone, Debug)]
pub(crate) struct Restartable<const N: usize> {
    /// What was believed before the first row, which no alarm takes away.
    start: Triangle<N>,
    pub(crate) now: Triangle<N>,
}

impl<const N: usize> Restartable<N> {
    pub(crate) fn new(start: Triangle<N>) -> Self {
        Self {
            now: start.clone(),
            start,
        }
    }

    /// The same information about other parameters, at the start and now.
    pub(crate) fn move_to(&mut self, parameters: &SVector<f64, N>) {
        self.start.move_to(parameters);
        self.now.move_to(parameters);
    }

    /// Forgets all rows.
    pub(crate) fn restart(&mut self) {
        self.now = self.start.clone();
    }

    /// The same parameters and residual variance, with their covariance inflated `by` this factor,
    /// the missing information being that of the start. Gives the part of the information that remains.
    ///
    /// # Errors
    /// Where `by` is less than one.
    pub(crate) fn reopen(&mut self, by: f64) -> Result<f64, SettingError> {
        let kept = by.recip();
        if by < 1.0 || by.is_nan() {
            return Err(SettingError {
                name: "by",
                given: by,
                range: "[1, inf]",
            });
        }
        let mut rest = self.start.clone();
        rest.move_to(&self.now.solve());
        rest.scale((1.0 - kept).sqrt());
        self.now.scale(kept.sqrt());
        self.now.take_in(&rest);
        Ok(kept)
    }
}

/// How a row departs from what an estimator predicts of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// What was wanted less what was predicted.
    pub error: f64,
    /// Variance of the prediction over that of the row's noise: vast in a direction not yet known.
    pub leverage: f64,
}

impl Innovation {
    /// The error over its standard deviation, for noise of this deviation on the row: white and of
    /// one size where the estimator's assumptions hold.
    #[must_use]
    pub fn over(&self, deviation: f64) -> f64 {
        self.error / (deviation * (1.0 + self.leverage).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    use proptest::prelude::*;

    use super::*;

    fn filled(entries: &[f64]) -> Triangle<3> {
        let mut triangle = Triangle::weak(&Vector3::zeros());
        for row in entries.chunks(4) {
            triangle.turn_in(&Vector3::new(row[0], row[1], row[2]), row[3]);
        }
        triangle
    }

    /// Relative difference in all that a triangle says of its rows.
    fn difference(one: &Triangle<3>, other: &Triangle<3>) -> f64 {
        let root = (one.root - other.root).norm() / one.root.norm();
        let target = (one.target - other.target).norm() / one.target.norm();
        let squares = (one.residual_squares - other.residual_squares).abs();
        root + target + squares / one.residual_squares
    }

    proptest! {
        /// Rows in two triangles, merged, are the rows in one.
        #[test]
        fn merging_is_turning_in(entries in proptest::collection::vec(-5.0..5.0f64, 4 * 20)) {
            let (first, second) = entries.split_at(4 * 11);
            let mut merged = filled(first);
            merged.take_in(&filled(second));
            prop_assert!(difference(&merged, &filled(&entries)) < 1e-9);
        }

        /// Moving along a row with full information and its own error is turning it in.
        #[test]
        fn moving_with_full_information_is_turning_in(
            entries in proptest::collection::vec(-5.0..5.0f64, 4 * 20),
        ) {
            let mut moved = filled(&entries);
            let mut turned = moved.clone();
            let row = Vector3::new(0.3, -2.0, 1.1);
            let innovation = moved.innovation(&row, 0.7);
            moved.move_along(&row, 1.0, innovation.error);
            turned.turn_in(&row, 0.7);
            let gained = turned.residual_squares - moved.residual_squares;
            let expected = innovation.over(1.0).powi(2);
            prop_assert!((gained - expected).abs() < 1e-9 * (1.0 + expected));
            *moved.residual_squares_mut() += expected;
            prop_assert!(difference(&moved, &turned) < 1e-9);
        }

        /// Several rows at once are the same as one after another, also where squares are out of range.
        #[test]
        fn all_at_once_is_one_after_another(
            entries in proptest::collection::vec(-5.0..5.0f64, 4 * 20),
            size in proptest::sample::select(vec![1.0, 1e-160, 1e-120, 1e120]),
        ) {
            let start = filled(&entries[..4 * 8]);
            let (mut one, mut all) = (start.clone(), start);
            one.scale(size);
            all.scale(size);
            let mut rows: Vec<_> = entries[4 * 8..]
                .chunks(4)
                .map(|row| (Vector3::new(row[0], row[1], row[2]) * size, row[3] * size))
                .collect();
            rows.iter().for_each(|(row, wanted)| one.turn_in(row, *wanted));
            all.turn_in_all(&mut rows);
            let difference = (one.root - all.root).abs().max() / one.root.abs().max()
                + (one.target - all.target).abs().max() / one.target.abs().max();
            prop_assert!(difference < 1e-12, "{difference:e}");
        }

        /// A triangle holds `AᵀA`, `Aᵀb` and `bᵀb`.
        #[test]
        fn holds_the_moments(entries in proptest::collection::vec(-5.0..5.0f64, 4 * 20)) {
            let triangle = filled(&entries);
            let (mut matrix, mut vector, mut scalar) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
            for row in entries.chunks(4) {
                let entries = Vector3::new(row[0], row[1], row[2]);
                matrix += entries * entries.transpose();
                vector += entries * row[3];
                scalar += row[3] * row[3];
            }
            let root = triangle.root;
            prop_assert!((root.transpose() * root - matrix).norm() < 1e-9 * matrix.norm());
            prop_assert!((root.transpose() * triangle.target - vector).norm() < 1e-9 * matrix.norm());
            let squares = triangle.target.norm_squared() + triangle.residual_squares;
            prop_assert!((squares - scalar).abs() < 1e-9 * scalar);
        }
    }
}
