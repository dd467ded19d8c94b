//! Gradients of all functions and limits against differences of the whole computation.

#[path = "../tests/common/mod.rs"]
#[allow(dead_code, reason = "not each test uses all of it")]
mod common;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};

use crate::cones::{Cone, LinearCone};
use crate::design::Designer;
use crate::problem::{BaseBounds, Criterion, Problem};
use crate::search::Search;
use crate::{DesignSettings, End, Grip};

/// A step along a random direction, in units of the variables' scales, that differences are taken over.
const STEP: f64 = 1e-4;

/// Returns the numbers of all cones in one vector.
fn flat(cones: &[LinearCone], of: impl Fn(&LinearCone) -> Vec<f64>) -> Vec<f64> {
    cones.iter().flat_map(of).collect()
}

fn moved(search: &Search, values: &[f64], direction: &[f64], step: f64) -> Vec<f64> {
    let pairs = values.iter().zip(direction).zip(&search.scales);
    pairs.map(|((x, d), scale)| x + step * d * scale).collect()
}

/// Returns the slopes of a vector function along a direction by central differences.
fn slopes(mut function: impl FnMut(f64) -> Vec<f64>) -> Vec<f64> {
    let (before, after) = (function(-STEP), function(STEP));
    let pairs = after.iter().zip(&before);
    pairs.map(|(a, b)| (a - b) / (2.0 * STEP)).collect()
}

fn assert_close(found: &[f64], expected: &[f64]) {
    let size = expected.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    assert!(size > 0.0 && found.len() == expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 2e-4 * size, "{found} {expected}");
    }
}

fn check(problem: &Problem) {
    let settings = DesignSettings::default();
    let mut designer = Designer::new(problem, &settings).unwrap();
    let search = &mut designer.search;
    let point = search.random_start(3).unwrap().unwrap();
    let mut random = StdRng::seed_from_u64(4);
    let direction: Vec<f64> = (0..search.scales.len())
        .map(|_| random.random_range(-1.0..1.0))
        .collect();
    let along = |g: &Vec<f64>| -> f64 { g.iter().zip(&direction).map(|(a, b)| a * b).sum() };
    let linear = search.linearise(&point).unwrap();
    let found: Vec<f64> = linear.functions.iter().map(|(_, g)| along(g)).collect();
    let expected = slopes(|step| {
        let values = moved(search, &point.values, &direction, step);
        search.point(values).unwrap().unwrap().uncertainty.functions
    });
    assert_close(&found, &expected);
    // A radius without bound keeps the cones of all samples.
    for cone in search.cones.clone() {
        let all = |search: &Search, samples: &crate::samples::Samples| {
            Cone::linearised(&cone, &search.sampler, samples, &search.scales, 1e9)
        };
        let linearised = all(search, &linear.samples);
        let gradient = |cone: &LinearCone| -> Vec<f64> {
            [&cone.head]
                .into_iter()
                .chain(&cone.tail)
                .map(along)
                .collect()
        };
        let found = flat(&linearised, gradient);
        let expected = slopes(|step| {
            let values = moved(search, &point.values, &direction, step);
            let samples = search.sampler.sample(&values, false).unwrap();
            let values = cone.values(&samples, search.sampler.grid.step_s);
            let values = linearised
                .iter()
                .map(|linear| values[linear.sample].clone());
            values
                .flat_map(|v| [vec![v.head], v.tail].concat())
                .collect()
        });
        if !found.is_empty() {
            assert_close(&found, &expected);
        }
    }
}

fn grip() -> Grip {
    Grip {
        center: Point3::new(0.2, 0.01, 0.07),
        normal: Vector3::y_axis(),
        distance_m: 0.05,
        grip_force_n: 900.0,
        friction: 0.7,
        torsion_radius_m: 0.04,
        used_fraction: 0.8,
    }
}

/// On the ground, with offsets, an open end, and windows as long as several samples.
#[test]
fn gradients_on_the_ground() {
    let mut problem = common::on_ground();
    check(&problem);
    problem.sensing.equations.wrench_offset = true;
    problem.duration_s = 0.8;
    problem.end = End::Free;
    problem.wrench = Some([30.0; 6]);
    check(&problem);
    problem.criterion = Criterion::Volume;
    check(&problem);
}

/// On a free-floating base, with its attitude and position bounded, the grip, and two payloads.
#[test]
fn gradients_in_orbit() {
    let mut problem = common::in_orbit();
    problem.base = BaseBounds {
        attitude_rad: Some(0.01),
        position_m: Some(0.02),
    };
    problem.grip = Some(grip());
    problem.end = End::Free;
    problem
        .payloads
        .push(common::body(50.0, [0.3, 0.0, 0.1], [0.5, 0.4, 0.3]));
    check(&problem);
}
