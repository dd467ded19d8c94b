//! The possible body that explains the data best.

use nalgebra::{Matrix4, SMatrix, SVector, SymmetricEigen};
use tactid_dynamics::InertialParameters;

type Parameters = SVector<f64, 10>;
type Information = SMatrix<f64, 10, 10>;

/// The barrier's weight falls by this factor once Newton's steps have become short.
const FALL: f64 = 0.05;

/// Half the squared length of a Newton step, in the barrier's own metric, that counts as short.
const SHORT: f64 = 0.05;

/// The result is this near to the least squared distance, relative to it.
const GAP: f64 = 1e-9;

/// More steps are never needed: each fall takes a few.
const MOST_STEPS: usize = 200;

/// Variances smaller than this part of the largest belong to directions that are unknown.
const UNKNOWN: f64 = 1e-13;

/// An unknown direction resists as if its deviation were this many times the largest known one.
const SLACK: f64 = 1e3;

/// A possible body near an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest {
    pub(crate) parameters: Parameters,
    /// From the estimate, in standard deviations.
    pub(crate) distance: f64,
}

/// The parameters of a possible body that are nearest to an estimate, in units of its uncertainty.
///
/// Least `½ (π - π̂)ᵀ Σ⁻¹ (π - π̂)` where the pseudo-inertia has no negative eigenvalue (Wensing, Kim and
/// Slotine 2018, doi 10.1109/LRA.2017.2729659), by an interior-point method: Newton's steps with a
/// barrier `-μ log det` (Boyd and Vandenberghe 2004, Convex Optimization, 11.3), which is within `4 μ` of
/// the least value, and always inside the set.
///
/// An estimate that is possible already stays as it is. `None` where the mass is not positive: no body
/// is near. In directions that are not known the result is free to follow. Some 0.1 ms.
pub(crate) fn nearest_possible(estimate: &Parameters, covariance: &Information) -> Option<Nearest> {
    let body = InertialParameters::from_vector(*estimate);
    if body.mass() <= 0.0 || !estimate.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    if body.is_physical() {
        return Some(Nearest {
            parameters: *estimate,
            distance: 0.0,
        });
    }
    let units = units(estimate);
    let wanted = estimate.component_div(&units);
    let information = information(covariance, &units);
    let mut inside = start(&wanted);
    let distance = |at: &Parameters| 0.5 * (information * (at - wanted)).dot(&(at - wanted));
    let value = |at: &Parameters, weight: f64| -> Option<f64> {
        let pseudo = InertialParameters::from_vector(*at).pseudo_inertia();
        let cholesky = pseudo.cholesky()?;
        Some(distance(at) - weight * cholesky.determinant().ln())
    };
    let mut weight = distance(&inside).max(f64::MIN_POSITIVE);
    for _ in 0..MOST_STEPS {
        // Rounding ends the path where the border is reached to the last digits.
        let Some((step, slope)) = newton_step(&inside, &wanted, &information, weight) else {
            break;
        };
        let Some(now) = value(&inside, weight) else {
            break;
        };
        // Backtracking: half as far until it is inside, and lower.
        let mut part = 1.0;
        while part > 1e-12 {
            let tried = inside + part * step;
            if value(&tried, weight).is_some_and(|there| there <= now - 0.1 * part * slope) {
                inside = tried;
                break;
            }
            part *= 0.5;
        }
        if slope < SHORT * weight || part <= 1e-12 {
            if 4.0 * weight < GAP * distance(&inside) {
                break;
            }
            weight *= FALL;
        }
    }
    Some(Nearest {
        parameters: inside.component_mul(&units),
        distance: (2.0 * distance(&inside)).sqrt(),
    })
}

/// Newton's step for the distance with the barrier, and how fast the value falls along it.
fn newton_step(
    inside: &Parameters,
    wanted: &Parameters,
    information: &Information,
    weight: f64,
) -> Option<(Parameters, f64)> {
    let pseudo = InertialParameters::from_vector(*inside).pseudo_inertia();
    let inverse = pseudo.cholesky()?.inverse();
    let relative: [Matrix4<f64>; 10] = std::array::from_fn(|k| {
        let unit = InertialParameters::from_vector(SVector::ith(k, 1.0));
        inverse * unit.pseudo_inertia()
    });
    let barrier = SVector::from_fn(|k, _| relative[k].trace());
    let gradient = information * (inside - wanted) - weight * barrier;
    let curvature = SMatrix::from_fn(|i, j| relative[i].dot(&relative[j].transpose()));
    let step = -(information + weight * curvature)
        .cholesky()?
        .solve(&gradient);
    Some((step, -gradient.dot(&step)))
}

/// By which each parameter is divided to be near one: the mass, and the size of a body of this mass
/// and inertia.
fn units(estimate: &Parameters) -> Parameters {
    let mass = estimate[0];
    let trace = estimate[4].abs() + estimate[7].abs() + estimate[9].abs();
    let length = (trace / mass).sqrt().max(1e-6);
    let moment = mass * length;
    let inertia = moment * length;
    SVector::from_fn(|k, _| match k {
        0 => mass,
        1..=3 => moment,
        _ => inertia,
    })
}

/// The inverse of the covariance in these units.
fn information(covariance: &Information, units: &Parameters) -> Information {
    let scaled = Information::from_fn(|i, j| covariance[(i, j)] / (units[i] * units[j]));
    let mut eigen = SymmetricEigen::new(scaled);
    let largest = eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
    eigen.eigenvalues.apply(|variance| {
        *variance = if *variance > UNKNOWN * largest {
            1.0 / *variance
        } else {
            1.0 / (largest * SLACK * SLACK)
        };
    });
    eigen.recompose()
}

/// A body inside the set: the estimate with its pseudo-inertia's eigenvalues brought above zero.
fn start(wanted: &Parameters) -> Parameters {
    let pseudo = InertialParameters::from_vector(*wanted).pseudo_inertia();
    let mut eigen = SymmetricEigen::new(pseudo);
    let least = 1e-2 * eigen.eigenvalues.amax();
    eigen.eigenvalues.apply(|value| *value = value.max(least));
    *InertialParameters::from_pseudo_inertia(&eigen.recompose()).as_vector()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    fn random_covariance(random: &mut SmallRng) -> Information {
        let root = SMatrix::<f64, 10, 10>::from_fn(|_, _| random.random_range(-1.0..1.0));
        root * root.transpose() * 0.01 + SMatrix::identity() * 1e-4
    }

    /// Far from any body, at random, with random covariances: the conditions of Karush, Kuhn and Tucker
    /// hold, which in a convex problem are those of the minimum. The gradient as a symmetric matrix
    /// has no negative eigenvalue, and is orthogonal to the pseudo-inertia.
    #[test]
    fn meets_the_conditions_of_the_minimum() {
        let mut random = SmallRng::seed_from_u64(1);
        let mut moved = 0;
        for _ in 0..300 {
            let mut estimate = SVector::from_fn(|_, _| random.random_range(-1.0..1.0));
            estimate[0] = random.random_range(0.5..2.0);
            let covariance = random_covariance(&mut random);
            let found = nearest_possible(&estimate, &covariance).unwrap().parameters;
            let body = InertialParameters::from_vector(found);
            assert!(body.is_physical(), "{found}");
            moved += u32::from((found - estimate).norm() > 1e-9);
            let gradient = covariance.try_inverse().unwrap() * (found - estimate);
            let dual = Matrix4::from_fn(|i, j| {
                let mut unit = Matrix4::zeros();
                unit[(i, j)] += 0.5;
                unit[(j, i)] += 0.5;
                gradient.dot(InertialParameters::from_pseudo_inertia(&unit).as_vector())
            });
            let size = 1.0 + gradient.norm();
            let least = SymmetricEigen::new(dual).eigenvalues.min();
            assert!(least > -1e-6 * size, "{least} of {size}");
            let gap = (dual * body.pseudo_inertia()).trace();
            assert!(gap.abs() < 1e-6 * size, "{gap} of {size}");
        }
        assert!(moved > 250, "{moved}");
    }

    /// A possible body stays as it is, bit by bit; one on the border, too.
    #[test]
    fn a_possible_body_stays() {
        let covariance = random_covariance(&mut SmallRng::seed_from_u64(2));
        for inertia in [
            [10.0, 0.1, 0.0, 15.0, 0.0, 10.0],
            [10.0, 0.0, 0.0, 20.0, 0.0, 10.0],
        ] {
            let [xx, xy, xz, yy, yz, zz] = inertia;
            let estimate = SVector::from([100.0, 0.0, 0.0, 0.0, xx, xy, xz, yy, yz, zz]);
            let found = nearest_possible(&estimate, &covariance).unwrap();
            assert_eq!((found.parameters, found.distance), (estimate, 0.0));
        }
    }

    /// What is known exactly does not move: the others make room.
    #[test]
    fn what_is_certain_stays() {
        let estimate = SVector::from([2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 2.5]);
        let mut covariance = SMatrix::identity() * 1e-2;
        for k in [0, 4, 7] {
            covariance[(k, k)] = 1e-12;
        }
        let Nearest {
            parameters: found,
            distance,
        } = nearest_possible(&estimate, &covariance).unwrap();
        assert!((distance - 5.0).abs() < 1e-4, "{distance}");
        assert!((found[0] - 2.0).abs() < 1e-6 && (found[4] - 1.0).abs() < 1e-6);
        assert!((found[9] - 2.0).abs() < 1e-5, "{found}");
    }

    /// Whatever the covariance, and be it no covariance at all, the result is a possible body.
    #[test]
    fn any_covariance_will_do() {
        let mut random = SmallRng::seed_from_u64(3);
        for _ in 0..500 {
            let mut estimate = SVector::from_fn(|_, _| random.random_range(-10.0..10.0));
            estimate[0] = random.random_range(0.01..100.0);
            let root = SMatrix::<f64, 10, 10>::from_fn(|_, _| random.random_range(-1.0..1.0));
            let sizes = SVector::<f64, 10>::from_fn(|_, _| {
                let sign = if random.random_bool(0.1) { -1.0 } else { 1.0 };
                sign * 10f64.powf(random.random_range(-20.0..5.0))
            });
            let covariance = root * SMatrix::from_diagonal(&sizes) * root.transpose();
            let found = nearest_possible(&estimate, &covariance).unwrap();
            let body = InertialParameters::from_vector(found.parameters);
            assert!(body.is_physical_within(1e-6), "{}", found.parameters);
        }
    }

    /// A negative mass is near no body.
    #[test]
    fn no_body_is_near_a_negative_mass() {
        let estimate = SVector::from([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
        assert_eq!(nearest_possible(&estimate, &SMatrix::identity()), None);
    }
}
