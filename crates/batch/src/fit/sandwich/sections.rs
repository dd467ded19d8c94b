//! The cluster-robust sandwich, whose clusters are sections of the recording.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{MeatEstimator, add, score, t_factor};
use crate::fit::products::{Products, WIDTH};

/// Number of sections. The more there are, the shorter are the errors that they show; the fewer,
/// the less certain is their scatter. With 4, 6, 8, 12 and 16 sections, 11, 16, 12, 24 and 28 of
/// 240 intervals of a prototype missed the truth.
const SECTIONS: usize = 8;

/// Fewest windows of a section. Those at its ends share samples with other sections.
const MIN_SECTION_WINDOWS: usize = 4;

/// Largest fraction of the information about a direction that counts as that of one section. The
/// residuals of a section that determines a direction alone say nothing about it.
const MAX_FRACTION: f64 = 0.95;

/// Probability, to a factor of two or three, that noise without serially correlated errors exceeds
/// [`ClusterRobust::bound`].
const PROBABILITY: f64 = 0.01;

/// The cluster-robust covariance of the unknowns, beside that of the noise.
pub(crate) struct ClusterRobust {
    /// Covariance of the unknowns, widened by Student's t because the sections are few.
    pub(crate) covariance: DMatrix<f64>,
    /// Size of the covariance without this widening, relative to that of the noise: the sum of the
    /// variances of all directions, in units of white noise.
    pub(crate) ratio: f64,
    /// Ratio that is rarely exceeded where the only error is the noise.
    pub(crate) bound: f64,
    /// Variance of Student's t, by which the covariance is widened.
    pub(crate) t_variance: f64,
}

impl MeatEstimator<'_> {
    /// Estimates the covariance of the unknowns from the sums of the scores of sections, given the
    /// meat of the noise and its degrees of freedom; `None` where windows are few. Cost: about a
    /// pass over all windows.
    ///
    /// It holds for errors that are correlated within a section and not beyond, also those of the
    /// model. The residuals of a section lack what the fit absorbs of its own error, the more the
    /// larger its fraction `Hₖ` of the information; `(I - Hₖ)^-½` corrects the bias for white noise
    /// (CR2: Bell and McCaffrey 2002, Survey Methodology 28, 169-181). The rank of the covariance
    /// is less than the number of sections, so that it says little about the correlation of
    /// unknowns.
    pub(crate) fn cluster_robust(
        &self,
        meat: &DMatrix<f64>,
        freedom_of_noise: f64,
    ) -> Option<ClusterRobust> {
        let count = self.count();
        if count < SECTIONS * MIN_SECTION_WINDOWS {
            return None;
        }
        let root = square_root(self.bread);
        let noise = root.tr_mul(meat) * &root;
        let size = noise.trace();
        let sections: Vec<_> = (0..SECTIONS)
            .map(|k| k * count / SECTIONS..(k + 1) * count / SECTIONS)
            .map(|windows| (windows.len(), self.information_and_score(windows)))
            .collect();
        // A known mass leaves the sum of all scores different from zero; each section has its share
        // of it.
        let sum: DVector<f64> = sections.iter().map(|(_, (_, score))| score).sum();
        let mut scatter = DMatrix::zeros(self.unknowns(), self.unknowns());
        let mut squares = 0.0;
        for (windows, (information, score)) in sections {
            let share = windows as f64 / count as f64;
            // With the root R of the bread, Hₖ = Rᵀ Aₖ R.
            let fraction = root.tr_mul(&information) * &root;
            let of_noise = &fraction * &noise;
            squares += of_noise.dot(&of_noise.transpose());
            let mut correction = fraction.symmetric_eigen();
            correction.eigenvalues.apply(|value| {
                *value = (1.0 - value.clamp(0.0, MAX_FRACTION)).sqrt().recip();
            });
            let moved = correction.recompose() * root.tr_mul(&(score - share * &sum));
            scatter += &moved * moved.transpose();
        }
        // The noise gives the scatter a mean of ΣₖHₖM and a variance of 2 ΣₖHₖMHₖM (Satterthwaite
        // 1946).
        let freedom = size * size / squares.max(f64::MIN_POSITIVE);
        let t_variance = t_factor((SECTIONS - 1) as f64).powi(2);
        let of_noise = FisherSnedecor::new(freedom, freedom_of_noise.max(1.0));
        Some(ClusterRobust {
            ratio: scatter.trace() / size,
            covariance: &root * scatter * root.transpose() * t_variance,
            bound: of_noise.map_or(f64::INFINITY, |of| of.inverse_cdf(1.0 - PROBABILITY)),
            t_variance,
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
fn square_root(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut eigen = matrix.clone().symmetric_eigen();
    eigen
        .eigenvalues
        .apply(|value| *value = value.max(0.0).sqrt());
    eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues)
}
