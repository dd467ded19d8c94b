//! Recursive least squares in square-root form.

use nalgebra::{SMatrix, SVector};

use crate::triangle::{Innovation, Restartable, Triangle};
use crate::{Counts, Estimator, Outcome, SettingError, check_all_within, check_within};

/// Recursive least squares.
///
/// Keeps the upper triangle `R` of the rows' QR decomposition, each row turned in by Givens
/// rotations, so that nothing is squared: right to rounding where the covariance form loses half of
/// its digits (Golub and Van Loan, *Matrix Computations*, section 6.5). A direction that no row
/// excites keeps its starting value.
///
/// Assumes noise on the wanted value alone, white, and of one size unless
/// [`update_with_deviation`](Self::update_with_deviation) says which. Cost a row: `2 N²`
/// multiplications; with [a memory](Self::with_memory), `4 N²`.
///
/// ```
/// use nalgebra::Vector2;
/// use tactid_nlms::{Estimator, Rls};
///
/// // Believed before the first row: 3 ± 1 and 0 ± 0.1. Rows come with their noise.
/// let mut rls = Rls::from_prior(Vector2::new(3.0, 0.0), Vector2::new(1.0, 0.1))?;
/// rls.update_with_deviation(&Vector2::new(1.0, 0.0), 4.0, 1.0);
/// assert!((rls.parameters() - Vector2::new(3.5, 0.0)).norm() < 1e-12);
/// let covariance = rls.covariance_of_known_noise();
/// assert!((covariance[(0, 0)] - 0.5).abs() < 1e-12);
/// assert!((covariance[(1, 1)] - 0.01).abs() < 1e-12);
/// # Ok::<(), tactid_nlms::SettingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Rls<const N: usize> {
    triangle: Restartable<N>,
    /// Directions of which the start says nothing: the rows must pay for them.
    unknown: f64,
    /// Rows beyond those that the unknown directions cost.
    freedom: f64,
    /// Part of a direction's information that a row in it replaces at most; 0 keeps everything.
    fade: f64,
    counts: Counts,
}

impl<const N: usize> Default for Rls<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Rls<N> {
    /// Starting at ones, as the paper's filters do, with no belief in them.
    #[must_use]
    pub fn new() -> Self {
        Self::starting_with(Triangle::weak(&SVector::repeat(1.0)), N as f64)
    }

    /// Starting with a prior: the parameters' means and standard deviations. It presumes that rows
    /// come with the deviations of their noise, or that their noise has deviation one.
    ///
    /// # Errors
    /// Where a mean is not finite, or a deviation not positive and finite.
    pub fn from_prior(
        mean: SVector<f64, N>,
        deviations: SVector<f64, N>,
    ) -> Result<Self, SettingError> {
        check_all_within("deviation", &deviations, (0.0, f64::INFINITY), "(0, inf)")?;
        Self::from_prior_root(mean, &SMatrix::from_diagonal(&deviations.map(f64::recip)))
    }

    /// The same with correlations: `root` is any square matrix whose `rootᵀ root` is the inverse of
    /// the prior covariance.
    ///
    /// # Errors
    /// Where a mean is not finite, or `root` is singular or not finite.
    pub fn from_prior_root(
        mean: SVector<f64, N>,
        root: &SMatrix<f64, N, N>,
    ) -> Result<Self, SettingError> {
        let everything = (f64::NEG_INFINITY, f64::INFINITY);
        check_all_within("mean", &mean, everything, "(-inf, inf)")?;
        let start = Triangle::of_belief(&mean, root);
        let diagonal = start.root().diagonal();
        check_all_within("prior root", &diagonal, (0.0, f64::INFINITY), "(0, inf)")?;
        Ok(Self::starting_with(start, 0.0))
    }

    /// The same, starting at the given parameters. To be said before the first row.
    #[must_use]
    pub fn starting_at(mut self, parameters: SVector<f64, N>) -> Self {
        self.triangle.move_to(&parameters);
        self
    }

    /// The same, forgetting: in each direction it knows at most as much as this many rows say (a
    /// time constant, in rows along that direction).
    ///
    /// Information is only ever replaced by information (after Kulhavý 1987, "Restricted exponential
    /// forgetting", Automatica 23): a row takes away, in its own direction alone, at most what it
    /// brings. So a direction that is not excited keeps value and covariance for as long as it
    /// takes, noise on rows of a robot at rest does not wear down what its motion taught, and there
    /// is no wind-up. The price: after a change, weak rows replace what strong rows taught only as
    /// fast as they inform; [`reopen`](Self::reopen) is for that.
    ///
    /// While nothing changes the covariance overstates the variance, about twofold: it allows for
    /// the drift that forgetting presumes.
    ///
    /// # Errors
    /// Where `rows` is not greater than one and finite.
    pub fn with_memory(self, rows: f64) -> Result<Self, SettingError> {
        check_within("memory", rows, (1.0, f64::INFINITY), "(1, inf)")?;
        let fade = rows.recip();
        Ok(Self { fade, ..self })
    }

    /// [`update`](Estimator::update) with a row whose noise has this standard deviation: it counts
    /// by the inverse square. One that is not positive and finite refuses the row.
    pub fn update_with_deviation(
        &mut self,
        row: &SVector<f64, N>,
        wanted: f64,
        deviation: f64,
    ) -> Outcome {
        match self.counts.admit_scaled(row, wanted, deviation) {
            Some((row, wanted)) => {
                self.take(&row, wanted);
                Outcome::Used
            }
            None => Outcome::Refused,
        }
    }

    /// [`update`](Estimator::update) with several rows and their wanted values, which it uses up: the same
    /// but for rounding, in a third of the time. A row that is not finite is refused, and is zero then.
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
        if self.fade > 0.0 {
            for (row, wanted) in rows {
                self.update(row, *wanted);
            }
            return;
        }
        for (row, wanted) in &mut *rows {
            match self.counts.admit(row, *wanted) {
                Outcome::Used => self.freedom += 1.0,
                Outcome::Refused => (*row, *wanted) = (SVector::zeros(), 0.0),
            }
        }
        self.triangle.now.turn_in_all(rows);
    }

    /// How the row departs from what is known: ask before the update. For a row with a deviation,
    /// of row and wanted value over the deviation.
    #[must_use]
    pub fn innovation(&self, row: &SVector<f64, N>, wanted: f64) -> Innovation {
        self.triangle.now.innovation(row, wanted)
    }

    /// Variance of what is predicted of the row, over that of its noise; without moving anything.
    #[must_use]
    pub fn leverage(&self, row: &SVector<f64, N>) -> f64 {
        self.triangle.now.whiten(row).norm_squared()
    }

    /// The upper triangle `R` whose `RᵀR` is the information of all rows, and of the start: that of
    /// [`new`](Self::new) is `1e-12` in each direction.
    #[must_use]
    pub fn root(&self) -> &SMatrix<f64, N, N> {
        self.triangle.now.root()
    }

    /// Sum of the squared residuals at the present parameters, and of the departure from the prior;
    /// with a memory, faded.
    #[must_use]
    pub fn residual_squares(&self) -> f64 {
        self.triangle.now.residual_squares()
    }

    /// Variance of the rows' noise, from their residuals, in squares of the deviations given; `None`
    /// until there are more rows than parameters that start unknown.
    #[must_use]
    pub fn noise_variance(&self) -> Option<f64> {
        (self.freedom > 0.0).then(|| self.residual_squares() / self.freedom)
    }

    /// Covariance of the parameters, from the rows and the residuals' variance; `None` until there
    /// are more rows than parameters. A direction that no row excites has a vast one.
    #[must_use]
    pub fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        let variance = self.noise_variance()?;
        let inverse = self.triangle.now.inverse();
        Some(inverse * inverse.transpose() * variance)
    }

    /// Covariance of the parameters where the deviations given are right (one for rows without).
    #[must_use]
    pub fn covariance_of_known_noise(&self) -> SMatrix<f64, N, N> {
        let inverse = self.triangle.now.inverse();
        inverse * inverse.transpose()
    }

    /// Forgets all rows, and starts anew as it was made.
    pub fn restart(&mut self) {
        self.triangle.restart();
        self.freedom = -self.unknown;
    }

    /// Keeps the parameters and inflates their covariance `by` this factor, towards that of the
    /// start and no further: infinity forgets all but where it stands.
    ///
    /// # Errors
    /// Where `by` is less than one.
    pub fn reopen(&mut self, by: f64) -> Result<(), SettingError> {
        let kept = self.triangle.reopen(by)?;
        self.freedom = self.freedom * kept - self.unknown * (1.0 - kept);
        Ok(())
    }

    fn starting_with(start: Triangle<N>, unknown: f64) -> Self {
        Self {
            triangle: Restartable::new(start),
            unknown,
            freedom: -unknown,
            fade: 0.0,
            counts: Counts::default(),
        }
    }

    fn take(&mut self, row: &SVector<f64, N>, wanted: f64) {
        if self.fade > 0.0 {
            self.replace(row, wanted);
        } else {
            self.triangle.now.turn_in(row, wanted);
        }
        self.freedom += 1.0;
    }

    /// Takes a row in, and as much out of its own direction as the memory is too short for.
    fn replace(&mut self, row: &SVector<f64, N>, wanted: f64) {
        let Innovation { error, leverage } = self.triangle.now.innovation(row, wanted);
        // What goes out, as a part of row rowᵀ: it makes `fade` of the direction's information.
        let out = (self.fade / leverage).min(1.0);
        self.triangle.now.move_along(row, 1.0 - out, error);
        // The residuals, unlike directions, are renewed by every row.
        let kept = if self.freedom > 0.0 {
            1.0 - self.fade
        } else {
            1.0
        };
        self.freedom *= kept;
        // Variance of the prediction after what went out.
        let leverage = leverage / (1.0 - out * leverage);
        let squares = self.triangle.now.residual_squares_mut();
        *squares = *squares * kept + error * error / (1.0 + leverage);
    }
}

impl<const N: usize> Estimator<N> for Rls<N> {
    fn update(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome {
        let outcome = self.counts.admit(row, wanted);
        if outcome == Outcome::Used {
            self.take(row, wanted);
        }
        outcome
    }

    fn parameters(&self) -> SVector<f64, N> {
        self.triangle.now.solve()
    }

    fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        Rls::covariance(self)
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector, Matrix3, Vector1, Vector3};
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

    /// A direction that no row excites keeps its start; the others are found.
    #[test]
    fn an_unexcited_direction_keeps_its_start() {
        let mut rls = Rls::<3>::new();
        for k in 0..50 {
            let row = Vector3::new(f64::from(k).cos(), f64::from(k).sin(), 0.0);
            rls.update(&row, row.dot(&Vector3::new(4.0, -2.0, 0.0)));
        }
        assert!((rls.parameters() - Vector3::new(4.0, -2.0, 1.0)).norm() < 1e-9);
    }

    /// Ill-conditioned rows (1e6 between columns) are solved to rounding: nothing is squared.
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
        for (row, wanted) in [
            (Vector3::new(f64::NAN, 0.0, 0.0), 1.0),
            (Vector3::new(0.0, f64::INFINITY, 0.0), 1.0),
            (Vector3::new(1.0, 1.0, 1.0), f64::NAN),
        ] {
            assert_eq!(rls.update(&row, wanted), Outcome::Refused);
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

    fn normal(rng: &mut StdRng) -> Vector3<f64> {
        SVector::from_fn(|_, _| rng.sample(StandardNormal))
    }

    /// A row of deviation one is a row without, bit by bit.
    #[test]
    fn a_row_of_deviation_one_is_a_row() {
        let mut rng = StdRng::seed_from_u64(1);
        let (mut plain, mut weighted) = (Rls::<3>::new(), Rls::<3>::new());
        for _ in 0..100 {
            let (row, wanted) = (normal(&mut rng), rng.sample(StandardNormal));
            plain.update(&row, wanted);
            weighted.update_with_deviation(&row, wanted, 1.0);
        }
        assert_eq!(plain.parameters(), weighted.parameters());
        assert_eq!(plain.covariance(), weighted.covariance());
    }

    proptest! {
        /// With a prior and deviations it is the textbook's: information adds up.
        #[test]
        fn equals_the_bayesian_batch(
            entries in proptest::collection::vec(-5.0..5.0f64, 5 * 12),
            spread in proptest::collection::vec(0.1..3.0f64, 3),
        ) {
            let mean = Vector3::new(1.0, -2.0, 0.5);
            let spread = Vector3::from_column_slice(&spread);
            let mut rls = Rls::<3>::from_prior(mean, spread).unwrap();
            let mut information = Matrix3::from_diagonal(&spread.map(|s| s.powi(-2)));
            let mut vector = information * mean;
            let mut squares = mean.dot(&vector);
            for row in entries.chunks(5) {
                let (entries, deviation) = (Vector3::new(row[0], row[1], row[2]), 0.1 + row[4].abs());
                rls.update_with_deviation(&entries, row[3], deviation);
                let weight = deviation.powi(-2);
                information += entries * entries.transpose() * weight;
                vector += entries * (row[3] * weight);
                squares += row[3] * row[3] * weight;
            }
            let covariance = information.try_inverse().unwrap();
            let expected = covariance * vector;
            prop_assert!((rls.parameters() - expected).norm() < 1e-9 * (1.0 + expected.norm()));
            let known = rls.covariance_of_known_noise();
            prop_assert!((known - covariance).norm() < 1e-9 * covariance.norm());
            // The prior's misfit is among the residuals, and a prior costs no row.
            let variance = (squares - vector.dot(&expected)) / 12.0;
            prop_assert!((rls.noise_variance().unwrap() - variance).abs() < 1e-8 * (1.0 + squares));
        }

        /// Any square root of the prior's information does.
        #[test]
        fn any_root_of_the_prior_does(entries in proptest::collection::vec(-2.0..2.0f64, 9)) {
            let root = Matrix3::from_column_slice(&entries) + Matrix3::identity() * 7.0;
            let mean = Vector3::new(1.0, -2.0, 0.5);
            let rls = Rls::from_prior_root(mean, &root).unwrap();
            prop_assert!((rls.parameters() - mean).norm() < 1e-12);
            let covariance = (root.transpose() * root).try_inverse().unwrap();
            prop_assert!((rls.covariance_of_known_noise() - covariance).norm() < 1e-12);
        }
    }

    /// In one dimension, equally strong rows give exponential forgetting once the memory is full:
    /// a step is forgotten by `1 - 1/memory` a row.
    #[test]
    fn forgets_exponentially_once_the_memory_is_full() {
        let mut rls = Rls::<1>::new().with_memory(20.0).unwrap();
        let row = Vector1::new(3.0);
        for _ in 0..1000 {
            rls.update(&row, 3.0);
        }
        for k in 1..60 {
            rls.update(&row, 6.0);
            let expected = 2.0 - 0.95f64.powi(k);
            assert!((rls.parameters()[0] - expected).abs() < 1e-9, "{k}");
        }
        // 20 rows of information 9.
        let variance = rls.covariance_of_known_noise()[(0, 0)];
        assert!((variance * 9.0 * 20.0 - 1.0).abs() < 1e-9);
    }

    /// In one dimension the variance is `σ² fade / (2 - fade)` and the covariance states `σ² fade`,
    /// nearly twice as much. Errors last 20 rows: over 400 000 their variance has a deviation of 1 %.
    #[test]
    fn forgetting_states_twice_the_variance() {
        let mut rng = StdRng::seed_from_u64(6);
        let mut rls = Rls::<1>::new().with_memory(20.0).unwrap();
        let mut squares = 0.0;
        for k in 0..401_000 {
            rls.update(&Vector1::new(1.0), rng.sample(StandardNormal));
            if k >= 1000 {
                squares += rls.parameters()[0].powi(2) / 400_000.0;
            }
        }
        let ratio = rls.covariance_of_known_noise()[(0, 0)] / squares;
        assert!((ratio / 1.95 - 1.0).abs() < 0.05, "{ratio}");
    }

    /// A million rows in one direction, or of noise a thousand times below the motion's, leave what
    /// is known of the other directions: no wind-up. Exponential forgetting has lost it all.
    #[test]
    fn unexcited_directions_are_not_forgotten() {
        let mut rng = StdRng::seed_from_u64(2);
        let truth = Vector3::new(4.0, -2.0, 1.5);
        let mut rls = Rls::<3>::new().with_memory(100.0).unwrap();
        for _ in 0..2000 {
            let row = normal(&mut rng);
            rls.update(
                &row,
                row.dot(&truth) + 0.1 * rng.sample::<f64, _>(StandardNormal),
            );
        }
        let (before, known) = (rls.parameters(), rls.covariance_of_known_noise());
        for _ in 0..1_000_000 {
            let row = Vector3::new(1.0, 0.0, 0.0) + normal(&mut rng) * 1e-3;
            rls.update(
                &row,
                row.dot(&truth) + 0.1 * rng.sample::<f64, _>(StandardNormal),
            );
        }
        // No direction is known less than it was.
        let grown = rls.covariance_of_known_noise() - known;
        assert!(
            grown.symmetric_eigenvalues().max() < 1e-9 * known.norm(),
            "{grown}"
        );
        // A million rows of 1e-3 are one of 1, for which the noise is 0.1: within five of these
        // over the hundred and more rows that are remembered.
        let moved = (rls.parameters() - before).fixed_rows::<2>(1).norm();
        assert!(moved < 0.05, "{moved}");
    }

    /// With a memory it follows a change in the same rows, which it cannot without; the noise's
    /// variance is found, to 5 % over a memory of 1000 rows (a deviation of 3 %), halved freedom
    /// allowed.
    #[test]
    fn follows_a_change() {
        let mut rng = StdRng::seed_from_u64(3);
        let mut forgetting = Rls::<3>::new().with_memory(1000.0).unwrap();
        let mut plain = Rls::<3>::new();
        let mut truth = Vector3::new(4.0, -2.0, 1.5);
        for k in 0..80_000 {
            if k == 40_000 {
                truth[1] = 3.0;
            }
            let row = normal(&mut rng).normalize();
            let wanted = row.dot(&truth) + 0.1 * rng.sample::<f64, _>(StandardNormal);
            forgetting.update(&row, wanted);
            plain.update(&row, wanted);
        }
        // 40 000 rows, a third in each direction: 13 memories.
        assert!((forgetting.parameters() - truth).norm() < 0.02);
        assert!((plain.parameters() - truth).norm() > 1.0);
        let deviation = forgetting.noise_variance().unwrap().sqrt();
        assert!((deviation / 0.1 - 1.0).abs() < 0.1, "{deviation}");
    }

    /// Covariance and noise are those of repeated runs: the mean of e'C⁻¹e over 2000 runs is 3, with
    /// a deviation of √(6 / 2000) = 0.055.
    #[test]
    fn covariance_is_that_of_repeated_runs() {
        let mut rng = StdRng::seed_from_u64(4);
        let (mut known, mut estimated) = (0.0, 0.0);
        for _ in 0..2000 {
            let mut rls = Rls::<3>::new();
            for k in 0..400 {
                let row = normal(&mut rng);
                let deviation = [0.1, 2.0][k % 2];
                let noise: f64 = rng.sample(StandardNormal);
                rls.update_with_deviation(&row, row.sum() + deviation * noise, deviation);
            }
            let error = rls.parameters() - Vector3::repeat(1.0);
            let inverse = rls.covariance_of_known_noise().try_inverse().unwrap();
            known += error.dot(&(inverse * error)) / 2000.0;
            let inverse = rls.covariance().unwrap().try_inverse().unwrap();
            estimated += error.dot(&(inverse * error)) / 2000.0;
        }
        assert!((known - 3.0).abs() < 0.27, "{known}");
        assert!((estimated - 3.0).abs() < 0.29, "{estimated}");
    }

    /// Reopening keeps the parameters and multiplies the covariance, to the start's at most; a
    /// restart is as new, but for the counts.
    #[test]
    fn reopens_and_restarts() {
        let fresh = || Rls::<3>::from_prior(Vector3::zeros(), Vector3::repeat(10.0)).unwrap();
        let mut rng = StdRng::seed_from_u64(5);
        let mut rls = fresh();
        for _ in 0..500 {
            let row = normal(&mut rng);
            rls.update(&row, row.sum());
        }
        let (parameters, known) = (rls.parameters(), rls.covariance_of_known_noise());
        rls.reopen(9.0).unwrap();
        assert!((rls.parameters() - parameters).norm() < 1e-12);
        let ratio = rls
            .covariance_of_known_noise()
            .component_div(&known)
            .diagonal();
        // Less by what remains of the start: 500 rows against 0.01.
        assert!((ratio - Vector3::repeat(9.0)).amax() < 2e-3, "{ratio}");
        for _ in 0..1000 {
            rls.reopen(1e6).unwrap();
        }
        assert!((rls.parameters() - parameters).norm() < 1e-9);
        let opened = rls.covariance_of_known_noise();
        assert!(
            (opened - Matrix3::identity() * 100.0).norm() < 1e-6,
            "{opened}"
        );
        rls.restart();
        assert_eq!(rls.parameters(), fresh().parameters());
        assert_eq!((rls.covariance(), rls.counts().used), (None, 500));
        for bad in [0.5, -1.0, f64::NAN] {
            assert!(rls.reopen(bad).is_err());
        }
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let ones = Vector3::repeat(1.0);
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Rls::from_prior(ones, Vector3::new(1.0, bad, 1.0)).is_err());
            assert!(Rls::<3>::new().with_memory(bad).is_err());
            let outcome = Rls::<3>::new().update_with_deviation(&ones, 1.0, bad);
            assert_eq!(outcome, Outcome::Refused);
        }
        assert!(Rls::from_prior(ones * f64::NAN, ones).is_err());
        assert!(Rls::from_prior_root(ones, &Matrix3::zeros()).is_err());
        assert!(Rls::from_prior_root(ones, &Matrix3::repeat(f64::NAN)).is_err());
    }
}
