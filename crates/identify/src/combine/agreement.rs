//! Whether runs agree within their noise, and which of them differs.

use super::between::Variation;
use super::distributions::hotelling_p;
use super::linear::Solved;
use crate::result::VALUE_NAMES;
use crate::solve::subspace::{Matrix, Vector};

/// Probability below which the chi-square over all runs and parameters counts as a disagreement.
const RARE: f64 = 0.01;

/// Probability below which the chi-square of one of the ten values counts as a disagreement. The sum over all parameters
/// would hide a single value that differs.
const RARE_VALUE: f64 = 0.001;

/// Whether runs agree within the noise of each.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// Sum over the runs of the squared Mahalanobis distance of their linear parameters from the combined ones.
    pub chi_square: f64,
    /// Number of parameters that the runs determine, each on its own, less the number that all determine together.
    pub degrees_of_freedom: u32,
    /// Probability of at least this chi-square if noise were the only difference between the runs; 1 where they determine
    /// nothing in common. It takes into account that the noise of each run was estimated from as many windows as it has.
    pub p_value: f64,
    /// The same probability for each of [`VALUE_NAMES`]; 1 where fewer than two runs determine the value.
    pub value_p_values: [f64; 10],
    /// Whether the runs agree: the probability of all is at least 1 %, and that of each value at least 0.1 %.
    pub agree: bool,
    /// Distance of each run from all others together, in the order of the runs.
    pub runs: Vec<RunDistance>,
    /// The largest difference between the run that differs most and the others, or between two runs; `None` where the runs
    /// determine no value in common.
    pub largest: Option<ValueDifference>,
}

/// Distance of one run from all others together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunDistance {
    /// Part of the chi-square over all runs that disappears without this run.
    pub chi_square: f64,
    /// Degrees of freedom that disappear with it.
    pub degrees_of_freedom: u32,
    /// Probability of at least this distance if noise were the only difference.
    pub p_value: f64,
    /// Whether the other runs agree among themselves.
    pub others_agree: bool,
}

/// Difference between one run and the others in one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueDifference {
    /// Index of the run. Of two runs, neither is the one that differs, and it is the second.
    pub run: usize,
    /// Name of the value, of [`VALUE_NAMES`].
    pub value: &'static str,
    /// Value of the run less that of the others, in its unit.
    pub difference: f64,
    /// Value of the others, in its unit.
    pub others: f64,
    /// Standard deviation of the difference from the noise within the runs, in the unit of the value.
    pub std_dev: f64,
}

impl ValueDifference {
    /// Returns the difference in standard deviations, with its sign.
    #[must_use]
    pub fn sigmas(&self) -> f64 {
        self.difference / self.std_dev
    }
}

/// Runs with the linearisation of the ten values, about which they are compared.
pub(crate) struct Comparison<'a> {
    pub(crate) terms: &'a [(Vector, Matrix)],
    pub(crate) runs: &'a [Solved],
    /// Parameters at which the ten values are linearised.
    pub(crate) at: &'a Vector,
    /// Degrees of freedom of the runs' covariances, on average.
    pub(crate) of_noise: f64,
    /// The ten values at these parameters, and their derivatives; `None` for a mass of zero.
    pub(crate) values: Option<([f64; 10], Matrix)>,
}

/// Chi-square of some runs with its degrees of freedom, and whether they agree.
struct Test {
    chi_square: f64,
    degrees_of_freedom: u32,
    p_value: f64,
    value_p_values: [f64; 10],
}

impl Test {
    fn agrees(&self) -> bool {
        self.p_value >= RARE && self.value_p_values.iter().all(|p| *p >= RARE_VALUE)
    }
}

impl Comparison<'_> {
    /// Returns whether the runs agree, and which one differs most.
    pub(crate) fn agreement(&self) -> Agreement {
        let all: Vec<usize> = (0..self.runs.len()).collect();
        let test = self.test(&all);
        let distance = |run: usize| {
            let others = self.test(&without(&all, run));
            let chi_square = (test.chi_square - others.chi_square).max(0.0);
            let degrees_of_freedom = test
                .degrees_of_freedom
                .saturating_sub(others.degrees_of_freedom);
            RunDistance {
                chi_square,
                degrees_of_freedom,
                p_value: hotelling_p(chi_square, degrees_of_freedom, self.of_noise, self.rank()),
                others_agree: others.agrees(),
            }
        };
        let runs: Vec<RunDistance> = all.iter().map(|run| distance(*run)).collect();
        let farthest = match runs.len() {
            0 | 1 => None,
            2 => Some(1),
            _ => farthest(&runs),
        };
        Agreement {
            chi_square: test.chi_square,
            degrees_of_freedom: test.degrees_of_freedom,
            p_value: test.p_value,
            value_p_values: test.value_p_values,
            agree: test.agrees(),
            largest: farthest.and_then(|run| self.largest_difference(run, &without(&all, run))),
            runs,
        }
    }

    /// Largest number of parameters that a run determines.
    fn rank(&self) -> u32 {
        self.runs.iter().map(Solved::rank).max().unwrap_or(0)
    }

    /// Tests whether the runs with these indices agree.
    fn test(&self, which: &[usize]) -> Test {
        let terms: Vec<_> = which.iter().map(|run| self.terms[*run]).collect();
        let together = Solved::new(&terms);
        let ranks: u32 = which.iter().map(|run| self.runs[*run].rank()).sum();
        let degrees_of_freedom = ranks.saturating_sub(together.rank());
        let chi_square = together.chi_square(&terms);
        let value_p_values = self.variations(which).map(|variation| {
            let degrees_of_freedom = variation.runs.saturating_sub(1);
            hotelling_p(variation.chi_square, degrees_of_freedom, self.of_noise, 1)
        });
        Test {
            chi_square,
            degrees_of_freedom,
            p_value: hotelling_p(chi_square, degrees_of_freedom, self.of_noise, self.rank()),
            value_p_values,
        }
    }

    /// Returns how each of the ten values varies over the runs with these indices.
    pub(crate) fn variations(&self, which: &[usize]) -> [Variation; 10] {
        let Some((_, jacobian)) = &self.values else {
            return [Variation::default(); 10];
        };
        let runs: Vec<Solved> = which.iter().map(|run| self.runs[*run].clone()).collect();
        Variation::of_values(&runs, self.at, jacobian)
    }

    /// Returns the largest difference of the ten values, in standard deviations, between a run and others.
    fn largest_difference(&self, run: usize, others: &[usize]) -> Option<ValueDifference> {
        let (values, jacobian) = self.values.as_ref()?;
        let terms: Vec<_> = others.iter().map(|other| self.terms[*other]).collect();
        let (one, others) = (&self.runs[run], Solved::new(&terms));
        let differences = (0..10).filter_map(|k| {
            let gradient = jacobian.row(k).into_owned();
            let both = [one, &others];
            if !both.iter().all(|of| of.null_space.determines(&gradient)) {
                return None;
            }
            let variance = gradient * (one.covariance + others.covariance) * gradient.transpose();
            Some(ValueDifference {
                run,
                value: VALUE_NAMES[k],
                difference: (gradient * (one.parameters - others.parameters))[0],
                others: values[k] + (gradient * (others.parameters - self.at))[0],
                std_dev: variance[0].max(f64::MIN_POSITIVE).sqrt(),
            })
        });
        differences.max_by(|a, b| a.sigmas().abs().total_cmp(&b.sigmas().abs()))
    }
}

/// Returns the run whose distance from the others is the least probable.
fn farthest(runs: &[RunDistance]) -> Option<usize> {
    // Probabilities underflow to zero: then the larger distance decides.
    let key = |run: &usize| (-runs[*run].p_value, runs[*run].chi_square);
    let compare = |a: &usize, b: &usize| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    };
    (0..runs.len()).max_by(compare)
}

fn without(all: &[usize], run: usize) -> Vec<usize> {
    all.iter().copied().filter(|other| *other != run).collect()
}
