//! Online estimators of the parameters `x` of a linear equation `A x = b`, (49), one row at a time.
//!
//! The crate implements section 3 of Hou et al. 2016 (doi 10.3873/j.issn.1000-1328.2016.10.009),
//! equations (49)-(54): an Adaline, a linear neuron with the parameters as weights, is trained on
//! the rows by least mean squares ([`Lms`]) or by normalised least mean squares ([`Nlms`]). It adds
//! recursive least squares ([`Rls`]) and a [`ChangeDetector`]. Nothing in it knows of robots, and
//! nothing allocates.
//!
//! ```
//! use nalgebra::Vector2;
//! use tactid_nlms::{Estimator, Nlms, Rls};
//!
//! let truth = Vector2::new(3.0, -0.5);
//! let (mut nlms, mut rls) = (Nlms::<2>::paper(), Rls::<2>::new());
//! for k in 0..100 {
//!     let row = Vector2::new((f64::from(k) * 0.7).cos(), (f64::from(k) * 0.3).sin());
//!     let target = row.dot(&truth);
//!     nlms.update(&row, target);
//!     rls.update(&row, target);
//! }
//! assert!((nlms.parameters() - truth).norm() < 1e-6);
//! assert!((rls.parameters() - truth).norm() < 1e-9);
//! assert!(rls.covariance().is_some());
//! ```
//!
//! # Which estimator to choose
//!
//! | type | choose it | it assumes | multiplications per row |
//! |---|---|---|---|
//! | [`Rls`] | in general: it returns the least-squares solution of all rows, and its covariance | exact rows; white noise of one standard deviation on the targets | `N²` |
//! | [`Rls::update_all`] | when several rows arrive together: they share `N` square roots | as [`Rls`] | `N²` |
//! | [`Nlms`] | to reproduce the paper's filter | exact rows and targets; columns of similar scale | `3 N` |
//! | [`Lms`] | to reproduce section 3.1 of the paper | as [`Nlms`], and a known bound on the norm of the rows | `2 N` |
//! | [`ChangeDetector`] | beside an estimator, to detect that the parameters have changed | Gaussian innovations, normalised to variance one | about 12 |
//!
//! [`Lms`] and [`Nlms`] follow parameters that change, but noise on the targets never averages out.
//! [`Rls`] weights all rows equally and never forgets: after a change of the parameters, start a
//! new one with [`Rls::starting_at`]. To weight rows by their noise, divide each row and its target
//! by the standard deviation of the noise. `make bench-study` compares the three on the same rows.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod adaline;
mod change;
mod error;
mod rls;
mod square_root;

use nalgebra::SVector;

pub use adaline::{
    Adaline, FixedStep, LearningRule, Lms, Nlms, NormalisedStep, PAPER_ALPHA, PAPER_BETA,
};
pub use change::{ChangeDetector, ChangeSettings};
pub use error::SettingError;
pub use rls::Rls;

/// Smallest magnitude that is refused: sums of squares stay finite below it.
const TOO_LARGE: f64 = 1e150;

/// Estimates the `N` parameters `x` of `A x = b` from one row at a time, without allocation.
pub trait Estimator<const N: usize> {
    /// Updates the estimate with row `A(k)` and its target `b(k)`, (50).
    ///
    /// A row or target with a magnitude of 1e150 or more, or that is not finite, changes nothing
    /// but the [counts](Self::counts).
    fn update(&mut self, row: &SVector<f64, N>, target: f64) -> Outcome;

    /// Returns the current estimate. Each parameter has the unit of the target over the unit of its
    /// column.
    fn parameters(&self) -> SVector<f64, N>;

    /// Returns how many rows were used and how many were refused.
    fn counts(&self) -> Counts;
}

/// Says whether an estimator used a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The row has updated the estimate.
    Used,
    /// The row or its target is not finite, or has a magnitude of 1e150 or more. The estimate is
    /// unchanged.
    Refused,
}

/// Number of rows that an estimator has used and refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of rows with [`Outcome::Used`].
    pub used: u64,
    /// Number of rows with [`Outcome::Refused`].
    pub refused: u64,
}

impl Counts {
    /// Counts a row and returns whether it may be used.
    fn admit<const N: usize>(&mut self, row: &SVector<f64, N>, target: f64) -> Outcome {
        // No branch for each entry: this takes less time than to stop at the first that is refused.
        let entries = row.iter().map(|&entry| has_finite_square(entry));
        if entries.fold(has_finite_square(target), |all, one| all & one) {
            self.used += 1;
            Outcome::Used
        } else {
            self.refused += 1;
            Outcome::Refused
        }
    }
}

/// Returns whether `number` is finite and small enough for sums of its square.
fn has_finite_square(number: f64) -> bool {
    number.abs() < TOO_LARGE
}
