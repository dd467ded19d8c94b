//! Kaczmarz projections over the last rows.

use nalgebra::{SMatrix, SVector};

use crate::adaline::{Adaline, NormalisedStep};
use crate::{Counts, Estimator, Outcome, SettingError, check_within};

/// How [`Kaczmarz`] projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KaczmarzSettings {
    /// How many of the last rows are kept to be projected onto again; at least 1, below a million, default 64.
    pub ring: usize,
    /// How many of them each new row brings; default 8. With 0, and a small regularisation, this is
    /// NLMS.
    pub repeats: usize,
    /// Part of the way to the row's hyperplane that a projection goes, in (0, 2); default 1.
    pub relaxation: f64,
    /// Added to the row's squared norm, so that rows below noise move nothing: positive, in squares
    /// of the rows' unit; default 1e-6.
    pub regularisation: f64,
}

impl Default for KaczmarzSettings {
    fn default() -> Self {
        Self {
            ring: 64,
            repeats: 8,
            relaxation: 1.0,
            regularisation: 1e-6,
        }
    }
}

/// Randomised Kaczmarz on a ring of the last rows.
///
/// Each row is projected onto once, and then some of the ring, drawn evenly from a fixed seed (after
/// Strohmer and Vershynin 2009, "A randomized Kaczmarz algorithm with exponential convergence"; even
/// draws weigh rows by their inverse norm). NLMS with its rows used again: neighbours in time, nearly
/// parallel, do not follow each other.
///
/// Assumes exact rows: noise on the wanted value does not average out. Cost a row: `3 N`
/// multiplications for each projection, and the ring is allocated once.
///
/// ```
/// use nalgebra::Vector2;
/// use tactid_nlms::{Estimator, Kaczmarz, KaczmarzSettings};
///
/// let truth = Vector2::new(3.0, -0.5);
/// let mut filter = Kaczmarz::<2>::new(KaczmarzSettings::default())?;
/// for k in 0..100 {
///     let row = Vector2::new((f64::from(k) * 0.02).cos(), (f64::from(k) * 0.02).sin());
///     filter.update(&row, row.dot(&truth));
/// }
/// assert!((filter.parameters() - truth).norm() < 1e-6);
/// # Ok::<(), tactid_nlms::SettingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Kaczmarz<const N: usize> {
    projections: Adaline<NormalisedStep, N>,
    ring: Vec<(SVector<f64, N>, f64)>,
    settings: KaczmarzSettings,
    /// State of the generator.
    random: u64,
    counts: Counts,
}

impl<const N: usize> Kaczmarz<N> {
    /// With parameters of one, as the paper's filters start.
    ///
    /// # Errors
    /// Where a setting is outside its range.
    pub fn new(settings: KaczmarzSettings) -> Result<Self, SettingError> {
        let KaczmarzSettings {
            ring,
            relaxation,
            regularisation,
            ..
        } = settings;
        check_within("ring", ring as f64, (0.0, 1e6), "[1, 1e6)")?;
        check_within("relaxation", relaxation, (0.0, 2.0), "(0, 2)")?;
        let positive = (0.0, f64::INFINITY);
        check_within("regularisation", regularisation, positive, "(0, inf)")?;
        Ok(Self {
            projections: Adaline::with_rule(NormalisedStep {
                alpha: relaxation,
                beta: regularisation,
            }),
            ring: Vec::with_capacity(ring),
            settings,
            random: 0x9E37_79B9_7F4A_7C15,
            counts: Counts::default(),
        })
    }

    /// The same, starting at the given parameters.
    #[must_use]
    pub fn starting_at(self, parameters: SVector<f64, N>) -> Self {
        Self {
            projections: self.projections.starting_at(parameters),
            ..self
        }
    }

    /// Puts a row into the ring, where the oldest was once it is full.
    fn keep(&mut self, row: (SVector<f64, N>, f64)) {
        if self.ring.len() < self.settings.ring {
            self.ring.push(row);
            return;
        }
        // `used` counts this row already; the ring has at least one place.
        let place = (self.counts.used - 1) % self.settings.ring as u64;
        self.ring[place as usize] = row;
    }

    /// A row of the ring, by Marsaglia's xorshift (2003).
    fn draw(&mut self) -> (SVector<f64, N>, f64) {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.ring[(self.random % self.ring.len() as u64) as usize]
    }
}

impl<const N: usize> Estimator<N> for Kaczmarz<N> {
    fn update(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome {
        let outcome = self.counts.admit(row, wanted);
        if outcome == Outcome::Used {
            self.projections.learn(row, wanted);
            self.keep((*row, wanted));
            for _ in 0..self.settings.repeats {
                let (row, wanted) = self.draw();
                self.projections.learn(&row, wanted);
            }
        }
        outcome
    }

    fn parameters(&self) -> SVector<f64, N> {
        self.projections.parameters()
    }

    /// `None`: projections keep no second moments.
    fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        None
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::Nlms;

    fn settings(repeats: usize) -> KaczmarzSettings {
        KaczmarzSettings {
            repeats,
            ..KaczmarzSettings::default()
        }
    }

    /// A slow sweep: neighbouring rows are nearly parallel.
    fn row(k: u32) -> Vector3<f64> {
        let t = f64::from(k) * 0.01;
        Vector3::new(t.cos(), t.sin(), (1.7 * t).cos())
    }

    /// Without repeats it is NLMS, bit by bit.
    #[test]
    fn without_repeats_it_is_nlms() {
        let mut kaczmarz = Kaczmarz::<3>::new(settings(0)).unwrap();
        let mut nlms = Nlms::<3>::new(1.0, 1e-6).unwrap();
        for k in 0..200 {
            kaczmarz.update(&row(k), f64::from(k).sin());
            nlms.update(&row(k), f64::from(k).sin());
        }
        assert_eq!(kaczmarz.parameters(), nlms.parameters());
    }

    /// On exact rows the error never grows (projections are contractions), and using rows again
    /// brings it down faster.
    #[test]
    fn rows_used_again_help_and_the_error_never_grows() {
        let truth = Vector3::new(2.0, -1.0, 0.5);
        let mut errors = [0, 20].map(|repeats| {
            let mut filter = Kaczmarz::<3>::new(settings(repeats)).unwrap();
            let mut error = f64::INFINITY;
            for k in 0..1000 {
                filter.update(&row(k), row(k).dot(&truth));
                let now = (filter.parameters() - truth).norm();
                assert!(now <= error + 1e-14, "{now} after {error}");
                error = now;
            }
            error
        });
        errors[1] *= 10.0;
        assert!(errors[1] < errors[0], "{errors:?}");
    }

    /// What left the ring moves nothing any more: rows of another truth are forgotten.
    #[test]
    fn the_ring_forgets() {
        let mut filter = Kaczmarz::<3>::new(KaczmarzSettings {
            ring: 16,
            ..settings(8)
        })
        .unwrap();
        let truth = Vector3::new(2.0, -1.0, 0.5);
        for k in 0..2000 {
            let sign = if k < 100 { -1.0 } else { 1.0 };
            filter.update(&row(k * 37), sign * row(k * 37).dot(&truth));
        }
        assert!((filter.parameters() - truth).norm() < 1e-6);
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let fine = KaczmarzSettings::default();
        for bad in [
            KaczmarzSettings { ring: 0, ..fine },
            KaczmarzSettings {
                relaxation: 2.0,
                ..fine
            },
            KaczmarzSettings {
                regularisation: 0.0,
                ..fine
            },
        ] {
            assert!(Kaczmarz::<3>::new(bad).is_err(), "{bad:?}");
        }
    }
}
