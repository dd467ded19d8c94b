//! How much the ten values vary from run to run, beyond the noise within each run.

use super::term::Term;

/// Steps of the bisection for a variance: each halves the bracket, so that the last is at the limit
/// of the digits.
const BISECTIONS: usize = 60;

/// How one value varies over the runs that determine it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Variation {
    /// Number of runs that determine the value.
    pub(crate) runs: u32,
    /// Variance between the runs, in the squared unit of the value; zero where their noise explains
    /// the differences.
    pub(crate) variance: f64,
}

/// A value of one run.
#[derive(Clone, Copy, Debug)]
struct Value {
    value: f64,
    /// Inverse of its weight.
    inverse_weight: f64,
    /// Variance of its error.
    variance: f64,
}

impl Variation {
    /// Returns how a value varies over terms in the first parameter.
    pub(crate) fn new<'a>(terms: impl Iterator<Item = &'a Term>) -> Self {
        let values = terms.map(|term| Value {
            value: term.at[0],
            inverse_weight: term.weight[(0, 0)].recip(),
            variance: term.covariance[(0, 0)],
        });
        Self::of_values(&values.collect::<Vec<_>>())
    }

    /// Returns how values vary, by the method of Paule and Mandel (1982, Journal of Research of the
    /// National Bureau of Standards 87, 377): the variance between the runs is that with which the
    /// differences have the size that is expected of as many values.
    fn of_values(values: &[Value]) -> Self {
        let runs = values.len() as u32;
        let mut range = (0.0, 0.0);
        if excess(values, 0.0) > 0.0 {
            let mean = values.iter().map(|of| of.value).sum::<f64>() / f64::from(runs);
            // With this variance and equal weights the scatter would be explained without any
            // noise.
            let squares = values.iter().map(|of| (of.value - mean).powi(2));
            range.1 = squares.sum::<f64>() / f64::from(runs - 1);
            while excess(values, range.1) > 0.0 {
                range.1 *= 2.0;
            }
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (range.0 + range.1);
                if excess(values, middle) > 0.0 {
                    range.0 = middle;
                } else {
                    range.1 = middle;
                }
            }
        }
        Self {
            runs,
            variance: range.1,
        }
    }
}

/// Returns the sum of the squared differences from the weighted mean less its expectation, where
/// `between` is added to each variance; not positive for fewer than two values.
fn excess(values: &[Value], between: f64) -> f64 {
    let weight = |of: &Value| 1.0 / (of.inverse_weight + between).max(f64::MIN_POSITIVE);
    let weights: f64 = values.iter().map(weight).sum();
    let mean = values.iter().map(|of| weight(of) * of.value).sum::<f64>() / weights;
    let terms = values.iter().map(|of| {
        let share = 1.0 - weight(of) / weights;
        weight(of) * ((of.value - mean).powi(2) - share * (of.variance + between))
    });
    terms.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns values with the variance that their weights claim.
    fn weighted(values: &[(f64, f64)]) -> Vec<Value> {
        let value = |(value, variance): &(f64, f64)| Value {
            value: *value,
            inverse_weight: *variance,
            variance: *variance,
        };
        values.iter().map(value).collect()
    }

    /// Of values with equal variances the variance between them is what that of the sample has
    /// beyond theirs, whatever the weights claim.
    #[test]
    fn equal_variances_have_a_closed_form() {
        let of_sample = (1.5f64.powi(2) + 0.5f64.powi(2) + 2.0f64.powi(2)) / 2.0;
        for claimed in [0.04, 0.01, 1.0] {
            let mut values = weighted(&[(1.0, 0.04), (2.0, 0.04), (4.5, 0.04)]);
            values.iter_mut().for_each(|of| of.inverse_weight = claimed);
            let variation = Variation::of_values(&values);
            assert!((variation.variance - (of_sample - 0.04)).abs() < 1e-12);
            assert_eq!(variation.runs, 3);
        }
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
            let variation = Variation::of_values(&weighted(values));
            assert_eq!(variation.variance, 0.0, "{values:?}");
        }
    }

    /// Of one very precise and two imprecise values, the precise one hardly counts once the runs
    /// vary: the squared differences are as many as expected.
    #[test]
    fn the_condition_of_paule_and_mandel_holds() {
        let values = weighted(&[(0.0, 1e-6), (3.0, 0.5), (4.0, 1.0)]);
        let between = Variation::of_values(&values).variance;
        let weights: Vec<f64> = values
            .iter()
            .map(|of| 1.0 / (of.variance + between))
            .collect();
        let sum: f64 = weights.iter().sum();
        let pairs = || weights.iter().zip(&values);
        let mean = pairs().map(|(w, of)| w * of.value).sum::<f64>() / sum;
        let scatter: f64 = pairs().map(|(w, of)| w * (of.value - mean).powi(2)).sum();
        assert!((scatter - 2.0).abs() < 1e-9, "{scatter}");
    }
}
