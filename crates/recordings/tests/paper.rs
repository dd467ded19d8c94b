//! The paper's filter, online, on exact samples of the project's robot.

use crate::common::{self, Experiment, SENSORS, TABLE_1, TOOL};
use allocation_counter::measure;
use tactid_identify::{EquationSettings, IdentifyError};
use tactid_recordings::{Method, PaperFilter, PaperSettings};

/// The filter with the paper's settings.
fn paper_filter(experiment: &Experiment, settings: &EquationSettings) -> PaperFilter {
    let robot = experiment.robot();
    PaperFilter::new(&robot, TOOL, &SENSORS, settings, PaperSettings::default()).unwrap()
}

/// Neither a sample nor an estimate allocates.
#[test]
fn push_and_estimate_allocate_nothing() {
    let experiment = Experiment {
        duration_s: 0.5,
        ..Experiment::default()
    };
    let instants = experiment.run();
    for method in [Method::Tactile, Method::JointSensing] {
        let settings = EquationSettings {
            method,
            ..EquationSettings::default()
        };
        let mut filter = paper_filter(&experiment, &settings);
        let allocations = measure(|| {
            for instant in &instants {
                filter.push(&instant.sample()).unwrap();
            }
            assert_eq!(filter.estimate().windows, 13);
        });
        assert_eq!(allocations.count_total, 0);
    }
}

/// Settings out of range, links that the robot does not have and a method without a force and a
/// moment on the end-effector are errors, which name their cause.
#[test]
fn impossible_requests_are_errors() {
    let robot = Experiment::default().robot();
    let equations = EquationSettings::default();
    let with = |tool: &str, sensors: &[&str], settings| {
        PaperFilter::new(&robot, tool, sensors, &equations, settings).map(drop)
    };
    let new = |tool: &str, sensors: &[&str]| with(tool, sensors, PaperSettings::default());
    let message = |result: Result<(), IdentifyError>| result.unwrap_err().to_string();
    assert!(message(new("hand", &SENSORS)).contains("no link `hand`"));
    assert!(message(new(TOOL, &["thumb"])).contains("no link `thumb`"));
    assert!(message(new(TOOL, &[])).contains("at least one wrench"));
    let defaults = PaperSettings::default();
    for (settings, name) in [
        (
            PaperSettings {
                alpha: 2.0,
                ..defaults
            },
            "`alpha` is 2",
        ),
        (
            PaperSettings {
                average_s: f64::NAN,
                ..defaults
            },
            "average_s",
        ),
        (
            PaperSettings {
                epochs: 0,
                ..defaults
            },
            "epochs",
        ),
    ] {
        assert!(message(with(TOOL, &SENSORS, settings)).contains(name));
    }
    let combined = EquationSettings {
        method: Method::Combined { effort: false },
        ..equations.clone()
    };
    let error = PaperFilter::new(&robot, TOOL, &SENSORS, &combined, defaults).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("which the combined method does not compute"),
        "{error}"
    );
}

/// A sample whose slices do not fit the robot is an error that names the joints.
#[test]
fn samples_that_do_not_fit_are_errors() {
    let experiment = Experiment {
        duration_s: 0.01,
        ..Experiment::default()
    };
    let mut filter = paper_filter(&experiment, &EquationSettings::default());
    let mut instant = experiment.run().remove(0);
    instant.wrenches.pop();
    let error = filter.push(&instant.sample()).unwrap_err().to_string();
    assert_eq!(error, "a sample has 1 wrenches, but there are 2 sensors");
    instant.velocity.pop();
    let error = filter.push(&instant.sample()).unwrap_err().to_string();
    assert!(
        error.contains("joint_velocity has 7 entries") && error.contains("joint_6"),
        "{error}"
    );
}

/// At the posture of the paper's Table 1 joints 3 and 6 are parallel, so that the motion does not
/// determine Ixx. The result reports it, and no other value.
#[test]
fn ixx_is_not_identifiable_at_the_posture_of_table_1() {
    for (posture, missing) in [(TABLE_1, vec!["Ixx"]), (common::IDENTIFIABLE, vec![])] {
        let experiment = Experiment {
            posture,
            moving: vec![3, 5, 6],
            in_sequence: true,
            duration_s: 15.0,
            ..Experiment::default()
        };
        let mut filter = paper_filter(&experiment, &EquationSettings::default());
        for instant in experiment.run() {
            filter.push(&instant.sample()).unwrap();
        }
        let estimate = filter.estimate();
        let found: Vec<_> = estimate.unobservable().collect();
        assert_eq!(found, missing, "{:?}", filter.singular_values());
    }
}
