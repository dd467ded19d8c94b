//! The scatter of the unknowns over the sections of a recording.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{MeatEstimator, add, score, t_factor};
use crate::fit::products::{Products, WIDTH};

/// Number of sections. The more there are, the shorter are the errors that they show; the fewer, the less certain is their
/// scatter.
const SECTIONS: usize = 8;

/// Fewest windows of a section. Those at its ends share samples with other sections.
const MIN_WINDOWS: usize = 4;

/// Largest fraction of the information about a direction that counts as that of one section. The residuals of a section that
/// determines a direction alone say nothing about it.
const MAX_FRACTION: f64 = 0.95;

/// Probability that noise without errors that last exceeds [`SectionScatter::bound`].
const PROBABILITY: f64 = 1e-3;

/// Scatter of the unknowns over the sections of a recording.
pub(crate) struct SectionScatter {
    /// Covariance of the unknowns, widened because eight sections are few.
    pub(crate) covariance: DMatrix<f64>,
    /// Sum of the variances of all directions, in units of white noise.
    pub(crate) size: f64,
    /// Ratio of this sum to that of the noise that noise alone rarely exceeds.
    pub(crate) bound: f64,
}

impl MeatEstimator<'_> {
    /// Estimates the covariance of the unknowns from the sums of the scores of eight sections; `None` where windows are few.
    ///
    /// It holds for errors of any kind that do not last much longer than a section. A section loses the part of its error that
    /// the fit follows, the more the larger its fraction `Hₖ` of the information; `(I - Hₖ)^-½` restores it (Bell and McCaffrey
    /// 2002, Survey Methodology 28, 169-181). The rank of the covariance is less than the number of sections, so that it says
    /// little about the correlation of unknowns.
    pub(crate) fn section_scatter(&self) -> Option<SectionScatter> {
        let length = self.count() / SECTIONS;
        if length < MIN_WINDOWS {
            return None;
        }
        let root = root(self.bread);
        let unknowns = self.unknowns();
        let mut scatter = DMatrix::zeros(unknowns, unknowns);
        let (mut fractions, mut squares) = (0.0, 0.0);
        for section in 0..SECTIONS {
            let first = section * length;
            let is_last = section + 1 == SECTIONS;
            let windows = first..if is_last {
                self.count()
            } else {
                first + length
            };
            let (information, score) = self.information_and_score(windows);
            // With the root of the bread, Hₖ = Rᵀ Aₖ R.
            let mut fraction = (root.tr_mul(&information) * &root).symmetric_eigen();
            fractions += fraction.eigenvalues.sum();
            squares += fraction.eigenvalues.norm_squared();
            fraction.eigenvalues.apply(|value| {
                *value = (1.0 - value.clamp(0.0, MAX_FRACTION)).sqrt().recip();
            });
            let moved = fraction.recompose() * root.tr_mul(&score);
            scatter += &moved * moved.transpose();
        }
        // White noise gives the sum a mean of ΣₖHₖ and a variance of 2 ΣₖHₖ².
        let freedom = fractions * fractions / squares.max(f64::MIN_POSITIVE);
        let few = t_factor((SECTIONS - 1) as f64).powi(2);
        Some(SectionScatter {
            size: scatter.trace(),
            covariance: &root * scatter * root.transpose() * few,
            bound: ChiSquared::new(freedom).map_or(f64::INFINITY, |of_noise| {
                of_noise.inverse_cdf(1.0 - PROBABILITY) / freedom
            }),
        })
    }

    /// Returns the information and the sum of the scores of some windows.
    fn information_and_score(&self, windows: Range<usize>) -> (DMatrix<f64>, DVector<f64>) {
        let mut products = Products::zero();
        let mut sum = [0.0; WIDTH];
        for window in windows.clone() {
            products.add_lower(self.entries(window), 1.0);
        }
        for rows in self.windows_from(windows.start).take(windows.len()) {
            add(&mut sum, &score(rows), 1.0);
        }
        (
            self.over_unknowns(|i, j| products.symmetric(i, j)),
            DVector::from_fn(self.unknowns(), |k, _| sum[k]),
        )
    }
}

/// Returns a matrix `R` with `R Rᵀ` equal to a positive semidefinite one.
fn root(of: &DMatrix<f64>) -> DMatrix<f64> {
    let mut eigen = of.clone().symmetric_eigen();
    eigen
        .eigenvalues
        .apply(|value| *value = value.max(0.0).sqrt());
    eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues)
}
