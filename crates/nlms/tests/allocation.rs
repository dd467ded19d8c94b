//! Estimators and the change detector allocate nothing, as a control loop requires.

#![allow(clippy::unwrap_used)]

use allocation_counter::measure;
use nalgebra::Vector3;
use tactid_nlms::{ChangeDetector, ChangeSettings, Estimator, Lms, Nlms, Rls};

fn row(k: u32) -> Vector3<f64> {
    let t = f64::from(k);
    Vector3::new(t.cos(), (0.7 * t).sin(), (1.3 * t).cos())
}

/// Asserts that neither updates with used or refused rows nor queries allocate.
fn assert_no_allocation(mut estimator: impl Estimator<3>) {
    let allocations = measure(|| {
        for k in 0..300 {
            let target = if k % 50 == 7 {
                f64::NAN
            } else {
                f64::from(k % 11)
            };
            estimator.update(&row(k), target);
            assert!(estimator.parameters().norm() < 1e9);
        }
        assert_eq!(estimator.counts().used, 294);
    });
    assert_eq!(allocations.count_total, 0);
}

#[test]
fn estimators_allocate_nothing() {
    assert_no_allocation(Lms::new(0.01).unwrap());
    assert_no_allocation(Nlms::paper());
    assert_no_allocation(Rls::new());
}

#[test]
fn blocks_covariances_alarms_and_restarts_allocate_nothing() {
    let mut rls = Rls::<3>::new();
    let mut detector = ChangeDetector::new(ChangeSettings::default()).unwrap();
    let (mut alarms, mut covariances) = (0, 0);
    let allocations = measure(|| {
        for k in 0..300 {
            let (row, target) = (row(k), f64::from(k % 100));
            if detector.update(target - row.dot(&rls.parameters())) {
                alarms += 1;
                rls = Rls::starting_at(rls.parameters());
                detector.restart();
            }
            rls.update_all(&mut [(row, target), (row * 0.5, f64::NAN)]);
            covariances += u32::from(rls.covariance().is_some());
        }
    });
    assert_eq!(allocations.count_total, 0);
    assert!(alarms > 0 && covariances > 0);
}
