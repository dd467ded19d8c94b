//! Gives any rows to the estimators of one row at a time: their parameters and covariances stay
//! finite.

use crate::{Number, parsed};
use arbitrary::Arbitrary;
use nalgebra::{SVector, Vector3};
use tactid_nlms::{ChangeDetector, ChangeSettings, Estimator, Nlms, Outcome, Rls};

#[derive(Arbitrary, Debug)]
struct Input {
    rows: Vec<([Number; 3], Number)>,
}

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold.
pub fn run(bytes: &[u8]) {
    let Some(input) = parsed::<Input>(bytes) else {
        return;
    };
    let mut nlms = Nlms::<3>::paper();
    let mut rls = Rls::<3>::new();
    let mut changes = ChangeDetector::new(ChangeSettings::default()).expect("the defaults");
    for (row, target) in &input.rows {
        let row = Vector3::from(row.map(|number| number.0));
        check(&mut nlms, &row, target.0);
        check(&mut rls, &row, target.0);
        if let Some(covariance) = rls.covariance() {
            assert!(covariance.iter().all(|x| x.is_finite()), "{covariance}");
            assert!(
                covariance.diagonal().iter().all(|&x| x >= 0.0),
                "{covariance}"
            );
        }
        changes.update(target.0);
    }
}

/// Asserts that an estimator refuses exactly what it documents, and has finite parameters.
fn check<const N: usize>(estimator: &mut impl Estimator<N>, row: &SVector<f64, N>, target: f64) {
    let before = estimator.parameters();
    let outcome = estimator.update(row, target);
    let after = estimator.parameters();
    let usable = row.iter().chain([&target]).all(|x| x.abs() < 1e150);
    assert_eq!(outcome == Outcome::Used, usable);
    assert!(
        usable || before == after,
        "a refused row changes the estimate"
    );
    assert!(after.iter().all(|x| x.is_finite()), "{after}");
}
