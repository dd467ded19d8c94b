//! What the covariance of the linear parameters says of mass, centre of mass and inertia.

use nalgebra::{RowSVector, SMatrix, SVector};
use tactid_dynamics::InertialParameters;

use crate::estimate::{KINDS, values};
use crate::fit::Directions;

/// A value is not known where more than this part of it (of its square) lies in unknown directions.
const SHARE: f64 = 1e-3;

/// Half the width of a 95 % interval, in standard deviations.
pub(crate) const HALF_WIDTH_95: f64 = 1.96;

/// The ten values that a user reads, of linear parameters; `None` without mass.
pub(crate) fn values_of(parameters: &SVector<f64, 10>) -> Option<[f64; 10]> {
    let body = InertialParameters::from_vector(*parameters).mass_properties()?;
    Some(values(&body))
}

/// Derivatives of the ten values after the linear parameters, each row one value.
pub(crate) fn jacobian(parameters: &SVector<f64, 10>) -> Option<SMatrix<f64, 10, 10>> {
    let mut jacobian = SMatrix::<f64, 10, 10>::zeros();
    // The values are polynomials over the mass, so central differences are right to 1e-9 or so.
    let mass = parameters[0].abs();
    let arm = parameters.fixed_rows::<3>(1).norm() / mass;
    for k in 0..10 {
        let step = 1e-5
            * match k {
                0 => mass,
                1..=3 => mass * arm.max(1e-3),
                _ => 1.0,
            };
        let at = |sign: f64| {
            let mut moved = *parameters;
            moved[k] += sign * step;
            values_of(&moved).map(SVector::from)
        };
        let slope = (at(1.0)? - at(-1.0)?) / (2.0 * step);
        jacobian.set_column(k, &slope);
    }
    Some(jacobian)
}

/// Standard deviations of the ten values; infinite for one that the motion did not determine.
pub(crate) fn deviations(
    parameters: &SVector<f64, 10>,
    covariance: &SMatrix<f64, 10, 10>,
    directions: &Directions,
) -> [f64; 10] {
    let Some(jacobian) = jacobian(parameters) else {
        return [f64::INFINITY; 10];
    };
    std::array::from_fn(|k| deviation(&jacobian.row(k).into(), covariance, directions))
}

/// Standard deviation of a quantity with these derivatives after the parameters; infinite where the
/// motion did not determine it.
pub(crate) fn deviation(
    slope: &RowSVector<f64, 10>,
    covariance: &SMatrix<f64, 10, 10>,
    directions: &Directions,
) -> f64 {
    let scaled = slope.component_mul(&directions.scales.transpose());
    let unknown: f64 = directions
        .unknown()
        .map(|direction| (scaled * direction)[0].powi(2))
        .sum();
    if unknown > SHARE * scaled.norm_squared() {
        f64::INFINITY
    } else {
        (slope * covariance * slope.transpose())[0].max(0.0).sqrt()
    }
}

/// A value counts as identifiable when its 95 % interval is narrower than the largest of its kind.
pub(crate) fn identifiable(values: &[f64; 10], deviations: &[f64; 10]) -> [bool; 10] {
    let mut known = [false; 10];
    let largest = largest_of_kind(values);
    for k in 0..10 {
        let half_width = HALF_WIDTH_95 * deviations[k];
        known[k] = half_width < largest[k] || half_width == 0.0;
    }
    known
}

/// For each value the largest of its kind, of mass, centre of mass and inertia: what its interval is
/// compared with. Many a value is zero by symmetry, and no part of zero is a measure.
pub(crate) fn largest_of_kind(values: &[f64; 10]) -> [f64; 10] {
    let mut largest = [0.0; 10];
    for kind in KINDS {
        let of_kind = values[kind.clone()].iter();
        largest[kind].fill(of_kind.fold(0.0, |a, b| f64::max(a, b.abs())));
    }
    largest
}
