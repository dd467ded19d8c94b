//! Payloads whose shape is given, of one or of two densities.

use std::cell::RefCell;
use std::path::PathBuf;

use nalgebra::{Isometry3, Matrix3, Rotation3, Vector3};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use tactid_dynamics::InertialParameters;
use tactid_identify::values_of_body;
use tactid_recordings::{
    Arrays, Combination, Finding, Identification, NotUsedBecause, Observability, Request,
    ShapePose, combine, identify_arrays, identify_poses,
};
use tempfile::TempDir;

/// Handle and head of a hammer, m, along the z axis of the sensor.
pub(crate) const PARTS: [[[f64; 3]; 2]; 2] = [
    [[-0.015, -0.012, 0.02], [0.015, 0.012, 0.24]],
    [[-0.06, -0.015, 0.24], [0.04, 0.015, 0.28]],
];

/// Densities of wood and steel, kg/m³.
pub(crate) const WOOD_AND_STEEL: [f64; 2] = [700.0, 7800.0];

/// Standard deviations of forces, N, and moments, N m.
const NOISE: [f64; 2] = [0.2, 0.01];

/// Returns the inertial parameters of boxes with densities.
pub(crate) fn body(densities: [f64; 2]) -> InertialParameters {
    let of_part = |(corners, density): (&[[f64; 3]; 2], f64)| {
        let [low, high] = corners.map(Vector3::from);
        let (size, center) = (high - low, 0.5 * (low + high));
        let mass = density * size.product();
        let squares = size.component_mul(&size) * (mass / 12.0);
        let about = Matrix3::from_diagonal(&Vector3::repeat(squares.sum()))
            - Matrix3::from_diagonal(&squares);
        let cross = center.cross_matrix();
        let origin = about - mass * cross * cross;
        InertialParameters::from_moments(mass, &(mass * center), &origin)
    };
    PARTS.iter().zip(densities).map(of_part).sum()
}

thread_local! {
    /// Folders of the files of a test, which are removed when its thread ends.
    static FOLDERS: RefCell<Vec<TempDir>> = const { RefCell::new(Vec::new()) };
}

/// Writes the parts as an OBJ file, with coordinates times a scale, into a folder that is kept for
/// the test.
pub(crate) fn file(name: &str, scale: f64, parts: &[[[f64; 3]; 2]]) -> PathBuf {
    const FACES: &str = "f -8 -6 -5 -7\nf -4 -3 -1 -2\nf -8 -7 -3 -4\nf -6 -2 -1 -5\nf -8 -4 -2 -6\nf -7 -5 -1 -3\n";
    let mut text = String::new();
    for corners in parts {
        for corner in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|axis| scale * corners[corner >> axis & 1][axis]);
            text += &format!("v {x} {y} {z}\n");
        }
        text += FACES;
    }
    written(name, text.as_bytes())
}

pub(crate) fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    FOLDERS.with_borrow_mut(|folders| folders.push(folder));
    path
}

/// Returns a request with a shape.
pub(crate) fn with_shape(shape: PathBuf) -> Request {
    Request {
        shape: Some(shape),
        ..Request::default()
    }
}

/// A sensor that turns about its origin under gravity, with what it carries.
pub(crate) struct Turning {
    times_s: Vec<f64>,
    poses: Vec<Isometry3<f64>>,
    wrenches: Vec<f64>,
}

impl Turning {
    /// Turns for some seconds at 100 Hz, with noise of a seed, relative to [`NOISE`].
    pub(crate) fn new(load: &InertialParameters, seconds: f64, seed: u64, noise: f64) -> Self {
        let mut random = SmallRng::seed_from_u64(seed);
        let phase: f64 = random.random_range(0.0..6.0);
        let turned = |t: f64| {
            Rotation3::from_euler_angles(
                1.2 * (1.7 * t + phase).sin(),
                0.9 * (2.3 * t).sin(),
                1.4 * (1.1 * t + 2.0 * phase).sin(),
            )
        };
        let step = 1e-4;
        let rate = |t: f64| {
            let difference = turned(t - step).inverse() * turned(t + step);
            difference.scaled_axis() / (2.0 * step)
        };
        let properties = load.mass_properties().unwrap();
        let (mass, center) = (properties.mass_kg, properties.center_of_mass);
        let mut run = Self {
            times_s: (0..(100.0 * seconds) as u32)
                .map(|k| 0.01 * f64::from(k))
                .collect(),
            poses: Vec::new(),
            wrenches: Vec::new(),
        };
        for &t in &run.times_s {
            let (pose, spin) = (turned(t), rate(t));
            let turn = (rate(t + step) - rate(t - step)) / (2.0 * step);
            let gravity = pose.inverse() * Vector3::new(0.0, 0.0, -9.81);
            let acceleration = turn.cross(&center) + spin.cross(&spin.cross(&center));
            let force = mass * (acceleration - gravity);
            let inertia = properties.inertia;
            let moment = inertia * turn + spin.cross(&(inertia * spin)) + center.cross(&force);
            for (entry, sigma) in [(force, NOISE[0]), (moment, NOISE[1])] {
                for value in &entry {
                    let drawn: f64 = StandardNormal.sample(&mut random);
                    run.wrenches.push(value + noise * sigma * drawn);
                }
            }
            run.poses
                .push(Isometry3::from_parts(Vector3::zeros().into(), pose.into()));
        }
        run
    }

    pub(crate) fn arrays(&self) -> Arrays<'_> {
        Arrays {
            time: &self.times_s,
            pose: &self.poses,
            wrench: &self.wrenches,
            ..Arrays::default()
        }
    }

    fn identify(&self, request: &Request) -> Identification {
        let mut observer = |_| std::ops::ControlFlow::Continue(());
        let found = identify_arrays(&self.arrays(), request, &mut observer).unwrap();
        found.into_least_squares().unwrap()
    }
}

/// Returns the error of the inertia, relative to its size.
fn inertia_error(found: &[f64; 10], load: &InertialParameters) -> f64 {
    let truth = values_of_body(&load.mass_properties().unwrap());
    let norm =
        |values: &dyn Fn(usize) -> f64| (4..10).map(|k| values(k).powi(2)).sum::<f64>().sqrt();
    norm(&|k| found[k] - truth[k]) / norm(&|k| truth[k])
}

/// Returns how many of the intervals contain the truth.
fn inside(found: &Identification, load: &InertialParameters) -> usize {
    let truth = values_of_body(&load.mass_properties().unwrap());
    let intervals = found.estimate.intervals.iter().zip(truth);
    intervals
        .filter(|([low, high], value)| (low..=high).contains(&value))
        .count()
}

/// A shape makes the inertia several times as well known, whether the body is of one material or of
/// two, and the intervals hold. Each value says how much it owes to the shape.
#[test]
fn a_shape_improves_the_inertia() {
    let shape = with_shape(file("hammer.obj", 1.0, &PARTS));
    for densities in [[7800.0; 2], WOOD_AND_STEEL] {
        let load = body(densities);
        let (mut errors, mut held) = ([0.0; 2], [0; 2]);
        let seeds = 30;
        for seed in 0..seeds {
            let run = Turning::new(&load, 4.0, seed, 12.0);
            let requests = [&Request::default(), &shape];
            for (k, request) in requests.into_iter().enumerate() {
                let found = run.identify(request);
                errors[k] += inertia_error(&found.estimate.values(), &load) / seeds as f64;
                held[k] += inside(&found, &load);
                assert!(
                    found.recording.findings.is_empty(),
                    "{:?}",
                    found.recording.findings
                );
                let Some(fit) = &found.shape else {
                    assert_eq!(k, 0);
                    continue;
                };
                assert!(fit.is_used && fit.p_value > 0.01, "{fit:?}");
                assert!(fit.fraction[0] < 0.1, "{:?}", fit.fraction);
                // The moment about the handle is the smallest: the measurements hardly show it.
                assert!(fit.fraction[9] > 0.8, "{:?}", fit.fraction);
                assert!(found.estimate.is_physical);
            }
        }
        assert!(errors[1] < 0.5 * errors[0], "{errors:?}");
        let all = 10 * seeds as usize;
        assert!(held[1] * 100 >= 92 * all, "{held:?} of {all}");
    }
}

/// A sensor without noise determines everything, and the shape changes nothing.
#[test]
fn exact_measurements_owe_nothing_to_a_shape() {
    let load = body(WOOD_AND_STEEL);
    let run = Turning::new(&load, 4.0, 1, 0.0);
    let found = run.identify(&with_shape(file("hammer.obj", 1.0, &PARTS)));
    let fit = found.shape.as_ref().unwrap();
    assert!(
        fit.is_used && fit.fraction.iter().all(|f| *f < 0.01),
        "{:?}",
        fit.fraction
    );
    assert!(inertia_error(&found.estimate.values(), &load) < 1e-3);
}

/// Another object, another pose and another unit contradict the measurements: the result does not
/// use the shape, and the finding says which unit would fit.
#[test]
fn a_wrong_shape_is_refused() {
    let load = body(WOOD_AND_STEEL);
    let run = Turning::new(&load, 8.0, 5, 0.3);
    let without = run.identify(&Request::default());
    let millimetres = file("hammer.obj", 1000.0, &PARTS);
    let reversed = ShapePose([0.0, 0.0, 0.28, 1.0, 0.0, 0.0, 0.0]);
    let other = [[[0.0, 0.0, 0.0], [0.1, 0.2, 0.02]]];
    let right = file("hammer.obj", 1.0, &PARTS);
    for (request, unit) in [
        (with_shape(millimetres.clone()), Some(1e-3)),
        (with_shape(file("plate.obj", 1.0, &other)), None),
        (
            Request {
                shape_pose: Some(reversed),
                ..with_shape(right)
            },
            None,
        ),
    ] {
        let found = run.identify(&request);
        let [
            Finding::ShapeContradicted {
                p_value,
                scale,
                is_of_mass,
            },
        ] = found.recording.findings[..]
        else {
            panic!("{:?}", found.recording.findings);
        };
        assert!(
            p_value < 0.01 && scale == unit && !is_of_mass,
            "{p_value} {scale:?}"
        );
        assert_eq!(found.estimate, without.estimate);
        let fit = found.shape.unwrap();
        assert!(!fit.is_used && fit.fraction == [0.0; 10]);
        let words = found.recording.findings[0].to_string();
        assert!(
            words.starts_with("The measurements contradict the shape ("),
            "{words}"
        );
    }
    let in_metres = Request {
        shape_scale: Some(1e-3),
        ..with_shape(millimetres)
    };
    assert!(run.identify(&in_metres).shape.unwrap().is_used);
}

/// A known mass that is wrong contradicts the right shape, which is not blamed.
#[test]
fn a_wrong_mass_is_no_wrong_shape() {
    let load = body(WOOD_AND_STEEL);
    let run = Turning::new(&load, 8.0, 5, 0.3);
    let mass_kg = load.mass_properties().unwrap().mass_kg;
    for (factor, is_wrong) in [(1.0, false), (1.2, true), (1000.0, true)] {
        let found = run.identify(&Request {
            known_mass_kg: Some(factor * mass_kg),
            ..with_shape(file("hammer.obj", 1.0, &PARTS))
        });
        let findings = found.recording.findings;
        let of_shape = findings.iter().find_map(|finding| match finding {
            Finding::ShapeContradicted { is_of_mass, .. } => Some((*is_of_mass, finding)),
            _ => None,
        });
        assert_eq!(
            of_shape.map(|found| found.0),
            is_wrong.then_some(true),
            "{findings:?}"
        );
        let words = of_shape.map(|found| found.1.to_string());
        let expected =
            "without the known mass (`known_mass_kg`) they agree, so that the mass is wrong";
        assert!(
            words.is_none_or(|words| words.contains(expected)),
            "{findings:?}"
        );
    }
}

/// A pose of the file's frame is that in the frame of the tip.
#[test]
fn a_shape_has_a_pose() {
    let turned = PARTS.map(|[low, high]| {
        // The z axis of the file is the x axis of the sensor: (x, y, z) is (y, z, x) there.
        let moved = |[x, y, z]: [f64; 3]| [y - 1.0, z, x];
        [moved(low), moved(high)]
    });
    let load = body(WOOD_AND_STEEL);
    let run = Turning::new(&load, 4.0, 2, 1.0);
    let there = run.identify(&with_shape(file("hammer.obj", 1.0, &PARTS)));
    let back = Request {
        shape_pose: Some(ShapePose([0.0, 1.0, 0.0, 0.5, 0.5, 0.5, 0.5])),
        ..with_shape(file("turned.obj", 1.0, &turned))
    };
    let found = run.identify(&back);
    for (a, b) in there
        .estimate
        .values()
        .into_iter()
        .zip(found.estimate.values())
    {
        assert!((a - b).abs() < 2e-3 * a.abs().max(1e-3), "{a} {b}");
    }
}

/// Poses at rest determine mass and centre of mass, and the shape the inertia; the interval of each
/// contains the truth.
#[test]
fn poses_at_rest_have_an_inertia() {
    let load = body(WOOD_AND_STEEL);
    let properties = load.mass_properties().unwrap();
    let mut random = SmallRng::seed_from_u64(3);
    let (mut poses, mut wrenches) = (Vec::new(), Vec::new());
    for k in 0..8 {
        let angle = f64::from(k);
        let turn = Rotation3::from_euler_angles(1.9 * angle, 1.3 * angle, 0.0);
        let force = turn.inverse() * Vector3::new(0.0, 0.0, 9.81 * properties.mass_kg);
        let moment = properties.center_of_mass.cross(&force);
        for (entry, sigma) in [(force, 0.02), (moment, 0.001)] {
            for value in &entry {
                let drawn: f64 = StandardNormal.sample(&mut random);
                wrenches.push(value + sigma * drawn);
            }
        }
        poses.push(Isometry3::from_parts(Vector3::zeros().into(), turn.into()));
    }
    let arrays = Arrays {
        pose: &poses,
        wrench: &wrenches,
        ..Arrays::default()
    };
    let request = with_shape(file("hammer.obj", 1.0, &PARTS));
    let without = identify_poses(&arrays, &Request::default()).unwrap();
    let found = identify_poses(&arrays, &request).unwrap();
    assert_eq!(
        without.estimate.observability[4],
        Observability::Unobservable
    );
    assert!(
        found.estimate.observability[4..]
            .iter()
            .all(|of| *of != Observability::Unobservable)
    );
    assert_eq!(inside(&found, &load), 10);
    let fit = found.shape.unwrap();
    assert!(fit.is_used && fit.degrees_of_freedom == 3.0, "{fit:?}");
    assert!(
        fit.fraction[4..].iter().all(|f| *f == 1.0),
        "{:?}",
        fit.fraction
    );
}

/// A mass that nothing determines leaves the shape without a use.
#[test]
fn a_shape_needs_a_mass() {
    let run = Turning::new(&body(WOOD_AND_STEEL), 4.0, 2, 1e3);
    let found = run.identify(&with_shape(file("hammer.obj", 1.0, &PARTS)));
    let expected = Finding::OptionNotUsed {
        option: "shape".into(),
        because: NotUsedBecause::MassUnknown,
    };
    assert!(
        found.recording.findings.contains(&expected),
        "{:?}",
        found.recording.findings
    );
    assert!(!found.shape.unwrap().is_used);
}

/// In a combination of recordings a shape counts once, and all recordings have the same.
#[test]
fn a_shape_counts_once() {
    let load = body(WOOD_AND_STEEL);
    let shape = with_shape(file("hammer.obj", 1.0, &PARTS));
    let runs: Vec<Identification> = (0..4)
        .map(|seed| Turning::new(&load, 2.0, 10 + seed, 1.0).identify(&shape))
        .collect();
    let alone = combine(&runs[..1]).unwrap();
    let close = |a: &Combination, b: &Identification| {
        let pairs = a.estimate.std_devs.iter().zip(b.estimate.std_devs);
        pairs.clone().all(|(a, b)| (a / b - 1.0).abs() < 1e-9)
    };
    assert!(close(&alone, &runs[0]));
    let together = combine(&runs).unwrap();
    let fraction = |of: &Combination| of.shape.as_ref().unwrap().fraction[7];
    assert!(fraction(&together) < fraction(&alone));
    assert!(together.findings.is_empty(), "{:?}", together.findings);
    let other = Turning::new(&load, 2.0, 20, 1.0).identify(&Request::default());
    let error = combine(&[runs[0].clone(), other]).unwrap_err().to_string();
    assert!(
        error.contains("another shape than the first recording"),
        "{error}"
    );
}
