//! Uncertainty of mass, centre of mass and inertia from the covariance of the linear parameters.

use nalgebra::RowSVector;
use tactid_dynamics::InertialParameters;
pub use tactid_dynamics::words::HALF_WIDTH_95;

use super::subspace::{Matrix, NullSpace, Vector};
use crate::result::{KINDS, Observability, values_of_body};

/// Largest relative standard deviation of a mass that is known. Beyond, quantities that are divided
/// by it are far from linear in the parameters, and are not reported.
const MASS_KNOWN: f64 = 0.25;

/// Returns whether a mass with this standard deviation is known.
#[must_use]
pub fn is_mass_known(mass: f64, std_dev: f64) -> bool {
    std_dev <= MASS_KNOWN * mass.abs()
}

/// Returns the ten values that a user reads, of linear parameters; `None` for a mass of zero.
pub fn values_of(parameters: &Vector) -> Option<[f64; 10]> {
    let body = InertialParameters::from_vector(*parameters).mass_properties()?;
    Some(values_of_body(&body))
}

/// The entries of a symmetric matrix, in the order of the ten values.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Returns the derivatives of the ten values of [`VALUE_NAMES`](crate::VALUE_NAMES) with respect to
/// the linear parameters, a row for each value; `None` for a mass of zero.
#[must_use]
pub fn value_jacobian(parameters: &Vector) -> Option<Matrix> {
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

/// Standard deviations of the ten values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueStdDevs {
    /// Standard deviation of each value, in its unit; infinite where it is not observable, or
    /// divided by a mass that is known too badly.
    pub std_devs: [f64; 10],
    /// Whether the observable directions determine each value, however uncertain it is.
    pub observable: [bool; 10],
}

impl ValueStdDevs {
    /// Standard deviations of values of which nothing is known.
    pub const UNKNOWN: Self = Self {
        std_devs: [f64::INFINITY; 10],
        observable: [false; 10],
    };
}

/// Returns the standard deviations of the ten values by linear error propagation. For a mass of
/// zero nothing is known.
pub fn std_devs(parameters: &Vector, covariance: &Matrix, null_space: &NullSpace) -> ValueStdDevs {
    let Some(jacobian) = value_jacobian(parameters) else {
        return ValueStdDevs::UNKNOWN;
    };
    let mut std_devs: [f64; 10] =
        std::array::from_fn(|k| std_dev(&jacobian.row(k).into(), covariance, null_space));
    let observable = std_devs.map(f64::is_finite);
    if !is_mass_known(parameters[0], std_devs[0]) {
        std_devs[1..].fill(f64::INFINITY);
    }
    ValueStdDevs {
        std_devs,
        observable,
    }
}

/// Number of standard deviations that an error should exceed once in a million estimates. A normal
/// variable does so at [`RARE_NORMAL`]; the rest is a margin for what is not normal.
const COVERED: f64 = 6.0;

/// Two-sided quantile of the standard normal distribution that is exceeded once in a million.
const RARE_NORMAL: f64 = 4.892;

/// Largest factor by which the standard deviation of a quotient is widened. It is reached where the
/// mass is known to a fifth; from there to the limit at which quotients are reported at all, six
/// standard deviations are exceeded with a probability of 5e-5.
const MAX_WIDENING: f64 = 20.0;

/// Returns standard deviations of the ten values of an estimate that is not known well yet, such
/// that an error of six of them remains as rare as once in a million. They are the `linear` ones
/// where the mass is known to 3.7 %, the inertia is far from the least that a body with this
/// uncertainty of its centre of mass can have, and `reported` is the estimate itself.
///
/// - Centre of mass and inertia are divided by the mass `m`. With the error `z s` of the mass, the
///   error of a quotient in units of its linear standard deviation is `z m / (m - z s)`, which for
///   the rare `z` stays below six only where `m / s` is above 26.5.
/// - The inertia about the centre of mass contains its square. Second order adds `m |δ|²` for the
///   error `δ` of the centre of mass, whose square in a plane is rarely above `28 s²`.
/// - `reported` may differ from the estimate, as the tracked projection does while it approaches. A
///   difference `d` adds the variance `d² / 12`: `d + z s` is then below `6 √(s² + d² / 12)` for
///   each `z` up to `√24 = 4.899`.
pub(crate) fn widened(estimate: &[f64; 10], reported: &[f64; 10], linear: &[f64; 10]) -> [f64; 10] {
    let mass = estimate[0].abs();
    let signal = mass / linear[0].max(f64::MIN_POSITIVE);
    let quotient = if signal > RARE_NORMAL {
        RARE_NORMAL / COVERED * signal / (signal - RARE_NORMAL)
    } else {
        f64::INFINITY
    };
    let quotient = quotient.clamp(1.0, MAX_WIDENING);
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

/// Returns the factor by which a standard deviation that was itself estimated with so many degrees
/// of freedom must be widened, so that six of it are exceeded once in a million: Student's
/// quantile, as Wallace (1959, Annals of Mathematical Statistics 30, 1124) approximates it, over
/// six; one from 34 degrees of freedom on.
pub fn students_widening(freedom: f64) -> f64 {
    let freedom = freedom.max(1.0);
    let normal = RARE_NORMAL * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    let student = (freedom * (normal * normal / freedom).exp_m1()).sqrt();
    (student / COVERED).max(1.0)
}

/// Returns the standard deviation of a quantity with this gradient in the parameters, infinite
/// where the motion does not determine it.
pub fn std_dev(gradient: &RowSVector<f64, 10>, covariance: &Matrix, null_space: &NullSpace) -> f64 {
    if null_space.directions().is_empty() {
        propagated(gradient, covariance)
    } else if null_space.determines(gradient) {
        propagated(gradient, &(covariance + null_space.hidden()))
    } else {
        f64::INFINITY
    }
}

/// Returns the standard deviation of a quantity with this gradient in the parameters; infinite
/// where a variance of a parameter that it depends on is.
pub fn propagated(gradient: &RowSVector<f64, 10>, covariance: &Matrix) -> f64 {
    // Most derivatives are zero, and so do not count.
    let pairs = gradient.iter().zip(covariance.column_iter());
    let product: Vector = pairs
        .filter(|(slope, _)| **slope != 0.0)
        .map(|(slope, column)| column * *slope)
        .sum();
    (gradient * product)[0].max(0.0).sqrt()
}

/// Returns the observability of each value, given its standard deviation and whether the motion
/// excites it: it is identifiable where 1.96 standard deviations are less than the largest value of
/// its kind, and the mass only where it is known to a quarter.
pub(crate) fn observability(
    values: &[f64; 10],
    std_devs: &[f64; 10],
    observable: &[bool; 10],
) -> [Observability; 10] {
    let largest = largest_of_kind(values);
    std::array::from_fn(|k| {
        let half_width = HALF_WIDTH_95 * std_devs[k];
        let is_narrow = half_width < largest[k] || half_width == 0.0;
        if is_narrow && (k > 0 || is_mass_known(values[0], std_devs[0])) {
            Observability::Identifiable
        } else if observable[k] {
            Observability::Uncertain
        } else {
            Observability::Unobservable
        }
    })
}

/// Returns for each value the largest magnitude of its kind (mass, centre of mass, inertia), to
/// which its interval is compared. Many values are zero by symmetry, so that a relative error would
/// be meaningless.
#[must_use]
pub fn largest_of_kind(values: &[f64; 10]) -> [f64; 10] {
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

    /// A mass is identifiable where what is divided by it is reported, and not as long as its
    /// interval just excludes zero.
    #[test]
    fn a_mass_is_identifiable_where_it_is_known_to_a_quarter() {
        let mut parameters = Vector::zeros();
        parameters[0] = -0.72;
        let no_null_space = NullSpace::new(Vector::repeat(1.0), std::iter::empty());
        for std_dev in [0.0, 0.17, 0.19, 0.36, 0.4] {
            let covariance = Matrix::from_diagonal_element(f64::powi(std_dev, 2));
            let found = super::std_devs(&parameters, &covariance, &no_null_space);
            let mut values = [0.0; 10];
            values[0] = parameters[0];
            let observability = observability(&values, &found.std_devs, &found.observable);
            let is_identifiable = observability[0] == Observability::Identifiable;
            assert_eq!(is_identifiable, std_dev < 0.18, "{std_dev}");
            assert_eq!(is_identifiable, found.std_devs[1].is_finite(), "{std_dev}");
        }
    }

    /// The derivatives agree with central differences of the values, at random bodies.
    #[test]
    fn jacobian_is_the_derivative() {
        let mut random = SmallRng::seed_from_u64(1);
        for _ in 0..100 {
            let mut parameters = SVector::<f64, 10>::from_fn(|_, _| random.random_range(-1.0..1.0));
            parameters[0] = random.random_range(0.5..2.0);
            let jacobian = value_jacobian(&parameters).unwrap();
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
        assert!(super::value_jacobian(&SVector::zeros()).is_none());
    }
}
