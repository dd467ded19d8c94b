//! Probabilities and quantiles of the chi-square, of Fisher's and of Student's distribution.

use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};
use statrs::function::gamma::checked_gamma_ur;

use crate::solve::HALF_WIDTH_95;

/// Returns the probability that a chi-square variable is at least `chi_square`; 1 without degrees of freedom.
pub(crate) fn chi_square_p(chi_square: f64, degrees_of_freedom: u32) -> f64 {
    if degrees_of_freedom == 0 || chi_square <= 0.0 {
        return 1.0;
    }
    let half = 0.5 * f64::from(degrees_of_freedom);
    // Beyond, the probability is smaller than any number.
    checked_gamma_ur(half, 0.5 * chi_square.min(1e6)).unwrap_or(0.0)
}

/// Returns the probability of at least this chi-square where the covariances in it were estimated with so many degrees of
/// freedom, `of_noise`, for `parameters` together.
///
/// The inverse of an estimated covariance is too large on average. With one covariance for all this is Hotelling's distribution:
/// a multiple of Fisher's.
pub(crate) fn hotelling_p(
    chi_square: f64,
    degrees_of_freedom: u32,
    of_noise: f64,
    parameters: u32,
) -> f64 {
    let freedom = f64::from(degrees_of_freedom);
    // With fewer windows than parameters the distribution has no mean; the test is then as weak as with few more.
    let remaining = (of_noise - f64::from(parameters) + 1.0).max(3.0);
    let fisher = FisherSnedecor::new(freedom, remaining);
    match fisher {
        // Beyond, the distribution is that of the chi-square, and the gamma function loses its digits.
        Ok(fisher) if chi_square > 0.0 && of_noise < 1e9 => {
            fisher.sf(chi_square.min(1e300) * remaining / (of_noise.max(remaining) * freedom))
        }
        _ => chi_square_p(chi_square, degrees_of_freedom),
    }
}

/// Returns the factor by which a standard deviation is multiplied so that 1.96 of the result are half of a 95 % interval
/// with so many degrees of freedom: 6.5 for one, 2.2 for two.
pub(crate) fn students_factor(degrees_of_freedom: u32) -> f64 {
    let student = StudentsT::new(0.0, 1.0, f64::from(degrees_of_freedom.max(1)));
    student.map_or(1.0, |student| student.inverse_cdf(0.975) / HALF_WIDTH_95)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The probabilities and quantiles are those of published tables.
    #[test]
    fn probabilities_agree_with_tables() {
        for (chi_square, freedom, p) in [
            (3.841_459, 1, 0.05),
            (18.307_04, 10, 0.05),
            (37.566_23, 20, 0.01),
            (45.314_75, 20, 0.001),
        ] {
            assert!((chi_square_p(chi_square, freedom) / p - 1.0).abs() < 1e-5);
        }
        assert_eq!(chi_square_p(0.0, 3), 1.0);
        assert_eq!(chi_square_p(5.0, 0), 1.0);
        assert_eq!(chi_square_p(f64::INFINITY, 20), 0.0);
        // F(2, 10) at 5 %, and Hotelling's T² = 27.2 for 5 parameters and 20 degrees of freedom: F(5, 16) = 4.3520.
        assert!((hotelling_p(2.0 * 4.102_82, 2, 10.0, 1) / 0.05 - 1.0).abs() < 1e-5);
        let same = hotelling_p(27.2, 5, 20.0, 5) / hotelling_p(5.0 * 4.352, 5, 16.0, 1);
        assert!((same - 1.0).abs() < 1e-9, "{same}");
        assert_eq!(
            hotelling_p(18.0, 10, f64::INFINITY, 10),
            chi_square_p(18.0, 10)
        );
        assert_eq!(hotelling_p(0.0, 0, 50.0, 10), 1.0);
        for (freedom, quantile) in [(1, 12.706_205), (2, 4.302_653), (9, 2.262_157)] {
            assert!((students_factor(freedom) * HALF_WIDTH_95 / quantile - 1.0).abs() < 1e-6);
        }
    }
}
