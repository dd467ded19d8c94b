//! The online identifier on exact samples of the project's robot.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::{
    Experiment, Instant, SENSORS, TABLE_1, TOOL, URDF, errors_percent, identifier, worst_percent,
};
use nalgebra::Vector3;
use tactid_dynamics::{BaseKind, InertialParameters, Manipulator, Workspace};
use tactid_identify::{
    EstimatorKind, Identifier, IdentifyError, PayloadEstimate, Pushed, Sample, Settings, Way,
};

fn identify(experiment: &Experiment, instants: &[Instant], settings: Settings) -> PayloadEstimate {
    let mut identifier = identifier(experiment, settings);
    for instant in instants {
        identifier.push(&instant.sample()).unwrap();
    }
    identifier.estimate()
}

fn joint_sensing() -> Settings {
    Settings {
        way: Way::JointSensing,
        ..Settings::default()
    }
}

/// Exact samples give the payload but for the fourth order of the time that polynomials reach over.
#[test]
fn least_squares_finds_the_payload_from_the_fingers() {
    let experiment = Experiment::default();
    let estimate = identify(&experiment, &experiment.run(), Settings::default());
    assert!(
        worst_percent(&estimate.body) < 1e-5,
        "{:?}",
        errors_percent(&estimate.body)
    );
    assert!(estimate.is_physical);
    assert_eq!(estimate.not_identifiable().count(), 0);
    assert_eq!(
        (estimate.intervals, estimate.refused, estimate.gaps),
        (159, 0, 0)
    );
}

/// The motion of base and links alone gives gripper and payload as one body, and the payload when
/// the gripper is taken off.
#[test]
fn least_squares_finds_the_payload_from_the_joints() {
    let experiment = Experiment::default();
    let instants = experiment.run();
    let estimate = identify(&experiment, &instants, joint_sensing());
    assert!(
        worst_percent(&estimate.body) < 1e-5,
        "{:?}",
        errors_percent(&estimate.body)
    );
    let robot = experiment.robot();
    let gripper = Workspace::new(&robot).subtree_parameters(robot.frame(TOOL).unwrap());
    let mass = estimate.composite.unwrap().mass_kg;
    assert!((mass - 100.0 - gripper.mass()).abs() < 1e-3, "{mass}");
}

/// Fingers and momentum together give what each gives alone, and need neither to be there; the paper's
/// filter cannot take their rows.
#[test]
fn least_squares_finds_the_payload_from_all_together() {
    let combined = Way::Combined { effort: false };
    let settings = Settings {
        way: combined,
        ..Settings::default()
    };
    let experiment = Experiment::default();
    let instants = experiment.run();
    let estimate = identify(&experiment, &instants, settings.clone());
    assert!(
        worst_percent(&estimate.body) < 1e-5,
        "{:?}",
        errors_percent(&estimate.body)
    );
    assert!(estimate.composite.is_none());

    let robot = experiment.robot();
    let mut identifier = Identifier::new(&robot, TOOL, &[], settings.clone()).unwrap();
    for instant in &instants {
        let sample = Sample {
            wrenches: &[],
            ..instant.sample()
        };
        identifier.push(&sample).unwrap();
    }
    let body = identifier.estimate().body;
    assert!(worst_percent(&body) < 1e-5, "{:?}", errors_percent(&body));

    let fixed = Manipulator::from_urdf(URDF, BaseKind::Fixed).unwrap();
    let nothing = Identifier::new(&fixed, TOOL, &[], settings);
    assert!(matches!(nothing, Err(IdentifyError::NoWrench)));
    let paper = Settings {
        way: combined,
        ..Settings::paper()
    };
    let refused = Identifier::new(&robot, TOOL, &SENSORS, paper);
    assert!(matches!(
        refused,
        Err(IdentifyError::NeedsLeastSquares("combined"))
    ));
}

/// Wrenches that are one sample late or early spoil the result by far more than the bound that exact
/// ones meet: alignment is what the first test tests.
#[test]
fn a_wrench_one_sample_beside_its_motion_shows() {
    let experiment = Experiment::default();
    let instants = experiment.run();
    for shift in [-1i64, 1] {
        let mut shifted = instants.clone();
        for (k, instant) in shifted.iter_mut().enumerate() {
            let from = (k as i64 + shift).clamp(0, instants.len() as i64 - 1) as usize;
            instant.wrenches.clone_from(&instants[from].wrenches);
        }
        let estimate = identify(&experiment, &shifted, Settings::default());
        assert!(
            worst_percent(&estimate.body) > 1e-2,
            "{:?}",
            errors_percent(&estimate.body)
        );
    }
}

/// A wrench of the payload on the fingers instead of the reverse makes a mass of -100 kg, which is
/// returned as what it is: impossible.
#[test]
fn a_wrench_of_the_wrong_sign_is_an_impossible_body() {
    let experiment = Experiment::default();
    let mut instants = experiment.run();
    for wrench in instants
        .iter_mut()
        .flat_map(|instant| &mut instant.wrenches)
    {
        *wrench = -*wrench;
    }
    let estimate = identify(&experiment, &instants, Settings::default());
    assert!((estimate.body.mass_kg + 100.0).abs() < 1e-2);
    assert!(!estimate.is_physical);
}

/// At the posture of the paper's Table 1 joints 3 and 6 are parallel: the motion says nothing of
/// Ixx, and the result says so, for it alone of the diagonal.
#[test]
fn ixx_is_not_identifiable_at_the_posture_of_table_1() {
    for (posture, missing) in [(TABLE_1, vec!["Ixx"]), (common::IDENTIFIABLE, vec![])] {
        let experiment = Experiment {
            posture,
            moving: vec![3, 5, 6],
            in_turn: true,
            duration_s: 15.0,
            ..Experiment::default()
        };
        let estimate = identify(&experiment, &experiment.run(), Settings::paper());
        let found: Vec<_> = estimate.not_identifiable().collect();
        assert_eq!(found, missing, "{:?}", estimate.singular_values);
    }
}

/// On the ground the weight is part of the wrench: with gravity at its default the payload comes out
/// right, and with its sign turned it does not.
#[test]
fn gravity_enters_with_its_sign() {
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let experiment = Experiment {
        base: BaseKind::Fixed,
        gravity,
        ..Experiment::default()
    };
    let instants = experiment.run();
    let estimate = identify(&experiment, &instants, Settings::default());
    assert!(
        worst_percent(&estimate.body) < 1e-5,
        "{:?}",
        errors_percent(&estimate.body)
    );
    let turned = Settings {
        gravity: Some(-gravity),
        ..Settings::default()
    };
    let estimate = identify(&experiment, &instants, turned);
    assert!(worst_percent(&estimate.body) > 50.0);
}

/// Bad samples change nothing and are counted; a gap is cut out, not bridged.
#[test]
fn bad_samples_are_refused_and_gaps_cut_out() {
    let experiment = Experiment::default();
    let instants = experiment.run();
    let mut identifier = identifier(&experiment, Settings::default());
    for (k, instant) in instants.iter().enumerate() {
        if (2000..2500).contains(&k) {
            continue;
        }
        let pushed = identifier.push(&instant.sample()).unwrap();
        assert_eq!(
            pushed,
            if k == 0 || k == 2500 {
                Pushed::Started
            } else {
                Pushed::Used
            }
        );
        let mut bad = instant.clone();
        bad.wrenches[1].moment.y = f64::NAN;
        bad.time_s += 1e-4;
        assert_eq!(identifier.push(&bad.sample()).unwrap(), Pushed::Refused);
        assert_eq!(identifier.push(&instant.sample()).unwrap(), Pushed::Refused);
    }
    let estimate = identifier.estimate();
    assert_eq!(
        (estimate.intervals, estimate.refused, estimate.gaps),
        (140, 9002, 1)
    );
    assert!(
        worst_percent(&estimate.body) < 1e-5,
        "{:?}",
        errors_percent(&estimate.body)
    );
}

/// What cannot work is refused when the identifier is made, by name.
#[test]
fn impossible_requests_are_refused() {
    let robot = Experiment::default().robot();
    let new = |tool, sensors: &[&str], settings| Identifier::new(&robot, tool, sensors, settings);
    let message = |result: Result<Identifier, IdentifyError>| result.unwrap_err().to_string();
    assert!(message(new("hand", &SENSORS, Settings::paper())).contains("no link `hand`"));
    assert!(message(new(TOOL, &["thumb"], Settings::paper())).contains("no link `thumb`"));
    assert!(matches!(
        new(TOOL, &[], Settings::paper()),
        Err(IdentifyError::NoWrench)
    ));
    let hot = EstimatorKind::Nlms {
        alpha: 2.0,
        beta: 0.9,
    };
    let settings = Settings {
        estimator: hot,
        ..Settings::paper()
    };
    assert!(message(new(TOOL, &SENSORS, settings)).contains("alpha is 2"));
    let settings = Settings {
        average_s: f64::NAN,
        ..Settings::paper()
    };
    assert!(message(new(TOOL, &SENSORS, settings)).contains("average_s"));
    let fixed = Experiment {
        base: BaseKind::Fixed,
        ..Experiment::default()
    }
    .robot();
    let result = Identifier::new(&fixed, TOOL, &SENSORS, joint_sensing());
    assert!(matches!(result, Err(IdentifyError::FixedBase)));
}

/// A sample of another robot is an error that names the joints.
#[test]
fn samples_that_do_not_fit_are_refused() {
    let experiment = Experiment {
        duration_s: 0.01,
        ..Experiment::default()
    };
    let mut identifier = identifier(&experiment, Settings::paper());
    let mut instant = experiment.run().remove(0);
    instant.wrenches.pop();
    let error = identifier.push(&instant.sample()).unwrap_err();
    assert!(matches!(
        error,
        IdentifyError::WrenchCount {
            given: 1,
            expected: 2
        }
    ));
    instant.velocity.pop();
    let error = identifier.push(&instant.sample()).unwrap_err().to_string();
    assert!(
        error.contains("joint_velocity has 7 entries") && error.contains("joint_6"),
        "{error}"
    );
}

/// The gripper is taken off where its fingers are, not where they are at zero: inertia of the
/// composite depends on the opening, the payload does not.
#[test]
fn the_gripper_is_taken_off_at_its_opening() {
    let experiment = Experiment::default();
    let robot = experiment.robot();
    let tool = robot.frame(TOOL).unwrap();
    let mut instants = experiment.run();
    let closed = Workspace::new(&robot).subtree_parameters(tool);
    for instant in &mut instants {
        instant.position[6] += 0.02;
        instant.position[7] += 0.02;
    }
    let estimate = identify(&experiment, &instants, joint_sensing());
    let composite = InertialParameters::from(estimate.composite.unwrap());
    let left = composite - InertialParameters::from(estimate.body);
    assert!((left.mass() - closed.mass()).abs() < 1e-9);
    assert!((left.as_vector() - closed.as_vector()).norm() > 1e-4);
}
