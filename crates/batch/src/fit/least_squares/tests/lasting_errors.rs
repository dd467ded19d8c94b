//! Errors of the model that are correlated over seconds.

use super::*;

/// A load that is a few percent off, by amounts that change over some 10 s: its errors are
/// correlated for longer than the Newey-West estimate looks. 83 % of the intervals of 95 % of 200
/// recordings of 15 s hold the truth; without the cluster-robust covariance, 76 % do.
#[test]
fn errors_that_are_correlated_over_seconds_are_in_the_covariance() {
    const RUNS: u64 = 200;
    let mut random = SmallRng::seed_from_u64(77);
    let mut inside = 0.0;
    for seed in 0..RUNS {
        let mut equations = equations(300, seed, 0.1, 0.0);
        for channel in 0..6 {
            let phase: f64 = random.random_range(0.0..6.3);
            let rate = 6.3 / random.random_range(8.0..15.0);
            for equation in &mut equations {
                let angle = rate * equation.time_s + phase;
                equation.rows[channel].target *= 1.0 + 0.05 * angle.sin();
            }
        }
        let found = fit_wrench(&equations);
        let error = found.parameters - truth();
        let half_widths = found
            .covariance
            .diagonal()
            .map(|variance| 1.96 * variance.sqrt());
        let holds = error.zip_map(&half_widths, |e, h| f64::from(u8::from(e.abs() < h)));
        inside += holds.sum() / (10 * RUNS) as f64;
    }
    assert!((0.80..0.99).contains(&inside), "{inside}");
}
