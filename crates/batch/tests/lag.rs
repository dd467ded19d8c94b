//! Motion and payload at once while samples come, on the robot with a base that floats.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{
    BatchIdentifier, BatchResult, BatchSettings, LagIdentifier, LagSettings, MotionEstimate,
};
use tactid_dynamics::MassProperties;
use tactid_identify::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use tactid_identify::{
    EquationSettings, Identifier, Method, PayloadEstimate, PushOutcome, values_of_body,
};

use crate::common::{Experiment, Instant, Noise, SENSORS, TOOL, errors_percent, payload};
use crate::trajectory_limits::accelerated;

pub(crate) fn experiment(duration_s: f64) -> Experiment {
    Experiment {
        duration_s,
        ..Experiment::default()
    }
}

/// Noise on every channel.
pub(crate) fn noisy(instants: &[Instant], seed: u64) -> Vec<Instant> {
    let noise = Noise {
        wrench: [0.2, 0.02],
        effort: 0.05,
        ..Noise::fraction(0.003)
    };
    let mut random = SmallRng::seed_from_u64(seed);
    let draw = |instant: &Instant| {
        let mut noisy = noise.on(instant, &mut random);
        let mut vector = || Vector3::from_fn(|_, _| 1e-3 * random.sample::<f64, _>(StandardNormal));
        let pose = &mut noisy.base.pose;
        pose.translation.vector += vector();
        pose.rotation = UnitQuaternion::from_scaled_axis(vector()) * pose.rotation;
        noisy
    };
    instants.iter().map(draw).collect()
}

pub(crate) fn settings() -> EquationSettings {
    EquationSettings {
        method: Method::Combined { effort: true },
        ..EquationSettings::default()
    }
}

pub(crate) fn identifier(
    experiment: &Experiment,
    lag_s: f64,
    settings: &EquationSettings,
) -> LagIdentifier {
    let lag = LagSettings {
        lag_s,
        ..LagSettings::default()
    };
    LagIdentifier::new(&experiment.robot(), TOOL, &SENSORS, settings, lag).unwrap()
}

pub(crate) fn lagged(experiment: &Experiment, instants: &[Instant], lag_s: f64) -> LagIdentifier {
    let mut identifier = identifier(experiment, lag_s, &settings());
    for instant in instants {
        identifier.push(&instant.sample()).unwrap();
    }
    identifier
}

pub(crate) fn recorded(
    experiment: &Experiment,
    equations: &EquationSettings,
    instants: &[Instant],
) -> BatchResult {
    let batch = BatchSettings::default();
    let batch = BatchIdentifier::new(
        &experiment.robot(),
        TOOL,
        &SENSORS,
        equations.clone(),
        batch,
    );
    let mut batch = batch.unwrap();
    for instant in instants {
        batch.push(&instant.sample()).unwrap();
    }
    batch.solve().unwrap()
}

/// Returns the largest distance of the ten values of two estimates, in standard deviations.
pub(crate) fn distance(one: &PayloadEstimate, other: &PayloadEstimate) -> f64 {
    let values = one.values().into_iter().zip(other.values());
    let distances = values.zip(other.std_devs);
    distances.fold(0.0, |most, ((one, other), std_dev)| {
        f64::max(most, (one - other).abs() / std_dev)
    })
}

/// The estimate is that of the recording where nothing is eliminated, intervals included, and is
/// near to it with less, also where accelerations of the base are measured.
#[test]
fn it_approaches_the_recording_as_the_lag_grows() {
    let experiment = Experiment {
        step_s: 1.0 / 1024.0,
        ..experiment(2.31)
    };
    let exact = experiment.run();
    let measured = noisy(&exact, 1);
    let mut random = SmallRng::seed_from_u64(1);
    let accelerated = accelerated(&measured, &exact, [true; 2], &mut random);
    for instants in [measured, accelerated] {
        // 129 bins of 18 samples end with a knot.
        let batch = recorded(&experiment, &settings(), &instants[..129 * 18]);
        assert_eq!(batch.fit.motion, MotionEstimate::WithPayload);
        let [short, longer, whole] = [0.1, 1.0, 2.2].map(|lag_s| {
            let found = lagged(&experiment, &instants, lag_s);
            assert_eq!(found.motion(), MotionEstimate::WithPayload, "{lag_s}");
            found.estimate().unwrap().clone()
        });
        let distances = [&short, &longer, &whole].map(|found| distance(found, &batch.estimate));
        for (one, other) in whole.std_devs.iter().zip(batch.estimate.std_devs) {
            assert!((one / other - 1.0).abs() < 0.001, "{one} {other}");
        }
        assert!(distances[2] < 0.01, "{distances:?}");
        assert!(distances[1] < 0.2 && distances[0] < 0.5, "{distances:?}");
    }
}

/// After a second, the worst of ten values has a third of the error of the online identifier, and
/// intervals hold.
#[test]
fn it_is_more_precise_than_windows_and_its_intervals_hold() {
    let experiment = experiment(1.05);
    let exact = experiment.run();
    let truth = values_of_body(&payload());
    let mut squares = [[0.0; 10]; 2];
    let (mut held, mut all) = (0, 0);
    for seed in 0..100 {
        let instants = noisy(&exact, seed);
        let identifier = lagged(&experiment, &instants, 0.1);
        let found = identifier.estimate().unwrap();
        let mut online = Identifier::new(&experiment.robot(), TOOL, &SENSORS, &settings()).unwrap();
        for instant in &instants {
            online.push(&instant.sample()).unwrap();
        }
        online.finish();
        for (sums, body) in squares.iter_mut().zip([found.body, online.estimate().body]) {
            for (sum, error) in sums.iter_mut().zip(errors_percent(&body)) {
                *sum += error * error / 100.0;
            }
        }
        let values = found.values().into_iter().zip(truth);
        for ((value, true_value), std_dev) in values.zip(found.std_devs) {
            held += u32::from((value - true_value).abs() < 1.96 * std_dev);
            all += 1;
        }
    }
    let [lag, online] = squares.map(|sums| sums.into_iter().fold(0.0, f64::max).sqrt());
    assert!(lag < 0.3 * online, "{lag} {online}");
    assert!(held * 100 >= all * 93, "{held} of {all}");
}

/// There is no estimate, and a reason, where that of windows is the right one.
#[test]
fn unsuited_robots_and_samples_have_no_estimate() {
    let floating = experiment(1.5);
    let exact = floating.run();
    let instants = noisy(&exact, 2);
    let reason = |experiment: &Experiment, instants: &[Instant]| {
        let found = lagged(experiment, instants, 0.1);
        assert!(found.estimate().is_none());
        found.motion()
    };
    let mut without_velocities = identifier(&floating, 0.1, &settings());
    for instant in &instants {
        let mut sample = instant.sample();
        sample.joint_velocity = &[];
        without_velocities.push(&sample).unwrap();
    }
    assert_eq!(without_velocities.motion(), MotionEstimate::NoVelocities);
    assert_eq!(reason(&floating, &instants[..700]), MotionEstimate::TooFew);
    // What the splines leave is then more than noise, unless windows are known to be as precise.
    let of_exact = reason(&floating, &exact);
    assert!(matches!(
        of_exact,
        MotionEstimate::Exact | MotionEstimate::Unexplained
    ));
    let mut vibrating = instants.clone();
    for instant in &mut vibrating {
        let (sin, cos) = (TAU * 15.0 * instant.time_s).sin_cos();
        instant.position[2] += 1e-4 * sin;
        instant.velocity[2] += 1e-4 * TAU * 15.0 * cos;
    }
    assert_eq!(reason(&floating, &vibrating), MotionEstimate::TooFast);
    let mut wrong = instants;
    for instant in &mut wrong {
        instant.effort[3] += 8.0 * instant.velocity[3].signum();
    }
    assert_eq!(reason(&floating, &wrong), MotionEstimate::Unexplained);
}

/// A stretch that is shorter than the lag is used when a gap ends it.
#[test]
fn a_gap_ends_a_long_lag() {
    let experiment = experiment(1.5);
    let mut instants = noisy(&experiment.run(), 1);
    instants.retain(|instant| !(1.2..1.4).contains(&instant.time_s));
    let lagged = lagged(&experiment, &instants, 5.0);
    assert_eq!(lagged.motion(), MotionEstimate::WithPayload);
    assert!((lagged.until_s() - 1.2).abs() < 0.1);
}

/// A gap ends the motion, and what was known of the payload stays: the estimate is as before, and
/// more precise with the samples after it.
#[test]
fn a_gap_keeps_what_is_known() {
    let experiment = experiment(3.0);
    let mut instants = noisy(&experiment.run(), 5);
    instants.retain(|instant| !(1.4..1.6).contains(&instant.time_s));
    let mut identifier = identifier(&experiment, 0.1, &settings());
    let mut precision = Vec::new();
    for instant in &instants {
        identifier.push(&instant.sample()).unwrap();
        if [1.39, 1.7, 2.99]
            .map(|time_s| (instant.time_s - time_s).abs() < 1e-6)
            .contains(&true)
        {
            let found = identifier.estimate().unwrap();
            let truth = PayloadEstimate {
                body: payload(),
                ..found.clone()
            };
            assert!(distance(&truth, &found) < 4.0);
            precision.push(found.std_devs[0]);
        }
    }
    assert_eq!(precision.len(), 3);
    assert!(precision[1] < 1.05 * precision[0], "{precision:?}");
    assert!(precision[2] < 0.8 * precision[1], "{precision:?}");
}

/// A payload change begins again: the estimate is that of the payload that is held now.
#[test]
fn another_payload_begins_again() {
    let lighter = MassProperties {
        mass_kg: 40.0,
        center_of_mass: Vector3::new(0.3, 0.0, 0.1),
        inertia: Matrix3::from_diagonal(&Vector3::new(6.0, 8.0, 7.0)),
    };
    let swapping = Experiment {
        swap: Some((2.0, lighter)),
        ..experiment(4.0)
    };
    let instants = noisy(&swapping.run(), 6);
    let mut identifier = identifier(&swapping, 0.1, &settings());
    let mut changes = 0;
    for instant in &instants {
        let outcome = identifier.push(&instant.sample()).unwrap();
        if outcome == PushOutcome::PayloadChanged {
            changes += 1;
            assert!(identifier.estimate().is_none());
        }
    }
    assert!(changes > 0);
    let found = identifier.estimate().unwrap();
    let truth = PayloadEstimate {
        body: lighter,
        ..found.clone()
    };
    assert!(distance(&truth, &found) < 4.0);
}

/// Memory does not grow with the run, which may be of any length: once the lag is full, two equally
/// long stretches of the run each leave less than a byte for each sample, as a single block that is
/// there at one end and not at the other does.
#[test]
fn memory_does_not_grow() {
    let experiment = experiment(4.0);
    let instants = noisy(&experiment.run(), 8);
    let (before, after) = instants[..4000].split_at(2000);
    let mut identifier = lagged(&experiment, before, 0.1);
    let growth = [&after[..1000], &after[1000..]].map(|stretch| {
        let push = |instant: &Instant| identifier.push(&instant.sample()).unwrap();
        let info = allocation_counter::measure(|| stretch.iter().map(push).for_each(drop));
        info.bytes_current
    });
    assert_eq!(identifier.motion(), MotionEstimate::WithPayload);
    assert!(growth.iter().all(|bytes| bytes.abs() < 1000), "{growth:?}");
}
