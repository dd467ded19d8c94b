//! Least squares with noise on both sides.

use nalgebra::{Cholesky, Const, SMatrix, SVector};

use crate::triangle::{Restartable, Triangle};
use crate::{Counts, Estimator, Outcome, is_sane, is_sane_row};

/// Steps towards the factor of the noise: a few are usual, and bisection ends in as many.
const MOST_STEPS: usize = 100;
/// Relative change of the factor that ends the search.
const CLOSE_ENOUGH: f64 = 1e-15;

/// Covariance of the noise of a row's entries and of its wanted value, known up to one factor that
/// is common to all rows. Positive semidefinite; zero where a number is exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowNoise<const N: usize> {
    /// Of the row's entries.
    pub row: SMatrix<f64, N, N>,
    /// Of the row's entries with the wanted value.
    pub cross: SVector<f64, N>,
    /// Variance of the wanted value.
    pub wanted: f64,
}

impl<const N: usize> RowNoise<N> {
    /// White noise of one size on every number.
    #[must_use]
    pub fn equal() -> Self {
        Self {
            row: SMatrix::identity(),
            ..Self::on_wanted()
        }
    }

    /// Exact rows: least squares.
    #[must_use]
    pub fn on_wanted() -> Self {
        Self {
            row: SMatrix::zeros(),
            cross: SVector::zeros(),
            wanted: 1.0,
        }
    }

    /// Whether it can be a covariance, as far as a look at each number tells.
    fn is_usable(&self) -> bool {
        let variances = self.row.diagonal();
        is_sane(self.wanted)
            && self.wanted >= 0.0
            && variances.iter().all(|&variance| variance >= 0.0)
            && self.row.iter().chain(&self.cross).all(|&x| is_sane(x))
    }

    fn add(&mut self, other: &Self) {
        // Half of each side, so that a matrix that is symmetric to rounding becomes so.
        self.row += (other.row + other.row.transpose()) * 0.5;
        self.cross += other.cross;
        self.wanted += other.wanted;
    }

    fn none() -> Self {
        Self {
            wanted: 0.0,
            ..Self::on_wanted()
        }
    }
}

/// Recursive total least squares: `(A + noise) x = b + noise`.
///
/// Where a row is measured, least squares is biased towards zero however many rows come. This takes
/// the noise's share out of the moments: with `M` the moments of `[A b]` and `C` the summed noise
/// covariance of the rows, it finds the smallest `λ` for which `M - λ C` is singular, and the `x` for
/// which `(M - λ C) [x; -1] = 0` (generalised total least squares, Van Huffel and Vandewalle 1989,
/// SIAM J. Matrix Anal. Appl. 10). For
/// [equal](RowNoise::equal) noise that is the smallest singular vector of `[A b]`; for exact rows,
/// least squares.
///
/// Assumes noise that is independent from row to row, with covariances known up to one factor, and
/// rows that excite every direction beyond their noise: a direction that holds noise alone cannot be
/// told from an exact equation. Cost a row: `2 N²` multiplications for the triangle of `[A b]`, of
/// which nothing is squared; asking takes some five Cholesky decompositions, `2 N³`, in the
/// triangle's coordinates.
///
/// ```
/// use nalgebra::Vector1;
/// use tactid_nlms::{Estimator, RowNoise, TotalLeastSquares};
///
/// let mut slope = TotalLeastSquares::<1>::new(RowNoise::equal());
/// // Points about y = x, with noise across the line alone.
/// for (x, y) in [(0.9, 1.1), (1.1, 0.9), (2.1, 1.9), (1.9, 2.1)] {
///     slope.update(&Vector1::new(x), y);
/// }
/// assert!((slope.parameters()[0] - 1.0).abs() < 1e-9);
/// ```
#[derive(Clone, Debug)]
pub struct TotalLeastSquares<const N: usize> {
    triangle: Restartable<N>,
    /// Of a row that comes without.
    standing: RowNoise<N>,
    noise: RowNoise<N>,
    rows: u64,
    counts: Counts,
}

/// The answer, and what the covariance needs beside it.
struct Solution<const N: usize> {
    parameters: SVector<f64, N>,
    /// The noise's factor `λ`, from `n` rows: `n / (n - N)` less than unbiased.
    factor: f64,
    /// Summed noise variance of the residuals, for a factor of one.
    spread: f64,
    /// Of `I - λ G`.
    cholesky: Option<Cholesky<f64, Const<N>>>,
}

/// The noise in the coordinates `y = R x`, where the rows' moments are the identity.
struct Whitened<'a, const N: usize> {
    triangle: &'a Triangle<N>,
    /// `G`.
    row: SMatrix<f64, N, N>,
    /// `g`.
    cross: SVector<f64, N>,
    wanted: f64,
}

impl<const N: usize> Whitened<'_, N> {
    /// `y` for a factor, if that is below where the rows' own block becomes singular.
    fn at(&self, factor: f64) -> Option<(SVector<f64, N>, Cholesky<f64, Const<N>>)> {
        let cholesky = Cholesky::new(SMatrix::identity() - self.row * factor)?;
        let solution = cholesky.solve(&(self.triangle.target() - self.cross * factor));
        Some((solution, cholesky))
    }

    /// Noise variance of the residuals at `y`, summed over the rows, for a factor of one.
    fn spread(&self, y: &SVector<f64, N>) -> f64 {
        y.dot(&(self.row * y)) - 2.0 * self.cross.dot(y) + self.wanted
    }

    /// The factor that the residuals at `y` show: nowhere less than the one sought.
    fn factor(&self, y: &SVector<f64, N>) -> f64 {
        let squares = (y - self.triangle.target()).norm_squared();
        (squares + self.triangle.residual_squares()) / self.spread(y)
    }

    /// `y` and the factor: Newton's method on the Schur complement of `M - λ C`, which is concave
    /// and falls, so that the step is the Rayleigh quotient and comes down to the root from above.
    /// Only the first steps, from least squares, may leap too far; then bisection.
    fn solve(&self) -> (SVector<f64, N>, f64, Option<Cholesky<f64, Const<N>>>) {
        let (mut low, mut high, mut factor) = (0.0, f64::INFINITY, 0.0);
        let (mut y, mut cholesky) = (*self.triangle.target(), None);
        for _ in 0..MOST_STEPS {
            let shown = self.factor(&y);
            // Without any noise on the residuals the factor has no meaning, and this no bound.
            let moves = (shown - factor).abs() > CLOSE_ENOUGH * shown.abs();
            if !shown.is_finite() || !moves {
                break;
            }
            let next = if shown < high && shown > low {
                shown
            } else {
                0.5 * (low + high)
            };
            match self.at(next) {
                Some((solution, decomposed)) => {
                    (y, cholesky, factor) = (solution, Some(decomposed), next);
                    if self.factor(&y) >= factor {
                        low = factor;
                    } else {
                        high = factor;
                    }
                }
                None => high = next,
            }
        }
        (y, factor, cholesky)
    }
}

impl<const N: usize> TotalLeastSquares<N> {
    /// Starting at ones with no belief in them. `standing` is the noise of rows that come
    /// [without](Estimator::update); one that is not finite makes those rows refused.
    #[must_use]
    pub fn new(standing: RowNoise<N>) -> Self {
        let start = Triangle::weak(&SVector::repeat(1.0));
        Self {
            triangle: Restartable::new(start),
            standing,
            noise: RowNoise::none(),
            rows: 0,
            counts: Counts::default(),
        }
    }

    /// The same, starting at the given parameters. To be said before the first row.
    #[must_use]
    pub fn starting_at(mut self, parameters: SVector<f64, N>) -> Self {
        self.triangle.move_to(&parameters);
        self
    }

    /// [`update`](Estimator::update) with a row whose noise differs from the others'. To give it its
    /// weight too, divide row and wanted value by the deviation of its residual, and the covariances
    /// by its square. A covariance with a number that is not finite, or a variance that is negative,
    /// refuses the row.
    pub fn update_with_noise(
        &mut self,
        row: &SVector<f64, N>,
        wanted: f64,
        noise: &RowNoise<N>,
    ) -> Outcome {
        let outcome = self
            .counts
            .admit_if(noise.is_usable() && is_sane_row(row, wanted));
        if outcome == Outcome::Used {
            self.triangle.now.turn_in(row, wanted);
            self.noise.add(noise);
            self.rows += 1;
        }
        outcome
    }

    /// The common factor of the noise's covariances, as the rows show it; `None` until there are
    /// more rows than parameters.
    #[must_use]
    pub fn noise_factor(&self) -> Option<f64> {
        Some(self.unbiased(self.solution().factor, self.freedom()?))
    }

    /// Forgets all rows.
    pub fn restart(&mut self) {
        self.triangle.restart();
        self.noise = RowNoise::none();
        self.rows = 0;
    }

    fn freedom(&self) -> Option<u64> {
        self.rows.checked_sub(N as u64).filter(|&rest| rest > 0)
    }

    fn unbiased(&self, factor: f64, freedom: u64) -> f64 {
        factor * self.rows as f64 / freedom as f64
    }

    fn whitened(&self) -> Whitened<'_, N> {
        Whitened {
            triangle: &self.triangle.now,
            row: self.triangle.now.whiten_both_sides(&self.noise.row),
            cross: self.triangle.now.whiten(&self.noise.cross),
            wanted: self.noise.wanted,
        }
    }

    fn solution(&self) -> Solution<N> {
        let whitened = self.whitened();
        let (y, factor, cholesky) = whitened.solve();
        let mut at_solution = self.triangle.now.clone();
        at_solution.set_target(y);
        Solution {
            parameters: at_solution.solve(),
            factor,
            spread: whitened.spread(&y),
            cholesky,
        }
    }
}

impl<const N: usize> Estimator<N> for TotalLeastSquares<N> {
    fn update(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome {
        let standing = self.standing;
        self.update_with_noise(row, wanted, &standing)
    }

    fn parameters(&self) -> SVector<f64, N> {
        self.solution().parameters
    }

    /// As rows grow many, for Gaussian noise of like covariance from row to row: with `H = AᵀA - λ C`,
    /// `s` the variance of a residual and `r` the regression of the row's noise on it,
    /// `λ s H⁻¹ (AᵀA - λ n s r rᵀ) H⁻¹` (after Fuller 1987, *Measurement Error Models*, chapter 2). `None` until there are more rows than parameters, or without any noise.
    fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        let freedom = self.freedom()?;
        let solution = self.solution();
        let cholesky = solution.cholesky?;
        let toll = self.noise.cross - self.noise.row * solution.parameters;
        let toll = self.triangle.now.whiten(&toll);
        let middle = SMatrix::<f64, N, N>::identity()
            - toll * toll.transpose() * (solution.factor / solution.spread);
        let half = self.triangle.now.inverse() * cholesky.inverse();
        let scale = self.unbiased(solution.factor, freedom) * solution.spread / self.rows as f64;
        Some(half * middle * half.transpose() * scale)
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, Matrix2, Vector2, Vector3};
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use rand_distr::StandardNormal;

    use super::*;
    use crate::Rls;

    fn normal<const N: usize>(rng: &mut StdRng) -> SVector<f64, N> {
        SVector::from_fn(|_, _| rng.sample(StandardNormal))
    }

    proptest! {
        /// For equal noise it is the smallest singular vector of `[A b]`.
        #[test]
        fn equals_batch_total_least_squares(seed in 0u64..10_000, noise in 0.001..0.5f64) {
            let mut rng = StdRng::seed_from_u64(seed);
            let truth = normal::<3>(&mut rng);
            let mut total = TotalLeastSquares::<3>::new(RowNoise::equal());
            let mut rows = DMatrix::zeros(60, 4);
            for mut stored in rows.row_iter_mut() {
                let row = normal::<3>(&mut rng);
                let errors = normal::<4>(&mut rng) * noise;
                let (noisy, wanted) = (row + errors.fixed_rows::<3>(0), row.dot(&truth) + errors[3]);
                total.update(&noisy, wanted);
                stored.copy_from_slice(&[noisy[0], noisy[1], noisy[2], wanted]);
            }
            let svd = rows.svd(false, true);
            let vectors = svd.v_t.unwrap();
            let smallest = vectors.row(3);
            let batch = Vector3::from_fn(|i, _| -smallest[i] / smallest[3]);
            let error = (total.parameters() - batch).norm();
            prop_assert!(error < 1e-9 * (1.0 + batch.norm()), "{:e}", error);
            let factor = total.noise_factor().unwrap() * 57.0;
            let expected = svd.singular_values[3].powi(2);
            // The weak start adds its 1e-12 for each parameter.
            prop_assert!((factor - expected).abs() < 1e-9 * expected + 1e-10);
        }

        /// With exact rows it is least squares: parameters and covariance.
        #[test]
        fn exact_rows_are_least_squares(entries in proptest::collection::vec(-5.0..5.0f64, 4 * 30)) {
            let mut total = TotalLeastSquares::<3>::new(RowNoise::on_wanted());
            let mut rls = Rls::<3>::new();
            for row in entries.chunks(4) {
                total.update(&Vector3::new(row[0], row[1], row[2]), row[3]);
                rls.update(&Vector3::new(row[0], row[1], row[2]), row[3]);
            }
            prop_assert!((total.parameters() - rls.parameters()).norm() < 1e-12);
            let (ours, theirs) = (total.covariance().unwrap(), rls.covariance().unwrap());
            prop_assert!((ours - theirs).norm() < 1e-10 * theirs.norm());
        }
    }

    /// Correlated noise that differs from row to row and is singular in some: `b` shares its noise
    /// with the first entry, and every third row is exact.
    fn noise_of(k: usize) -> RowNoise<2> {
        let size = [0.0, 1.0, 4.0][k % 3];
        RowNoise {
            row: Matrix2::new(1.0, 0.0, 0.0, 0.25) * size,
            cross: Vector2::new(0.5, 0.0) * size,
            wanted: size * 0.25,
        }
    }

    fn noisy_row(rng: &mut StdRng, truth: &Vector2<f64>, k: usize) -> (Vector2<f64>, f64) {
        let row = normal::<2>(rng) * 1.5;
        let errors = normal::<2>(rng) * (0.3 * noise_of(k).wanted.sqrt() * 2.0);
        let noisy = row + Vector2::new(errors[0], 0.5 * errors[1]);
        (noisy, row.dot(truth) + 0.5 * errors[0])
    }

    /// The bias vanishes as rows grow, where that of least squares stays: over 40 000 rows the error
    /// is within five deviations, and within those of least squares it is not.
    #[test]
    fn its_bias_vanishes_and_that_of_least_squares_does_not() {
        let truth = Vector2::new(2.0, -1.0);
        let mut rng = StdRng::seed_from_u64(7);
        let mut total = TotalLeastSquares::<2>::new(RowNoise::equal());
        let mut rls = Rls::<2>::new();
        for k in 0..40_000 {
            let (row, wanted) = noisy_row(&mut rng, &truth, k);
            total.update_with_noise(&row, wanted, &noise_of(k));
            rls.update(&row, wanted);
        }
        let deviation = total.covariance().unwrap().diagonal().map(f64::sqrt);
        let error = (total.parameters() - truth).component_div(&deviation);
        assert!(error.amax() < 5.0, "{error}");
        assert!(deviation.amax() < 0.01, "{deviation}");
        let deviation = rls.covariance().unwrap().diagonal().map(f64::sqrt);
        let error = (rls.parameters() - truth).component_div(&deviation);
        assert!(error.amax() > 20.0, "{error}");
        // 0.3² is the factor: its deviation over 40 000 rows, a third of which is exact, is 1 %.
        assert!((total.noise_factor().unwrap() / 0.09 - 1.0).abs() < 0.05);
    }

    /// The covariance is that of repeated runs: the mean of e'C⁻¹e over 2000 runs is 2, with a
    /// deviation of 2 / √2000 = 0.045, for noise as large as the rows, where each term matters.
    #[test]
    fn covariance_is_that_of_repeated_runs() {
        let truth = Vector2::new(2.0, -1.0);
        let mut rng = StdRng::seed_from_u64(8);
        let (runs, mut mean) = (2000, 0.0);
        for _ in 0..runs {
            let mut total = TotalLeastSquares::<2>::new(RowNoise::equal());
            for _ in 0..2000 {
                let row = normal::<2>(&mut rng);
                let errors = normal::<3>(&mut rng);
                total.update(
                    &(row + errors.fixed_rows::<2>(0)),
                    row.dot(&truth) + errors[2],
                );
            }
            let error = total.parameters() - truth;
            let inverse = total.covariance().unwrap().try_inverse().unwrap();
            mean += error.dot(&(inverse * error)) / f64::from(runs);
        }
        // Five deviations, and 2 % that 2000 rows lack to infinity.
        assert!((mean - 2.0).abs() < 0.225 + 0.04, "{mean}");
    }

    /// Rows without any noise, or in one direction alone, or fewer than parameters, end in numbers.
    #[test]
    fn degenerate_rows_end_in_numbers() {
        let silent = RowNoise {
            wanted: 0.0,
            ..RowNoise::on_wanted()
        };
        for noise in [silent, RowNoise::on_wanted(), RowNoise::equal()] {
            for directions in 0..=2 {
                let mut total = TotalLeastSquares::<2>::new(noise);
                for k in 0..50 {
                    let row = Vector2::new(
                        f64::from(k % 7) * f64::from(directions.min(1)),
                        f64::from(k % 5) * f64::from((directions - 1).max(0)),
                    );
                    total.update(&row, 3.0 * row[0] + f64::from(k % 3));
                    assert!(
                        total.parameters().iter().all(|x| x.is_finite()),
                        "{noise:?} {k}"
                    );
                    total.covariance();
                }
            }
        }
    }

    /// A covariance that is none refuses its row and changes nothing; a restart forgets the rest.
    #[test]
    fn refuses_what_is_no_covariance() {
        let mut total = TotalLeastSquares::<2>::new(RowNoise::equal());
        let row = Vector2::new(1.0, 2.0);
        total.update(&row, 1.0);
        let before = total.parameters();
        for wanted in [f64::NAN, -1.0, f64::INFINITY] {
            let noise = RowNoise {
                wanted,
                ..RowNoise::equal()
            };
            assert_eq!(total.update_with_noise(&row, 5.0, &noise), Outcome::Refused);
        }
        assert_eq!(total.update(&(row * f64::NAN), 5.0), Outcome::Refused);
        assert_eq!(total.parameters(), before);
        assert_eq!((total.counts().used, total.counts().refused), (1, 4));
        total.restart();
        assert!((total.parameters() - Vector2::repeat(1.0)).norm() < 1e-12);
    }
}
