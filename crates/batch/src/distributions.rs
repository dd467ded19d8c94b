//! Probabilities and quantiles of the chi-square, of Fisher's and of Student's distribution.

use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};
use statrs::function::gamma::checked_gamma_ur;
use tactid_identify::solve::HALF_WIDTH_95;

/// Returns the probability of a chi-square of at least `chi_square`; 1 without degrees of freedom.
fn chi_square_p(chi_square: f64, degrees_of_freedom: f64) -> f64 {
    // Beyond, the probability is smaller than any number.
    checked_gamma_ur(0.5 * degrees_of_freedom, 0.5 * chi_square.min(1e6)).unwrap_or(0.0)
}

/// Returns the probability of at least this chi-square where the size of the noise in it was
/// estimated with so many degrees of freedom, `of_noise`: by Fisher's distribution for the ratio of
/// `chi_square` to its degrees of freedom. It is 1 without degrees of freedom.
#[must_use]
pub fn f_p(chi_square: f64, degrees_of_freedom: f64, of_noise: f64) -> f64 {
    if chi_square <= 0.0 || degrees_of_freedom <= 0.0 {
        return 1.0;
    }
    match FisherSnedecor::new(degrees_of_freedom, of_noise) {
        // Beyond, the distribution is the chi-square's, and the gamma function loses its digits.
        Ok(fisher) if of_noise < 1e9 => fisher.sf(chi_square.min(1e300) / degrees_of_freedom),
        _ => chi_square_p(chi_square, degrees_of_freedom),
    }
}

/// Returns the factor by which a standard deviation is multiplied so that 1.96 of the result are
/// half of a 95 % interval with so many degrees of freedom: 6.5 for one, 2.2 for two. It is infinite
/// without degrees of freedom.
#[must_use]
pub fn students_factor(degrees_of_freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, degrees_of_freedom) {
        Ok(student) if degrees_of_freedom < 1e6 => student.inverse_cdf(0.975) / HALF_WIDTH_95,
        // The distribution is normal to a millionth, and from 1.4e7 on its quantile does not return.
        Ok(_) => 1.0,
        Err(_) => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The probabilities and quantiles agree with published tables.
    #[test]
    fn probabilities_agree_with_tables() {
        for (chi_square, freedom, p) in [
            (3.841_459, 1.0, 0.05),
            (18.307_04, 10.0, 0.05),
            (37.566_23, 20.0, 0.01),
            (45.314_75, 20.0, 0.001),
        ] {
            assert!((f_p(chi_square, freedom, f64::INFINITY) / p - 1.0).abs() < 1e-5);
            assert!((f_p(chi_square, freedom, 1e8) / p - 1.0).abs() < 1e-4);
        }
        assert_eq!(f_p(0.0, 3.0, 10.0), 1.0);
        assert_eq!(f_p(5.0, 0.0, 10.0), 1.0);
        assert_eq!(f_p(f64::INFINITY, 20.0, f64::INFINITY), 0.0);
        // F(2, 10) and F(5, 16) at 5 %.
        assert!((f_p(2.0 * 4.102_82, 2.0, 10.0) / 0.05 - 1.0).abs() < 1e-5);
        assert!((f_p(5.0 * 2.852_409, 5.0, 16.0) / 0.05 - 1.0).abs() < 1e-5);
        for (freedom, quantile) in [
            (1.0, 12.706_205),
            (2.0, 4.302_653),
            (9.0, 2.262_157),
            (1e8, 1.96),
            (f64::INFINITY, 1.96),
        ] {
            assert!((students_factor(freedom) * HALF_WIDTH_95 / quantile - 1.0).abs() < 1e-6);
        }
    }
}
