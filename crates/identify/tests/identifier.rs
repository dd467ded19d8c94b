//! The online identifier on exact samples of the project's robot.

use crate::common::{
    Experiment, Instant, SENSORS, TOOL, URDF, errors_percent, identifier, worst_percent,
};
use nalgebra::Vector3;
use tactid_dynamics::{BaseKind, InertialParameters, Manipulator, Workspace};
use tactid_identify::{
    EquationSettings, Identifier, IdentifyError, Method, PayloadEstimate, PushOutcome, Sample,
};

fn identify(
    experiment: &Experiment,
    instants: &[Instant],
    settings: EquationSettings,
) -> PayloadEstimate {
    let mut identifier = identifier(experiment, &settings);
    for instant in instants {
        identifier.push(&instant.sample()).unwrap();
    }
    identifier.estimate()
}

fn joint_sensing() -> EquationSettings {
    EquationSettings {
        method: Method::JointSensing,
        ..EquationSettings::default()
    }
}

/// Exact samples give the payload to the accuracy of the polynomials that differentiate them.
#[test]
fn least_squares_finds_the_payload_from_the_fingers() {
    let experiment = Experiment::default();
    let estimate = identify(&experiment, &experiment.run(), EquationSettings::default());
    assert!(
        worst_percent(&estimate.body) < 1e-5,
        "{:?}",
        errors_percent(&estimate.body)
    );
    assert!(estimate.is_physical);
    assert_eq!(estimate.not_identifiable().count(), 0);
    assert_eq!(
        (estimate.windows, estimate.rejected, estimate.gaps),
        (159, 0, 0)
    );
}

/// The motion of base and links gives gripper and payload as one body, and the payload once the
/// gripper is subtracted.
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

/// Fingers and momentum together give the payload, and so does momentum without fingers. Without
/// either the method is an error.
#[test]
fn least_squares_finds_the_payload_from_all_together() {
    let combined = Method::Combined { effort: false };
    let settings = EquationSettings {
        method: combined,
        ..EquationSettings::default()
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
    let mut identifier = Identifier::new(&robot, TOOL, &[], &settings).unwrap();
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
    let nothing = Identifier::new(&fixed, TOOL, &[], &settings);
    let error = nothing.map(drop).unwrap_err().to_string();
    assert!(error.contains("at least one wrench"), "{error}");
}

/// Wrenches that are one sample late or early make errors far beyond the bound that exact samples
/// satisfy, so the tests above detect a misalignment by one sample.
#[test]
fn a_wrench_misaligned_by_one_sample_shows() {
    let experiment = Experiment::default();
    let instants = experiment.run();
    for shift in [-1i64, 1] {
        let mut shifted = instants.clone();
        for (k, instant) in shifted.iter_mut().enumerate() {
            let from = (k as i64 + shift).clamp(0, instants.len() as i64 - 1) as usize;
            instant.wrenches.clone_from(&instants[from].wrenches);
        }
        let estimate = identify(&experiment, &shifted, EquationSettings::default());
        assert!(
            worst_percent(&estimate.body) > 1e-2,
            "{:?}",
            errors_percent(&estimate.body)
        );
    }
}

/// Wrenches with the opposite sign, of the payload on the fingers, give a mass of -100 kg, which is
/// reported as not physical.
#[test]
fn a_wrench_of_the_wrong_sign_is_not_physical() {
    let experiment = Experiment::default();
    let mut instants = experiment.run();
    for wrench in instants
        .iter_mut()
        .flat_map(|instant| &mut instant.wrenches)
    {
        *wrench = -*wrench;
    }
    let estimate = identify(&experiment, &instants, EquationSettings::default());
    assert!((estimate.body.mass_kg + 100.0).abs() < 1e-2);
    assert!(!estimate.is_physical);
}

/// On the ground the wrench contains the weight: the default gravity gives the payload, and the
/// opposite sign does not.
#[test]
fn gravity_enters_with_its_sign() {
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let experiment = Experiment {
        base: BaseKind::Fixed,
        gravity,
        ..Experiment::default()
    };
    let instants = experiment.run();
    let estimate = identify(&experiment, &instants, EquationSettings::default());
    assert!(
        worst_percent(&estimate.body) < 1e-5,
        "{:?}",
        errors_percent(&estimate.body)
    );
    let opposite = EquationSettings {
        gravity: Some(-gravity),
        ..EquationSettings::default()
    };
    let estimate = identify(&experiment, &instants, opposite);
    assert!(worst_percent(&estimate.body) > 50.0);
}

/// Invalid samples are counted and change nothing, and no window spans a gap.
#[test]
fn bad_samples_are_rejected_and_gaps_are_not_bridged() {
    let experiment = Experiment::default();
    let instants = experiment.run();
    let mut identifier = identifier(&experiment, &EquationSettings::default());
    for (k, instant) in instants.iter().enumerate() {
        if (2000..2500).contains(&k) {
            continue;
        }
        let pushed = identifier.push(&instant.sample()).unwrap();
        assert_eq!(
            pushed,
            if k == 0 || k == 2500 {
                PushOutcome::Started
            } else {
                PushOutcome::Used
            }
        );
        let mut bad = instant.clone();
        bad.wrenches[1].moment.y = f64::NAN;
        bad.time_s += 1e-4;
        assert_eq!(
            identifier.push(&bad.sample()).unwrap(),
            PushOutcome::Rejected
        );
        assert_eq!(
            identifier.push(&instant.sample()).unwrap(),
            PushOutcome::Rejected
        );
    }
    let estimate = identifier.estimate();
    assert_eq!(
        (estimate.windows, estimate.rejected, estimate.gaps),
        (140, 9002, 1)
    );
    assert!(
        worst_percent(&estimate.body) < 1e-5,
        "{:?}",
        errors_percent(&estimate.body)
    );
}

/// Rejected samples do not count towards those among which the update by a window is divided: with
/// sparse samples the estimate includes a window as soon as the sample that ends it is used,
/// however many are rejected between them.
#[test]
fn rejected_samples_do_not_defer_an_update() {
    let experiment = Experiment {
        step_s: 5e-3,
        ..Experiment::default()
    };
    let settings = EquationSettings::default();
    let mut once = identifier(&experiment, &settings);
    let mut repeated = identifier(&experiment, &settings);
    for instant in experiment.run() {
        let outcome = once.push(&instant.sample()).unwrap();
        assert_eq!(repeated.push(&instant.sample()).unwrap(), outcome);
        // Many samples come before the first window ends, and its update is divided among those
        // that follow.
        if instant.time_s > 0.5 {
            // The values differ where the projection has not settled yet: it takes a step with each
            // sample.
            assert_eq!(once.covariance(), repeated.covariance());
        }
        for _ in 0..10 {
            let outcome = repeated.push(&instant.sample()).unwrap();
            assert_eq!(outcome, PushOutcome::Rejected);
        }
    }
}

/// A request that cannot work is an error at construction, which names its cause.
#[test]
fn impossible_requests_are_errors() {
    let robot = Experiment::default().robot();
    let equations = EquationSettings::default();
    let online =
        |tool: &str, sensors: &[&str]| Identifier::new(&robot, tool, sensors, &equations).map(drop);
    let message = |result: Result<(), IdentifyError>| result.unwrap_err().to_string();
    assert!(message(online("hand", &SENSORS)).contains("no link `hand`"));
    assert!(message(online(TOOL, &["thumb"])).contains("no link `thumb`"));
    assert!(message(online(TOOL, &[])).contains("at least one wrench"));
    let fixed = Experiment {
        base: BaseKind::Fixed,
        ..Experiment::default()
    }
    .robot();
    let result = Identifier::new(&fixed, TOOL, &SENSORS, &joint_sensing());
    assert!(message(result.map(drop)).contains("needs a free-floating base"));
}

/// A sample whose slices do not fit the robot is an error that names the joints.
#[test]
fn samples_that_do_not_fit_are_errors() {
    let experiment = Experiment {
        duration_s: 0.01,
        ..Experiment::default()
    };
    let settings = EquationSettings::default();
    let mut identifier = identifier(&experiment, &settings);
    let mut instant = experiment.run().remove(0);
    instant.wrenches.pop();
    let error = identifier.push(&instant.sample()).unwrap_err().to_string();
    assert_eq!(error, "a sample has 1 wrenches, but there are 2 sensors");
    instant.velocity.pop();
    let error = identifier.push(&instant.sample()).unwrap_err().to_string();
    assert!(
        error.contains("joint_velocity has 7 entries") && error.contains("joint_6"),
        "{error}"
    );
}

/// The gripper is subtracted at the position of its fingers and not at their zero position, on
/// which its inertia depends.
#[test]
fn the_gripper_is_subtracted_at_its_opening() {
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
    let gripper = composite - InertialParameters::from(estimate.body);
    assert!((gripper.mass() - closed.mass()).abs() < 1e-9);
    assert!((gripper.as_vector() - closed.as_vector()).norm() > 1e-4);
}
