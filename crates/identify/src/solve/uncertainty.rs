//! What the covariance of the linear parameters says of mass, centre of mass and inertia.

use nalgebra::{RowSVector, SMatrix, SVector};
use tactid_dynamics::InertialParameters;

use crate::result::{KINDS, values};

/// A value is not known where more than this part of it (of its square) lies in unknown directions.
const SHARE: f64 = 1e-3;

/// What is divided by the mass is known only where the mass is, to this part of it: beyond, it is far
/// from linear in what was estimated.
const MASS_KNOWN: f64 = 0.25;

/// Half the width of a 95 % interval, in standard deviations.
pub const HALF_WIDTH_95: f64 = 1.96;

/// The ten values that a user reads, of linear parameters; `None` without mass.
pub(crate) fn values_of(parameters: &SVector<f64, 10>) -> Option<[f64; 10]> {
    let body = InertialParameters::from_vector(*parameters).mass_properties()?;
    Some(values(&body))
}

/// The entries of a symmetric matrix, in the order of the ten values.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Derivatives of the ten values after the linear parameters, each row one value; `None` without mass.
pub(crate) fn jacobian(parameters: &SVector<f64, 10>) -> Option<SMatrix<f64, 10, 10>> {
    let mass = parameters[0];
    if mass == 0.0 {
        return None;
    }
    let mut jacobian = SMatrix::<f64, 10, 10>::identity();
    let first = parameters.fixed_rows::<3>(1);
    // a = h / m
    for axis in 0..3 {
        jacobian[(1 + axis, 0)] = -first[axis] / (mass * mass);
        jacobian[(1 + axis, 1 + axis)] = 1.0 / mass;
    }
    // I = I_o - (|h|² E - h hᵀ) / m
    let square = first.norm_squared();
    for (entry, (a, b)) in ENTRIES.into_iter().enumerate() {
        let diagonal = f64::from(a == b);
        let moved = square * diagonal - first[a] * first[b];
        jacobian[(4 + entry, 0)] = moved / (mass * mass);
        for k in 0..3 {
            let slope = 2.0 * first[k] * diagonal
                - f64::from(k == a) * first[b]
                - f64::from(k == b) * first[a];
            jacobian[(4 + entry, 1 + k)] = -slope / mass;
        }
    }
    Some(jacobian)
}

/// Standard deviations of the ten values; infinite for one that the motion did not determine.
///
/// `unknown` are unit vectors in the parameters, each divided by its scale.
pub(crate) fn std_devs(
    parameters: &SVector<f64, 10>,
    covariance: &SMatrix<f64, 10, 10>,
    scales: &SVector<f64, 10>,
    unknown: impl Iterator<Item = SVector<f64, 10>>,
) -> [f64; 10] {
    let Some(jacobian) = jacobian(parameters) else {
        return [f64::INFINITY; 10];
    };
    // Each is needed for each value.
    let mut directions = [SVector::zeros(); 10];
    let places = directions.iter_mut().zip(unknown);
    let count = places.map(|(place, direction)| *place = direction).count();
    let mut std_devs: [f64; 10] = std::array::from_fn(|k| {
        let unknown = directions[..count].iter().copied();
        std_dev(&jacobian.row(k).into(), covariance, scales, unknown)
    });
    if std_devs[0] > MASS_KNOWN * parameters[0].abs() {
        std_devs[1..].fill(f64::INFINITY);
    }
    std_devs
}

/// Standard deviation of a quantity with these derivatives after the parameters; infinite where the
/// motion did not determine it.
pub(crate) fn std_dev(
    slope: &RowSVector<f64, 10>,
    covariance: &SMatrix<f64, 10, 10>,
    scales: &SVector<f64, 10>,
    unknown: impl Iterator<Item = SVector<f64, 10>>,
) -> f64 {
    let scaled = slope.component_mul(&scales.transpose());
    let unknown: f64 = unknown
        .map(|direction| (scaled * direction)[0].powi(2))
        .sum();
    if unknown > SHARE * scaled.norm_squared() {
        f64::INFINITY
    } else {
        // Most derivatives are zero.
        let pairs = slope.iter().zip(covariance.column_iter());
        let pulled: SVector<f64, 10> = pairs
            .filter(|(slope, _)| **slope != 0.0)
            .map(|(slope, column)| column * *slope)
            .sum();
        (slope * pulled)[0].max(0.0).sqrt()
    }
}

/// A value counts as identifiable when its 95 % interval is narrower than the largest of its kind.
pub(crate) fn identifiable(values: &[f64; 10], std_devs: &[f64; 10]) -> [bool; 10] {
    let mut known = [false; 10];
    let largest = largest_of_kind(values);
    for k in 0..10 {
        let half_width = HALF_WIDTH_95 * std_devs[k];
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

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    /// The derivatives are those of the values, by central differences at random bodies.
    #[test]
    fn jacobian_is_the_derivative() {
        let mut random = SmallRng::seed_from_u64(1);
        for _ in 0..100 {
            let mut parameters = SVector::<f64, 10>::from_fn(|_, _| random.random_range(-1.0..1.0));
            parameters[0] = random.random_range(0.5..2.0);
            let jacobian = jacobian(&parameters).unwrap();
            for k in 0..10 {
                let at = |step: f64| {
                    let mut moved = parameters;
                    moved[k] += step;
                    SVector::from(values_of(&moved).unwrap())
                };
                let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((slope - jacobian.column(k)).norm() < 1e-7, "{k}: {slope}");
            }
        }
        assert!(super::jacobian(&SVector::zeros()).is_none());
    }
}
