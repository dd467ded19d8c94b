//! Inverses of matrices that have a null space.

use nalgebra::{DMatrix, SymmetricEigen};
use tactid_identify::solve::{Matrix, NullSpace, VARIANCE_RATIO, Vector};

/// Ratio of an eigenvalue to the largest one, in parameters scaled to an information of one each,
/// at and below which a direction is unobservable: above the rounding of an inverted covariance.
pub(crate) const INVERSE_ROUNDING: f64 = 1e-12;

/// Returns a symmetric matrix in units in which its diagonal is one where it is positive.
#[must_use]
pub fn normalized(matrix: &Matrix) -> Matrix {
    let scales = scales(matrix);
    matrix.component_mul(&(scales * scales.transpose()))
}

/// Returns the inverse of a covariance in the observable directions; it is zero in those of the
/// null space.
#[must_use]
pub fn information(covariance: &Matrix, null_space: &NullSpace) -> Matrix {
    let scales = null_space.scales();
    let scaled = covariance.component_div(&(scales * scales.transpose()));
    let largest = scaled.diagonal().max().max(f64::MIN_POSITIVE);
    // With a variance of its own, an unobservable direction can be inverted, and is then removed
    // again.
    let directions = null_space.directions().iter();
    let unobservable: Matrix = directions.map(|n| n * n.transpose()).sum();
    let mut eigen = SymmetricEigen::new(scaled + unobservable * largest);
    eigen
        .eigenvalues
        .apply(|variance| *variance = 1.0 / variance.max(VARIANCE_RATIO * largest));
    let information = eigen.recompose() - unobservable / largest;
    information.component_div(&(scales * scales.transpose()))
}

/// The inverse of an information in its observable directions.
#[derive(Clone, Debug)]
pub struct PseudoInverse {
    /// The inverse, zero in unobservable directions.
    pub covariance: Matrix,
    /// The directions without information.
    pub null_space: NullSpace,
}

/// Returns the inverse of an information, and the directions without information.
#[must_use]
pub fn pseudo_inverse(information: &Matrix) -> PseudoInverse {
    let scales = scales(information);
    let eigen = SymmetricEigen::new(normalized(information));
    let largest = eigen.eigenvalues.max();
    let is_observable = |k: &usize| eigen.eigenvalues[*k] > INVERSE_ROUNDING * largest;
    let column = |k: usize| -> Vector { eigen.eigenvectors.column(k).into() };
    let variances = (0..10).filter(is_observable).map(|k| {
        let direction = column(k).component_mul(&scales);
        direction * direction.transpose() / eigen.eigenvalues[k]
    });
    let unobservable = (0..10).filter(|k| !is_observable(k));
    PseudoInverse {
        covariance: variances.sum(),
        null_space: NullSpace::new(scales, unobservable.map(column)),
    }
}

/// Returns units of the parameters in which each has an information of one; one where it has none.
fn scales(information: &Matrix) -> Vector {
    let unit = |entry: f64| {
        if entry > 0.0 {
            entry.sqrt().recip()
        } else {
            1.0
        }
    };
    information.diagonal().map(unit)
}

/// Returns the information that remains where the parameters of a run also vary with the covariance
/// `between`: `(W⁻¹ + T)⁻¹`, written so that it holds for a singular `W`, too.
#[must_use]
pub fn with_variance(information: &Matrix, between: &Matrix) -> Matrix {
    let scales = scales(information);
    let products = scales * scales.transpose();
    let scaled = information.component_mul(&products);
    let sum = Matrix::identity() + between.component_div(&products) * scaled;
    let Some(inverse) = sum.try_inverse() else {
        return *information;
    };
    let remaining = scaled * inverse;
    (0.5 * (remaining + remaining.transpose())).component_div(&products)
}

/// Returns `whole` with at least a fraction, `floor`, of the variance of `same_window` in each
/// direction. Estimated correlations may leave a direction no variance, or a negative one.
pub(crate) fn with_variance_floor(
    same_window: &DMatrix<f64>,
    whole: DMatrix<f64>,
    floor: f64,
) -> DMatrix<f64> {
    let cholesky = same_window.clone().cholesky();
    let Some(root) = cholesky.map(|cholesky| cholesky.unpack()) else {
        return whole;
    };
    // R⁻¹ W R⁻ᵀ, in which `same_window` is the identity.
    let mut relative = whole;
    root.solve_lower_triangular_mut(&mut relative);
    let mut relative = relative.transpose();
    root.solve_lower_triangular_mut(&mut relative);
    let mut eigen = SymmetricEigen::new(relative);
    eigen.eigenvalues.apply(|value| *value = value.max(floor));
    &root * eigen.recompose() * root.transpose()
}
