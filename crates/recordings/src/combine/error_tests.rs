//! Runs whose covariances are estimates, and runs that share errors.

use rand::{SeedableRng, rngs::SmallRng};
use tactid_batch::SharedErrors;
use tactid_identify::solve::values_of;

use super::tests::{combined, covariance, half_widths, normal, run, truth};
use super::*;

/// Runs whose covariances are estimated from few windows, with errors that are larger than their
/// information claims by different factors in different directions: the 95 % intervals of many such
/// runs hold as well as those of one, and false alarms are rare. With the inverses of the estimated
/// covariances as weights, the intervals of twenty runs hold in half of the draws.
#[test]
fn estimated_covariances_leave_intervals_and_verdict_honest() {
    let expected = values_of(&truth()).unwrap();
    for (runs, windows, draws) in [(3, 30, 300), (20, 16, 150)] {
        let mut random = SmallRng::seed_from_u64(10);
        let (mut alarms, mut held) = (0, 0);
        for _ in 0..draws {
            let runs: Vec<_> = (0..runs)
                .map(|_| {
                    let claimed = covariance(&mut random);
                    let factors =
                        Matrix::from_diagonal(&Vector::from_fn(|k, _| 1.0 + 0.2 * k as f64));
                    let root = claimed.cholesky().unwrap().l() * factors;
                    let sample = (0..windows).map(|_| root * normal(&mut random));
                    let estimated: Matrix = sample.map(|drawn| drawn * drawn.transpose()).sum();
                    LinearEstimate {
                        covariance: estimated / f64::from(windows),
                        degrees_of_freedom: f64::from(windows),
                        ..LinearEstimate::with_known_noise(
                            truth() + root * normal(&mut random),
                            claimed.try_inverse().unwrap(),
                        )
                    }
                })
                .collect();
            let found = combined(&runs);
            alarms += u32::from(!found.agreement.agree);
            let errors = found.estimate.values().into_iter().zip(expected);
            let errors = errors.zip(half_widths(&found));
            held += errors
                .filter(|((value, truth), half)| (value - truth).abs() <= *half)
                .count();
        }
        let held = held as f64 / (10 * draws) as f64;
        assert!((0.93..0.98).contains(&held), "{runs}: {held}");
        assert!(alarms <= draws / 25, "{runs}: {alarms}");
    }
}

/// Draws runs whose parameters have a shared error: a common gain with a standard deviation of 2 %,
/// besides noise of 0.1 %.
fn runs_with_a_gain(
    random: &mut SmallRng,
    count: usize,
    source: impl Fn(usize) -> u64,
) -> Vec<LinearEstimate> {
    let gains: Vec<f64> = (0..count).map(|_| 0.02 * normal(random)[0]).collect();
    let scale = Matrix::from_diagonal(&truth().map(|entry| 1e-3 * entry.abs().max(0.01)));
    let run = |k: usize| {
        let at = (1.0 + gains[source(k) as usize]) * truth() + scale * normal(random);
        LinearEstimate {
            shared: SharedErrors {
                unknowns: vec![source(k)],
                changes: GainErrors::from_column_slice((0.02 * truth()).as_slice()),
            },
            ..LinearEstimate::with_known_noise(at, (scale * scale).try_inverse().unwrap())
        }
    };
    (0..count).map(run).collect()
}

/// An error that all runs share stays as large in the combination as in each run, and is no
/// disagreement. The interval of the mass holds. Runs that do not share it average it, and it is
/// part of what they may differ by.
#[test]
fn a_shared_error_is_not_divided() {
    let mut random = SmallRng::seed_from_u64(12);
    for (is_shared, expected) in [(true, 0.04), (false, 0.02)] {
        let (mut held, mut agreed, draws) = (0, 0, 400);
        for _ in 0..draws {
            let source = |k: usize| if is_shared { 0 } else { k as u64 };
            let found = combined(&runs_with_a_gain(&mut random, 4, source));
            let mass = found.estimate.body.mass_kg;
            held += u32::from((mass - 2.0).abs() <= half_widths(&found)[0]);
            agreed += u32::from(found.agreement.agree);
            let std_dev = found.estimate.std_devs[0];
            if found.agreement.agree && found.between_runs[0] == 0.0 {
                assert!((std_dev / expected - 1.0).abs() < 0.05, "{std_dev}");
            }
        }
        assert!((376..=398).contains(&held), "{is_shared}: {held}");
        assert!(agreed >= 384, "{is_shared}: {agreed}");
    }
}

/// A recording that is given twice is an error that names both, because its noise would count as
/// agreement.
#[test]
fn the_same_run_twice_is_refused() {
    let mut random = SmallRng::seed_from_u64(11);
    let mut runs: Vec<_> = (0..3).map(|_| run(&mut random, &truth())).collect();
    runs.push(runs[1].clone());
    let error = combine_estimates("tool", &runs, &PriorKnowledge::default(), None).unwrap_err();
    let text = error.to_string();
    assert!(
        text.starts_with("recordings 2 and 4 have the same data"),
        "{text}"
    );
}
