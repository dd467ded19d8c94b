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

/// Six standard deviations are meant to be exceeded once in a million estimates. Of a normal variable,
/// [`RARE_NORMAL`] are: the rest is left for what is not normal.
const COVERED: f64 = 6.0;

/// The two-sided quantile of the standard normal distribution that is exceeded once in a million.
const RARE_NORMAL: f64 = 4.892;

/// Deviations of quotients are widened by no more than this factor, which they reach where the mass is
/// known to a fifth: up to [`MASS_KNOWN`], six of them are then exceeded with a probability of 5e-5.
const WIDEST: f64 = 20.0;

/// Standard deviations of the ten values at an estimate that is not yet known well, such that an error
/// of six of them remains as rare as once in a million. Where the mass is known to 3.7 %, the inertia is
/// far from the least that a body with this uncertainty of its centre of mass can have, and `reported` is
/// the estimate itself, they are the [linear ones](deviations).
///
/// - Centre of mass and inertia are divided by the mass `m`. With the error `z s` of the mass the error of a
///   quotient in units of its linear deviation is `z m / (m - z s)`, which for the rare `z` stays below
///   six only where `m / s` is above 26.5.
/// - The inertia about the centre of mass contains its square. Second order adds `m |δ|²` for the error `δ`
///   of the centre of mass, whose square in a plane is rarely above `28 s²`.
/// - `reported` may differ from the estimate, as the nearest consistent body does while it is approached.
///   A difference `d` adds the variance `d² / 12`: `d + z s` is then below `6 √(s² + d² / 12)` for each
///   `z` up to `√24 = 4.899`.
pub(crate) fn widened(estimate: &[f64; 10], reported: &[f64; 10], linear: &[f64; 10]) -> [f64; 10] {
    let mass = estimate[0].abs();
    let known = mass / linear[0].max(f64::MIN_POSITIVE);
    let quotient = if known > RARE_NORMAL {
        RARE_NORMAL / COVERED * known / (known - RARE_NORMAL)
    } else {
        f64::INFINITY
    };
    let quotient = quotient.clamp(1.0, WIDEST);
    let of_center = linear[1..4].iter().fold(0.0, |a, &b| f64::max(a, b)) * quotient;
    // 4.892 s + 28 c ≤ 6 √(s² + (8 c)²).
    let second_order = 8.0 * mass * of_center * of_center;
    std::array::from_fn(|k| {
        let of_estimate = match k {
            0 => linear[0],
            1..=3 => linear[k] * quotient,
            _ => (linear[k] * quotient).hypot(second_order),
        };
        let difference = reported[k] - estimate[k];
        of_estimate.hypot(difference / 12f64.sqrt())
    })
}

/// By how much a standard deviation that was itself estimated with so many degrees of freedom is to be
/// larger, for six of it to be exceeded once in a million: Student's quantile, as Wallace (1959, Annals of
/// Mathematical Statistics 30, 1124) approximates it, over six; one from 34 degrees of freedom on.
pub(crate) fn students_widening(freedom: f64) -> f64 {
    let freedom = freedom.max(1.0);
    let normal = RARE_NORMAL * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    let student = (freedom * (normal * normal / freedom).exp_m1()).sqrt();
    (student / COVERED).max(1.0)
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
