//! One payload from several recordings, and whether they agree.
//!
//! Each recording contributes a point in the ten linear parameters and the information on them
//! ([`LinearEstimate`]). [`combine_estimates`] weights the points by their information, so that
//! motions which determine different directions complement each other, and tests whether the
//! recordings agree within their noise ([`Agreement`]).
//!
//! Weights and errors are two things. The information of a run follows from its motion and from the
//! mean noise of its channels; how much its parameters scatter in each direction is estimated from
//! few windows. If the inverse of this estimate were the weight, the runs that seem precise by
//! chance would count most, and their small covariances would make the interval of the whole small:
//! the 95 % intervals of twenty recordings of 2 s would contain the truth in 67 %. So a run with
//! the information `A` and the covariance `N` has the share `W = (Σ A)⁻¹ A` of the mean, whose
//! covariance is `Σ W N Wᵀ`, the sandwich of all runs; it holds for any weights that do not depend
//! on the errors. In the same draws these intervals contain it in 95 %.
//!
//! Where the runs differ by more than their noise, they are taken as draws of payloads that vary
//! from run to run (random effects): what varies is not known, but each of the ten values has a
//! variance between the runs, estimated from the runs that determine it ([Paule and
//! Mandel](https://doi.org/10.6028/jres.087.022)). This variance is part of the covariance of every
//! run, so that a long recording does not outvote the others, and of every interval. The model is
//! diagonal in the ten values a user reads: a gain that changes from run to run changes the mass
//! and leaves the centre of mass, and so does this variance. With few runs the variance between
//! them is itself badly known, even where the runs happen to be close in one value. Where they
//! disagree, every interval is that of Student's distribution with one degree of freedom less than
//! there are runs (the modified method of [Hartung and Knapp](https://doi.org/10.1002/sim.791)). Of
//! two runs that disagree neither is known to be right, and the intervals are 6.5 times as wide as
//! their standard deviations alone would make them.
//!
//! What recordings have in common is in none of these differences, and no number of recordings
//! reduces its error. The gains and the calibration of the arm are known with their uncertainty: an
//! estimate says how much each of their errors changes its parameters ([`SharedErrors`]), and the
//! changes are averaged, not their squares. The error of a known tool is treated in the same way.
//! Errors of an unloaded reference that is subtracted are in no interval.

mod agreement;
mod between;
mod check;
mod scatter;
mod shape;
mod term;

use schemars::JsonSchema;
use serde::Serialize;
use tactid_batch::Finding as Data;
use tactid_batch::diagnosis::nearest_consistent;
use tactid_batch::distributions::students_factor;
use tactid_batch::solve::with_variance;
use tactid_batch::solve::{Posterior, PrincipalMoments, Report};
use tactid_batch::{GainErrors, LinearEstimate, PriorKnowledge, SharedErrors};
use tactid_identify::serial::TenValues;
use tactid_identify::solve::value_jacobian;
use tactid_identify::solve::{Matrix, Vector};
use tactid_identify::{KnownMass, PayloadEstimate, VALUE_NAMES};
use tactid_shapes::ShapePrior;

use self::agreement::Comparison;
pub use self::agreement::{Agreement, RunDistance, ValueDifference};
use self::between::Variation;
use self::check::check_run;
pub use self::shape::ShapeFit;
use self::shape::with_shape;
use self::term::{Pooled, Term};
use crate::{Finding, RecordingError};

/// Standard deviation of a run's parameters, relative to a body of the payload's size, below which
/// runs are not compared: exact samples give the payload to 1e-7.
const LEAST_STD_DEV: f64 = 1e-6;

/// One payload from several recordings.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Combination {
    /// The payload. Each standard deviation is that of which 1.96 are half of the 95 % interval; it
    /// includes the variation between the runs. The numbers of windows, rejected samples and gaps
    /// are zero: they belong to the recordings.
    pub estimate: PayloadEstimate,
    /// Principal moments of inertia of the payload; `None` where its mass is zero.
    pub principal_moments: Option<PrincipalMoments>,
    /// Whether the recordings agree within their noise.
    pub agreement: Agreement,
    /// Standard deviation of each of [`VALUE_NAMES`](crate::VALUE_NAMES) between the runs, beyond
    /// their noise, in its unit: zero where noise explains the differences. A value that fewer than
    /// two runs determine has the largest relative one of the others, if the runs disagree.
    #[schemars(with = "TenValues<f64>")]
    pub between_runs: [f64; 10],
    /// What the shape of the payload contributed; `None` where none was given.
    pub shape: Option<ShapeFit>,
    /// A disagreement between the runs, a shape that they contradict, and a body that is far from consistent.
    #[serde(skip)]
    pub findings: Vec<Finding>,
}

/// Combines the estimates of several recordings of one payload, all in the frame named `frame`, and
/// what its shape says.
///
/// The order of the runs does not matter. One run alone is its own combination, and `n` with the
/// same information have its covariance divided by `n`, except for the errors that they share.
/// Cost: for `n` runs, some 0.1 ms times `n²`.
///
/// # Errors
/// Returns [`RecordingError::Together`] if there is none, an information or a covariance is not
/// finite, symmetric and positive semidefinite, or two runs are equal, and the errors of a known
/// mass and a bounding box that [`BatchSettings::check`](tactid_batch::BatchSettings::check)
/// lists.
///
/// ```
/// use tactid_identify::nalgebra::{SMatrix, SVector};
/// use tactid_batch::LinearEstimate;
/// use tactid_batch::PriorKnowledge;
/// use tactid_recordings::combine_estimates;
///
/// // 2 kg, 0.1 m in front of the flange, with standard deviations of 1 %; the third recording has a gain of 1.1.
/// let parameters = SVector::from([2.0, 0.0, 0.0, 0.2, 0.03, 0.0, 0.0, 0.03, 0.0, 0.01]);
/// let std_devs = SVector::from([0.02, 2e-3, 2e-3, 2e-3, 3e-4, 3e-4, 3e-4, 3e-4, 3e-4, 3e-4]);
/// let information = SMatrix::from_diagonal(&std_devs.map(|s: f64| s.powi(-2)));
/// let run = |gain: f64| LinearEstimate::with_known_noise(gain * parameters, information);
/// let found = combine_estimates("flange", &[run(1.0), run(1.0005), run(1.1)], &PriorKnowledge::default(), None)?;
/// assert!(!found.agreement.agree);
/// assert_eq!(found.agreement.largest.unwrap().run, 2);
/// assert!((found.estimate.body.mass_kg - 2.067).abs() < 1e-3);
/// let half_width = 1.96 * found.estimate.std_devs[0];
/// assert!(half_width > 0.2); // of two degrees of freedom
/// assert!((found.estimate.body.center_of_mass.z - 0.1).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn combine_estimates(
    frame: &str,
    runs: &[LinearEstimate],
    prior: &PriorKnowledge,
    shape: Option<&ShapePrior>,
) -> Result<Combination, RecordingError> {
    if runs.is_empty() {
        return Err(RecordingError::Together(
            "there is no recording to combine".to_owned(),
        ));
    }
    for (index, run) in runs.iter().enumerate() {
        check_run(run, index)?;
        let is_same = |other: &LinearEstimate| other == run && run.information != Matrix::zeros();
        if let Some(first) = runs[..index].iter().position(is_same) {
            return Err(RecordingError::Together(format!(
                "recordings {} and {} have the same data: their noise would count as agreement",
                first + 1,
                index + 1
            )));
        }
    }
    prior.check()?;
    let terms = comparable(runs);
    let within = Pooled::new(terms.iter()).term.at;
    let comparison = Comparison::new(&terms, &within);
    let agreement = comparison.agreement();
    let variations = comparison.variations();
    let between = between_runs(&variations, &within, agreement.agree);
    let mean = |terms: &[Term]| pooled(terms, &between, &within, prior.known_mass);
    let (pooled, shape) = match shape {
        None => (mean(&terms), None),
        Some(shape) => {
            // `constant` is the covariance of the errors of gains, calibration and known tool.
            let of_noise = mean(&comparable(&runs.iter().map(alone).collect::<Vec<_>>()));
            let of_all = mean(&terms);
            let constant = of_all.covariance() - of_noise.covariance();
            let (pooled, fit) = with_shape(&of_all, &constant, shape);
            (pooled, Some(fit))
        }
    };
    let factors = variations.map(|variation| match variation.runs {
        _ if agreement.agree => 1.0,
        0 | 1 => students_factor(terms.len() as f64 - 1.0),
        runs => students_factor(f64::from(runs) - 1.0),
    });
    Ok(combination(
        frame, prior, &pooled, factors, agreement, between, shape,
    ))
}

/// Returns an estimate without the errors that others may share.
fn alone(run: &LinearEstimate) -> LinearEstimate {
    LinearEstimate {
        shared: SharedErrors::none(),
        ..run.clone()
    }
}

/// Returns the terms of runs, limited to a precision at which runs can be compared.
fn comparable(runs: &[LinearEstimate]) -> Vec<Term> {
    let mut terms = Term::of_runs(runs);
    let [mass, length] = size(&Pooled::new(terms.iter()).term.at);
    let least = Vector::from_fn(|k, _| {
        let unit = mass * length.powi([0, 1, 1, 1, 2, 2, 2, 2, 2, 2][k]);
        (LEAST_STD_DEV * unit).powi(2)
    });
    for term in &mut terms {
        add_variance(term, &Matrix::from_diagonal(&least));
    }
    terms
}

/// Adds a covariance to the errors of a term, and reduces its weight by it.
fn add_variance(term: &mut Term, covariance: &Matrix) {
    term.weight = with_variance(&term.weight, covariance);
    term.covariance += covariance;
}

/// Returns the mass of a body, kg, and its size, m: the distance of its centre of mass from the
/// frame's origin, or the root mean square distance of its parts where that is larger.
fn size(parameters: &Vector) -> [f64; 2] {
    let mass = parameters[0].abs();
    if mass == 0.0 {
        return [0.0; 2];
    }
    let lever = parameters.fixed_rows::<3>(1).norm() / mass;
    let trace = parameters[4].abs() + parameters[7].abs() + parameters[9].abs();
    [mass, lever.max((0.5 * trace / mass).sqrt())]
}

/// Returns the standard deviation of each value between the runs, see
/// [`Combination::between_runs`].
fn between_runs(variations: &[Variation; 10], at: &Vector, agree: bool) -> [f64; 10] {
    let [mass, length] = size(at);
    let moment = mass * length * length;
    let sizes: [f64; 10] = std::array::from_fn(|k| [mass, length, moment][kind(k)]);
    let compared = |k: &usize| variations[*k].runs >= 2 && sizes[*k] > 0.0;
    let fractions = (0..10).filter(compared);
    let fractions = fractions.map(|k| variations[k].variance.sqrt() / sizes[k]);
    let largest = fractions.fold(0.0, f64::max);
    std::array::from_fn(|k| match variations[k].runs {
        0 | 1 if agree => 0.0,
        0 | 1 => largest * sizes[k],
        _ => variations[k].variance.sqrt(),
    })
}

/// Returns 0 for the mass, 1 for a coordinate of the centre of mass and 2 for an entry of the
/// inertia.
fn kind(value: usize) -> usize {
    match value {
        0 => 0,
        1..=3 => 1,
        _ => 2,
    }
}

/// Returns the combined estimate of runs whose ten values vary by so many standard deviations, and
/// of a known mass.
fn pooled(
    terms: &[Term],
    between: &[f64; 10],
    at: &Vector,
    known_mass: Option<KnownMass>,
) -> Pooled {
    let of_values = Matrix::from_diagonal(&Vector::from_fn(|k, _| between[k].powi(2)));
    let inverse = value_jacobian(at).and_then(Matrix::try_inverse);
    let covariance = inverse.map(|inverse| inverse * of_values * inverse.transpose());
    let mut terms = terms.to_vec();
    if let Some(covariance) = covariance.filter(|covariance| *covariance != Matrix::zeros()) {
        for term in &mut terms {
            add_variance(term, &covariance);
        }
    }
    if let Some(mass) = known_mass {
        let variance = mass.with(0.0).std_dev_kg.powi(2);
        let (mut weight, mut covariance) = (Matrix::zeros(), Matrix::zeros());
        (weight[(0, 0)], covariance[(0, 0)]) = (variance.recip(), variance);
        terms.push(Term {
            at: Vector::ith(0, mass.mass_kg),
            weight,
            covariance,
            changes: GainErrors::zeros(terms[0].changes.ncols()),
            degrees_of_freedom: 0.0,
        });
    }
    Pooled::new(terms.iter())
}

/// Returns the payload. Its standard deviations are multiplied by `factors`, or by what makes the
/// nearest consistent body plausible where that is larger; disagreement does not make a known mass
/// less certain.
fn combination(
    frame: &str,
    prior: &PriorKnowledge,
    pooled: &Pooled,
    factors: [f64; 10],
    agreement: Agreement,
    between_runs: [f64; 10],
    shape: Option<ShapeFit>,
) -> Combination {
    let bounding_box = prior.bounding_box.as_ref();
    let scales = pooled.inverse.null_space.scales();
    let covariance = pooled.covariance();
    let consistent = nearest_consistent(pooled.term.at, &covariance, scales, bounding_box);
    let posterior = Posterior {
        parameters: consistent.parameters,
        covariance,
        null_space: &pooled.inverse.null_space,
        factors: factors.map(|factor| factor.max(consistent.widening)),
    };
    let Report {
        estimate,
        principal_moments,
    } = posterior.report(frame, prior);
    let is_mass_uncertain = estimate.uncertain().any(|name| name == VALUE_NAMES[0]);
    let disagreement = agreement.disagreement(is_mass_uncertain);
    let disagreement = disagreement.map(Data::RunsDisagree);
    let contradicted = shape.as_ref().filter(|fit| fit.is_contradicted());
    let contradicted = contradicted.map(|fit| Finding::ShapeContradicted {
        p_value: fit.p_value,
        scale: None,
        is_of_mass: false,
    });
    Combination {
        estimate,
        principal_moments,
        findings: disagreement
            .into_iter()
            .chain(consistent.contradiction)
            .map(Finding::Data)
            .chain(contradicted)
            .collect(),
        agreement,
        between_runs,
        shape,
    }
}

#[cfg(test)]
mod error_tests;
#[cfg(test)]
mod tests;
