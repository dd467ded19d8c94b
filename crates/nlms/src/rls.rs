//! Recursive least squares in square-root information form.

use std::borrow::Cow;

use nalgebra::{SMatrix, SVector};

use crate::square_root::SquareRootInformation;
use crate::{Counts, Estimator, Outcome};

/// Number of rows of single updates that enter the factorisation together. Six rows of ten
/// parameters by Householder reflections needed a quarter of the time of Givens rotations (51
/// against 217 ns a row).
const BLOCK: usize = 8;

/// Recursive least squares over all rows with equal weight.
///
/// The estimate is the least-squares solution of all rows so far. It is kept as the upper
/// triangular factor `R` of the QR decomposition of the rows (Golub and Van Loan, *Matrix
/// Computations*, section 6.5). `AᵀA` is never formed, so that the estimate is accurate to rounding
/// where the recursion on the covariance loses half of the digits. A direction that no row excites
/// keeps its initial value, and all parameters do where the solution is beyond the range of
/// numbers. The units of rows, targets and parameters do not matter.
///
/// The rows are assumed to be exact, and the noise on the targets white with one standard
/// deviation. Where noise differs, each row and its target are divided by its standard deviation.
///
/// Single rows are kept until there are eight, which enter the factorisation together. A row costs
/// `N²` multiplications and an eighth of `N` square roots in the mean: seven of eight updates only
/// copy it, and the eighth does the work of all. The estimate costs about `N³` multiplications, and
/// a factorisation of the rows that are kept, each time that a result is asked for.
///
/// ```
/// use nalgebra::Vector2;
/// use tactid_nlms::{Estimator, Rls};
///
/// // Three rows: the offset and the slope of a line through (0, 1), (1, 3) and (2, 4).
/// let mut rls = Rls::<2>::new();
/// for (abscissa, ordinate) in [(0.0, 1.0), (1.0, 3.0), (2.0, 4.0)] {
///     rls.update(&Vector2::new(1.0, abscissa), ordinate);
/// }
/// assert!((rls.parameters() - Vector2::new(7.0 / 6.0, 1.5)).norm() < 1e-9);
/// // The residuals are -1/6, 1/3 and -1/6, and the abscissas scatter by 2 about their mean.
/// let slope_variance = rls.covariance().expect("more rows than parameters")[(1, 1)];
/// assert!((slope_variance - (1.0 / 6.0) / 2.0).abs() < 1e-9);
/// ```
#[derive(Clone, Debug)]
pub struct Rls<const N: usize> {
    /// All rows but the pending ones.
    information: SquareRootInformation<N>,
    /// Rows of single updates that have not entered the factorisation yet; the first
    /// `pending_count` are valid.
    pending: [(SVector<f64, N>, f64); BLOCK],
    pending_count: usize,
    counts: Counts,
    /// Parameters before the first row.
    start: SVector<f64, N>,
}

impl<const N: usize> Default for Rls<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Rls<N> {
    /// Returns an estimator without rows; its parameters are ones, as in the paper's filters.
    #[must_use]
    pub fn new() -> Self {
        Self::starting_at(SVector::repeat(1.0))
    }

    /// Returns an estimator without rows that has these parameters.
    ///
    /// The initial values weigh as little as rounding, 1.5e-8 of the largest entry of each column.
    /// They show only in directions that no row excites.
    #[must_use]
    pub fn starting_at(parameters: SVector<f64, N>) -> Self {
        Self {
            information: SquareRootInformation::new(),
            pending: [(SVector::zeros(), 0.0); BLOCK],
            pending_count: 0,
            counts: Counts::default(),
            start: parameters,
        }
    }

    /// Updates the estimate with several rows and their targets, and overwrites them.
    ///
    /// The result differs from single [updates](Estimator::update) by rounding only. Each row costs
    /// `N²` multiplications, and all rows together cost `N` square roots: less than single updates
    /// from eight rows on, or where a result is asked for after each block. A row that is not
    /// finite, or has a magnitude of 1e150 or more, changes nothing but the
    /// [counts](Estimator::counts).
    ///
    /// ```
    /// use nalgebra::Vector1;
    /// use tactid_nlms::{Estimator, Rls};
    ///
    /// let mut rls = Rls::<1>::new();
    /// rls.update_all(&mut [(Vector1::new(1.0), 2.0), (Vector1::new(2.0), 4.0)]);
    /// assert!((rls.parameters()[0] - 2.0).abs() < 1e-9);
    /// ```
    pub fn update_all(&mut self, rows: &mut [(SVector<f64, N>, f64)]) {
        for (row, target) in &mut *rows {
            if self.counts.admit(row, *target) == Outcome::Refused {
                (*row, *target) = (SVector::zeros(), 0.0);
            }
        }
        self.add_pending();
        self.information.update_all(rows);
    }

    /// Adds the pending rows to the factorisation.
    fn add_pending(&mut self) {
        self.information
            .update_all(&mut self.pending[..self.pending_count]);
        self.pending_count = 0;
    }

    /// Returns the factorisation of all rows.
    fn of_all_rows(&self) -> Cow<'_, SquareRootInformation<N>> {
        if self.pending_count == 0 {
            return Cow::Borrowed(&self.information);
        }
        let (mut all, mut pending) = (self.information.clone(), self.pending);
        all.update_all(&mut pending[..self.pending_count]);
        Cow::Owned(all)
    }

    /// Returns the square root of the information: the upper triangular `R` with `RᵀR = AᵀA`, where
    /// `A` are all rows.
    ///
    /// An entry of its diagonal is positive, or its whole row is zero: each row so far is a
    /// combination of fewer parameters.
    #[must_use]
    pub fn information_root(&self) -> SMatrix<f64, N, N> {
        self.of_all_rows().root()
    }

    /// Returns the targets `z` of the triangular system `R x = z`, with the
    /// [square root of the information](Self::information_root) `R`: `Rᵀz = Aᵀb` for the rows
    /// `A x = b`.
    #[must_use]
    pub fn transformed_target(&self) -> SVector<f64, N> {
        self.of_all_rows().transformed_target()
    }

    /// Returns the [square root of the information](Self::information_root) of the rows and of the
    /// small weights on the initial values, which is regular: its diagonal is positive. With it
    /// come the [parameters](Estimator::parameters), which follow from it.
    #[must_use]
    pub fn regularised(&self) -> (SMatrix<f64, N, N>, SVector<f64, N>) {
        let regular = self.of_all_rows().regularised(&self.start);
        let found = regular.solve();
        // Rows that are minute beside their targets have solutions beyond the largest number.
        let is_finite = found.iter().all(|entry| entry.is_finite());
        (regular.root(), if is_finite { found } else { self.start })
    }

    /// Returns the sum of the squared residuals of all rows at the least-squares solution.
    #[must_use]
    pub fn residual_squares(&self) -> f64 {
        self.of_all_rows().residual_squares
    }

    /// Returns the covariance `s² (AᵀA)⁻¹` of the estimate, or `None` until there are more rows
    /// than parameters, and they excite every direction. It is also `None` where an entry is beyond
    /// the range of numbers.
    ///
    /// The variance `s²` of the noise on the targets is estimated as the sum of squared residuals
    /// over the number of rows beyond `N`. The covariance costs about `N³` multiplications.
    #[must_use]
    pub fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        let freedom = self.counts.used as f64 - N as f64;
        let information = self.of_all_rows();
        if freedom <= 0.0 || !information.is_regular() {
            return None;
        }
        let covariance =
            information.inverse_information() * (information.residual_squares / freedom);
        covariance
            .iter()
            .all(|entry| entry.is_finite())
            .then_some(covariance)
    }
}

impl<const N: usize> Estimator<N> for Rls<N> {
    fn update(&mut self, row: &SVector<f64, N>, target: f64) -> Outcome {
        let outcome = self.counts.admit(row, target);
        if outcome == Outcome::Used {
            self.pending[self.pending_count] = (*row, target);
            self.pending_count += 1;
            if self.pending_count == BLOCK {
                self.add_pending();
            }
        }
        outcome
    }

    fn parameters(&self) -> SVector<f64, N> {
        self.regularised().1
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector, Vector3};
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use rand_distr::StandardNormal;

    use super::*;

    proptest! {
        /// After any rows the parameters are the batch least-squares solution of the same rows, and
        /// the covariance is the textbook's.
        #[test]
        fn equals_batch_least_squares(
            entries in proptest::collection::vec(-5.0..5.0f64, 4 * 30),
        ) {
            let mut rls = Rls::<3>::new();
            for row in entries.chunks(4) {
                rls.update(&Vector3::new(row[0], row[1] * 10.0, row[2]), row[3]);
            }
            let a = DMatrix::from_fn(30, 3, |i, j| entries[4 * i + j] * [1.0, 10.0, 1.0][j]);
            let b = DVector::from_fn(30, |i, _| entries[4 * i + 3]);
            let batch = a.clone().svd(true, true).solve(&b, 1e-14).unwrap();
            prop_assert!((rls.parameters() - &batch).norm() < 1e-9 * (1.0 + batch.norm()));
            let squares = (&a * &batch - &b).norm_squared();
            prop_assert!((rls.residual_squares() - squares).abs() < 1e-9 * squares);
            let covariance = (a.transpose() * &a).try_inverse().unwrap() * (squares / 27.0);
            let difference = (rls.covariance().unwrap() - &covariance).norm();
            prop_assert!(difference < 1e-8 * covariance.norm());
        }
    }

    /// Asking for the parameters after each row changes nothing of what follows, and the parameters
    /// include every row so far: one block of the same rows gives the same ones.
    #[test]
    fn rows_that_are_kept_count_at_once() {
        let (mut single, mut rows) = (Rls::<3>::new(), Vec::new());
        for k in 0..30 {
            let row = Vector3::new(1.0, f64::from(k).cos(), f64::from(k).sin());
            let target = 3.0 - 2.0 * row.y + 0.1 * f64::from(k % 3);
            single.update(&row, target);
            rows.push((row, target));
            let mut block = Rls::new();
            block.update_all(&mut rows.clone());
            let difference = single.parameters() - block.parameters();
            assert!(difference.norm() < 1e-9, "{k}: {}", difference.norm());
            let roots = (single.information_root(), block.information_root());
            assert!((roots.0 - roots.1).norm() < 1e-12 * roots.1.norm(), "{k}");
        }
    }

    /// A direction that no row excites keeps its initial value; the others are found.
    #[test]
    fn an_unexcited_direction_keeps_its_start() {
        for (mut rls, start) in [
            (Rls::<3>::new(), 1.0),
            (Rls::starting_at(Vector3::new(-8.0, 9.0, 7.0)), 7.0),
        ] {
            for k in 0..50 {
                let row = Vector3::new(f64::from(k).cos(), f64::from(k).sin(), 0.0);
                rls.update(&row, row.dot(&Vector3::new(4.0, -2.0, 0.0)));
            }
            let expected = Vector3::new(4.0, -2.0, start);
            assert!((rls.parameters() - expected).norm() < 1e-9);
        }
    }

    /// Ill-conditioned rows (a ratio of 1e6 of columns) are solved to rounding: nothing is squared.
    #[test]
    fn keeps_its_digits_on_badly_scaled_rows() {
        let truth = Vector3::new(1e-3, 2.0, -700.0);
        let mut rls = Rls::<3>::new();
        for k in 0..10_000 {
            let t = f64::from(k) * 0.01;
            let row = Vector3::new(1e4 * t.cos(), t.sin(), 1e-2 * (1.7 * t).cos());
            rls.update(&row, row.dot(&truth));
        }
        let error = (rls.parameters() - truth).component_div(&truth).amax();
        assert!(error < 1e-9, "{error:e}");
    }

    /// A row with NaN or infinity changes nothing and is counted.
    #[test]
    fn refuses_what_is_not_finite() {
        let mut rls = Rls::<3>::new();
        rls.update(&Vector3::new(1.0, 2.0, 3.0), 4.0);
        let before = rls.parameters();
        for (row, target) in [
            (Vector3::new(f64::NAN, 0.0, 0.0), 1.0),
            (Vector3::new(0.0, f64::INFINITY, 0.0), 1.0),
            (Vector3::new(1.0, 1.0, 1.0), f64::NAN),
        ] {
            assert_eq!(rls.update(&row, target), Outcome::Refused);
        }
        assert_eq!(rls.parameters(), before);
        rls.update_all(&mut [(Vector3::repeat(f64::NAN), 1.0), (Vector3::zeros(), 0.0)]);
        assert_eq!(rls.parameters(), before);
        let expected = Counts {
            used: 2,
            refused: 4,
        };
        assert_eq!(rls.counts(), expected);
    }

    /// The covariance describes repeated runs, with rows divided by the standard deviation of their
    /// noise: the mean of e'C⁻¹e over 2000 runs is 3, with a standard deviation of √(6 / 2000) =
    /// 0.055.
    #[test]
    fn covariance_is_that_of_repeated_runs() {
        let mut rng = StdRng::seed_from_u64(4);
        let (mut known, mut estimated) = (0.0, 0.0);
        for _ in 0..2000 {
            let mut rls = Rls::<3>::new();
            for k in 0..400 {
                let row: Vector3<f64> = SVector::from_fn(|_, _| rng.sample(StandardNormal));
                let std_dev = [0.1, 2.0][k % 2];
                let noise: f64 = rng.sample(StandardNormal);
                rls.update(&(row / std_dev), row.sum() / std_dev + noise);
            }
            let error = rls.parameters() - Vector3::repeat(1.0);
            // The information is the inverse covariance where the noise is known.
            known += (rls.information_root() * error).norm_squared() / 2000.0;
            let inverse = rls.covariance().unwrap().try_inverse().unwrap();
            estimated += error.dot(&(inverse * error)) / 2000.0;
        }
        assert!((known - 3.0).abs() < 0.27, "{known}");
        assert!((estimated - 3.0).abs() < 0.29, "{estimated}");
    }

    /// Parameters in any units are found, and those that no row excites keep their initial value.
    #[test]
    fn units_do_not_matter() {
        let start = Vector3::new(1.0, 2.0, 3.0);
        let truth = Vector3::new(-4.0, 5.0, 3.0);
        let direction = Vector3::new(0.6, 0.0, 0.8);
        for scale in [1e-60, 1e-9, 1.0, 1e9, 1e60] {
            let units = Vector3::new(1.0, scale, scale * scale);
            let mut rls = Rls::starting_at(start.component_mul(&units));
            for k in 0..50 {
                // The rows do not excite the second direction of the first and third parameter.
                let row = direction * f64::from(k).cos() + Vector3::y() * f64::from(k).sin();
                rls.update(&row.component_div(&units), row.dot(&truth));
            }
            let found = rls.parameters().component_div(&units);
            // Relative to their columns, in the ratio of 0.6 to 0.8, both change equally.
            let change = 0.5 * direction.dot(&(truth - start));
            let change = Vector3::new(change / 0.6, 3.0, change / 0.8);
            let expected = start + change;
            assert!((found - expected).norm() < 1e-6, "{scale:e}: {found}");
            assert_eq!(rls.covariance(), None);
            rls.update(&Vector3::z().component_div(&units), truth.z);
            assert!(rls.covariance().is_some(), "{scale:e}");
            let found = rls.parameters().component_div(&units);
            assert!((found - truth).norm() < 1e-6, "{scale:e}: {found}");
        }
    }

    /// There is no covariance before there are more rows than parameters.
    #[test]
    fn covariance_needs_more_rows_than_parameters() {
        let mut rls = Rls::<3>::new();
        for k in 0..4 {
            assert_eq!(rls.covariance(), None);
            let row = Vector3::new(1.0, f64::from(k), f64::from(k * k));
            rls.update(&row, f64::from(k % 2));
        }
        assert!(rls.covariance().is_some());
    }
}
