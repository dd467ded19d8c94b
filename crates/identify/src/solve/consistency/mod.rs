//! Projection of an estimate onto physically consistent parameters.
//!
//! Parameters are physically consistent where some distribution of positive mass has them: the
//! pseudo-inertia, a 4x4 matrix that is linear in the parameters, has no negative eigenvalue
//! (Wensing, Kim and Slotine 2018, doi 10.1109/LRA.2017.2729659). The projection of an estimate
//! `π̂` minimises `½ (π - π̂)ᵀ Σ⁻¹ (π - π̂)` over these parameters: the nearest body in units of
//! the uncertainty.
//!
//! It is computed by an interior-point method: Newton's method on the distance plus a barrier,
//! minus `μ` times the log of the pseudo-inertia's determinant and of the slack of each bound (Boyd
//! and Vandenberghe 2004, Convex Optimization, 11.3). The minimum for a barrier weight `μ` is
//! within `μ` times the number of barriers (4 for the determinant) of the least value, and always
//! inside the set.
//!
//! [`project`] computes it for an estimate with a box, and [`ProjectionTracker`] follows an
//! estimate in the control loop.

mod barrier;
mod newton;
mod tracker;

use nalgebra::{SVector, SymmetricEigen, Vector3};
use tactid_dynamics::InertialParameters;

use self::barrier::{ConsistentSet, PSEUDO_INERTIA_BARRIERS};
use self::newton::{Objective, solve};
pub(crate) use self::tracker::ProjectionTracker;
use super::subspace::{Matrix, VARIANCE_RATIO, Vector};
use crate::prior::BoundingBox;

/// Standard deviation of an unobservable direction, in [`units`] of the estimate: far beyond any
/// body of its size.
const UNOBSERVABLE_STD_DEV: f64 = 1e3;

/// Least standard deviation of an observable direction, in [`units`] of the estimate: a hundredth
/// of that of an exact known mass. Estimates that are more precise are exact but for rounding.
const MIN_STD_DEV: f64 = 1e-11;

/// Physically consistent parameters near an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Parameters of the consistent body, in the order of `InertialParameters`.
    pub parameters: Vector,
    /// Mahalanobis distance from the estimate, in standard deviations.
    pub distance: f64,
}

/// Projects an estimate onto the parameters of physically consistent bodies that fit into a box, if
/// there is one.
///
/// A consistent estimate is returned unchanged. `None` where the mass is not positive: then no body
/// is near. In unobservable directions the result moves freely. `scales` are units of the
/// parameters in which their standard deviations are of similar size, so that small variances are
/// distinguished from unobservable directions. Cost: some 0.1 ms.
pub fn project(
    estimate: &Vector,
    covariance: &Matrix,
    scales: &Vector,
    bounding_box: Option<&BoundingBox>,
) -> Option<Projection> {
    let body = InertialParameters::from_vector(*estimate);
    if body.mass() <= 0.0 || !estimate.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let bounds = bounding_box.map_or(vec![], |bounding| bounding.bounds().to_vec());
    if body.is_physical() && bounds.iter().all(|bound| bound.dot(estimate) >= 0.0) {
        return Some(Projection {
            parameters: *estimate,
            distance: 0.0,
        });
    }
    let units = units(estimate);
    let (problem, start) = whitened_problem(estimate, covariance, scales, &units, bounding_box)?;
    let barriers = PSEUDO_INERTIA_BARRIERS + bounds.len();
    let inside = solve(&problem, start, barriers);
    Some(Projection {
        parameters: problem.parameters(&inside).component_mul(&units),
        distance: inside.norm(),
    })
}

/// Returns the problem of an estimate of positive mass with a start inside the set; `None` where the
/// covariance is singular.
fn whitened_problem(
    estimate: &Vector,
    covariance: &Matrix,
    scales: &Vector,
    units: &Vector,
    bounding_box: Option<&BoundingBox>,
) -> Option<(WhitenedProblem, Vector)> {
    let target = estimate.component_div(units);
    let (basis, unobservable) = standard_deviations(covariance, scales, units);
    let (bounds, start) = match bounding_box {
        Some(bounding) => {
            let bounds = bounding.bounds();
            let rows = bounds.iter().map(|bound| bound.component_mul(units));
            let filled = bounding.filled(estimate[0]);
            (rows.collect(), filled.as_vector().component_div(units))
        }
        None => (vec![], interior_start(&target)),
    };
    let start = basis.lu().solve(&(start - target))?;
    let problem = WhitenedProblem {
        target,
        basis,
        unobservable,
        set: ConsistentSet { bounds },
    };
    Some((problem, start))
}

/// The nearest consistent parameters, in coordinates in which the distance is the Euclidean one.
///
/// Precise and unobservable directions differ in their standard deviations by more than the digits
/// of a number. A matrix of their information would be rounding, and in these coordinates it is the
/// identity.
struct WhitenedProblem {
    /// The estimate, divided by units: the origin of the coordinates.
    target: Vector,
    /// Standard deviations of the estimate in orthogonal directions, the columns, divided by units.
    basis: Matrix,
    /// 1 for the coordinates of unobservable directions, and 0 for the others.
    unobservable: Vector,
    set: ConsistentSet,
}

impl WhitenedProblem {
    /// Returns the parameters, divided by units.
    fn parameters(&self, at: &Vector) -> Vector {
        self.target + self.basis * at
    }
}

impl Objective for WhitenedProblem {
    fn distance(&self, at: &Vector) -> f64 {
        0.5 * at.norm_squared()
    }

    /// The unobservable coordinates are part of the barrier, too, which would otherwise move the
    /// parameters to bodies of any size while its weight is large.
    fn value(&self, at: &Vector, weight: f64) -> Option<f64> {
        let barrier = self.set.log_barrier(&self.parameters(at))?;
        let unobservable = at.component_mul(&self.unobservable).norm_squared();
        Some(self.distance(at) - weight * (barrier - 0.5 * unobservable))
    }

    fn newton_step(&self, at: &Vector, weight: f64) -> Option<(Vector, f64)> {
        let (barrier, curvature) = self.set.derivatives(&self.parameters(at))?;
        let metric = Vector::repeat(1.0) + weight * self.unobservable;
        let gradient = at.component_mul(&metric) - weight * self.basis.tr_mul(&barrier);
        let curvature = self.basis.tr_mul(&(curvature * self.basis));
        let hessian = Matrix::from_diagonal(&metric) + weight * curvature;
        let step = -hessian.cholesky()?.solve(&gradient);
        Some((step, -gradient.dot(&step)))
    }
}

/// Returns units in which the parameters of an estimate are near one: its mass, and powers of the
/// size of a body with this mass, centre of mass and inertia.
fn units(estimate: &Vector) -> Vector {
    let mass = estimate[0];
    let trace = estimate[4].abs() + estimate[7].abs() + estimate[9].abs();
    let lever = estimate.fixed_rows::<3>(1).norm() / mass;
    let length = (trace / mass).sqrt().max(lever);
    // A point at the frame's origin has no size: any unit will do.
    let length = if (mass * length * length).is_normal() {
        length
    } else {
        1.0
    };
    let moment = mass * length;
    let inertia = moment * length;
    SVector::from_fn(|k, _| match k {
        0 => mass,
        1..=3 => moment,
        _ => inertia,
    })
}

/// Returns the standard deviations of an estimate in orthogonal directions as the columns of a
/// matrix, divided by units, and a vector with 1 for those that are unobservable. These are without
/// variance in scaled parameters, and get the standard deviation [`UNOBSERVABLE_STD_DEV`].
fn standard_deviations(covariance: &Matrix, scales: &Vector, units: &Vector) -> (Matrix, Vector) {
    let scaled = Matrix::from_fn(|i, j| covariance[(i, j)] / (scales[i] * scales[j]));
    let eigen = SymmetricEigen::new(scaled);
    let largest = eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
    let in_units = |direction: Vector| direction.component_mul(scales).component_div(units);
    let mut columns = Matrix::zeros();
    let mut unobservable = Vector::zeros();
    for (k, &variance) in eigen.eigenvalues.iter().enumerate() {
        let direction = in_units(eigen.eigenvectors.column(k).into());
        if variance > VARIANCE_RATIO * largest {
            let factor = variance.sqrt().max(MIN_STD_DEV / direction.norm());
            columns.set_column(k, &(direction * factor));
        } else {
            unobservable[k] = 1.0;
            columns.set_column(k, &direction);
        }
    }
    orthogonalise(&mut columns, &unobservable);
    (columns, unobservable)
}

/// Makes the columns of unobservable directions orthogonal, with the length
/// [`UNOBSERVABLE_STD_DEV`]. They are arbitrary in scaled parameters, and can be almost parallel in
/// others.
///
/// The steps of Gram and Schmidt keep the small rows accurate beside those of parameters with huge
/// scales.
fn orthogonalise(columns: &mut Matrix, unobservable: &Vector) {
    for k in 0..10 {
        let mut direction = columns.column(k).into_owned();
        for before in (0..k).filter(|&before| unobservable[before] > 0.0) {
            let other = columns.column(before) / UNOBSERVABLE_STD_DEV;
            direction -= other * other.dot(&direction);
        }
        if unobservable[k] > 0.0 {
            columns.set_column(k, &(direction.normalize() * UNOBSERVABLE_STD_DEV));
        }
    }
}

/// Returns consistent parameters with the mass and the first moments of an estimate, which are its
/// most precise ones: the eigenvalues of the second moments about the centre of mass are raised
/// above zero.
fn interior_start(target: &Vector) -> Vector {
    let mut pseudo = InertialParameters::from_vector(*target).pseudo_inertia();
    let first: Vector3<f64> = pseudo.fixed_view::<3, 1>(0, 3).into();
    let of_center = first * first.transpose() / pseudo[(3, 3)];
    let second = pseudo.fixed_view::<3, 3>(0, 0) - of_center;
    let mut eigen = SymmetricEigen::new(second);
    let least = 1e-2
        * eigen
            .eigenvalues
            .amax()
            .max(of_center.amax())
            .max(f64::EPSILON);
    eigen.eigenvalues.apply(|value| *value = value.max(least));
    let raised = eigen.recompose() + of_center;
    pseudo.fixed_view_mut::<3, 3>(0, 0).copy_from(&raised);
    *InertialParameters::from_pseudo_inertia(&pseudo).as_vector()
}

#[cfg(test)]
mod tests;
