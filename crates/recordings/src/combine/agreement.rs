//! Whether runs agree within their noise, and which of them differs.

use schemars::JsonSchema;
use serde::Serialize;
use tactid_batch::Disagreement;
use tactid_batch::solve::{PseudoInverse, pseudo_inverse};
use tactid_identify::VALUE_NAMES;
use tactid_identify::serial::TenValues;
use tactid_identify::solve::{Matrix, Vector};
use tactid_identify::solve::{value_jacobian, values_of};

use super::between::Variation;
use super::scatter::Scatter;
use super::term::{Pooled, Term};

/// Probability below which the chi-square over all runs and parameters counts as a disagreement.
const RARE: f64 = 0.01;

/// Probability below which the chi-square of one of the ten values counts as a disagreement. The
/// sum over all parameters would hide a single value that differs.
const RARE_VALUE: f64 = 0.001;

/// Whether runs agree within the noise of each.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Agreement {
    /// Distance of the linear parameters of the runs from the combined ones: the weighted sum of
    /// its squares, in the unit in which it would be as large as its degrees of freedom on average
    /// if noise were the only difference between the runs.
    pub chi_square: f64,
    /// Degrees of freedom: about the number of parameters that the runs determine, each on its own,
    /// less the number that all determine together. It is smaller, and no integer, where noise
    /// differs between directions.
    pub degrees_of_freedom: f64,
    /// Degrees of freedom from which the noise was estimated: the windows of all runs, less their
    /// overlap.
    pub noise_degrees_of_freedom: f64,
    /// Probability of at least this chi-square if noise were the only difference between the runs;
    /// 1 where they determine nothing in common. It is that of Fisher's distribution for
    /// `chi_square / degrees_of_freedom`, with `degrees_of_freedom` and `noise_degrees_of_freedom`.
    pub p_value: f64,
    /// The same probability for each of [`VALUE_NAMES`]; 1 where fewer than two runs determine the
    /// value.
    #[schemars(with = "TenValues<f64>")]
    pub value_p_values: [f64; 10],
    /// Whether the runs agree: the probability of all is at least 1 %, and that of each value at
    /// least 0.1 %.
    pub agree: bool,
    /// Distance of each run from all others together, in the order of the runs.
    pub runs: Vec<RunDistance>,
    /// The largest difference between the run that differs most and the others, or between two
    /// runs; `None` where the runs determine no value in common.
    pub largest: Option<ValueDifference>,
}

/// Distance of one run from all others together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RunDistance {
    /// Squared distance of this run from the mean of the others, as [`Agreement::chi_square`].
    pub chi_square: f64,
    /// Degrees of freedom of this distance.
    pub degrees_of_freedom: f64,
    /// Probability of at least this distance if noise were the only difference.
    pub p_value: f64,
    /// Whether the other runs agree among themselves.
    pub others_agree: bool,
}

/// Difference between one run and the others in one value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ValueDifference {
    /// Index of the run. Of two runs, neither is the one that differs, and it is the second.
    pub run: usize,
    /// Name of the value, of [`VALUE_NAMES`].
    pub value: &'static str,
    /// Value of the run less that of the others, in its unit.
    pub difference: f64,
    /// Value of the others, in its unit.
    pub others: f64,
    /// Standard deviation of the difference from the noise within the runs, in the unit of the
    /// value.
    pub std_dev: f64,
}

impl ValueDifference {
    /// Returns the difference in standard deviations, with its sign.
    #[must_use]
    pub fn sigmas(&self) -> f64 {
        self.difference / self.std_dev
    }
}

impl Agreement {
    /// Returns the disagreement of recordings that do not agree, whose mass may be uncertain.
    pub(crate) fn disagreement(&self, is_mass_uncertain: bool) -> Option<Disagreement> {
        let largest = self.largest;
        let run = largest.map(|largest| largest.run);
        let run = run.filter(|_| self.runs.len() > 2);
        let name = |run: usize| format!("recording {}", run + 1);
        let values = VALUE_NAMES.into_iter().zip(self.value_p_values);
        let (least_probable, least_p_value) = values.min_by(|a, b| a.1.total_cmp(&b.1))?;
        (!self.agree).then_some(Disagreement {
            runs: self.runs.len(),
            chi_square: self.chi_square,
            degrees_of_freedom: self.degrees_of_freedom,
            noise_degrees_of_freedom: self.noise_degrees_of_freedom,
            p_value: self.p_value,
            least_probable: least_probable.into(),
            least_p_value,
            recordings: (0..self.runs.len()).map(name).collect(),
            run: run.map(name),
            others_agree: run.is_some_and(|run| self.runs[run].others_agree),
            value: largest.map(|largest| largest.value.into()),
            difference: largest.map(|largest| largest.difference),
            of_others: largest.map(|largest| largest.others),
            sigmas: largest.as_ref().map(ValueDifference::sigmas),
            is_mass_uncertain,
        })
    }
}

impl RunDistance {
    /// Distance of a run without others.
    const NONE: Self = Self {
        chi_square: 0.0,
        degrees_of_freedom: 0.0,
        p_value: 1.0,
        others_agree: true,
    };
}

/// Runs with the linearisation of the ten values, about which they are compared.
pub(crate) struct Comparison<'a> {
    pub(crate) terms: &'a [Term],
    /// The ten values alone, each of the runs that determine it.
    values: [Vec<(usize, Term)>; 10],
    /// Parameters at which the ten values are linearised.
    at: &'a Vector,
    /// The ten values at these parameters, and their derivatives; `None` for a mass of zero.
    linearization: Option<([f64; 10], Matrix)>,
}

/// How far some runs are from each other, and whether they agree.
struct Test {
    all: Scatter,
    value_p_values: [f64; 10],
}

impl Test {
    fn agrees(&self) -> bool {
        self.all.p_value() >= RARE && self.value_p_values.iter().all(|p| *p >= RARE_VALUE)
    }
}

impl<'a> Comparison<'a> {
    /// Prepares a comparison at these parameters.
    pub(crate) fn new(terms: &'a [Term], at: &'a Vector) -> Self {
        let linearization = values_of(at).zip(value_jacobian(at));
        let inverses: Vec<_> = terms
            .iter()
            .map(|term| pseudo_inverse(&term.weight))
            .collect();
        let of_value = |k: usize| {
            let Some((_, jacobian)) = &linearization else {
                return Vec::new();
            };
            let gradient = jacobian.row(k).into_owned();
            let of_run = |(run, (term, inverse)): (usize, (&Term, &PseudoInverse))| {
                Some((run, term.of_quantity(inverse, &gradient, at)?))
            };
            let runs = terms.iter().zip(&inverses).enumerate();
            runs.filter_map(of_run).collect()
        };
        Self {
            terms,
            values: std::array::from_fn(of_value),
            at,
            linearization,
        }
    }

    /// Returns whether the runs agree, and which one differs most.
    pub(crate) fn agreement(&self) -> Agreement {
        let test = self.test(None);
        let distance = |run: usize| {
            let others = self.others(run);
            let both = [&self.terms[run], &others.term];
            let scatter = Scatter::new(both.into_iter(), &Pooled::new(both.into_iter()));
            RunDistance {
                chi_square: scatter.chi_square,
                degrees_of_freedom: scatter.degrees_of_freedom,
                p_value: scatter.p_value(),
                others_agree: self.test(Some(run)).agrees(),
            }
        };
        let runs: Vec<RunDistance> = match self.terms.len() {
            0 | 1 => vec![RunDistance::NONE; self.terms.len()],
            count => (0..count).map(distance).collect(),
        };
        let farthest = match runs.len() {
            0 | 1 => None,
            2 => Some(1),
            _ => farthest(&runs),
        };
        Agreement {
            chi_square: test.all.chi_square,
            degrees_of_freedom: test.all.degrees_of_freedom,
            noise_degrees_of_freedom: test.all.of_noise,
            p_value: test.all.p_value(),
            value_p_values: test.value_p_values,
            agree: test.agrees(),
            largest: farthest.and_then(|run| self.largest_difference(run)),
            runs,
        }
    }

    /// Returns the mean of all runs but one.
    fn others(&self, run: usize) -> Pooled {
        let others = self.terms.iter().enumerate();
        Pooled::new(others.filter(|(k, _)| *k != run).map(|(_, term)| term))
    }

    /// Tests whether the runs agree, without one of them.
    fn test(&self, without: Option<usize>) -> Test {
        let terms = self.terms.iter().enumerate();
        let terms = terms.filter(|(k, _)| Some(*k) != without);
        Test {
            all: scatter(terms.map(|(_, term)| term)),
            value_p_values: std::array::from_fn(|k| {
                let of_value = self.values[k].iter();
                let of_value = of_value.filter(|(run, _)| Some(*run) != without);
                scatter(of_value.map(|(_, term)| term)).p_value()
            }),
        }
    }

    /// Returns how each of the ten values varies over all runs.
    pub(crate) fn variations(&self) -> [Variation; 10] {
        std::array::from_fn(|k| Variation::new(self.values[k].iter().map(|(_, term)| term)))
    }

    /// Returns the largest difference of the ten values, in standard deviations, between a run and
    /// the others.
    fn largest_difference(&self, run: usize) -> Option<ValueDifference> {
        let (values, jacobian) = self.linearization.as_ref()?;
        let others = self.others(run);
        let difference = |k: usize| {
            let (_, one) = self.values[k].iter().find(|(of, _)| *of == run)?;
            let gradient = jacobian.row(k).into_owned();
            let others = others
                .term
                .of_quantity(&others.inverse, &gradient, self.at)?;
            let changes = (&one.changes - &others.changes).row(0).norm_squared();
            let variance = one.covariance[(0, 0)] + others.covariance[(0, 0)] + changes;
            Some(ValueDifference {
                run,
                value: VALUE_NAMES[k],
                difference: one.at[0] - others.at[0],
                others: values[k] + others.at[0],
                std_dev: variance.max(f64::MIN_POSITIVE).sqrt(),
            })
        };
        let differences = (0..10).filter_map(difference);
        differences.max_by(|a, b| a.sigmas().abs().total_cmp(&b.sigmas().abs()))
    }
}

/// Returns how far terms are from their mean.
fn scatter<'a>(terms: impl Iterator<Item = &'a Term> + Clone) -> Scatter {
    if terms.clone().nth(1).is_none() {
        return Scatter::default();
    }
    Scatter::new(terms.clone(), &Pooled::new(terms))
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
