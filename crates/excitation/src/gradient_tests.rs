//! Gradients of all functions and limits against differences of the whole computation.

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};

use crate::cones::{Cone, Kind, LinearCone};
use crate::design::Designer;
use crate::problem::{BaseBounds, Criterion, Problem};
use crate::search::Search;
use crate::{CollisionModel, End, Grip, KeepOutBox, OrientedBox, WorkspaceBounds};

/// A step of differences along a random direction, in units of the variables' scales.
const STEP: f64 = 1e-4;

/// Control points of each joint.
const CONTROL_POINTS: usize = 16;

/// Tolerance of slopes, as a fraction of the largest.
const TOLERANCE: f64 = 2e-4;

/// Tolerance of the slopes of distances, and the fraction of them that may be further off: closest
/// points are found to a few digits only, and jump where the closest edge changes.
const OF_DISTANCES: f64 = 2e-3;
const MOST_OFF: f64 = 0.05;

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

/// Returns the number of slopes that differ by more than a fraction of the largest.
fn count_off(found: &[f64], expected: &[f64], tolerance: f64) -> usize {
    let size = expected.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    assert!(size > 0.0 && found.len() == expected.len());
    let pairs = found.iter().zip(expected);
    pairs
        .filter(|(a, b)| (*a - *b).abs() >= tolerance * size)
        .count()
}

fn check(problem: &Problem) {
    let mut designer = Designer::new(problem, CONTROL_POINTS).unwrap();
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
    assert_eq!(count_off(&found, &expected, TOLERANCE), 0);
    let mut distances = (Vec::new(), Vec::new());
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
        if let Kind::Distance { .. } = cone.kind {
            distances.0.extend(found);
            distances.1.extend(expected);
        } else {
            // A limit with derivatives of zero cannot be reached, and is left out.
            assert!(!found.is_empty(), "{}", cone.limit);
            assert_eq!(count_off(&found, &expected, TOLERANCE), 0);
        }
    }
    assert_eq!(distances.0.is_empty(), problem.collisions.is_none());
    if !distances.0.is_empty() {
        let off = count_off(&distances.0, &distances.1, OF_DISTANCES);
        let all = distances.0.len();
        assert!((off as f64) < MOST_OFF * all as f64, "{off} of {all}");
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
    let mut problem = crate::common::on_ground();
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
    let mut problem = crate::common::in_orbit();
    problem.base = BaseBounds {
        attitude_rad: Some(0.01),
        position_m: Some(0.02),
    };
    problem.grip = Some(grip());
    problem.end = End::Free;
    problem
        .payloads
        .push(crate::common::body(50.0, [0.3, 0.0, 0.1], [0.5, 0.4, 0.3]));
    check(&problem);
}

/// Places and distances, with links, payload and a keep-out box close to one another.
#[test]
fn gradients_of_places() {
    let mut problem = crate::common::on_ground();
    let no_files = &mut |_: &str| Err("there is no file".to_owned());
    let model = CollisionModel::of_urdf(&crate::common::urdf(), &problem.robot, no_files).unwrap();
    problem.collisions = Some(model);
    problem.payload_box = Some(OrientedBox::between([0.1, -0.1, 0.0], [0.3, 0.1, 0.2]));
    problem.workspace = WorkspaceBounds {
        inside: Some(OrientedBox::between([-3.0; 3], [1.0, 2.0, 4.0])),
        keep_out: vec![KeepOutBox {
            name: "table".to_owned(),
            place: OrientedBox::between([0.0, -1.0, 0.0], [1.0, 1.0, 1.0]),
        }],
    };
    check(&problem);
}
