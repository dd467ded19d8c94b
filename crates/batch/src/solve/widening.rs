//! Larger standard deviations of linear parameters.

use tactid_identify::KnownMass;
use tactid_identify::solve::Matrix;

/// Returns the covariance of linear parameters with standard deviations that are larger by a
/// factor. That of a known mass does not grow beyond that of its weighing.
pub fn widened(covariance: &Matrix, factor: f64, known_mass: Option<KnownMass>) -> Matrix {
    let mut wide = covariance * (factor * factor);
    if let Some(mass) = known_mass {
        let largest = mass.std_dev_kg.powi(2).max(covariance[(0, 0)]);
        let ratio = (largest / wide[(0, 0)].max(f64::MIN_POSITIVE)).min(1.0);
        wide.row_mut(0).scale_mut(ratio.sqrt());
        wide.column_mut(0).scale_mut(ratio.sqrt());
    }
    wide
}
