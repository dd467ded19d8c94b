//! The estimators in a control loop.

#![allow(clippy::unwrap_used)]

use allocation_counter::measure;
use nalgebra::{SVector, Vector3};
use tactid_nlms::{
    ChangeDetector, ChangeSettings, Estimator, Kaczmarz, KaczmarzSettings, Lms, Nlms, Rls, Robust,
    RowNoise, SlidingWindow, TotalLeastSquares,
};

fn row(k: u32) -> Vector3<f64> {
    let t = f64::from(k);
    Vector3::new(t.cos(), (0.7 * t).sin(), (1.3 * t).cos())
}

/// Neither rows, used or refused, nor questions allocate.
fn allocates_nothing(mut estimator: impl Estimator<3>) {
    let allocations = measure(|| {
        for k in 0..300 {
            let wanted = if k % 50 == 7 {
                f64::NAN
            } else {
                f64::from(k % 11)
            };
            estimator.update(&row(k), wanted);
            assert!(estimator.parameters().norm() < 1e9);
            estimator.covariance();
        }
        assert_eq!(estimator.counts().used, 294);
    });
    assert_eq!(allocations.count_total, 0);
}

#[test]
fn estimators_allocate_nothing() {
    allocates_nothing(Lms::new(0.01).unwrap());
    allocates_nothing(Nlms::paper());
    allocates_nothing(Kaczmarz::new(KaczmarzSettings::default()).unwrap());
    allocates_nothing(Rls::new());
    allocates_nothing(Rls::new().with_memory(50.0).unwrap());
    allocates_nothing(SlidingWindow::new(20).unwrap());
    allocates_nothing(TotalLeastSquares::new(RowNoise::equal()));
    allocates_nothing(Robust::with_tracked_scale(1.0).unwrap());
}

#[test]
fn weights_alarms_and_restarts_allocate_nothing() {
    let mut rls = Rls::from_prior(Vector3::zeros(), SVector::repeat(1.0)).unwrap();
    let mut window = SlidingWindow::<3>::new(21).unwrap();
    let mut total = TotalLeastSquares::<3>::new(RowNoise::equal());
    let mut detector = ChangeDetector::new(ChangeSettings::default()).unwrap();
    let mut alarms = 0;
    let allocations = measure(|| {
        for k in 0..300 {
            let (row, wanted) = (row(k), f64::from(k % 100));
            if detector
                .update(rls.innovation(&row, wanted).over(1.0))
                .is_some()
            {
                alarms += 1;
                rls.reopen(100.0).unwrap();
                window.restart();
                total.restart();
            }
            rls.update_with_deviation(&row, wanted, 0.5);
            window.update_with_deviation(&row, wanted, 0.5);
            total.update_with_noise(&row, wanted, &RowNoise::on_wanted());
        }
        rls.restart();
    });
    assert_eq!(allocations.count_total, 0);
    assert!(alarms > 0);
}
