//! Motion and payload in one estimate, on the robot with a base that floats.

use std::f64::consts::TAU;

use rand::{SeedableRng, rngs::SmallRng};
use tactid_batch::{BatchIdentifier, BatchResult, BatchSettings, MotionEstimate};
use tactid_identify::nalgebra::SVector;
use tactid_identify::{BaseKind, EquationSettings, KnownMass, Method, values_of_body};

use crate::common::{
    Experiment, Instant, Noise, SENSORS, TOOL, assert_holds_truth, errors_percent, payload,
};

const COMBINED: Method = Method::Combined { effort: true };

fn experiment() -> Experiment {
    Experiment {
        duration_s: 1.5,
        ..Experiment::default()
    }
}

/// Noise on every channel but the pose of the base, with which no source outdoes the others.
fn noise() -> Noise {
    Noise {
        wrench: [0.2, 0.02],
        effort: 0.05,
        ..Noise::fraction(0.003)
    }
}

fn solve(
    experiment: &Experiment,
    instants: &[Instant],
    method: Method,
    settings: BatchSettings,
) -> BatchResult {
    let equations = EquationSettings {
        method,
        ..EquationSettings::default()
    };
    solve_with(experiment, instants, equations, settings)
}

fn solve_with(
    experiment: &Experiment,
    instants: &[Instant],
    equations: EquationSettings,
    settings: BatchSettings,
) -> BatchResult {
    let robot = experiment.robot();
    let mut identifier = BatchIdentifier::new(&robot, TOOL, &SENSORS, equations, settings).unwrap();
    for instant in instants {
        identifier.push(&instant.sample()).unwrap();
    }
    identifier.solve().unwrap()
}

fn noisy(instants: &[Instant], seed: u64) -> Vec<Instant> {
    let mut random = SmallRng::seed_from_u64(seed);
    let drawn = instants
        .iter()
        .map(|instant| noise().on(instant, &mut random));
    drawn.collect()
}

/// All sources together are at least as good as the best of them, because the noise of the motion
/// is the same in all, and the intervals contain the truth.
#[test]
fn combined_is_as_good_as_its_best_source() {
    let experiment = experiment();
    let exact = experiment.run();
    let methods = [
        Method::Tactile,
        Method::Effort,
        Method::JointSensing,
        COMBINED,
    ];
    let truth = values_of_body(&payload());
    let mut squares = methods.map(|_| 0.0);
    let (mut held, mut all) = (0, 0);
    for seed in 0..6 {
        let instants = noisy(&exact, seed);
        for (method, sum) in methods.into_iter().zip(&mut squares) {
            let found = solve(&experiment, &instants, method, BatchSettings::default());
            assert_eq!(found.fit.motion, MotionEstimate::WithPayload, "{method}");
            let errors = SVector::from(errors_percent(&found.estimate.body));
            *sum += errors.norm_squared();
            let values = values_of_body(&found.estimate.body);
            for ((value, true_value), std_dev) in
                values.iter().zip(truth).zip(found.estimate.std_devs)
            {
                held += u32::from((value - true_value).abs() < 1.96 * std_dev);
                all += 1;
            }
        }
    }
    let [singles @ .., combined] = squares;
    for single in singles {
        assert!(combined < 1.05f64.powi(2) * single, "{squares:?}");
    }
    assert!(held * 10 > all * 9, "{held} of {all}");
}

/// A known mass, also an exact one, is kept. It makes no value less precise than without it, and the
/// errors are less than half of those with windows.
#[test]
fn a_known_mass_is_one_more_row() {
    let experiment = experiment();
    let exact = experiment.run();
    let mut squares = [0.0; 2];
    for (seed, std_dev_kg) in [(7, 0.0), (8, 1e-3), (9, 0.0)] {
        let instants = noisy(&exact, seed);
        let mass = KnownMass {
            mass_kg: 100.0,
            std_dev_kg,
        };
        let of = |known_mass, smoothed| {
            let settings = BatchSettings {
                known_mass,
                smoothed,
                ..BatchSettings::default()
            };
            solve(&experiment, &instants, COMBINED, settings)
        };
        let found = of(Some(mass), None);
        assert_eq!(found.fit.motion, MotionEstimate::WithPayload);
        assert!((found.estimate.body.mass_kg - 100.0).abs() < 5.0 * std_dev_kg + 1e-4);
        assert!(found.estimate.std_devs[0] <= std_dev_kg);
        // More of the motion determines the other values better, and takes time.
        let (values, std_devs) = (found.estimate.values(), found.estimate.std_devs);
        let remaining = found.forecast.as_ref().unwrap();
        let remaining = remaining.remaining_s(&values, &std_devs, 1e-5);
        assert!(
            remaining[1..].iter().all(|&time_s| time_s > 0.0),
            "{remaining:?}"
        );
        let (free, windows) = (
            of(None, None),
            of(Some(mass), Some(MotionEstimate::Smoothed)),
        );
        assert_eq!(found.linear, free.linear);
        for k in 0..10 {
            let [std_dev, without] = [&found, &free].map(|of| of.estimate.std_devs[k]);
            assert!(std_dev <= without, "{k}: {std_dev} {without}");
        }
        for (sum, of) in squares.iter_mut().zip([found, windows]) {
            *sum += SVector::from(errors_percent(&of.estimate.body)).norm_squared();
        }
    }
    assert!(squares[0] < 0.25 * squares[1], "{squares:?}");
}

/// An exact mass of one source alone, which determines the mass least, is kept, too.
#[test]
fn an_exact_mass_is_kept_by_each_source() {
    let experiment = experiment();
    let instants = noisy(&experiment.run(), 7);
    for method in [Method::JointSensing, Method::Effort] {
        let settings = BatchSettings {
            known_mass: Some(KnownMass {
                mass_kg: 100.0,
                std_dev_kg: 0.0,
            }),
            ..BatchSettings::default()
        };
        let found = solve(&experiment, &instants, method, settings);
        assert_eq!(found.fit.motion, MotionEstimate::WithPayload);
        let mass_kg = found.estimate.body.mass_kg;
        assert!((mass_kg - 100.0).abs() < 1e-4, "{method:?}: {mass_kg} kg");
    }
}

/// The result is the last point of its history.
#[test]
fn history_ends_with_the_result() {
    let experiment = experiment();
    let found = solve(
        &experiment,
        &noisy(&experiment.run(), 3),
        COMBINED,
        BatchSettings::default(),
    );
    let last = found.history.last().unwrap();
    assert_eq!(last.values, values_of_body(&found.estimate.body));
    assert_eq!(last.std_devs, found.estimate.std_devs);
}

/// The motion is smoothed before where the offset of a sensor is unknown, too: the common estimate
/// has none.
#[test]
fn an_unknown_offset_keeps_windows() {
    let experiment = experiment();
    let instants = noisy(&experiment.run(), 2);
    let equations = EquationSettings {
        method: Method::Tactile,
        wrench_offset: true,
        ..EquationSettings::default()
    };
    let found = solve_with(&experiment, &instants, equations, BatchSettings::default());
    assert_eq!(found.fit.motion, MotionEstimate::Smoothed);
    assert!(found.fit.wrench_offset.is_some());
}

/// The motion is smoothed before where splines would be wrong or no better: on a fixed base,
/// without noise, beside a vibration that they do not follow, and where the model is wrong.
#[test]
fn splines_are_used_where_they_help() {
    let motion = |experiment: &Experiment, instants: &[Instant], method| {
        let found = solve(experiment, instants, method, BatchSettings::default());
        found.fit.motion
    };
    let floating = experiment();
    let exact = floating.run();
    assert_eq!(motion(&floating, &exact, COMBINED), MotionEstimate::Exact);
    let fixed = Experiment {
        base: BaseKind::Fixed,
        ..experiment()
    };
    let on_ground = noisy(&fixed.run(), 1);
    assert_eq!(
        motion(&fixed, &on_ground, Method::Tactile),
        MotionEstimate::Smoothed
    );
    let instants = noisy(&exact, 1);
    let mut vibrating = instants.clone();
    for instant in &mut vibrating {
        let (sin, cos) = (TAU * 15.0 * instant.time_s).sin_cos();
        instant.position[2] += 1e-4 * sin;
        instant.velocity[2] += 1e-4 * TAU * 15.0 * cos;
    }
    assert_eq!(
        motion(&floating, &vibrating, COMBINED),
        MotionEstimate::TooFast
    );
    let mut wrong = instants;
    for instant in &mut wrong {
        // The fourth joint has friction that no model contains.
        instant.effort[3] += 8.0 * instant.velocity[3].signum();
    }
    let found = motion(&floating, &wrong, COMBINED);
    assert_eq!(found, MotionEstimate::Unexplained);
}

/// What the control of a held joint leaves of it, be that faster than splines follow, is nothing
/// beside the joints that move: motion and payload are estimated at once, and hold the truth.
#[test]
fn what_a_held_joint_moves_is_nothing() {
    let held = Experiment {
        moving: vec![3, 5, 6],
        ..experiment()
    };
    let mut exact = held.run();
    for instant in &mut exact {
        let (sin, cos) = (TAU * 15.0 * instant.time_s).sin_cos();
        instant.position[0] += 3e-5 / (TAU * 15.0) * sin;
        instant.velocity[0] += 3e-5 * cos;
    }
    for seed in 0..3 {
        let noise = Noise {
            joints: [0.0; 2],
            ..noise()
        };
        let mut random = SmallRng::seed_from_u64(seed);
        let instants = exact.iter().map(|each| noise.on(each, &mut random));
        let instants: Vec<Instant> = instants.collect();
        let found = solve(&held, &instants, COMBINED, BatchSettings::default());
        assert_eq!(found.fit.motion, MotionEstimate::WithPayload);
        assert_holds_truth(&found.estimate, seed);
    }
}
