//! How much the ten values vary from run to run, beyond the noise within each run.

use super::linear::Solved;
use crate::solve::subspace::{Matrix, Vector};

/// Steps of the bisection for a variance: each halves the bracket, so that the last is at the limit of the digits.
const BISECTIONS: usize = 60;

/// How one value varies over the runs that determine it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Variation {
    /// Number of runs that determine the value.
    pub(crate) runs: u32,
    /// Sum of the squared differences from the weighted mean, each in units of its variance.
    pub(crate) chi_square: f64,
    /// Variance between the runs, in the squared unit of the value; zero where their noise explains the differences.
    pub(crate) variance: f64,
}

impl Variation {
    /// Returns how the values `(value, variance)` of runs vary, by the method of Paule and Mandel (1982, Journal of Research of
    /// the National Bureau of Standards 87, 377): the variance between the runs is that with which the differences have
    /// the size that is expected of as many values.
    pub(crate) fn new(values: &[(f64, f64)]) -> Self {
        let runs = values.len() as u32;
        let freedom = f64::from(runs.saturating_sub(1));
        let chi_square = scatter(values, 0.0);
        let mut range = (0.0, 0.0);
        if chi_square > freedom {
            let mean = values.iter().map(|(value, _)| value).sum::<f64>() / f64::from(runs);
            // With this variance even the scatter about the mean of all is below the degrees of freedom.
            let squares = values.iter().map(|(value, _)| (value - mean).powi(2));
            range.1 = squares.sum::<f64>() / freedom;
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (range.0 + range.1);
                if scatter(values, middle) > freedom {
                    range.0 = middle;
                } else {
                    range.1 = middle;
                }
            }
        }
        Self {
            runs,
            chi_square,
            variance: range.1,
        }
    }

    /// Returns how each of the ten values varies over runs, linearised at parameters `at` with the derivatives `jacobian`.
    pub(crate) fn of_values(runs: &[Solved], at: &Vector, jacobian: &Matrix) -> [Self; 10] {
        std::array::from_fn(|k| {
            let gradient = jacobian.row(k).into_owned();
            let determined = runs
                .iter()
                .filter(|run| run.null_space.determines(&gradient));
            let values = determined.map(|run| {
                let value = (gradient * (run.parameters - at))[0];
                (value, (gradient * run.covariance * gradient.transpose())[0])
            });
            Self::new(&values.collect::<Vec<_>>())
        })
    }
}

/// Returns the sum of the squared differences from the weighted mean, where `between` is added to each variance.
fn scatter(values: &[(f64, f64)], between: f64) -> f64 {
    let weight = |variance: f64| 1.0 / (variance + between).max(f64::MIN_POSITIVE);
    let weights: f64 = values.iter().map(|(_, variance)| weight(*variance)).sum();
    let weighted = values.iter().map(|(value, v)| weight(*v) * value);
    let mean = weighted.sum::<f64>() / weights;
    let squares = values
        .iter()
        .map(|(value, v)| weight(*v) * (value - mean).powi(2));
    squares.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of values with equal variances the variance between them is what that of the sample has beyond theirs.
    #[test]
    fn equal_variances_have_a_closed_form() {
        let variation = Variation::new(&[(1.0, 0.04), (2.0, 0.04), (4.5, 0.04)]);
        let of_sample = (1.5f64.powi(2) + 0.5f64.powi(2) + 2.0f64.powi(2)) / 2.0;
        assert!((variation.variance - (of_sample - 0.04)).abs() < 1e-12);
        assert!((variation.chi_square - 2.0 * of_sample / 0.04).abs() < 1e-9);
        assert_eq!(variation.runs, 3);
    }

    /// A single value, no value, and values within their noise show no variance between runs.
    #[test]
    fn no_variance_without_differences() {
        for values in [
            &[][..],
            &[(3.0, 1.0)],
            &[(3.0, 1.0), (3.5, 1.0)],
            &[(0.0, 0.0), (0.0, 0.0)],
        ] {
            assert_eq!(Variation::new(values).variance, 0.0, "{values:?}");
        }
    }

    /// Of one very precise and two imprecise values, the precise one hardly counts once the runs vary.
    #[test]
    fn the_condition_of_paule_and_mandel_holds() {
        let values = [(0.0, 1e-6), (3.0, 0.5), (4.0, 1.0)];
        let variation = Variation::new(&values);
        assert!((scatter(&values, variation.variance) - 2.0).abs() < 1e-9);
    }
}
