//! Telling from innovations that the parameters have changed.

use crate::{SettingError, check_within, is_sane};

/// Evidence that any alarm takes, however short the time between false ones may be: odds of 10.
const LEAST_THRESHOLD: f64 = std::f64::consts::LN_10;

/// What [`ChangeDetector`] looks for, and how sure it must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChangeSettings {
    /// Mean rows between two false alarms, at least; default 1e9. More costs delay, by its logarithm.
    pub rows_between_false_alarms: f64,
    /// How many rows the innovations stay alike, at least 1; default 1, white. The peak of their
    /// spectral density over that of white ones: where neighbours correlate by `φ`, and those `k`
    /// rows apart by `φ^k`, it is `(1 + φ) / (1 - φ)`.
    pub correlation_rows: f64,
    /// The smallest lasting shift of the mean worth an alarm, in deviations; default 1. Half of it
    /// and less is let pass.
    pub shift: f64,
    /// The smallest growth of the deviation worth an alarm, as a factor above 1; default 2. It sees
    /// changes whose sign follows the motion.
    pub growth: f64,
    /// Beyond so many deviations an innovation says no more, so that a single bump is no change;
    /// default 4.
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

/// What has changed about the innovations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    /// Their mean has risen.
    Up,
    /// Their mean has fallen.
    Down,
    /// They have grown to both sides.
    Spread,
}

/// An alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// What was seen first.
    pub kind: ChangeKind,
    /// How many rows ago it began, as far as the innovations tell.
    pub rows_ago: u64,
}

/// Cumulative sums of log-likelihood ratios (Page 1954, Biometrika 41): of a mean shifted up, of one
/// shifted down, and of a grown deviation, against innovations of mean 0 and deviation 1.
///
/// For such a sum, the mean time to a false alarm at the threshold `h` is at least `eʰ` rows (Lorden
/// 1971), so that the three together keep
/// [`rows_between_false_alarms`](ChangeSettings::rows_between_false_alarms), whatever the number of
/// parameters. Where innovations are correlated, rows that are alike count as one: the sums are
/// divided by the correlation's length, and so is the number of rows. Then the mean of `exp` of a
/// long stretch does not grow, for any stationary Gaussian process whose spectral density nowhere
/// exceeds that length (for the deviation's sum, because `-ln(1 - s)` is convex in `s`). This is no
/// proof of the rate, as Lorden's is for white rows. Measured in 1e6 rows at a documented rate of one
/// in 1000, white and with correlations of 0.6 and 0.95: 141, 87 and 74 alarms, so the true rate is
/// a seventh and less. A shift of `m` deviations is seen after about
/// `h · correlation / (m · shift - shift² / 2)` rows: at the defaults 15 for `m = 2`.
///
/// Assumes innovations [over their deviation](crate::Innovation::over), Gaussian or with lighter tails
/// inside the clip. Cost a row: a dozen multiplications. On an alarm, it begins anew; `reopen` or
/// `restart` the estimator.
///
/// ```
/// use nalgebra::Vector1;
/// use tactid_nlms::{ChangeDetector, ChangeSettings, Estimator, Rls};
///
/// let (mut rls, noise) = (Rls::<1>::new(), 0.1);
/// let mut detector = ChangeDetector::new(ChangeSettings::default())?;
/// let mut alarms = Vec::new();
/// for k in 0..2000 {
///     let payload = if k < 1000 { 1.0 } else { 2.0 };
///     let wanted = payload + noise * f64::from(k).sin();
///     let row = Vector1::new(1.0);
///     if detector.update(rls.innovation(&row, wanted).over(noise)).is_some() {
///         rls.reopen(f64::INFINITY)?;
///         alarms.push(k);
///     }
///     rls.update(&row, wanted);
/// }
/// assert_eq!(alarms.len(), 1);
/// assert!(alarms[0] < 1010 && (rls.parameters()[0] - 2.0).abs() < 0.01);
/// # Ok::<(), tactid_nlms::SettingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ChangeDetector {
    settings: ChangeSettings,
    threshold: f64,
    up: Sum,
    down: Sum,
    spread: Sum,
    refused: u64,
}

/// A cumulative sum that starts again whenever it would fall below zero.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    value: f64,
    /// Rows since it was last zero.
    rows: u64,
}

impl Sum {
    fn add(&mut self, evidence: f64) {
        self.value += evidence;
        self.rows += 1;
        if self.value <= 0.0 {
            *self = Self::default();
        }
    }
}

impl ChangeDetector {
    /// With nothing seen yet.
    ///
    /// # Errors
    /// Where a setting is outside its range.
    pub fn new(settings: ChangeSettings) -> Result<Self, SettingError> {
        let above_one = (1.0, f64::INFINITY);
        let rows = settings.rows_between_false_alarms;
        check_within("rows_between_false_alarms", rows, above_one, "(1, inf)")?;
        check_within("growth", settings.growth, above_one, "(1, inf)")?;
        let positive = (0.0, f64::INFINITY);
        check_within("shift", settings.shift, positive, "(0, inf)")?;
        check_within("clip", settings.clip, positive, "(0, inf)")?;
        let correlation = settings.correlation_rows;
        if correlation != 1.0 {
            check_within("correlation_rows", correlation, above_one, "[1, inf)")?;
        }
        Ok(Self {
            settings,
            // Three sums, each with a third of the false alarms; rows that are alike are one.
            threshold: (3.0 * rows / correlation).ln().max(LEAST_THRESHOLD),
            up: Sum::default(),
            down: Sum::default(),
            spread: Sum::default(),
            refused: 0,
        })
    }

    /// Takes an innovation over its deviation, and tells of a change. One that is not finite changes
    /// nothing but the count.
    pub fn update(&mut self, innovation: f64) -> Option<Change> {
        if !is_sane(innovation) {
            self.refused += 1;
            return None;
        }
        let ChangeSettings {
            correlation_rows,
            shift,
            growth,
            clip,
            ..
        } = self.settings;
        let innovation = innovation.clamp(-clip, clip);
        // Logarithms of the ratios of Gaussian densities.
        self.up
            .add((shift * innovation - shift * shift / 2.0) / correlation_rows);
        self.down
            .add((-shift * innovation - shift * shift / 2.0) / correlation_rows);
        let grown = innovation * innovation * (1.0 - growth.powi(-2)) / 2.0 - growth.ln();
        self.spread.add(grown / correlation_rows);
        self.judge()
    }

    /// Innovations that were not finite.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Forgets what it has seen.
    pub fn restart(&mut self) {
        self.up = Sum::default();
        self.down = Sum::default();
        self.spread = Sum::default();
    }

    fn judge(&mut self) -> Option<Change> {
        let (kind, sum) = [
            (ChangeKind::Up, self.up),
            (ChangeKind::Down, self.down),
            (ChangeKind::Spread, self.spread),
        ]
        .into_iter()
        .find(|(_, sum)| sum.value >= self.threshold)?;
        self.restart();
        Some(Change {
            kind,
            rows_ago: sum.rows,
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{SVector, Vector3};
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use rand_distr::StandardNormal;

    use super::*;
    use crate::{Estimator, Rls};

    /// Innovations of mean 0 and deviation 1 of which neighbours correlate by `correlation`.
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

        /// Rows that they stay alike.
        fn rows(&self) -> f64 {
            (1.0 + self.correlation) / (1.0 - self.correlation)
        }
    }

    fn alarms_in_a_million(seed: u64, correlation: f64, settings: ChangeSettings) -> usize {
        let mut noise = Noise::new(seed, correlation);
        let mut detector = ChangeDetector::new(settings).unwrap();
        (0..1_000_000)
            .filter(|_| detector.update(noise.next()).is_some())
            .count()
    }

    const CORRELATIONS: [f64; 3] = [0.0, 0.6, 0.95];

    /// At the defaults there is no alarm in a million clean rows, white or coloured: the documented
    /// rate makes one less likely than one in a thousand. Told that coloured rows are white, there
    /// are many.
    #[test]
    fn a_million_clean_rows_raise_no_alarm() {
        for correlation in CORRELATIONS {
            let correlation_rows = Noise::new(0, correlation).rows();
            let settings = ChangeSettings {
                correlation_rows,
                ..ChangeSettings::default()
            };
            assert_eq!(alarms_in_a_million(1, correlation, settings), 0);
        }
        assert!(alarms_in_a_million(1, 0.95, ChangeSettings::default()) > 1000);
    }

    /// False alarms are not more frequent than documented, by five deviations of a Poisson count,
    /// for a rate at which there are enough to count.
    #[test]
    fn false_alarms_keep_the_documented_rate() {
        for correlation in CORRELATIONS {
            let settings = ChangeSettings {
                rows_between_false_alarms: 1000.0,
                correlation_rows: Noise::new(0, correlation).rows(),
                ..ChangeSettings::default()
            };
            let alarms = alarms_in_a_million(2, correlation, settings);
            assert!(alarms < 1000 + 158, "{alarms} at {correlation}");
            // Neither is it deaf.
            assert!(alarms > 5, "{alarms} at {correlation}");
        }
    }

    /// Mean delay and kind of the alarm after innovations change by `change`.
    fn delay(change: impl Fn(f64) -> f64) -> (f64, ChangeKind, f64) {
        let mut noise = Noise::new(3, 0.0);
        let (mut sum, mut ago, mut kind) = (0.0, 0.0, ChangeKind::Up);
        for _ in 0..400 {
            let mut detector = ChangeDetector::new(ChangeSettings::default()).unwrap();
            for _ in 0..200 {
                assert_eq!(detector.update(noise.next()), None);
            }
            let mut rows = 1.0;
            let seen = loop {
                if let Some(seen) = detector.update(change(noise.next())) {
                    break seen;
                }
                rows += 1.0;
            };
            kind = seen.kind;
            sum += rows / 400.0;
            ago += seen.rows_ago as f64 / 400.0;
        }
        (sum, kind, ago)
    }

    /// The delay is the threshold over the mean evidence a row, Wald's approximation, to which the
    /// overshoot adds up to two rows; and the alarm dates the change to a few rows.
    #[test]
    fn delays_are_as_documented() {
        let threshold = 3e9f64.ln();
        let (rows, kind, ago) = delay(|x| x + 2.0);
        let expected = threshold / 1.5;
        assert_eq!(kind, ChangeKind::Up);
        assert!((expected - 2.0..expected + 2.0).contains(&rows), "{rows}");
        assert!((ago - rows).abs() < 2.0, "{ago} {rows}");
        let (rows, kind, _) = delay(|x| x - 1.0);
        assert_eq!(kind, ChangeKind::Down);
        let expected = threshold / 0.5;
        assert!((expected - 4.0..expected + 4.0).contains(&rows), "{rows}");
        // Growth by three: 9 · 3/8 - ln 2 a row, less what the clip takes.
        let (rows, kind, _) = delay(|x| 3.0 * x);
        assert_eq!(kind, ChangeKind::Spread);
        assert!((8.0..18.0).contains(&rows), "{rows}");
    }

    /// Bumps of a single row, however large, and what is not finite, are no change.
    #[test]
    fn a_bump_is_no_change() {
        let mut noise = Noise::new(4, 0.0);
        let mut detector = ChangeDetector::new(ChangeSettings::default()).unwrap();
        for k in 0..100_000 {
            let innovation = match k % 100 {
                50 => 1000.0,
                70 => f64::NAN,
                90 => f64::NEG_INFINITY,
                _ => noise.next(),
            };
            assert_eq!(detector.update(innovation), None);
        }
        assert_eq!(detector.refused(), 2000);
    }

    /// Over least squares of three parameters: no alarm while they are learnt, one when they change
    /// along with the motion, and reopened they are found.
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
            let wanted = row.dot(&truth) + 0.1 * noise.next();
            if detector
                .update(rls.innovation(&row, wanted).over(0.1))
                .is_some()
            {
                alarms.push(k);
                rls.reopen(f64::INFINITY).unwrap();
            }
            rls.update(&row, wanted);
        }
        assert_eq!(alarms.len(), 1, "{alarms:?}");
        assert!((10_000..10_050).contains(&alarms[0]), "{alarms:?}");
        // Five deviations of the length, of 0.1 · √(3 / 10 000).
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
