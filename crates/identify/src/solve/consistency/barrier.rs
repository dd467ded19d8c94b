//! The barrier of the pseudo-inertia and of linear bounds, with its derivatives.

use std::ops::{Add, Mul, Sub};

use tactid_dynamics::InertialParameters;

use super::super::subspace::{Matrix, Vector};

/// Number of barriers of the pseudo-inertia: the degree of its determinant.
pub(super) const PSEUDO_INERTIA_BARRIERS: usize = 4;

/// The set of physically consistent parameters whose products with some rows are not negative
/// either.
#[derive(Clone, Debug, Default)]
pub(super) struct ConsistentSet {
    pub(super) bounds: Vec<Vector>,
}

impl ConsistentSet {
    /// Returns the log of the determinant of the pseudo-inertia, plus those of the slacks of the
    /// bounds; `None` outside the set.
    pub(super) fn log_barrier(&self, at: &Vector) -> Option<f64> {
        let pseudo = InertialParameters::from_vector(*at).pseudo_inertia();
        let mut barrier = pseudo.cholesky()?.determinant().ln();
        for bound in &self.bounds {
            let slack = bound.dot(at);
            if slack <= 0.0 {
                return None;
            }
            barrier += slack.ln();
        }
        Some(barrier)
    }

    /// Returns the gradient of the [log barrier](Self::log_barrier), and its curvature with the
    /// opposite sign, which is positive.
    pub(super) fn derivatives(&self, at: &Vector) -> Option<(Vector, Matrix)> {
        let pseudo = InertialParameters::from_vector(*at).pseudo_inertia();
        let inverse = pseudo.cholesky()?.inverse();
        // Derivatives of the log of the determinant: tr(P⁻¹ dP) and -tr(P⁻¹ dP P⁻¹ dP).
        let mut gradient = Vector::from(traces(|i, j| inverse[(i, j)]));
        let mut curvature = Matrix::from_columns(&traces(|a, b| {
            let (a, b) = (inverse.column(a), inverse.column(b));
            Vector::from(traces(|i, j| 0.5 * (a[i] * b[j] + b[i] * a[j])))
        }));
        for bound in &self.bounds {
            let relative = bound / bound.dot(at);
            gradient += relative;
            curvature += relative * relative.transpose();
        }
        Some((gradient, curvature))
    }
}

/// Returns for each parameter the trace of a symmetric matrix, given by its entries, times the
/// derivative of the pseudo-inertia with respect to the parameter.
fn traces<T>(entry: impl Fn(usize, usize) -> T) -> [T; 10]
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
{
    let diagonal = [entry(0, 0), entry(1, 1), entry(2, 2)];
    let half = (diagonal[0] + diagonal[1] + diagonal[2]) * 0.5;
    [
        entry(3, 3),
        entry(0, 3) * 2.0,
        entry(1, 3) * 2.0,
        entry(2, 3) * 2.0,
        half - diagonal[0],
        entry(0, 1) * -2.0,
        entry(0, 2) * -2.0,
        half - diagonal[1],
        entry(1, 2) * -2.0,
        half - diagonal[2],
    ]
}
