//! Recursive least squares that a bump hardly moves.

use nalgebra::{SMatrix, SVector};

use crate::triangle::{Innovation, Restartable, Triangle};
use crate::{Counts, Estimator, Outcome, SettingError, check_within};

/// Degrees of freedom of the noise it is built for: 95 % efficient in one pass over Gaussian noise,
/// and a row of 100 deviations counts as much as one of 0.1.
const FREEDOM: f64 = 10.0;
/// The median of a standard Gaussian's magnitude.
const MEDIAN: f64 = 0.674_489_750_196_081_7;
/// Of a quantile's recursion for Gaussian noise: the inverse of the density of the logarithm.
const GAIN: f64 = 2.33;
/// Least gain of the scale, so that it follows slow changes.
const LEAST_GAIN: f64 = 0.005;

/// Recursive M-estimation with the weights of Student's t.
///
/// A row whose innovation is `t` deviations off counts `1 / (1 + t²/10)`. Huber's weights would let
/// each bump pull with 1.3 deviations, and bumps have a preferred side: a steady bias. Student's t
/// lets a far row go altogether (Lange, Little and Taylor 1989, JASA 84), and no row counts nothing,
/// so that it comes back from a wrong start. What is expected is given, or tracked as the median of
/// the innovations' magnitudes (Robbins and Monro 1951), which bumps move little.
///
/// Assumes white noise of one size on the wanted value, fewer than half of the rows bumps, and those
/// not within the first `N` rows (with a tracked scale it recovers from these too). Cost a row:
/// `4 N²` multiplications.
///
/// ```
/// use nalgebra::Vector1;
/// use tactid_nlms::{Estimator, Robust};
///
/// let mut robust = Robust::<1>::with_known_scale(0.1)?;
/// for k in 0..200 {
///     let bump = if k % 20 == 10 { 10.0 } else { 0.0 };
///     robust.update(&Vector1::new(1.0), 3.0 + 0.1 * f64::from(k).sin() + bump);
/// }
/// assert!((robust.parameters()[0] - 3.0).abs() < 0.02);
/// # Ok::<(), tactid_nlms::SettingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Robust<const N: usize> {
    triangle: Restartable<N>,
    scale: Scale,
    moments: Moments,
    counts: Counts,
}

/// The deviation of the rows' noise.
#[derive(Clone, Copy, Debug)]
struct Scale {
    deviation: f64,
    /// Rows that it was tracked over; `None` where it is known.
    tracked: Option<u64>,
}

impl Scale {
    /// Moves towards the median of the magnitudes, a step for each row.
    fn follow(&mut self, magnitude: f64) {
        let Some(rows) = &mut self.tracked else {
            return;
        };
        *rows += 1;
        // Slower than 1/n, so that a start that is orders of magnitude off is soon left.
        let gain = (GAIN * (*rows as f64).powf(-2.0 / 3.0)).clamp(LEAST_GAIN, 1.0);
        let side = if magnitude > MEDIAN { 0.5 } else { -0.5 };
        let moved = self.deviation * (gain * side).exp();
        // Noise-free rows would bring it to zero, and there it would stay.
        self.deviation = moved.clamp(f64::MIN_POSITIVE.sqrt(), f64::MAX.sqrt());
    }
}

/// Sums of the weight, the squared score and the score's slope, in units of the scale.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    rows: u64,
    weight: f64,
    score_squares: f64,
    slope: f64,
}

impl Moments {
    fn add(&mut self, weight: f64) {
        self.rows += 1;
        self.weight += weight;
        // With w = 1 / (1 + t²/ν) the score t w has the square ν w (1 - w), and the slope w (2 w - 1).
        self.score_squares += FREEDOM * weight * (1.0 - weight);
        self.slope += weight * (2.0 * weight - 1.0);
    }

    /// What the inverse of the weighted information is to be multiplied with, for a scale of one:
    /// the sandwich of an M-estimate, with what one pass loses because its gain is `1 / Σ weight`
    /// and not `1 / Σ slope` (stochastic approximation, Fabian 1968).
    fn inflation(&self) -> f64 {
        // Gaussian noise has a ratio of 0.86; a half would be noise without a finite answer.
        let ratio = (self.slope / self.weight).max(0.6);
        self.score_squares / self.weight / (2.0 * ratio - 1.0)
    }
}

impl<const N: usize> Robust<N> {
    /// For noise of this standard deviation, starting at ones.
    ///
    /// # Errors
    /// Where `deviation` is not positive and finite.
    pub fn with_known_scale(deviation: f64) -> Result<Self, SettingError> {
        Self::with_scale(deviation, None)
    }

    /// For noise of unknown size, starting at ones and with this guess of its standard deviation: a
    /// factor of a thousand is made good in a hundred rows. Until then bumps count as much as rows
    /// where it is too large, and good rows as little as bumps where it is too small.
    ///
    /// # Errors
    /// Where `guess` is not positive and finite.
    pub fn with_tracked_scale(guess: f64) -> Result<Self, SettingError> {
        Self::with_scale(guess, Some(0))
    }

    fn with_scale(deviation: f64, tracked: Option<u64>) -> Result<Self, SettingError> {
        check_within("deviation", deviation, (0.0, f64::INFINITY), "(0, inf)")?;
        let start = Triangle::weak(&SVector::repeat(1.0));
        Ok(Self {
            triangle: Restartable::new(start),
            scale: Scale { deviation, tracked },
            moments: Moments::default(),
            counts: Counts::default(),
        })
    }

    /// The same, starting at the given parameters. To be said before the first row.
    #[must_use]
    pub fn starting_at(mut self, parameters: SVector<f64, N>) -> Self {
        self.triangle.move_to(&parameters);
        self
    }

    /// Standard deviation of the rows' noise, as given or as tracked.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale.deviation
    }

    /// How the row departs from what is known: ask before the update.
    #[must_use]
    pub fn innovation(&self, row: &SVector<f64, N>, wanted: f64) -> Innovation {
        self.triangle.now.innovation(row, wanted)
    }

    /// Forgets all rows, but keeps a scale that was tracked.
    pub fn restart(&mut self) {
        self.triangle.restart();
        self.moments = Moments::default();
    }

    /// Keeps the parameters and inflates their covariance `by` this factor; infinity forgets all but
    /// where it stands.
    ///
    /// # Errors
    /// Where `by` is less than one.
    pub fn reopen(&mut self, by: f64) -> Result<(), SettingError> {
        self.triangle.reopen(by).map(|_| ())
    }

    /// The weight of a row.
    fn weigh(&mut self, row: &SVector<f64, N>, wanted: f64) -> f64 {
        let innovation = self.innovation(row, wanted);
        // Of a direction that is not known the innovation says nothing about the noise.
        if innovation.leverage > 1.0 {
            return 1.0;
        }
        let magnitude = innovation.over(self.scale.deviation).abs();
        self.scale.follow(magnitude);
        let weight = (1.0 + magnitude * magnitude / FREEDOM).recip();
        self.moments.add(weight);
        weight
    }
}

impl<const N: usize> Estimator<N> for Robust<N> {
    fn update(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome {
        let outcome = self.counts.admit(row, wanted);
        if outcome == Outcome::Used {
            let weight = self.weigh(row, wanted).sqrt();
            self.triangle.now.turn_in(&(row * weight), wanted * weight);
        }
        outcome
    }

    fn parameters(&self) -> SVector<f64, N> {
        self.triangle.now.solve()
    }

    /// As rows grow many, from the scale and the rows' weights; `None` until `N` rows were judged.
    fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        (self.moments.rows > N as u64).then(|| {
            let inverse = self.triangle.now.inverse();
            let variance = self.scale.deviation.powi(2) * self.moments.inflation();
            inverse * inverse.transpose() * variance
        })
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector3};
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use rand_distr::StandardNormal;

    use super::*;
    use crate::Rls;

    const NOISE: f64 = 0.05;

    fn truth() -> Vector2<f64> {
        Vector2::new(2.0, -1.0)
    }

    /// A row with an intercept, which one-sided bumps bias, and its wanted value with noise.
    fn noisy_row(rng: &mut StdRng) -> (Vector2<f64>, f64) {
        let row = Vector2::new(1.0, rng.sample::<f64, _>(StandardNormal));
        let noise: f64 = rng.sample(StandardNormal);
        (row, row.dot(&truth()) + NOISE * noise)
    }

    fn both_scales() -> [Robust<2>; 2] {
        [
            Robust::with_known_scale(NOISE).unwrap(),
            Robust::with_tracked_scale(3.0 * NOISE).unwrap(),
        ]
    }

    /// 5 % outliers of 100 deviations, all to one side, move the estimate by less than the deviation
    /// of a clean run, and least squares by far more.
    #[test]
    fn bumps_hardly_move_it() {
        for robust in both_scales() {
            let mut rng = StdRng::seed_from_u64(3);
            let (mut clean, mut bumped) = (robust.clone(), robust);
            let mut rls = Rls::<2>::new();
            for k in 0..1000 {
                let (row, wanted) = noisy_row(&mut rng);
                let bump = if k % 20 == 15 { 100.0 * NOISE } else { 0.0 };
                clean.update(&row, wanted);
                bumped.update(&row, wanted + bump);
                rls.update(&row, wanted + bump);
            }
            let deviation = clean.covariance().unwrap().diagonal().map(f64::sqrt);
            let moved = bumped.parameters() - clean.parameters();
            assert!(moved.component_div(&deviation).amax() < 1.0, "{moved}");
            let moved = rls.parameters() - clean.parameters();
            assert!(moved.component_div(&deviation).amax() > 50.0, "{moved}");
        }
    }

    /// On Gaussian noise the variance is that of least squares over 0.95, and the covariance says so:
    /// over 3000 runs, on the same rows, the ratio of squared errors has a deviation of 0.7 %.
    #[test]
    fn is_efficient_on_gaussian_noise() {
        for robust in both_scales() {
            let mut rng = StdRng::seed_from_u64(4);
            let (mut ours, mut theirs, mut normalised) = (0.0, 0.0, 0.0);
            for _ in 0..3000 {
                let (mut robust, mut rls) = (robust.clone(), Rls::<2>::new());
                for _ in 0..1000 {
                    let (row, wanted) = noisy_row(&mut rng);
                    robust.update(&row, wanted);
                    rls.update(&row, wanted);
                }
                let error = robust.parameters() - truth();
                ours += error.norm_squared();
                theirs += (rls.parameters() - truth()).norm_squared();
                let inverse = robust.covariance().unwrap().try_inverse().unwrap();
                normalised += error.dot(&(inverse * error)) / (2.0 * 3000.0);
            }

            assert!(theirs / ours > 0.92, "{}", theirs / ours);
            // A deviation of 1/√3000 = 0.018; the tracked scale adds its own noise.
            assert!((normalised - 1.0).abs() < 0.1, "{normalised}");
        }
    }

    /// A bump in the very first rows, where nothing is known to judge it by, is made good.
    #[test]
    fn recovers_from_a_bump_in_the_first_row() {
        let mut rng = StdRng::seed_from_u64(5);
        for mut robust in both_scales() {
            for k in 0..5000 {
                let (row, wanted) = noisy_row(&mut rng);
                robust.update(&row, if k == 0 { wanted + 5.0 } else { wanted });
            }
            let error = (robust.parameters() - truth()).norm();
            assert!(error < 10.0 * NOISE / 5000f64.sqrt(), "{error}");
        }
    }

    /// The tracked scale is the noise's, from a guess a thousand times too large or too small, and
    /// with 5 % bumps: within 10 %, of which bumps take 6 and the gain's noise two deviations.
    #[test]
    fn finds_the_scale() {
        for guess in [1000.0, 1e-3] {
            let mut rng = StdRng::seed_from_u64(6);
            let mut robust = Robust::<2>::with_tracked_scale(guess * NOISE).unwrap();
            for k in 0..3000 {
                let (row, wanted) = noisy_row(&mut rng);
                robust.update(&row, if k % 20 == 15 { wanted + 5.0 } else { wanted });
            }
            let ratio = robust.scale() / NOISE;
            assert!((ratio - 1.06).abs() < 0.1, "{ratio}");
        }
    }

    /// Reopened, it follows a change that its certainty would have taken for bumps.
    #[test]
    fn reopened_it_follows_a_change() {
        let mut rng = StdRng::seed_from_u64(7);
        let [mut robust, _] = both_scales();
        for _ in 0..2000 {
            let (row, wanted) = noisy_row(&mut rng);
            robust.update(&row, wanted);
        }
        let mut stubborn = robust.clone();
        robust.reopen(f64::INFINITY).unwrap();
        assert!((robust.parameters() - stubborn.parameters()).norm() < 1e-9);
        for _ in 0..200 {
            let (row, wanted) = noisy_row(&mut rng);
            robust.update(&row, wanted + 5.0 * row[0]);
            stubborn.update(&row, wanted + 5.0 * row[0]);
        }
        let after = truth() + Vector2::new(5.0, 0.0);
        assert!((robust.parameters() - after).norm() < 0.03);
        assert!((stubborn.parameters() - after).norm() > 4.0);
        robust.restart();
        assert!((robust.parameters() - Vector2::repeat(1.0)).norm() < 1e-9);
    }

    #[test]
    fn refuses_what_is_not_finite() {
        let mut robust = Robust::<3>::with_known_scale(1.0).unwrap();
        let outcome = robust.update(&Vector3::new(f64::NAN, 0.0, 0.0), 1.0);
        assert_eq!((outcome, robust.counts().refused), (Outcome::Refused, 1));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Robust::<3>::with_known_scale(bad).is_err());
            assert!(Robust::<3>::with_tracked_scale(bad).is_err());
        }
        assert!(robust.reopen(0.5).is_err());
    }
}
