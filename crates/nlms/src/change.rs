//! Detection of changed parameters from the innovations of an estimator.

use crate::error::ensure;
use crate::{SettingError, has_finite_square};

/// Lower limit of the alarm threshold, a log-likelihood ratio: even where false alarms may be
/// frequent, an alarm takes odds of 10 to 1.
const LEAST_THRESHOLD: f64 = std::f64::consts::LN_10;

/// Says which changes a [`ChangeDetector`] looks for and how rare its false alarms are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChangeSettings {
    /// Lower bound of the mean number of rows between two false alarms; default 1e9. The delay of
    /// an alarm grows with its logarithm.
    pub rows_between_false_alarms: f64,
    /// Number of rows over which the innovations are correlated, at least 1; default 1 (white). It
    /// is the peak of their spectral density, as a multiple of white innovations':
    /// `(1 + φ) / (1 - φ)` where innovations `k` rows apart have the correlation `φ^k`.
    pub correlation_rows: f64,
    /// Smallest lasting shift of the mean that is detected, in standard deviations; default 1. A
    /// shift of half of it or less adds no evidence.
    pub shift: f64,
    /// Smallest growth of the standard deviation that is detected, a factor above 1; default 2. The
    /// growth reveals changes with an effect that alternates in sign with the motion.
    pub growth: f64,
    /// Limit of a single innovation, in standard deviations; default 4. Innovations beyond it count
    /// as `clip`, so that a single outlier raises no alarm.
    pub clip: f64,
}

impl Default for ChangeSettings {
    fn default() -> Self {
        Self {
            rows_between_false_alarms: 1e9,
            correlation_rows: 1.0,
            shift: 1.0,
            growth: 2.0,
            clip: 4.0,
        }
    }
}

impl ChangeSettings {
    fn check(&self) -> Result<(), SettingError> {
        let above = |value: f64, limit: f64| value > limit && value.is_finite();
        let rows = self.rows_between_false_alarms;
        let is_valid = above(rows, 1.0);
        ensure(is_valid, "rows_between_false_alarms", rows, "(1, inf)")?;
        let correlation = self.correlation_rows;
        let is_valid = (1.0..f64::INFINITY).contains(&correlation);
        ensure(is_valid, "correlation_rows", correlation, "[1, inf)")?;
        ensure(above(self.shift, 0.0), "shift", self.shift, "(0, inf)")?;
        ensure(above(self.growth, 1.0), "growth", self.growth, "(1, inf)")?;
        ensure(above(self.clip, 0.0), "clip", self.clip, "(0, inf)")
    }
}

/// Detects from the innovations of an estimator that its parameters have changed.
///
/// The detector accumulates three log-likelihood ratios against innovations of mean 0 and variance
/// 1 (Page 1954, Biometrika 41: CUSUM): for a mean shifted up, for a mean shifted down, and for a
/// larger standard deviation. It raises an alarm when one of them reaches the threshold `h`, and
/// then starts anew. One row costs about a dozen multiplications.
///
/// # False alarms
/// For white innovations the mean time to a false alarm of one such sum is at least `eʰ` rows
/// (Lorden 1971, Annals of Mathematical Statistics 42), so that the three together keep
/// [`rows_between_false_alarms`](ChangeSettings::rows_between_false_alarms), whatever the number of
/// parameters. Where innovations are correlated over
/// [`correlation_rows`](ChangeSettings::correlation_rows), so many rows count as one: the evidence
/// of each row and the number of rows are divided by it. The mean likelihood ratio of a long
/// stretch of rows then does not grow, for any stationary Gaussian process with a spectral density
/// that nowhere exceeds `correlation_rows` (for the standard deviation's sum, because `-ln(1 - s)`
/// is convex in `s`). This does not prove the rate, as Lorden's theorem does for white innovations.
/// Measured over 1e6 rows at a documented rate of one alarm in 1000 rows, with correlations of 0,
/// 0.6 and 0.95 between neighbours: 141, 87 and 74 alarms, a seventh of the documented rate or
/// less.
///
/// # Delay
/// A shift by `m` standard deviations is detected after about
/// `h · correlation_rows / (m · shift - shift² / 2)` rows: 15 for `m = 2` at the defaults.
///
/// # Example
/// The innovation is the target less its prediction, before the update. Its variance is
/// `σ² (1 + l)` for noise of variance `σ²` on the target, where `l = |R⁻ᵀ a|²` is the variance that
/// the uncertainty of the estimate adds for the row `a`.
///
/// ```
/// use nalgebra::Vector1;
/// use tactid_nlms::{ChangeDetector, ChangeSettings, Estimator, Rls};
///
/// let (mut rls, noise_std_dev) = (Rls::<1>::new(), 0.1);
/// let mut detector = ChangeDetector::new(ChangeSettings::default())?;
/// let mut alarms = Vec::new();
/// for k in 0..2000 {
///     let truth = if k < 1000 { 1.0 } else { 2.0 };
///     let row = Vector1::new(1.0);
///     let target = truth + noise_std_dev * f64::from(k).sin();
///     let innovation = target - row.dot(&rls.parameters());
///     let leverage = (row[0] / rls.information_root()[(0, 0)]).powi(2);
///     let innovation_std_dev = noise_std_dev * (1.0 + leverage).sqrt();
///     if detector.update(innovation / innovation_std_dev) {
///         rls = Rls::starting_at(rls.parameters());
///         alarms.push(k);
///     }
///     rls.update(&row, target);
/// }
/// assert_eq!(alarms.len(), 1);
/// assert!(alarms[0] < 1010 && (rls.parameters()[0] - 2.0).abs() < 0.01);
/// # Ok::<(), tactid_nlms::SettingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ChangeDetector {
    settings: ChangeSettings,
    threshold: f64,
    evidence: Evidence,
}

/// Cumulative sums of log-likelihood ratios, none of which falls below zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Evidence {
    /// For a mean shifted up.
    rise: f64,
    /// For a mean shifted down.
    fall: f64,
    /// For a larger standard deviation.
    growth: f64,
}

impl ChangeDetector {
    /// Returns a detector that has no evidence yet.
    ///
    /// # Errors
    /// Returns the [`SettingError`] of the first setting that is outside its range.
    pub fn new(settings: ChangeSettings) -> Result<Self, SettingError> {
        settings.check()?;
        // Each of the three sums may raise a third of the false alarms. Rows that are correlated
        // count as one.
        let rows_per_sum = 3.0 * settings.rows_between_false_alarms / settings.correlation_rows;
        Ok(Self {
            settings,
            threshold: rows_per_sum.ln().max(LEAST_THRESHOLD),
            evidence: Evidence::default(),
        })
    }

    /// Adds the evidence of an innovation over its standard deviation, and returns true if it shows
    /// a change. The detector then starts anew.
    ///
    /// An innovation with a magnitude of 1e150 or more, or that is not finite, changes nothing.
    pub fn update(&mut self, normalised_innovation: f64) -> bool {
        if !has_finite_square(normalised_innovation) {
            return false;
        }
        let ChangeSettings {
            correlation_rows,
            shift,
            growth,
            clip,
            ..
        } = self.settings;
        let innovation = normalised_innovation.clamp(-clip, clip);
        // Log-likelihood ratios of Gaussian densities.
        let rise = shift * innovation - shift * shift / 2.0;
        let fall = -shift * innovation - shift * shift / 2.0;
        let grown = innovation * innovation * (1.0 - growth.powi(-2)) / 2.0 - growth.ln();
        let accumulated = |sum: f64, ratio: f64| (sum + ratio / correlation_rows).max(0.0);
        self.evidence = Evidence {
            rise: accumulated(self.evidence.rise, rise),
            fall: accumulated(self.evidence.fall, fall),
            growth: accumulated(self.evidence.growth, grown),
        };
        let is_change = self.evidence.greatest() >= self.threshold;
        if is_change {
            self.restart();
        }
        is_change
    }

    /// Returns whether the innovations so far are evidence of a change: whether any of the sums is
    /// above zero.
    #[must_use]
    pub fn has_evidence(&self) -> bool {
        self.evidence.greatest() > 0.0
    }

    /// Discards the evidence of all innovations so far.
    pub fn restart(&mut self) {
        self.evidence = Evidence::default();
    }
}

impl Evidence {
    fn greatest(&self) -> f64 {
        self.rise.max(self.fall).max(self.growth)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{SVector, Vector3};
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use rand_distr::StandardNormal;

    use super::*;
    use crate::{Estimator, Rls};

    /// Innovations of mean 0 and standard deviation 1 with this correlation of neighbours.
    struct Noise {
        rng: StdRng,
        correlation: f64,
        last: f64,
    }

    impl Noise {
        fn new(seed: u64, correlation: f64) -> Self {
            let mut rng = StdRng::seed_from_u64(seed);
            let last = rng.sample(StandardNormal);
            Self {
                rng,
                correlation,
                last,
            }
        }

        fn next(&mut self) -> f64 {
            let fresh: f64 = self.rng.sample(StandardNormal);
            let kept = self.correlation;
            self.last = kept * self.last + (1.0 - kept * kept).sqrt() * fresh;
            self.last
        }

        /// The peak of the spectral density, as a multiple of white innovations'.
        fn correlation_rows(&self) -> f64 {
            (1.0 + self.correlation) / (1.0 - self.correlation)
        }
    }

    fn alarms_in_a_million(seed: u64, correlation: f64, settings: ChangeSettings) -> usize {
        let mut noise = Noise::new(seed, correlation);
        let mut detector = ChangeDetector::new(settings).unwrap();
        (0..1_000_000)
            .filter(|_| detector.update(noise.next()))
            .count()
    }

    const CORRELATIONS: [f64; 3] = [0.0, 0.6, 0.95];

    /// At the defaults there is no alarm in a million rows without change, white or coloured: the
    /// documented rate makes one less likely than one in a thousand. Where coloured rows are
    /// declared white, there are many.
    #[test]
    fn a_million_clean_rows_raise_no_alarm() {
        for correlation in CORRELATIONS {
            let correlation_rows = Noise::new(0, correlation).correlation_rows();
            let settings = ChangeSettings {
                correlation_rows,
                ..ChangeSettings::default()
            };
            assert_eq!(alarms_in_a_million(1, correlation, settings), 0);
        }
        assert!(alarms_in_a_million(1, 0.95, ChangeSettings::default()) > 1000);
    }

    /// False alarms are not more frequent than documented, by five standard deviations of a Poisson
    /// count, for a rate at which there are enough to count.
    #[test]
    fn false_alarms_keep_the_documented_rate() {
        for correlation in CORRELATIONS {
            let settings = ChangeSettings {
                rows_between_false_alarms: 1000.0,
                correlation_rows: Noise::new(0, correlation).correlation_rows(),
                ..ChangeSettings::default()
            };
            let alarms = alarms_in_a_million(2, correlation, settings);
            assert!(alarms < 1000 + 158, "{alarms} at {correlation}");
            // The detector is not insensitive, either.
            assert!(alarms > 5, "{alarms} at {correlation}");
        }
    }

    /// Mean number of rows from a change of the innovations to the alarm.
    fn mean_delay(change: impl Fn(f64) -> f64) -> f64 {
        let mut noise = Noise::new(3, 0.0);
        let mut sum = 0.0;
        for _ in 0..400 {
            let mut detector = ChangeDetector::new(ChangeSettings::default()).unwrap();
            for _ in 0..200 {
                assert!(!detector.update(noise.next()));
            }
            let mut rows = 1.0;
            while !detector.update(change(noise.next())) {
                rows += 1.0;
            }
            sum += rows;
        }
        sum / 400.0
    }

    /// The delay is the threshold over the mean evidence of a row, Wald's approximation, to which
    /// the overshoot adds up to two rows.
    #[test]
    fn delays_are_as_documented() {
        let threshold = 3e9f64.ln();
        let rows = mean_delay(|x| x + 2.0);
        let expected = threshold / 1.5;
        assert!((expected - 2.0..expected + 2.0).contains(&rows), "{rows}");
        let rows = mean_delay(|x| x - 1.0);
        let expected = threshold / 0.5;
        assert!((expected - 4.0..expected + 4.0).contains(&rows), "{rows}");
        // Growth by three: 9 · 3/8 - ln 2 for each row, less what the clip removes.
        let rows = mean_delay(|x| 3.0 * x);
        assert!((8.0..18.0).contains(&rows), "{rows}");
    }

    /// The sums are the log-likelihood ratios of eight innovations: a mean shifted by one standard
    /// deviation up or down, and innovations that alternate in sign.
    #[test]
    fn each_kind_of_change_has_its_own_evidence() {
        let after = |innovations: [f64; 2]| {
            let mut detector = ChangeDetector::new(ChangeSettings::default()).unwrap();
            for k in 0..8 {
                assert!(!detector.update(innovations[k % 2]));
            }
            detector.evidence
        };
        let none = Evidence::default();
        assert_eq!(after([1.0, 1.0]), Evidence { rise: 4.0, ..none });
        assert_eq!(after([-1.0, -1.0]), Evidence { fall: 4.0, ..none });
        let alternating = after([2.0, -2.0]);
        let expected = 8.0 * (4.0 * 3.0 / 8.0 - 2.0f64.ln());
        assert!((alternating.growth - expected).abs() < 1e-12);
        // The last innovation shifts down: 2 - 1/2.
        assert_eq!((alternating.rise, alternating.fall), (0.0, 1.5));
    }

    /// Outliers in single rows, however large, and innovations that are not finite raise no alarm;
    /// the latter leave the evidence as it was.
    #[test]
    fn a_bump_is_no_change() {
        let mut noise = Noise::new(4, 0.0);
        let mut detector = ChangeDetector::new(ChangeSettings::default()).unwrap();
        for k in 0..100_000 {
            let before = detector.evidence;
            let innovation = match k % 100 {
                50 => 1000.0,
                70 => f64::NAN,
                90 => f64::NEG_INFINITY,
                _ => noise.next(),
            };
            assert!(!detector.update(innovation));
            assert!(innovation.is_finite() || detector.evidence == before);
        }
    }

    /// Beside least squares of three parameters: there is no alarm while they are estimated, one
    /// when they change, and an estimator that starts anew finds the new ones.
    #[test]
    fn finds_a_change_of_payload_and_the_new_one() {
        let mut noise = Noise::new(5, 0.0);
        let mut rls = Rls::<3>::new();
        let mut detector = ChangeDetector::new(ChangeSettings::default()).unwrap();
        let before = Vector3::new(3.0, 0.5, -0.2);
        let after = Vector3::new(3.0, 0.9, -0.2);
        let mut alarms = Vec::new();
        for k in 0..20_000 {
            let truth = if k < 10_000 { before } else { after };
            let row: Vector3<f64> = SVector::from_fn(|_, _| noise.next());
            let target = row.dot(&truth) + 0.1 * noise.next();
            let mut whitened = row;
            rls.information_root()
                .tr_solve_upper_triangular_mut(&mut whitened);
            let std_dev = 0.1 * (1.0 + whitened.norm_squared()).sqrt();
            if detector.update((target - row.dot(&rls.parameters())) / std_dev) {
                alarms.push(k);
                rls = Rls::starting_at(rls.parameters());
            }
            rls.update(&row, target);
        }
        assert_eq!(alarms.len(), 1, "{alarms:?}");
        assert!((10_000..10_050).contains(&alarms[0]), "{alarms:?}");
        // Five standard deviations, 0.1 · √(3 / 10 000) for the length of the error.
        let error = (rls.parameters() - after).norm();
        assert!(error < 5.0 * 0.1 * 3e-4f64.sqrt(), "{error}");
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let fine = ChangeSettings::default();
        for bad in [
            ChangeSettings {
                rows_between_false_alarms: 1.0,
                ..fine
            },
            ChangeSettings {
                correlation_rows: 0.9,
                ..fine
            },
            ChangeSettings { shift: 0.0, ..fine },
            ChangeSettings {
                growth: 1.0,
                ..fine
            },
            ChangeSettings {
                clip: f64::NAN,
                ..fine
            },
        ] {
            assert!(ChangeDetector::new(bad).is_err(), "{bad:?}");
        }
    }
}
