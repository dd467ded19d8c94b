//! The online identifier under noise: its uncertainty, and payload changes.

use crate::common::{Experiment, Instant, Noise, TOOL, identifier, payload};
use nalgebra::{Matrix3, Vector3};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_dynamics::{MassProperties, Wrench};
use tactid_identify::{EquationSettings, Identifier, Method, PayloadEstimate, PushOutcome};

const COMBINED: Method = Method::Combined { effort: false };

fn online(experiment: &Experiment, method: Method) -> Identifier {
    let settings = EquationSettings {
        method,
        ..EquationSettings::default()
    };
    identifier(experiment, &settings)
}

/// Returns the estimates at some times, and the times of detected payload changes, s.
fn run(
    identifier: &mut Identifier,
    instants: impl Iterator<Item = Instant>,
    times_s: &[f64],
) -> (Vec<PayloadEstimate>, Vec<f64>) {
    let (mut estimates, mut changes) = (Vec::new(), Vec::new());
    for instant in instants {
        if identifier.push(&instant.sample()).unwrap() == PushOutcome::PayloadChanged {
            changes.push(instant.time_s);
        }
        let estimate = identifier.estimate();
        assert!(estimate.is_physical || estimate.body.mass_kg <= 0.0);
        if times_s.iter().any(|t| (t - instant.time_s).abs() < 1e-6) {
            estimates.push(estimate);
        }
    }
    (estimates, changes)
}

fn noisy(instants: &[Instant], noise: Noise, seed: u64) -> impl Iterator<Item = Instant> {
    let mut random = SmallRng::seed_from_u64(seed);
    instants
        .iter()
        .map(move |instant| noise.on(instant, &mut random))
}

/// With noise on the wrenches alone the standard deviations have the size of the errors at any
/// time; with noise on all channels they are not smaller. No run detects a payload change or
/// reports an inconsistent body.
#[test]
fn std_devs_have_the_size_of_the_errors() {
    let times_s = [1.0, 2.0, 5.0];
    let experiment = Experiment::default();
    let instants = experiment.run();
    let wrench = Noise {
        joints: [0.0; 2],
        base: [0.0; 2],
        ..Noise::fraction(0.01)
    };
    // Rms over 40 runs and 3 times that are half correlated: it scatters by 0.1 or less.
    for (noise, method, least) in [
        (wrench, Method::Tactile, 0.7),
        (Noise::fraction(0.01), Method::Tactile, 0.25),
        (Noise::fraction(0.01), COMBINED, 0.25),
        (Noise::fraction(0.01), Method::JointSensing, 0.2),
    ] {
        let mut squares = [0.0; 10];
        let mut count = 0.0;
        for seed in 0..40 {
            let mut identifier = online(&experiment, method);
            let samples = noisy(&instants, noise, seed);
            let (estimates, changes) = run(&mut identifier, samples, &times_s);
            assert!(changes.is_empty(), "{changes:?}");
            for estimate in estimates {
                let truth = Vec::from(values(&payload()));
                let found = estimate.values();
                let std_devs = estimate.std_devs;
                for k in (0..10).filter(|&k| std_devs[k].is_finite()) {
                    squares[k] += ((found[k] - truth[k]) / std_devs[k]).powi(2);
                }
                count += f64::from(std_devs.iter().all(|d| d.is_finite()));
            }
        }
        assert!(count > 90.0, "{method:?}: {count}");
        let ratios = squares.map(|square| (square / count).sqrt());
        for ratio in ratios {
            assert!((least..1.3).contains(&ratio), "{method:?}: {ratios:?}");
        }
    }
}

fn values(body: &MassProperties) -> [f64; 10] {
    let (a, i) = (&body.center_of_mass, &body.inertia);
    let [xx, xy, xz, yy, yz, zz] = [
        i[(0, 0)],
        i[(0, 1)],
        i[(0, 2)],
        i[(1, 1)],
        i[(1, 2)],
        i[(2, 2)],
    ];
    [body.mass_kg, a.x, a.y, a.z, xx, xy, xz, yy, yz, zz]
}

fn other() -> MassProperties {
    MassProperties {
        mass_kg: 60.0,
        center_of_mass: Vector3::new(0.3, 0.05, -0.02),
        inertia: Matrix3::from_diagonal(&Vector3::new(6.0, 9.0, 7.0)),
    }
}

/// A payload change from 100 kg to 60 kg during the motion is detected within 0.2 s and reported
/// once, and after 2 s all ten values are within 2 % of the new ones, on a floating base and on the
/// ground.
#[test]
fn a_payload_change_is_detected_and_identified() {
    let other = other();
    let scales = [60.0, 0.3, 0.3, 0.3, 6.0, 9.0, 9.0, 9.0, 9.0, 7.0];
    let on_the_ground = Experiment {
        base: tactid_dynamics::BaseKind::Fixed,
        gravity: Vector3::new(0.0, 0.0, -9.81),
        ..Experiment::default()
    };
    let cases = [
        (Experiment::default(), Method::Tactile),
        (Experiment::default(), COMBINED),
        (on_the_ground, Method::Tactile),
    ];
    for (experiment, method) in cases {
        for (seed, swap_s) in [(0, 2.5), (1, 3.017), (2, 4.4)] {
            let experiment = Experiment {
                swap: Some((swap_s, other)),
                duration_s: swap_s + 2.0,
                urdf: experiment.urdf.clone(),
                moving: experiment.moving.clone(),
                ..experiment
            };
            let instants = experiment.run();
            let mut identifier = online(&experiment, method);
            let samples = noisy(&instants, Noise::fraction(0.001), seed);
            let end_s = instants.last().unwrap().time_s;
            let (estimates, changes) = run(&mut identifier, samples, &[end_s]);
            assert_eq!(changes.len(), 1, "{changes:?}");
            let delay_s = changes[0] - swap_s;
            assert!(delay_s > 0.0 && delay_s <= 0.2, "{delay_s}");
            let estimate = &estimates[0];
            assert_eq!(estimate.payload_changes, 1);
            assert!(estimate.since_s > swap_s && estimate.since_s <= changes[0]);
            let errors = (0..10).map(|k| (estimate.values()[k] - values(&other)[k]) / scales[k]);
            let worst = errors.fold(0.0f64, |worst, error| worst.max(error.abs()));
            assert!(worst < 0.02, "{worst}");
        }
    }
}

/// A payload change whose effect is below the noise of one window is detected later.
#[test]
fn a_payload_change_below_the_noise_of_a_window_is_detected() {
    let experiment = Experiment {
        swap: Some((3.0, other())),
        duration_s: 10.0,
        ..Experiment::default()
    };
    let instants = experiment.run();
    for seed in 0..5 {
        let mut identifier = online(&experiment, Method::JointSensing);
        let samples = noisy(&instants, Noise::fraction(0.005), seed);
        let (_, changes) = run(&mut identifier, samples, &[]);
        assert_eq!(changes.len(), 1, "{changes:?}");
        assert!((3.0..8.0).contains(&changes[0]), "{changes:?}");
    }
}

/// The results of a window are reported together, [`Identifier::DEFERRED_STAGES`] samples after its
/// end at the latest, and are the same as when its deferred stages run at once.
#[test]
fn the_results_of_a_window_are_reported_together() {
    let experiment = Experiment::default();
    let instants = experiment.run();
    for method in [Method::Tactile, COMBINED, Method::JointSensing] {
        let mut identifier = online(&experiment, method);
        let mut samples = noisy(&instants, Noise::fraction(0.01), 11);
        let mut reported = 0;
        while let Some(instant) = samples.next() {
            let before = (identifier.estimate(), identifier.covariance());
            identifier.push(&instant.sample()).unwrap();
            if identifier.estimate().windows == before.0.windows || before.0.windows < 10 {
                continue;
            }
            let mut at_once = identifier.clone();
            at_once.finish();
            let mut passed = 0;
            while identifier.covariance() == before.1 {
                let now = identifier.estimate();
                assert_eq!(now.body, before.0.body);
                assert_eq!(now.std_devs, before.0.std_devs);
                identifier.push(&samples.next().unwrap().sample()).unwrap();
                passed += 1;
            }
            assert!(passed <= Identifier::DEFERRED_STAGES, "{passed}");
            let (now, expected) = (identifier.estimate(), at_once.estimate());
            assert_eq!(identifier.covariance(), at_once.covariance());
            assert_eq!(now.body, expected.body);
            assert_eq!(now.std_devs, expected.std_devs);
            reported += 1;
        }
        assert!(reported > 100, "{reported}");
    }
}

/// A bump of ten times the load, 20 ms long, is not a payload change, and moves the estimate by
/// less than its standard deviations.
#[test]
fn a_bump_is_not_a_payload_change() {
    let experiment = Experiment::default();
    let instants = experiment.run();
    let estimate = |bump_n: f64| {
        let mut identifier = online(&experiment, Method::Tactile);
        let bumped = noisy(&instants, Noise::fraction(0.01), 7).map(|mut instant| {
            if (3.0..3.02).contains(&instant.time_s) {
                instant.wrenches[0].force.x += bump_n;
            }
            instant
        });
        let (estimates, changes) = run(&mut identifier, bumped, &[5.0]);
        assert!(changes.is_empty(), "{changes:?}");
        estimates[0].clone()
    };
    let (calm, bumped) = (estimate(0.0), estimate(2000.0));
    let std_devs = calm.std_devs;
    for (k, std_dev) in std_devs.iter().enumerate() {
        let moved = (bumped.values()[k] - calm.values()[k]) / std_dev;
        assert!(moved.abs() < 1.0, "{k}: {moved}");
    }
}

/// Rest keeps the estimate, and neither rest nor the next motion is a payload change, although an
/// error of 2 % of a finger's scale shows in motion more than at rest.
#[test]
fn rest_is_not_a_payload_change() {
    let experiment = Experiment::default();
    let mut instants = experiment.run();
    let still = Experiment {
        moving: vec![],
        duration_s: 30.0,
        ..Experiment::default()
    };
    let mut append = |more: Vec<Instant>| {
        let end_s = instants.last().unwrap().time_s;
        instants.extend(more.into_iter().map(|instant| Instant {
            time_s: instant.time_s + end_s + 1.0,
            ..instant
        }));
    };
    append(still.run());
    append(experiment.run());
    for instant in &mut instants {
        let force = &mut instant.wrenches[1].force;
        force.x *= 1.02;
        force.z *= 0.98;
    }
    for seed in 0..8 {
        let mut identifier = online(&experiment, Method::Tactile);
        let samples = noisy(&instants, Noise::fraction(0.001), seed);
        let (estimates, changes) = run(&mut identifier, samples, &[5.0, 35.0, 42.0]);
        assert!(changes.is_empty(), "{seed}: {changes:?}");
        let mass = |k: usize| estimates[k].std_devs[0];
        // 1000 windows of rest, 150 of motion.
        assert!(
            (0.5..2.0).contains(&(mass(1) / mass(0))),
            "{}",
            mass(1) / mass(0)
        );
        assert!(mass(2) < mass(0));
        assert_eq!(estimates[2].gaps, 2);
    }
}

/// A constant offset of a finger's force is separated from the payload: standard deviations have
/// the size of the errors. Without an unknown offset it is a bias. A payload change is detected
/// nevertheless.
#[test]
fn an_offset_is_separated_from_the_payload() {
    let experiment = Experiment {
        swap: Some((
            5.0,
            MassProperties {
                mass_kg: 60.0,
                ..payload()
            },
        )),
        duration_s: 8.0,
        ..Experiment::default()
    };
    let mut instants = experiment.run();
    for instant in &mut instants {
        instant.wrenches[0].force += Vector3::new(20.0, -30.0, 10.0);
    }
    let noise = Noise {
        joints: [0.0; 2],
        base: [0.0; 2],
        ..Noise::fraction(0.001)
    };
    // Only values that are reported as known count: with the bias some runs find no consistent
    // body.
    let (mut squares, mut counts) = ([0.0; 2], [0.0; 2]);
    for seed in 0..10 {
        for (case, wrench_offset) in [true, false].into_iter().enumerate() {
            let settings = EquationSettings {
                wrench_offset,
                ..EquationSettings::default()
            };
            let mut identifier = identifier(&experiment, &settings);
            let samples = noisy(&instants, noise, seed);
            let (estimates, changes) = run(&mut identifier, samples, &[4.5, 8.0]);
            let found = estimates[0].values();
            let truth = Vec::from(values(&payload()));
            let std_devs = estimates[0].std_devs;
            for k in (0..10).filter(|&k| std_devs[k].is_finite()) {
                squares[case] += ((found[k] - truth[k]) / std_devs[k]).powi(2);
                counts[case] += 1.0;
            }
            if wrench_offset {
                assert_eq!(changes.len(), 1, "{seed} {changes:?}");
                assert!((5.0..5.3).contains(&changes[0]), "{changes:?}");
                assert!((estimates[1].body.mass_kg - 60.0).abs() < 1.0);
                let offset = identifier.wrench_offset().unwrap();
                assert_eq!(&*offset.frame, TOOL);
                let force = offset.wrench.force;
                assert!((force.norm() - 37.4).abs() < 1.5, "{force}");
            }
        }
    }
    assert_eq!(counts[0], 100.0);
    let squares = [0, 1].map(|case| squares[case] / counts[case]);
    assert!((0.5..1.6).contains(&squares[0]), "{squares:?}");
    assert!(squares[1] > 10.0 * squares[0], "{squares:?}");
}

/// The covariance is that of the linear parameters: its entry of the mass is the square of the
/// standard deviation of the mass.
#[test]
fn the_covariance_agrees_with_the_std_devs() {
    let experiment = Experiment::default();
    let mut identifier = online(&experiment, Method::Tactile);
    let instants = experiment.run();
    let (estimates, _) = run(
        &mut identifier,
        noisy(&instants, Noise::fraction(0.01), 5),
        &[5.0],
    );
    let covariance = identifier.covariance().unwrap();
    let std_dev = estimates[0].std_devs[0];
    assert!((covariance[(0, 0)].sqrt() / std_dev - 1.0).abs() < 1e-12);
    assert!((covariance - covariance.transpose()).norm() < 1e-12 * covariance.norm());
    assert!(covariance.symmetric_eigenvalues().min() > 0.0);
}

/// Zeros that a sensor reports before it has started have no effect on the state: every number of
/// every estimate is finite, and the payload is identified from the measurements that follow. The
/// same holds for a sensor that reports no moments at all.
#[test]
fn constant_zeros_are_no_lasting_damage() {
    let experiment = Experiment {
        duration_s: 8.0,
        ..Experiment::default()
    };
    let instants = experiment.run();
    let zero_until = |end_s: f64| {
        let mut recorded = instants.clone();
        for instant in recorded.iter_mut().filter(|instant| instant.time_s < end_s) {
            instant.wrenches.fill(Wrench::zero());
        }
        recorded
    };
    let mut without_moments = instants.clone();
    for instant in &mut without_moments {
        for wrench in &mut instant.wrenches {
            wrench.moment = Vector3::zeros();
        }
    }
    for (recorded, is_complete) in [
        (zero_until(0.5), true),
        (zero_until(2.0), true),
        (without_moments, false),
    ] {
        let mut identifier = online(&experiment, Method::Tactile);
        for instant in noisy(&recorded, Noise::fraction(0.0), 0) {
            identifier.push(&instant.sample()).unwrap();
            let values = identifier.estimate().values();
            assert!(values.iter().all(|value| value.is_finite()), "{values:?}");
        }
        identifier.finish();
        let estimate = identifier.estimate();
        let mass_kg = estimate.body.mass_kg;
        assert!(!is_complete || (mass_kg - 100.0).abs() < 1.0, "{mass_kg}");
        let covariance = identifier.covariance().unwrap();
        assert!(covariance.iter().all(|entry| entry.is_finite()));
    }
}
