//! The noise model on drawn residuals.

use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;

use super::*;
use crate::equations::KnownNoise;

/// The noise of three channels is known, that of two is estimated. The first keep their proportions
/// and correlations, and have none with the others, whatever the residuals are; all are as large as
/// the residuals.
#[test]
fn known_noise_keeps_its_proportions() {
    let covariance = DMatrix::from_row_slice(
        3,
        3,
        &[4.0, 1.8, 0.0, 1.8, 1.0, 0.0, 0.0, 0.0, 9.0], // correlation 0.9
    );
    let channels = Channels {
        kinds: vec![3, 2],
        sources: vec![3, 2],
        known_noise: vec![KnownNoise {
            first_channel: 0,
            covariance,
        }],
        ..Channels::of_wrench()
    };
    let mut equation = Equation::new(5);
    equation.instants = 70;
    equation.rows.iter_mut().for_each(|row| row.target = 100.0);
    let mut noise = Noise::from_targets(&[equation], &channels, RESIDUAL_ROUNDING);
    let window_std_dev = (35.0 / 18.0 / 70.0f64).sqrt();
    for (found, sample_std_dev) in noise.std_devs.iter().zip([2.0, 1.0, 3.0]) {
        assert!((found / sample_std_dev / window_std_dev - 1.0).abs() < 1e-12);
    }
    assert!((noise.std_devs[3] - 100.0).abs() < 1e-9);

    let mut random = SmallRng::seed_from_u64(5);
    let mut draw = || -> f64 { random.sample(StandardNormal) };
    // Five times as large as known, and common to all five channels.
    let residuals: Vec<[f64; 5]> = (0..2000)
        .map(|_| {
            let common = draw();
            [10.0, 5.0, 15.0, 1.0, 2.0].map(|size| size * window_std_dev * (common + 0.1 * draw()))
        })
        .collect();
    noise.estimate(residuals.iter().map(|residual| (&residual[..], 1.0)));
    for (found, target) in noise.std_devs.iter().zip([10.0, 5.0, 15.0, 1.0, 2.0]) {
        assert!(
            (found / target / window_std_dev - 1.0).abs() < 0.06,
            "{found}"
        );
    }
    let correlation = &noise.root * noise.root.transpose();
    assert!((correlation[(1, 0)] - 0.9).abs() < 1e-12);
    assert!(correlation[(2, 0)].abs() < 1e-12 && correlation[(3, 1)].abs() < 1e-12);
    assert!((correlation[(4, 3)] - 1.0 / 1.01).abs() < 0.01);
}

/// Whitened rows have the identity as their noise covariance, by substitution and with the inverse
/// that is computed once.
#[test]
fn whitened_rows_have_the_identity_as_their_covariance() {
    let covariance = DMatrix::from_row_slice(
        3,
        3,
        &[4.0, 1.8, 0.3, 1.8, 1.0, 0.1, 0.3, 0.1, 9.0], // Correlations 0.9, 0.05 and 0.03.
    );
    let channels = Channels {
        kinds: vec![3],
        sources: vec![3],
        known_noise: vec![KnownNoise {
            first_channel: 0,
            covariance: covariance.clone(),
        }],
        ..Channels::of_wrench()
    };
    let mut equation = Equation::new(3);
    equation.instants = 70;
    let noise = Noise::from_targets(&[equation], &channels, RESIDUAL_ROUNDING);
    let root = covariance.cholesky().unwrap().unpack();
    let mut rows: Vec<(SVector<f64, 10>, f64)> = (0..3)
        .map(|i| {
            let entry = |k: usize| if k < 3 { root[(i, k)] } else { 0.0 };
            (SVector::from_fn(|k, _| entry(k)), root[(i, 2)])
        })
        .collect();
    noise.whiten(&mut rows);
    // The noise of a window's mean is smaller than that of the samples by the same factor in all
    // channels.
    let scale = rows[0].0[0];
    for (i, (regressor, target)) in rows.iter().enumerate() {
        let mut unit = SVector::zeros();
        unit[i] = 1.0;
        assert!((regressor / scale - unit).norm() < 1e-12);
        assert_eq!(*target, regressor[2]);
    }
    let wide: Vec<[f64; 3]> = (0..3).map(|i| [0, 1, 2].map(|k| root[(i, k)])).collect();
    let (whitening, mut whitened) = (Whitening::new(&noise), vec![[0.0; 3]; 3]);
    whitening.apply(&wide, &mut whitened);
    for (i, k) in (0..3).flat_map(|i| (0..3).map(move |k| (i, k))) {
        assert!((whitened[i][k] - rows[i].0[k]).abs() < 1e-12 * scale);
    }
    let residuals = [0.3, -2.0, 1.0];
    let mut targets = residuals.map(|residual| (SVector::zeros(), residual));
    noise.whiten(&mut targets);
    let square: f64 = targets.iter().map(|(_, target)| target * target).sum();
    assert!((whitening.squared_distance(&residuals) / square - 1.0).abs() < 1e-12);
}
