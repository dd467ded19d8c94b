//! Uncertainty of mass, centre of mass and inertia from the covariance of the linear parameters.

use nalgebra::RowSVector;
use tactid_dynamics::InertialParameters;

use super::subspace::{Matrix, NullSpace, Vector};
use crate::result::{KINDS, values};

/// Largest relative standard deviation of the mass with which quantities that are divided by the mass are
/// reported: beyond, they are far from linear in the parameters.
const MASS_KNOWN: f64 = 0.25;

/// Half width of a 95 % interval, in standard deviations.
pub const HALF_WIDTH_95: f64 = 1.96;

/// Returns the ten values that a user reads, of linear parameters; `None` for a mass of zero.
pub(crate) fn values_of(parameters: &Vector) -> Option<[f64; 10]> {
    let body = InertialParameters::from_vector(*parameters).mass_properties()?;
    Some(values(&body))
}

/// The entries of a symmetric matrix, in the order of the ten values.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Returns the derivatives of the ten values with respect to the linear parameters, a row for each value;
/// `None` for a mass of zero.
pub(crate) fn jacobian(parameters: &Vector) -> Option<Matrix> {
    let mass = parameters[0];
    if mass == 0.0 {
        return None;
    }
    let mut jacobian = Matrix::identity();
    let first = parameters.fixed_rows::<3>(1);
    // a = h / m
    for axis in 0..3 {
        jacobian[(1 + axis, 0)] = -first[axis] / (mass * mass);
        jacobian[(1 + axis, 1 + axis)] = 1.0 / mass;
    }
    // I = I_o - (|h|² E - h hᵀ) / m: the theorem of Huygens and Steiner
    let square = first.norm_squared();
    for (entry, (a, b)) in ENTRIES.into_iter().enumerate() {
        let diagonal = f64::from(a == b);
        let steiner = square * diagonal - first[a] * first[b];
        jacobian[(4 + entry, 0)] = steiner / (mass * mass);
        for k in 0..3 {
            let slope = 2.0 * first[k] * diagonal
                - f64::from(k == a) * first[b]
                - f64::from(k == b) * first[a];
            jacobian[(4 + entry, 1 + k)] = -slope / mass;
        }
    }
    Some(jacobian)
}

/// Returns the standard deviations of the ten values by linear error propagation, each in its unit. They are
/// infinite for a value that the motion does not determine.
pub(crate) fn std_devs(
    parameters: &Vector,
    covariance: &Matrix,
    null_space: &NullSpace,
) -> [f64; 10] {
    let Some(jacobian) = jacobian(parameters) else {
        return [f64::INFINITY; 10];
    };
    let mut std_devs: [f64; 10] =
        std::array::from_fn(|k| std_dev(&jacobian.row(k).into(), covariance, null_space));
    if std_devs[0] > MASS_KNOWN * parameters[0].abs() {
        std_devs[1..].fill(f64::INFINITY);
    }
    std_devs
}

/// Returns the standard deviation of a quantity with this gradient in the parameters, infinite where the
/// motion does not determine it.
pub(crate) fn std_dev(
    gradient: &RowSVector<f64, 10>,
    covariance: &Matrix,
    null_space: &NullSpace,
) -> f64 {
    if !null_space.determines(gradient) {
        return f64::INFINITY;
    }
    // Most derivatives are zero.
    let pairs = gradient.iter().zip(covariance.column_iter());
    let product: Vector = pairs
        .filter(|(slope, _)| **slope != 0.0)
        .map(|(slope, column)| column * *slope)
        .sum();
    (gradient * product)[0].max(0.0).sqrt()
}

/// Returns whether each value is identifiable: half of its 95 % interval is less than the largest value of its
/// kind.
pub(crate) fn identifiable(values: &[f64; 10], std_devs: &[f64; 10]) -> [bool; 10] {
    let mut identifiable = [false; 10];
    let largest = largest_of_kind(values);
    for k in 0..10 {
        let half_width = HALF_WIDTH_95 * std_devs[k];
        identifiable[k] = half_width < largest[k] || half_width == 0.0;
    }
    identifiable
}

/// Returns for each value the largest magnitude of its kind (mass, centre of mass, inertia), to which its
/// interval is compared. Many values are zero by symmetry, so that a relative error would be meaningless.
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
    use nalgebra::SVector;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    /// The derivatives agree with central differences of the values, at random bodies.
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
