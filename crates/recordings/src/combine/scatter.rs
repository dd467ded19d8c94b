//! How far terms are from their weighted mean, compared with what their errors cause.

use nalgebra::DMatrix;

use tactid_batch::distributions::f_p;
use tactid_identify::solve::Matrix;

use super::term::{Pooled, Term};

/// The weighted sum of the squared distances of terms from their mean, in units in which errors
/// alone would give about its degrees of freedom.
///
/// Weights are not the inverses of the errors' covariances, which are estimates. So the sum `Q = Σ
/// (πᵢ - π̄)ᵀ Aᵢ (πᵢ - π̄)` of errors with the covariance `Σ` is `eᵀ H e`, a sum of squares with
/// different factors: with the mean `m₁ = tr HΣ` and the variance `2 m₂ = 2 tr HΣHΣ` of a multiple
/// `m₂ / m₁` of a chi-square with `m₁² / m₂` degrees of freedom (Box 1954, Annals of Mathematical
/// Statistics 25, 290). Where weights are the inverse covariances, these are 1 and the number of
/// parameters of all terms less that of their mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Scatter {
    pub(crate) chi_square: f64,
    pub(crate) degrees_of_freedom: f64,
    /// Degrees of freedom from which the covariances of the errors were estimated.
    pub(crate) of_noise: f64,
}

impl Scatter {
    /// Returns how far terms are from their mean.
    pub(crate) fn new<'a>(terms: impl Iterator<Item = &'a Term> + Clone, mean: &Pooled) -> Self {
        let bread = &mean.inverse.covariance;
        let (mut squares, mut first, mut second) = (0.0, 0.0, 0.0);
        let (mut meat, mut cubes) = (Matrix::zeros(), Matrix::zeros());
        let columns = mean.term.changes.ncols();
        let mut of_changes = DMatrix::<f64>::zeros(columns, columns);
        for term in terms {
            let rest = term.at - mean.term.at;
            squares += (term.weight * rest).dot(&rest);
            // A N, A N A and A N A N A of the errors of each term alone.
            let product = term.weight * term.covariance;
            let of_term = product * term.weight;
            first += product.trace();
            second += (product * product).trace();
            meat += of_term;
            cubes += product * of_term;
            if columns > 0 {
                // Errors that all terms have alike move the mean with them.
                let changes = &term.changes - &mean.term.changes;
                of_changes += changes.tr_mul(&(term.weight * &changes));
                second += 2.0 * (of_term * &changes * changes.transpose()).trace();
            }
        }
        let of_mean = bread * meat;
        first += of_changes.trace() - of_mean.trace();
        second += (of_mean * of_mean).trace() - 2.0 * (bread * cubes).trace();
        second += of_changes.norm_squared();
        if !(first > 0.0 && second > 0.0) {
            return Self::default();
        }
        Self {
            chi_square: squares.max(0.0) * first / second,
            degrees_of_freedom: first * first / second,
            of_noise: mean.term.degrees_of_freedom,
        }
    }

    /// Probability of at least this distance if there are no other errors; 1 where nothing is
    /// compared.
    pub(crate) fn p_value(&self) -> f64 {
        f_p(self.chi_square, self.degrees_of_freedom, self.of_noise)
    }
}
