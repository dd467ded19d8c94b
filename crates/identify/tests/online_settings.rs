//! What an online identifier knows of the load and of the wrenches gives the result of samples from
//! which it has been taken.

use crate::arm::{Instant, Run, TOOL, arm, body};
use crate::handling;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::{BaseKind, InertialParameters, Wrench};
use tactid_identify::{
    ActsOn, EquationSettings, Identifier, KnownTool, OnlineSettings, PushOutcome, WORLD,
};

const RATE_HZ: f64 = 500.0;

fn instants() -> Vec<Instant> {
    let run = Run {
        base: BaseKind::Fixed,
        rate_hz: RATE_HZ,
        payloads: vec![(0.0, body(3.2, [0.03, -0.02, 0.09], [0.2, 0.15, 0.25]))],
        duration_s: 4.0,
        gap_s: None,
        motion_seed: 4,
    };
    let mut instants = handling::stopping(&run, 100.0, |_, _| Wrench::zero());
    let mut random = SmallRng::seed_from_u64(4);
    let mut draw =
        |std_dev: f64| Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal));
    for instant in &mut instants {
        instant.wrench.force += draw(0.3);
        instant.wrench.moment += draw(0.02);
    }
    instants
}

fn identifier(online: &OnlineSettings) -> Identifier {
    let settings = EquationSettings::default();
    Identifier::with_settings(&arm(BaseKind::Fixed), TOOL, &[TOOL], &settings, online).unwrap()
}

/// Pushes the motion of each instant with a wrench.
fn push(identifier: &mut Identifier, instants: &[Instant], wrench: impl Fn(usize) -> Wrench) {
    for (k, instant) in instants.iter().enumerate() {
        let outcome = identifier.push(&instant.sample(&[wrench(k)])).unwrap();
        assert_ne!(outcome, PushOutcome::Rejected);
    }
    identifier.finish();
}

fn assert_same(found: &Identifier, expected: &Identifier, tolerance: f64) {
    let (found, expected) = (found.estimate(), expected.estimate());
    assert_eq!(found.windows, expected.windows);
    for (k, (a, b)) in found.values().iter().zip(expected.values()).enumerate() {
        assert!((a - b).abs() <= tolerance * b.abs(), "{k}: {a} {b}");
        let [a, b] = [found.std_devs[k], expected.std_devs[k]];
        assert!((a - b).abs() <= tolerance * b, "{k}: {a} {b}");
    }
}

/// Wrenches on the sensor give the same payload, and a contact of the opposite sign.
#[test]
fn wrenches_may_act_on_the_sensor() {
    let instants = instants();
    let mut expected = identifier(&OnlineSettings::default());
    push(&mut expected, &instants, |k| instants[k].wrench);
    let mut found = identifier(&OnlineSettings {
        wrench_acts_on: ActsOn::Sensor,
        ..OnlineSettings::default()
    });
    push(&mut found, &instants, |k| {
        Wrench::zero() - instants[k].wrench
    });
    assert_same(&found, &expected, 0.0);
    let contact = |identifier: &Identifier| {
        let frame = identifier.wrench_frame(TOOL, Some(WORLD)).unwrap();
        identifier.contact_wrench(&frame).unwrap().wrench.force
    };
    assert_eq!(contact(&found), -contact(&expected));
}

/// A delay of whole samples gives the result of wrenches that are moved by as many samples, in
/// either direction, and one of parts of a sample nearly that of wrenches without a delay. Given
/// too late, it shows in the result.
#[test]
fn a_given_delay_is_subtracted() {
    let instants = instants();
    let count = instants.len();
    for samples in [6usize, 40] {
        let delay_s = samples as f64 / RATE_HZ;
        // The wrench of each instant comes `samples` later, or earlier.
        let mut expected = identifier(&OnlineSettings::default());
        push(&mut expected, &instants[..count - samples], |k| {
            instants[k].wrench
        });
        let mut late = identifier(&OnlineSettings {
            delay_s,
            ..OnlineSettings::default()
        });
        push(&mut late, &instants, |k| {
            instants[k.saturating_sub(samples)].wrench
        });
        let mut late_direct = identifier(&OnlineSettings::default());
        let latest = &instants[..count];
        push(&mut late_direct, latest, |k| {
            instants[k.saturating_sub(samples)].wrench
        });
        let [a, b, c] = [&late, &expected, &late_direct].map(|i| i.estimate().values()[4]);
        assert!((a - b).abs() < 0.2 * (c - b).abs(), "{a} {b} {c}");
        assert!(late.estimate().windows >= expected.estimate().windows - 1);
        let mut early = identifier(&OnlineSettings {
            delay_s: -delay_s,
            ..OnlineSettings::default()
        });
        push(&mut early, &instants[..count - samples], |k| {
            instants[k + samples].wrench
        });
        let mut expected = identifier(&OnlineSettings::default());
        push(&mut expected, &instants[samples..count - samples], |k| {
            instants[k + samples].wrench
        });
        assert_same(&early, &expected, 1e-9);
    }
}

/// A clock that goes back by 50 ms in the motion starts a stretch, and leaves the estimate within
/// its intervals, also where wrenches act on the sensor or come with a delay.
#[test]
fn a_clock_that_goes_back_starts_a_stretch() {
    let mut instants = instants();
    let middle = instants.len() / 2;
    for instant in &mut instants[middle..] {
        instant.time_s -= 0.05;
    }
    for (wrench_acts_on, samples) in [
        (ActsOn::Payload, 0),
        (ActsOn::Sensor, 0),
        (ActsOn::Sensor, 6),
    ] {
        let mut found = identifier(&OnlineSettings {
            wrench_acts_on,
            delay_s: samples as f64 / RATE_HZ,
            ..OnlineSettings::default()
        });
        let mut started = Vec::new();
        for (k, instant) in instants.iter().enumerate() {
            let wrench = instants[k.saturating_sub(samples)].wrench;
            let wrench = match wrench_acts_on {
                ActsOn::Payload => wrench,
                ActsOn::Sensor => Wrench::zero() - wrench,
            };
            if found.push(&instant.sample(&[wrench])).unwrap() == PushOutcome::Started {
                started.push(k);
            }
        }
        let [_, after] = started[..] else {
            panic!("{started:?}")
        };
        assert!((middle + 2..middle + 12).contains(&after), "{after}");
        let estimate = found.estimate();
        let error = (estimate.body.mass_kg - 3.2).abs();
        assert!(
            error < 4.0 * estimate.std_devs[0],
            "{error} {:?}",
            estimate.std_devs
        );
    }
}

/// A stamp far in the future costs the window around it, and does not stop the identifier.
#[test]
fn a_stamp_far_in_the_future_is_left_behind() {
    let mut instants = instants();
    let middle = instants.len() / 2;
    for samples in [0, 6] {
        let run = |instants: &[Instant]| {
            let mut found = identifier(&OnlineSettings {
                delay_s: samples as f64 / RATE_HZ,
                ..OnlineSettings::default()
            });
            for (k, instant) in instants.iter().enumerate() {
                let wrench = instants[k.saturating_sub(samples)].wrench;
                found.push(&instant.sample(&[wrench])).unwrap();
            }
            found.finish();
            found.estimate()
        };
        instants[middle].time_s += 1e9;
        let found = run(&instants);
        instants[middle].time_s -= 1e9;
        let whole = run(&instants);
        assert_eq!((found.rejected, whole.rejected), (2, 0));
        // Windows overlap by more than half.
        assert!(found.windows + 5 > whole.windows, "{}", found.windows);
        let error = (found.body.mass_kg - 3.2).abs();
        assert!(error < 4.0 * found.std_devs[0], "{error}");
    }
}

/// A known tool is subtracted from the load, and its uncertainty is part of that of the payload.
#[test]
fn a_known_tool_is_subtracted() {
    let instants = instants();
    let mut load = identifier(&OnlineSettings::default());
    push(&mut load, &instants, |k| instants[k].wrench);
    let tool = body(0.9, [0.0, 0.01, 0.05], [0.1, 0.1, 0.05]);
    let given = KnownTool::with_relative_std_dev(tool, 0.01);
    let mut payload = identifier(&OnlineSettings {
        known_tool: Some(given),
        ..OnlineSettings::default()
    });
    push(&mut payload, &instants, |k| instants[k].wrench);
    let parameters = |body| *InertialParameters::from(body).as_vector();
    let rest = parameters(load.estimate().body) - parameters(tool);
    let found = parameters(payload.estimate().body);
    assert!((found - rest).norm() < 1e-9, "{found} {rest}");
    let sum = load.covariance().unwrap() + given.covariance;
    assert!((payload.covariance().unwrap() - sum).norm() < 1e-12);
    let [of_payload, of_load] = [&payload, &load].map(|i| i.estimate().std_devs[0]);
    assert!((of_payload - of_load.hypot(9e-3)).abs() < 1e-6);
    let frame = payload.wrench_frame(TOOL, None).unwrap();
    let carried = payload.load_wrench(&frame).unwrap();
    assert_eq!(Some(carried), load.load_wrench(&frame));
    // Nothing else is measured, but for an offset of zero and noise of 0.3 N and 0.02 N m.
    let lag_s = |instant: &&Instant| (instant.time_s - carried.time_s).abs();
    let felt = instants.iter().min_by(|a, b| lag_s(a).total_cmp(&lag_s(b)));
    let error = carried.wrench - felt.unwrap().wrench;
    assert!(error.force.norm() < 1.5, "{error:?} of {carried:?}");
    assert!(error.moment.norm() < 0.15, "{error:?} of {carried:?}");
}

/// A delay of more than a second is refused.
#[test]
fn a_long_delay_is_refused() {
    let settings = EquationSettings::default();
    let online = OnlineSettings {
        delay_s: 12.0,
        ..OnlineSettings::default()
    };
    let robot = arm(BaseKind::Fixed);
    let error = Identifier::with_settings(&robot, TOOL, &[TOOL], &settings, &online).unwrap_err();
    assert_eq!(error.option(), Some("delay_s"));
}
