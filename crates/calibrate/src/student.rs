//! Widths of intervals from recordings that determine their own noise with few degrees of freedom.

use tactid_identify::solve::HALF_WIDTH_95;

/// Degrees of freedom with which recordings determine their noise.
pub(crate) const DEGREES_OF_FREEDOM: f64 = 8.0;

/// Quantile of Student's distribution with [`DEGREES_OF_FREEDOM`] above 95 % of absolute values.
const STUDENT_95: f64 = 2.306_004;

/// Ratio of the quantiles of Student's and of the normal distribution.
pub(crate) const WIDENING: f64 = STUDENT_95 / HALF_WIDTH_95;

#[cfg(test)]
mod tests {
    use statrs::distribution::{ContinuousCDF, StudentsT};

    use super::*;

    /// The quantile belongs to the degrees of freedom.
    #[test]
    fn the_quantile_is_that_of_the_degrees_of_freedom() {
        let student = StudentsT::new(0.0, 1.0, DEGREES_OF_FREEDOM).unwrap();
        assert!((student.inverse_cdf(0.975) - STUDENT_95).abs() < 1e-6);
    }
}
