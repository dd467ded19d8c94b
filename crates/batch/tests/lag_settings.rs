//! What is known beside the samples of the estimate with a lag, and what it says beside the payload.

use tactid_batch::{LagIdentifier, LagSettings, online_findings};
use tactid_dynamics::{InertialParameters, Manipulator, MassProperties};
use tactid_identify::nalgebra::{Matrix3, Vector3};
use tactid_identify::{
    ActsOn, BaseKind, BoundingBox, EquationSettings, KnownTool, Method, OnlineSettings,
    PayloadEstimate,
};

use crate::common::{Experiment, Instant, SENSORS, TOOL, payload};
use crate::lag::{distance, experiment, identifier, lagged, noisy, settings};

fn with_settings(
    experiment: &Experiment,
    instants: &[Instant],
    given: LagSettings,
) -> LagIdentifier {
    let robot = experiment.robot();
    let mut identifier = LagIdentifier::new(&robot, TOOL, &SENSORS, &settings(), given).unwrap();
    for instant in instants {
        identifier.push(&instant.sample()).unwrap();
    }
    identifier
}

fn with_online(
    experiment: &Experiment,
    instants: &[Instant],
    online: OnlineSettings,
) -> PayloadEstimate {
    let given = LagSettings {
        online,
        ..LagSettings::default()
    };
    let found = with_settings(experiment, instants, given);
    found.estimate().unwrap()
}

/// A known tool is subtracted, with its uncertainty.
#[test]
fn a_known_tool_is_subtracted() {
    let experiment = experiment(1.5);
    let instants = noisy(&experiment.run(), 21);
    let body = MassProperties {
        mass_kg: 30.0,
        center_of_mass: Vector3::new(0.2, 0.0, 0.0),
        inertia: Matrix3::from_diagonal(&Vector3::new(2.0, 4.0, 2.0)),
    };
    let found = |known_tool| {
        let online = OnlineSettings {
            known_tool,
            ..OnlineSettings::default()
        };
        with_online(&experiment, &instants, online)
    };
    let whole = found(None);
    let exact = found(Some(KnownTool::from(body)));
    let linear = |body| *InertialParameters::from(body).as_vector();
    let sum = linear(exact.body) + linear(body);
    let sum = PayloadEstimate {
        body: InertialParameters::from_vector(sum)
            .mass_properties()
            .unwrap(),
        ..whole.clone()
    };
    assert!(distance(&sum, &whole) < 1e-3);
    let uncertain = found(Some(KnownTool::with_relative_std_dev(body, 0.1)));
    let expected = whole.std_devs[0].hypot(3.0);
    assert!((uncertain.std_devs[0] / expected - 1.0).abs() < 1e-6);
}

/// Wrenches on the sensor, and wrenches that are late, give the estimate of those on the payload at
/// the time of the motion.
#[test]
fn sign_and_delay_are_those_of_the_online_identifier() {
    let experiment = experiment(1.5);
    let instants = noisy(&experiment.run(), 22);
    let plain = with_online(&experiment, &instants, OnlineSettings::default());
    let mut negated = instants.clone();
    for wrench in negated.iter_mut().flat_map(|instant| &mut instant.wrenches) {
        (wrench.force, wrench.moment) = (-wrench.force, -wrench.moment);
    }
    let on_sensor = OnlineSettings {
        wrench_acts_on: ActsOn::Sensor,
        ..OnlineSettings::default()
    };
    let found = with_online(&experiment, &negated, on_sensor);
    assert!(distance(&found, &plain) < 1e-9);
    let late = 8;
    let mut delayed = instants[late..].to_vec();
    for (instant, before) in delayed.iter_mut().zip(&instants) {
        instant.wrenches.clone_from(&before.wrenches);
    }
    let of_delayed = OnlineSettings {
        delay_s: 8e-3,
        ..OnlineSettings::default()
    };
    let found = with_online(&experiment, &delayed, of_delayed);
    let far = distance(&found, &plain);
    assert!(far < 1.0, "{far}");
}

/// The estimate fits into a box that is given.
#[test]
fn a_bounding_box_contains_the_payload() {
    let experiment = experiment(1.5);
    let instants = noisy(&experiment.run(), 23);
    let free = lagged(&experiment, &instants, 0.1).estimate().unwrap();
    let largest_m = free.body.center_of_mass.y - free.std_devs[2];
    let bounding_box = BoundingBox {
        min: Vector3::new(-1.0, -1.0, -1.0),
        max: Vector3::new(1.0, largest_m, 1.0),
    };
    let given = LagSettings {
        bounding_box: Some(bounding_box),
        ..LagSettings::default()
    };
    let found = with_settings(&experiment, &instants, given);
    let found = found.estimate().unwrap();
    assert!(found.body.center_of_mass.y < largest_m + 1e-6);
}

/// A lag that is no time, or too short or long, and a box without volume, are errors that say what
/// would be right.
#[test]
fn settings_are_checked() {
    let robot = experiment(1.0).robot();
    let new = |given| LagIdentifier::new(&robot, TOOL, &SENSORS, &settings(), given);
    for lag_s in [f64::NAN, f64::INFINITY, -1.0, 0.0, 0.09, 11.0] {
        let given = LagSettings {
            lag_s,
            ..LagSettings::default()
        };
        let error = new(given).unwrap_err();
        assert_eq!(error.option(), Some("lag_s"));
        let words = error.to_string();
        assert!(words.ends_with("must be between 0.1 and 10"), "{words}");
    }
    let flat = BoundingBox {
        min: Vector3::zeros(),
        max: Vector3::new(1.0, 0.0, 1.0),
    };
    let given = LagSettings {
        bounding_box: Some(flat),
        ..LagSettings::default()
    };
    assert_eq!(new(given).unwrap_err().option(), Some("bounding_box"));
}

/// A robot and settings that never have an estimate are refused, with what excludes it and what to
/// use instead.
#[test]
fn what_never_has_an_estimate_is_refused() {
    let floating = experiment(1.0).robot();
    let fixed = Experiment {
        base: BaseKind::Fixed,
        ..experiment(1.0)
    };
    let tactile = EquationSettings {
        method: Method::Tactile,
        ..settings()
    };
    let mut unmeasured = tactile.clone();
    unmeasured.unmeasured[5] = true;
    let with_offset = EquationSettings {
        wrench_offset: true,
        ..tactile.clone()
    };
    let interpolated = EquationSettings {
        shared_noise_s: 0.02,
        ..tactile.clone()
    };
    let uncertain = EquationSettings {
        effort_gain_std_dev: vec![0.05],
        ..settings()
    };
    for (robot, equations, option) in [
        (&fixed.robot(), &tactile, "robot"),
        (&floating, &with_offset, "wrench_offset"),
        (&floating, &unmeasured, "unmeasured"),
        (&floating, &interpolated, "shared_noise_s"),
        (&floating, &uncertain, "effort_gain_std_dev"),
    ] {
        let given = LagSettings::default();
        let error = LagIdentifier::new(robot, TOOL, &SENSORS, equations, given).unwrap_err();
        assert_eq!(error.option(), Some(option));
        let words = error.to_string();
        assert!(words.contains("LagIdentifier does not"), "{words}");
        assert!(words.ends_with("use Identifier"), "{words}");
    }
    let sensor = Manipulator::lone_body("sensor");
    let given = LagSettings::default();
    let error = LagIdentifier::new(&sensor, "sensor", &["sensor"], &tactile, given).unwrap_err();
    assert_eq!(error.option(), Some("robot"));
}

/// The estimate says until when it has samples, `finish` uses the open bin, and the online
/// identifier has the same samples, with their findings.
#[test]
fn the_end_of_a_run_is_used() {
    let experiment = Experiment {
        step_s: 1.0 / 1024.0,
        ..experiment(2.31)
    };
    let instants = noisy(&experiment.run(), 24);
    // The last bin of 18 samples ends an interval, and is open until the next sample comes.
    let instants = &instants[..129 * 18];
    let mut identifier = identifier(&experiment, 0.1, &settings());
    assert_eq!(identifier.until_s(), f64::NEG_INFINITY);
    for instant in instants {
        identifier.push(&instant.sample()).unwrap();
    }
    let before_s = identifier.until_s();
    identifier.finish();
    let last_s = instants.last().unwrap().time_s;
    let until_s = identifier.until_s();
    assert!(
        (until_s - before_s - 0.05).abs() < 1e-9,
        "{before_s} {until_s}"
    );
    assert!(last_s - identifier.until_s() < 0.02);
    let online = identifier.online();
    let found = identifier.estimate().unwrap();
    assert_eq!(found.windows, online.estimate().windows);
    assert!(distance(&found, &online.estimate()) < 4.0);
    assert!(online_findings(&online.snapshot()).is_empty());
    let truth = PayloadEstimate {
        body: payload(),
        ..found.clone()
    };
    assert!(distance(&truth, &found) < 4.0);
}
