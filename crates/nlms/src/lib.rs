//! Online estimators of the parameters `x` in `A x = b`: rows in, parameters out.
//!
//! Section 3 of Hou et al. 2016 (doi 10.3873/j.issn.1000-1328.2016.10.009), equations (49)-(54): a
//! linear neuron (Adaline) whose weights are the parameters, trained once on each row by least
//! mean squares ([`Lms`]) or its normalised form ([`Nlms`]). [`Rls`] is plain recursive least
//! squares, the yardstick that any gradient filter is measured by. None knows of robots.
//!
//! ```
//! use nalgebra::Vector2;
//! use tactid_nlms::{Estimator, Nlms};
//!
//! let truth = Vector2::new(3.0, -0.5);
//! let mut filter = Nlms::<2>::paper();
//! for k in 0..100 {
//!     let row = Vector2::new((f64::from(k) * 0.7).cos(), (f64::from(k) * 0.3).sin());
//!     filter.update(&row, row.dot(&truth));
//! }
//! assert!((filter.parameters() - truth).norm() < 1e-6);
//! ```
//!
//! | estimator | what it assumes | cost a row, multiplications | choose it when |
//! |---|---|---|---|
//! | [`Lms`] | exact rows of a known scale | `2 N` | reproducing section 3.1; the step must fit the rows' scale |
//! | [`Nlms`] | exact measurements, rows of like scale | `3 N` | reproducing the paper |
//! | [`Kaczmarz`] | exact measurements | `3 N` for each projection | a gradient baseline that uses rows again |
//! | [`Rls`] | white noise on the wanted value | `2 N²` | anything else: it reaches what the rows contain; weights, a prior, forgetting |
//! | [`SlidingWindow`] | the same, and nothing older than the window matters | `4 N²` | the past must be gone for certain |
//! | [`TotalLeastSquares`] | noise on both sides, covariances known up to a factor | `2 N²` | the rows themselves are measured |
//! | [`Robust`] | white noise with bumps | `4 N²` | contacts and impacts disturb single rows |
//!
//! [`ChangeDetector`] tells from an estimator's innovations when what is held has changed.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod adaline;
mod change;
mod kaczmarz;
mod rls;
mod robust;
mod total;
mod triangle;
mod window;

use nalgebra::{SMatrix, SVector};
use thiserror::Error;

pub use adaline::{
    Adaline, FixedStep, LearningRule, Lms, Nlms, NormalisedStep, PAPER_ALPHA, PAPER_BETA,
};
pub use change::{Change, ChangeDetector, ChangeKind, ChangeSettings};
pub use kaczmarz::{Kaczmarz, KaczmarzSettings};
pub use rls::Rls;
pub use robust::Robust;
pub use total::{RowNoise, TotalLeastSquares};
pub use triangle::Innovation;
pub use window::SlidingWindow;

/// From where on numbers are refused: beyond, their squares overflow.
const TOO_LARGE: f64 = 1e150;

/// Estimates `N` parameters from the rows of `A x = b`, one at a time, without allocation.
pub trait Estimator<const N: usize> {
    /// Takes the row `A(k)` and the wanted `b(k)`. A row with an entry that is not finite changes
    /// nothing, is counted, and gives [`Outcome::Refused`].
    fn update(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome;

    /// The parameters as known now, in the units that the rows imply.
    fn parameters(&self) -> SVector<f64, N>;

    /// Covariance of the parameters; `None` where the estimator has none, or not yet.
    fn covariance(&self) -> Option<SMatrix<f64, N, N>>;

    /// How many rows came, and what became of them.
    fn counts(&self) -> Counts;
}

/// What became of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It was used.
    Used,
    /// It was not finite, or so large (1e150) that its square is not, and changed nothing.
    Refused,
}

/// Settings out of the range in which an estimator is stable.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("{name} is {given}, but must lie in {range}")]
pub struct SettingError {
    /// Which setting.
    pub name: &'static str,
    /// What was given.
    pub given: f64,
    /// What is possible.
    pub range: &'static str,
}

/// That `given` lies strictly between `low` and `high`; NaN does not.
fn check_within(
    name: &'static str,
    given: f64,
    (low, high): (f64, f64),
    range: &'static str,
) -> Result<(), SettingError> {
    if given > low && given < high {
        return Ok(());
    }
    Err(SettingError { name, given, range })
}

/// That each of `given` does.
fn check_all_within<const N: usize>(
    name: &'static str,
    given: &SVector<f64, N>,
    limits: (f64, f64),
    range: &'static str,
) -> Result<(), SettingError> {
    given
        .iter()
        .try_for_each(|&entry| check_within(name, entry, limits, range))
}

/// That a number is finite, and its square.
fn is_sane(number: f64) -> bool {
    number.abs() < TOO_LARGE
}

/// That a row may be used.
fn is_sane_row<const N: usize>(row: &SVector<f64, N>, wanted: f64) -> bool {
    is_sane(wanted) && row.iter().all(|&entry| is_sane(entry))
}

/// How many rows came, and what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rows that were used.
    pub used: u64,
    /// Rows that were not finite, and changed nothing.
    pub refused: u64,
}

impl Counts {
    /// Counts a row, and says whether it may be used.
    fn admit<const N: usize>(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome {
        self.admit_if(is_sane_row(row, wanted))
    }

    /// The row and the wanted value in units of the deviation of their noise, if they may be used.
    fn admit_scaled<const N: usize>(
        &mut self,
        row: &SVector<f64, N>,
        wanted: f64,
        deviation: f64,
    ) -> Option<(SVector<f64, N>, f64)> {
        // Of no use, and NaN, where the deviation is not positive and finite.
        let scale = if deviation > 0.0 && deviation.is_finite() {
            deviation.recip()
        } else {
            f64::NAN
        };
        let (row, wanted) = (row * scale, wanted * scale);
        (self.admit(&row, wanted) == Outcome::Used).then_some((row, wanted))
    }

    fn admit_if(&mut self, usable: bool) -> Outcome {
        if usable {
            self.used += 1;
            Outcome::Used
        } else {
            self.refused += 1;
            Outcome::Refused
        }
    }
}
