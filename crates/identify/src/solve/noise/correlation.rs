//! Correlation matrices: normalisation, Cholesky factorisation in place, and shrinkage of
//! estimates.

use nalgebra::DMatrix;

/// Independent windows for each channel from which all correlations are known well enough not to be
/// shrunk.
const AMPLE_WINDOWS: f64 = 10.0;

/// Factor of correlations that are known well. It is less than one so that channels which are equal
/// but for rounding leave a positive definite matrix.
const MAX_FACTOR: f64 = 1.0 - 1e-6;

/// Turns a lower triangle of a covariance matrix into one of correlations, in place.
pub(crate) fn to_correlation(covariance: &mut DMatrix<f64>) {
    for i in 0..covariance.nrows() {
        for j in 0..i {
            let size = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            covariance[(i, j)] /= size.max(f64::MIN_POSITIVE);
        }
    }
    covariance.fill_diagonal(1.0);
}

/// Replaces a lower triangle by its Cholesky factor, without allocation. Returns false where the
/// matrix is not positive definite; its entries are then meaningless.
pub(crate) fn cholesky_in_place(matrix: &mut DMatrix<f64>) -> bool {
    for j in 0..matrix.nrows() {
        for k in 0..j {
            let factor = matrix[(j, k)];
            for i in j..matrix.nrows() {
                matrix[(i, j)] -= factor * matrix[(i, k)];
            }
        }
        let pivot = matrix[(j, j)];
        // NaN is not positive either.
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        for i in j..matrix.nrows() {
            matrix[(i, j)] /= pivot.sqrt();
        }
    }
    matrix.fill_upper_triangle(0.0, 1);
    true
}

/// Returns the factor, at most [`MAX_FACTOR`], by which estimated correlations are multiplied for
/// the least mean square error, given the number of independent windows that they were estimated
/// from (Schäfer and Strimmer 2005, doi 10.2202/1544-6115.1175). It is computed from the pairs of
/// channels that `among` accepts.
///
/// From [ample](AMPLE_WINDOWS) windows the factor is nearly one: channels whose noise is almost the
/// same determine most by their difference, and would lose that with a factor one percent smaller.
pub(crate) fn shrinkage_factor(
    correlation: &DMatrix<f64>,
    independent: f64,
    among: impl Fn(usize, usize) -> bool,
) -> f64 {
    if independent >= AMPLE_WINDOWS * correlation.nrows() as f64 {
        return MAX_FACTOR;
    }
    let (mut variances, mut squares) = (0.0, 0.0);
    for i in 0..correlation.nrows() {
        for j in (0..i).filter(|&j| among(i, j)) {
            let square = correlation[(i, j)] * correlation[(i, j)];
            variances += (1.0 - square).powi(2) / independent;
            squares += square;
        }
    }
    if squares > 0.0 {
        (1.0 - variances / squares).max(0.0)
    } else {
        0.0
    }
}
