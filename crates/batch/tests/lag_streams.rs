//! The estimate with a lag where a stream is not as it should be: gaps, faults, odd samples, and
//! rates.

use std::f64::consts::TAU;

use rand::{SeedableRng, rngs::SmallRng};
use tactid_batch::{LagIdentifier, MotionEstimate};
use tactid_dynamics::MassProperties;
use tactid_identify::nalgebra::Vector3;
use tactid_identify::{EquationSettings, Method, PushOutcome};

use crate::common::{Experiment, Instant, payload};
use crate::lag::{distance, experiment, identifier, lagged, noisy, recorded, settings};
use crate::trajectory_limits::{accelerated, with_light_payload};

/// Returns the estimate that is exact, with the uncertainty of the present one.
fn off(identifier: &LagIdentifier, body: MassProperties) -> f64 {
    let found = identifier.estimate().unwrap();
    let mut truth = found.clone();
    truth.body = body;
    distance(&truth, &found)
}

fn push_all(identifier: &mut LagIdentifier, instants: &[Instant]) {
    for instant in instants {
        identifier.push(&instant.sample()).unwrap();
    }
}

/// What is subtracted of a light payload with noise is the gripper, also where the estimate is
/// projected onto bodies that exist.
#[test]
fn a_light_payload_is_that_of_the_recording() {
    let light = with_light_payload(Experiment {
        step_s: 1.0 / 1024.0,
        ..experiment(2.31)
    });
    let equations = EquationSettings {
        method: Method::JointSensing,
        ..EquationSettings::default()
    };
    let exact = light.run();
    let mut compared = 0;
    for seed in 0..6 {
        let instants = noisy(&exact, seed);
        let batch = recorded(&light, &equations, &instants[..129 * 18]);
        let mut found = identifier(&light, 2.2, &equations);
        push_all(&mut found, &instants);
        let (MotionEstimate::WithPayload, Some(estimate)) = (batch.fit.motion, found.estimate())
        else {
            continue;
        };
        let far = distance(&estimate, &batch.estimate);
        assert!(far < 0.02, "{seed}: {far}");
        compared += 1;
    }
    assert!(compared > 1, "{compared}");
}

/// A vibration that splines do not follow is a gap: what was known before stays, and the estimate
/// becomes more precise with the samples after it.
#[test]
fn a_vibration_is_a_gap() {
    let experiment = experiment(7.0);
    let mut instants = noisy(&experiment.run(), 11);
    for instant in &mut instants {
        let since_s = instant.time_s - 4.0;
        if (0.0..0.4).contains(&since_s) {
            instant.base.pose.translation.x += 5e-3 * (TAU * 15.0 * since_s).sin();
        }
    }
    let mut identifier = identifier(&experiment, 0.1, &settings());
    push_all(&mut identifier, &instants[..4000]);
    let before = identifier.estimate().unwrap().std_devs[0];
    push_all(&mut identifier, &instants[4000..]);
    assert_eq!(identifier.motion(), MotionEstimate::WithPayload);
    let after = identifier.estimate().unwrap().std_devs[0];
    assert!(after < 0.9 * before, "{after} {before}");
    assert!(off(&identifier, payload()) < 4.0);
}

/// Once there is an estimate, it stays, whatever the rate of the samples is, from 40 Hz on. Rarer ones
/// never have one.
#[test]
fn the_answer_does_not_flicker_at_any_rate() {
    for (rate_hz, cutoff_hz) in [
        (40.0, 2.0),
        (50.0, 2.0),
        (60.0, 2.0),
        (62.5, 2.0),
        (66.0, 2.0),
        (90.0, 4.0),
        (1000.0, 10.0),
    ] {
        let experiment = Experiment {
            step_s: 1.0 / rate_hz,
            ..experiment(6.0)
        };
        let equations = EquationSettings {
            cutoff_hz,
            ..settings()
        };
        let instants = noisy(&experiment.run(), 3);
        let mut identifier = identifier(&experiment, 0.1, &equations);
        let (mut first_s, mut without) = (f64::INFINITY, 0);
        for instant in &instants {
            identifier.push(&instant.sample()).unwrap();
            match identifier.motion() {
                MotionEstimate::WithPayload => first_s = first_s.min(instant.time_s),
                _ if first_s.is_finite() => without += 1,
                _ => {}
            }
        }
        assert!(
            first_s < 3.5 && without == 0,
            "{rate_hz}: {first_s} {without}"
        );
        assert!(off(&identifier, payload()) < 4.0, "{rate_hz}");
    }
    let rare = Experiment {
        step_s: 1.0 / 33.0,
        ..experiment(6.0)
    };
    let instants = noisy(&rare.run(), 3);
    let equations = EquationSettings {
        cutoff_hz: 2.0,
        ..settings()
    };
    let mut identifier = identifier(&rare, 0.1, &equations);
    for instant in &instants {
        identifier.push(&instant.sample()).unwrap();
        assert_eq!(identifier.motion(), MotionEstimate::TooFew);
    }
}

/// A fault that begins late is seen as soon as one that was there from the beginning.
#[test]
fn a_late_fault_is_unexplained() {
    let experiment = experiment(7.5);
    let mut instants = noisy(&experiment.run(), 12);
    for instant in &mut instants {
        if instant.time_s > 6.0 {
            instant.effort[3] += 0.06 * (TAU * 5.0 * instant.time_s).sin();
        }
    }
    let mut identifier = identifier(&experiment, 0.1, &settings());
    push_all(&mut identifier, &instants[..6000]);
    assert_eq!(identifier.motion(), MotionEstimate::WithPayload);
    let mut seen_s = f64::INFINITY;
    for instant in &instants[6000..] {
        identifier.push(&instant.sample()).unwrap();
        if identifier.motion() == MotionEstimate::Unexplained {
            assert!(identifier.estimate().is_none());
            seen_s = seen_s.min(instant.time_s);
        }
    }
    assert!(seen_s < 7.0, "{seen_s}");
    assert!(identifier.estimate().is_none());
}

/// No sample is final: after one outlier, late times, and samples that lack velocities or
/// accelerations, there is an estimate again.
#[test]
fn one_odd_sample_is_not_final() {
    let experiment = experiment(4.5);
    let exact = experiment.run();
    let clean = noisy(&exact, 13);
    for (name, at, change) in [
        (
            "position",
            600,
            (|at| at.position[2] += 10.0) as fn(&mut Instant),
        ),
        ("position", 1500, |at| at.position[2] += 10.0),
        ("effort", 1500, |at| at.effort[2] += 1e4),
        ("pose", 1500, |at| at.base.pose.translation.x += 100.0),
        ("wrench", 600, |at| at.wrenches[0].force.x += 1e5),
        ("velocities", 1500, |at| at.velocity.clear()),
        ("repeated", 1500, |at| at.time_s -= 1e-3),
        ("earlier", 1500, |at| at.time_s -= 10.0),
        ("acceleration", 1500, |at| {
            at.base.acceleration = Some(Vector3::zeros())
        }),
    ] {
        let mut instants = clean.clone();
        change(&mut instants[at]);
        let mut identifier = identifier(&experiment, 0.1, &settings());
        push_all(&mut identifier, &instants);
        assert_eq!(identifier.motion(), MotionEstimate::WithPayload, "{name}");
        assert!(off(&identifier, payload()) < 4.0, "{name}");
    }
}

/// Accelerations of the base that only begin late are used from then on.
#[test]
fn accelerations_may_begin_late() {
    let experiment = experiment(4.0);
    let exact = experiment.run();
    let mut random = SmallRng::seed_from_u64(1);
    let mut instants = accelerated(&noisy(&exact, 14), &exact, [true; 2], &mut random);
    for instant in &mut instants[..1500] {
        (instant.base.acceleration, instant.base.angular_acceleration) = (None, None);
    }
    let found = lagged(&experiment, &instants, 0.1);
    assert_eq!(found.motion(), MotionEstimate::WithPayload);
    assert!(off(&found, payload()) < 4.0);
}

/// A joint that is locked, whose sensors have no noise, is no hindrance.
#[test]
fn a_locked_joint_is_exact() {
    let experiment = Experiment {
        moving: vec![1, 3, 4, 5, 6],
        ..experiment(2.5)
    };
    let exact = experiment.run();
    let mut instants = noisy(&exact, 15);
    for (instant, exact) in instants.iter_mut().zip(&exact) {
        for joint in [1, 6, 7] {
            instant.position[joint] = exact.position[joint];
            instant.velocity[joint] = 0.0;
        }
    }
    let found = lagged(&experiment, &instants, 0.1);
    assert_eq!(found.motion(), MotionEstimate::WithPayload);
    assert!(off(&found, payload()) < 4.0);
}

/// Where the online identifier starts again, the estimate does, too, also where that is no payload
/// change that is reported: a contact, while the payload is exchanged, is contradicted after the
/// change.
#[test]
fn a_silent_restart_begins_again() {
    let experiment = experiment(4.0);
    let instants = noisy(&experiment.run(), 16);
    let tactile = EquationSettings {
        method: Method::Tactile,
        ..EquationSettings::default()
    };
    let mut silent = 0;
    for (contact_s, factor) in [(0.15, 0.6), (0.15, 0.8), (0.2, 0.6)] {
        let mut identifier = identifier(&experiment, 0.1, &tactile);
        let (mut since_s, mut restarted_s) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for instant in &instants {
            let mut instant = instant.clone();
            if instant.time_s >= 2.0 {
                for wrench in &mut instant.wrenches {
                    (wrench.force, wrench.moment) = (wrench.force * factor, wrench.moment * factor);
                }
                let is_touched = instant.time_s < 2.0 + contact_s;
                instant.wrenches[0].force.x += if is_touched { 300.0 } else { 0.0 };
            }
            let outcome = identifier.push(&instant.sample()).unwrap();
            let now_s = identifier.online().estimate().since_s;
            if now_s != std::mem::replace(&mut since_s, now_s) {
                restarted_s = instant.time_s;
                silent += u32::from(outcome == PushOutcome::Used);
            }
            if identifier.estimate().is_some() {
                let used_s = identifier.until_s() - restarted_s;
                assert!(used_s > 0.79, "{contact_s} {factor}: {used_s}");
            }
        }
    }
    assert!(silent > 0, "{silent}");
}
