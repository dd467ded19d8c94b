//! The meats on drawn rows.

use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;

use super::*;
use crate::fit::vector_unit::assert_same_digits;

/// Returns 4000 windows of one channel. Every second one excites the first unknown and has noise of
/// variance 9, the others the second unknown with noise of variance 1; half-differences are so many
/// times as large.
fn uneven_rows(difference: f64) -> Vec<ScoredRow> {
    let mut random = SmallRng::seed_from_u64(1);
    let mut draw = || -> f64 { random.sample(StandardNormal) };
    let row = |k: usize| {
        let mut entries = [0.0; WIDTH];
        entries[k % 2] = 1.0;
        let std_dev = if k.is_multiple_of(2) { 3.0 } else { 1.0 };
        ScoredRow {
            entries,
            residual: std_dev * draw(),
            difference: std_dev * difference * draw(),
            weight: 1.0,
            ..ScoredRow::default()
        }
    };
    (0..4000).map(row).collect()
}

/// The local estimate has the variance of the windows that determine an unknown, where the
/// stationary one has the mean of all. With 2000 windows each they scatter by some 5 %.
#[test]
fn local_noise_counts_for_its_unknown() {
    let rows = uneven_rows(1.0);
    let bread = DMatrix::identity(2, 2) / 2000.0;
    let sums = MeatEstimator::new(&rows, 1, &bread);
    assert!(sums.is_white());
    let local = sums.local_meat().meat / 2000.0;
    let stationary = sums.stationary_meat().meat / 2000.0;
    for (unknown, variance) in [(0, 9.0), (1, 1.0)] {
        let ratio = local[(unknown, unknown)] / variance;
        assert!((ratio - 1.0).abs() < 0.15, "{local}");
        assert!(
            (stationary[(unknown, unknown)] - 5.0).abs() < 0.75,
            "{stationary}"
        );
    }
}

/// Noise that neighbouring samples share, and an error of the model, are not in the
/// half-differences.
#[test]
fn residuals_that_differences_do_not_explain_are_not_white() {
    let bread = DMatrix::identity(2, 2) / 2000.0;
    for (difference, white) in [
        (0.0, false),
        (0.5, false),
        (0.8, true),
        (1.3, true),
        (2.0, false),
    ] {
        let rows = uneven_rows(difference);
        let sums = MeatEstimator::new(&rows, 1, &bread);
        assert_eq!(sums.is_white(), white, "{difference}");
    }
}

/// Returns rows of two channels with scores of random numbers.
fn scored_rows(windows: usize) -> Vec<ScoredRow> {
    let mut random = SmallRng::seed_from_u64(2);
    let row = |_| {
        let mut row = ScoredRow::default();
        for score in &mut row.score[..3] {
            *score = random.random_range(-1.0..1.5);
        }
        row
    };
    (0..2 * windows).map(row).collect()
}

/// The mean product of sums over neighbouring windows is the sum over all lags with weights that
/// fall linearly, also where there are fewer windows than lags.
#[test]
fn sums_of_neighbours_are_products_over_all_lags() {
    for windows in [1, 2, 3, 4, 50, 1000] {
        let rows = scored_rows(windows);
        let bread = DMatrix::identity(3, 3);
        let found = MeatEstimator::new(&rows, 2, &bread).newey_west_meat();
        let scores: Vec<DVector<f64>> = rows
            .chunks_exact(2)
            .map(|rows| DVector::from_fn(3, |k, _| rows[0].score[k] + rows[1].score[k]))
            .collect();
        let length = newey_west_reach(windows) + 1;
        let mut expected = DMatrix::<f64>::zeros(3, 3);
        for (i, first) in scores.iter().enumerate() {
            for (j, second) in scores.iter().enumerate() {
                let weight = 1.0 - i.abs_diff(j) as f64 / length as f64;
                expected += first * second.transpose() * weight.max(0.0);
            }
        }
        let difference = (found - &expected).amax();
        assert!(
            difference < 1e-12 * expected.amax(),
            "{windows}: {difference}"
        );
    }
}

/// Returns the rows of a fit of three unknowns to white noise in 83 windows, with the inverse of
/// their information.
fn fitted_rows(seed: u64) -> (Vec<ScoredRow>, DMatrix<f64>) {
    let mut random = SmallRng::seed_from_u64(seed);
    let mut draw = || -> f64 { random.sample(StandardNormal) };
    // The motion grows: the last section has a third of the information.
    let rows = DMatrix::from_fn(83, 3, |k, _| draw() * (0.3 + (k as f64 / 80.0).powi(2)));
    let targets = DVector::from_fn(83, |_, _| draw());
    let bread = rows.tr_mul(&rows).try_inverse().unwrap();
    let residuals = &targets - &rows * (&bread * rows.tr_mul(&targets));
    let scored = (0..83).map(|k| {
        let entries = std::array::from_fn(|j| if j < 3 { rows[(k, j)] } else { 0.0 });
        ScoredRow {
            entries,
            score: entries.map(|entry| entry * residuals[k]),
            residual: residuals[k],
            weight: 1.0,
            difference: 0.0,
        }
    });
    (scored.collect(), bread)
}

/// White noise makes the sections scatter as it makes the unknowns uncertain, a ratio of one in the
/// mean of 2000 fits, and more than the bound in one to three of a hundred. The covariance is that
/// of Student's t with seven degrees of freedom.
#[test]
fn sections_scatter_by_white_noise() {
    const FITS: u32 = 2000;
    let (mut mean, mut beyond) = (0.0, 0);
    let mut covariance = DMatrix::zeros(3, 3);
    for seed in 0..FITS {
        let (rows, bread) = fitted_rows(u64::from(seed));
        let information = bread.clone().try_inverse().unwrap();
        let sums = MeatEstimator::new(&rows, 1, &bread);
        let found = sums.cluster_robust(&information, 1e6).unwrap();
        mean += found.ratio / f64::from(FITS);
        beyond += u32::from(found.ratio > found.bound);
        covariance += information * found.covariance / f64::from(FITS);
    }
    // The standard deviation of a ratio is some 0.4.
    assert!((mean - 1.0).abs() < 0.04, "{mean}");
    assert!((10..60).contains(&beyond), "{beyond}");
    for unknown in 0..3 {
        let ratio = covariance[(unknown, unknown)] / (7.0 / 5.0);
        assert!((ratio - 1.0).abs() < 0.1, "{covariance}");
    }
}

/// Too few windows have no sections, and an unknown that no window excites has no variance.
#[test]
fn sections_need_windows() {
    let (mut rows, _) = fitted_rows(0);
    for row in &mut rows {
        row.entries[3] = 0.0;
    }
    let mut bread = DMatrix::identity(4, 4);
    bread[(3, 3)] = 0.0;
    let meat = DMatrix::identity(4, 4);
    let sums = MeatEstimator::new(&rows, 1, &bread);
    let found = sums.cluster_robust(&meat, 100.0).unwrap();
    assert!(found.covariance.row(3).iter().all(|entry| *entry == 0.0));
    let few = MeatEstimator::new(&rows[..31], 1, &bread);
    assert!(few.cluster_robust(&meat, 100.0).is_none());
}

/// The products of neighbouring windows have the same digits on the widest vector unit as on the
/// baseline.
#[test]
fn products_do_not_depend_on_the_vector_unit() {
    let mut random = SmallRng::seed_from_u64(3);
    let mut draw = || -> f64 { random.sample(StandardNormal) };
    let row = |_| ScoredRow {
        entries: std::array::from_fn(|_| draw()),
        residual: draw(),
        weight: 1.0,
        ..ScoredRow::default()
    };
    let rows: Vec<ScoredRow> = (0..600).map(row).collect();
    let bread = DMatrix::identity(10, 10);
    let estimator = MeatEstimator::new(&rows, 6, &bread);
    assert_same_digits(ProductsOfNeighbours {
        estimator: &estimator,
        covariances: &estimator.residual_covariances(None),
    });
}
