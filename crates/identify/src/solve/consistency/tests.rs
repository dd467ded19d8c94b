//! The projection on random problems.

use std::cell::Cell;

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use rand::{RngExt, SeedableRng, rngs::SmallRng};

use super::newton::{GAP, Objective, WEIGHT_FACTOR, solve};
use super::*;

fn random_covariance(random: &mut SmallRng) -> Matrix {
    let root = Matrix::from_fn(|_, _| random.random_range(-1.0..1.0));
    root * root.transpose() * 0.01 + Matrix::identity() * 1e-4
}

/// Projects parameters whose standard deviations are of similar size, without a box.
fn project_freely(estimate: &Vector, covariance: &Matrix) -> Option<Projection> {
    project(estimate, covariance, &SVector::repeat(1.0), None)
}

/// Far from consistent parameters, with random covariances, the conditions of Karush, Kuhn and
/// Tucker hold, which in a convex problem are those of the minimum: the gradient as a symmetric
/// matrix has no negative eigenvalue, and is orthogonal to the pseudo-inertia.
#[test]
fn meets_the_conditions_of_the_minimum() {
    let mut random = SmallRng::seed_from_u64(1);
    let mut moved = 0;
    for _ in 0..300 {
        let mut estimate = SVector::from_fn(|_, _| random.random_range(-1.0..1.0));
        estimate[0] = random.random_range(0.5..2.0);
        let covariance = random_covariance(&mut random);
        let found = project_freely(&estimate, &covariance).unwrap().parameters;
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

/// A problem that counts the steps and the values that are computed.
struct Counted {
    problem: WhitenedProblem,
    steps: Cell<u32>,
    values: Cell<u32>,
}

impl Objective for Counted {
    fn distance(&self, at: &Vector) -> f64 {
        self.problem.distance(at)
    }

    fn value(&self, at: &Vector, weight: f64) -> Option<f64> {
        self.values.set(self.values.get() + 1);
        self.problem.value(at, weight)
    }

    fn newton_step(&self, at: &Vector, weight: f64) -> Option<(Vector, f64)> {
        self.steps.set(self.steps.get() + 1);
        self.problem.newton_step(at, weight)
    }
}

/// However precise the estimate of a plate is, 50 to 100 steps lead to its projection, with a few
/// trials each: none is spent on what rounding hides.
#[test]
fn rounding_takes_no_steps() {
    let mut random = SmallRng::seed_from_u64(7);
    let mut projected = 0;
    let plate = SVector::from([100.0, 50.0, 0.0, 0.0, 10.0, 0.0, 0.0, 45.0, 0.0, 35.0]);
    for precision in [1e-2, 1e-4, 1e-6] {
        for _ in 0..100 {
            let root = Matrix::from_fn(|_, _| random.random_range(-1.0..1.0)) * precision;
            let noise = Vector::from_fn(|_, _| random.random_range(-1.7..1.7));
            let (estimate, units) = (plate + root * noise, units(&plate));
            if InertialParameters::from_vector(estimate).is_physical_within(0.0) {
                continue;
            }
            let covariance = root * root.transpose();
            let scales = SVector::repeat(precision);
            let problem = whitened_problem(&estimate, &covariance, &scales, &units, None);
            let (problem, start) = problem.unwrap();
            let counted = Counted {
                problem,
                steps: Cell::new(0),
                values: Cell::new(0),
            };
            solve(&counted, start, PSEUDO_INERTIA_BARRIERS);
            let (steps, values) = (counted.steps.get(), counted.values.get());
            assert!(
                steps < 120 && values < 1000,
                "{precision}: {steps} {values}"
            );
            projected += 1;
        }
    }
    assert!(projected > 100, "{projected}");
}

/// Consistent parameters are returned unchanged, also on the boundary.
#[test]
fn consistent_parameters_are_unchanged() {
    let covariance = random_covariance(&mut SmallRng::seed_from_u64(2));
    for inertia in [
        [10.0, 0.1, 0.0, 15.0, 0.0, 10.0],
        [10.0, 0.0, 0.0, 20.0, 0.0, 10.0],
    ] {
        let [xx, xy, xz, yy, yz, zz] = inertia;
        let estimate = SVector::from([100.0, 0.0, 0.0, 0.0, xx, xy, xz, yy, yz, zz]);
        let found = project_freely(&estimate, &covariance).unwrap();
        assert_eq!((found.parameters, found.distance), (estimate, 0.0));
    }
}

/// Parameters without uncertainty do not move; the others do.
#[test]
fn certain_parameters_do_not_move() {
    let estimate = SVector::from([2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 2.5]);
    let mut covariance = Matrix::identity() * 1e-2;
    for k in [0, 4, 7] {
        covariance[(k, k)] = 1e-12;
    }
    let Projection {
        parameters: found,
        distance,
    } = project_freely(&estimate, &covariance).unwrap();
    assert!((distance - 5.0).abs() < 1e-4, "{distance}");
    assert!((found[0] - 2.0).abs() < 1e-6 && (found[4] - 1.0).abs() < 1e-6);
    assert!((found[9] - 2.0).abs() < 1e-5, "{found}");
}

/// The inertial parameters of eight random point masses.
fn random_body(random: &mut SmallRng) -> Vector {
    let mut pseudo = Matrix4::zeros();
    for _ in 0..8 {
        let mut point = Vector4::from_fn(|_, _| random.random_range(-0.3..0.3));
        point[3] = 1.0;
        pseudo += point * point.transpose() * random.random_range(0.1..0.5);
    }
    *InertialParameters::from_pseudo_inertia(&pseudo).as_vector()
}

/// Where a consistent body explains an estimate in all observable directions, the projection finds
/// one that does, and however precise the estimate is and whatever the scales of unobservable
/// parameters are, one of similar size.
#[test]
fn unobservable_directions_move_freely() {
    let mut random = SmallRng::seed_from_u64(4);
    let mut moved = 0;
    for _ in 0..400 {
        let body = random_body(&mut random);
        let exactness = 10f64.powf(random.random_range(-12.0..-2.0));
        let unscaled: Vec<usize> = (4..10).filter(|_| random.random_bool(0.3)).collect();
        let scales = SVector::from_fn(|k, _| if unscaled.contains(&k) { 1e8 } else { 0.1 });
        let mixed = Vector::from_fn(|k, _| f64::from(!unscaled.contains(&k) && k > 0));
        let mut unknown: Vec<Vector> = unscaled
            .iter()
            .map(|&k| Vector::from_fn(|i, _| f64::from(i == k)))
            .collect();
        unknown.push(mixed.component_mul(&Vector::from_fn(|_, _| random.random_range(-1.0..1.0))));
        let across = unknown
            .iter()
            .fold(Matrix::identity(), |projector, direction| {
                let unit = direction.normalize();
                projector - unit * unit.transpose()
            });
        let estimate = (across * body.component_div(&scales)).component_mul(&scales);
        let scale = Matrix::from_diagonal(&scales);
        let root = across * random_covariance(&mut random) * across * exactness;
        let Some(found) = project(&estimate, &(scale * root * scale), &scales, None) else {
            continue;
        };
        assert!(found.distance < 0.1, "{} {exactness}", found.distance);
        assert!(InertialParameters::from_vector(found.parameters).is_physical());
        let error = across * (found.parameters - body).component_div(&scales);
        assert!(
            error.amax() < 0.1 * exactness.sqrt(),
            "{} {error} {exactness} {unscaled:?}",
            found.distance
        );
        let size = found.parameters.amax();
        assert!(size < 1e3 * body.amax(), "{}", found.parameters);
        moved += u32::from(found.parameters != estimate);
    }
    assert!(moved > 250, "{moved}");
}

/// The result is consistent for any symmetric matrix in place of the covariance, also an indefinite
/// one.
#[test]
fn any_covariance_gives_consistent_parameters() {
    let mut random = SmallRng::seed_from_u64(3);
    for _ in 0..500 {
        let mut estimate = SVector::from_fn(|_, _| random.random_range(-10.0..10.0));
        estimate[0] = random.random_range(0.01..100.0);
        let root = Matrix::from_fn(|_, _| random.random_range(-1.0..1.0));
        let sizes = SVector::<f64, 10>::from_fn(|_, _| {
            let sign = if random.random_bool(0.1) { -1.0 } else { 1.0 };
            sign * 10f64.powf(random.random_range(-20.0..5.0))
        });
        let covariance = root * Matrix::from_diagonal(&sizes) * root.transpose();
        let found = project_freely(&estimate, &covariance).unwrap();
        let body = InertialParameters::from_vector(found.parameters);
        assert!(body.is_physical_within(1e-6), "{}", found.parameters);
    }
}

/// A negative mass has no projection.
#[test]
fn a_negative_mass_has_no_projection() {
    let estimate = SVector::from([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
    assert_eq!(project_freely(&estimate, &Matrix::identity()), None);
}

const CUBE: BoundingBox = BoundingBox {
    min: Vector3::new(-0.1, -0.2, 0.1),
    max: Vector3::new(0.3, 0.2, 0.5),
};

fn slacks(bounding: &BoundingBox, parameters: &Vector) -> Vec<f64> {
    let bounds = bounding.bounds();
    bounds.iter().map(|bound| bound.dot(parameters)).collect()
}

/// With a box, far from any body inside, no consistent body is nearer but for the rounding of the
/// slacks: multipliers that are not negative bound the distance of all of them from below (weak
/// duality; Boyd and Vandenberghe 2004, 5.2.2). The multipliers are those of the barrier at its
/// last weight.
#[test]
fn no_body_in_the_box_is_nearer() {
    let mut random = SmallRng::seed_from_u64(4);
    for _ in 0..300 {
        let mut target = SVector::from_fn(|_, _| random.random_range(-1.0..1.0));
        target[0] = random.random_range(0.5..2.0);
        let covariance = random_covariance(&mut random);
        let information = covariance.try_inverse().unwrap();
        let distance_to = |at: Vector| 0.5 * (information * (at - target)).dot(&(at - target));
        let start = *CUBE.filled(target[0]).as_vector();
        let scales = SVector::repeat(1.0);
        let found = project(&target, &covariance, &scales, Some(&CUBE));
        let found = found.unwrap().parameters;
        let body = InertialParameters::from_vector(found);
        assert!(body.is_physical() && slacks(&CUBE, &found).iter().all(|slack| *slack > 0.0));
        let distance = distance_to(found);
        assert!(distance > 0.1, "{distance}");
        let mut weight = distance_to(start);
        while 19.0 * weight >= GAP * distance {
            weight *= WEIGHT_FACTOR;
        }
        let dual = weight * body.pseudo_inertia().cholesky().unwrap().inverse();
        let mut sum = SVector::from_fn(|k, _| {
            let unit = InertialParameters::from_vector(SVector::ith(k, 1.0));
            dual.dot(&unit.pseudo_inertia())
        });
        for bound in &CUBE.bounds() {
            sum += weight / bound.dot(&found) * bound;
        }
        // Least value of the Lagrangian, the distance less multipliers times bounds, over all
        // parameters.
        let least = -sum.dot(&target) - 0.5 * sum.dot(&(covariance * sum));
        assert!(least > (1.0 - 1e-3) * distance, "{least} {distance}");
    }
}

/// A body whose centre of mass is outside the box moves to its boundary, and only along the axis on
/// which it is outside where the covariance does not couple the axes.
#[test]
fn a_body_outside_the_box_moves_inside() {
    let outside = InertialParameters::from(tactid_dynamics::MassProperties {
        mass_kg: 2.0,
        center_of_mass: Vector3::new(0.35, 0.05, 0.3),
        inertia: Matrix3::from_diagonal_element(0.01),
    });
    let estimate = *outside.as_vector();
    let covariance = Matrix::identity() * 1e-4;
    let scales = SVector::repeat(1e-2);
    let free = project(&estimate, &covariance, &scales, None).unwrap();
    assert_eq!((free.parameters, free.distance), (estimate, 0.0));
    let found = project(&estimate, &covariance, &scales, Some(&CUBE)).unwrap();
    assert!(found.distance > 0.0);
    let slacks = slacks(&CUBE, &found.parameters);
    assert!(slacks.iter().all(|slack| *slack >= 0.0), "{slacks:?}");
    assert!(slacks.iter().any(|slack| *slack < 1e-6), "{slacks:?}");
    let body = InertialParameters::from_vector(found.parameters);
    let center = body.mass_properties().unwrap().center_of_mass;
    assert!(center.x < 0.3 && (center.y - 0.05).abs() < 0.02, "{center}");
}

/// A body that fits into the box is returned unchanged.
#[test]
fn a_body_inside_the_box_is_unchanged() {
    let estimate = *CUBE.filled(3.0).as_vector();
    let covariance = random_covariance(&mut SmallRng::seed_from_u64(5));
    let scales = SVector::repeat(0.1);
    let found = project(&estimate, &covariance, &scales, Some(&CUBE)).unwrap();
    assert_eq!((found.parameters, found.distance), (estimate, 0.0));
}

/// A mass with a relative standard deviation of a billionth does not move, although its variance is
/// as small as rounding.
#[test]
fn a_known_mass_does_not_move() {
    let mut random = SmallRng::seed_from_u64(6);
    let mut moved = 0;
    for bounding_box in [None, Some(&CUBE)] {
        for _ in 0..100 {
            let mut estimate = SVector::from_fn(|_, _| random.random_range(-1.0..1.0));
            estimate[0] = 1.5;
            let mut scales = SVector::repeat(0.1);
            scales[0] = 1e-9;
            let mut covariance = random_covariance(&mut random);
            covariance.row_mut(0).scale_mut(1e-8);
            covariance.column_mut(0).scale_mut(1e-8);
            let found = project(&estimate, &covariance, &scales, bounding_box).unwrap();
            moved += u32::from(found.distance > 0.0);
            let difference = found.parameters[0] - 1.5;
            assert!(difference.abs() < 1e-6, "{difference}");
        }
    }
    assert!(moved > 150, "{moved}");
}

/// The tracker of an estimate that moves while its information grows is always consistent, and
/// settles after a few steps within a tenth of a standard deviation of the projection.
#[test]
fn a_moving_estimate_is_tracked() {
    let mut random = SmallRng::seed_from_u64(4);
    for _ in 0..30 {
        let root = Matrix::from_fn(|_, _| random.random_range(-1.0..1.0));
        let covariance = root * root.transpose() * 0.01 + Matrix::identity() * 1e-4;
        let Some(inverse) = covariance.try_inverse() else {
            continue;
        };
        let plate = SVector::from([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 1.0]);
        let mut tracker = ProjectionTracker::new();
        let mut sum = Vector::zeros();
        for window in 1..200 {
            sum += root * Vector::from_fn(|_, _| random.random_range(-0.17..0.17));
            let estimate = plate + sum / f64::from(window);
            let information = inverse * f64::from(window);
            tracker.set_estimate(&estimate, &information);
            // There are as many samples to the next window at 1 kHz and 10 Hz.
            let mut steps = 0;
            while !tracker.is_settled() {
                tracker.step();
                let found = InertialParameters::from_vector(tracker.parameters());
                assert!(found.is_physical() || estimate[0] <= 0.0);
                steps += 1;
            }
            assert!(steps <= 30, "{steps}");
            let found = tracker.parameters();
            if estimate[0] <= 0.0 {
                assert_eq!(found, estimate);
                continue;
            }
            let scales = Vector::repeat(1.0);
            let covariance = covariance / f64::from(window);
            let projection = project(&estimate, &covariance, &scales, None).unwrap();
            let difference = found - projection.parameters;
            let apart = (information * difference).dot(&difference).sqrt();
            assert!(apart < 0.15, "{window}: {apart}");
        }
    }
}
