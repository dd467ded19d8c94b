//! Errors for experiments that cannot be run.

use std::path::PathBuf;

use tactid_sim::{Experiment, SimError, Simulation};

fn run(experiment: &Experiment) -> Result<(), SimError> {
    let mut simulation = Simulation::new(experiment)?;
    while simulation.steps() < simulation.total_steps() {
        simulation.step()?;
    }
    Ok(())
}

fn short() -> Experiment {
    let mut experiment = Experiment::paper();
    experiment.duration_s = 6.0;
    experiment
}

/// A payload that slips because of low friction is reported with advice.
#[test]
fn a_slippery_payload_is_reported() {
    let mut experiment = short();
    experiment.gripper.friction = 0.01;
    let error = run(&experiment).unwrap_err();
    let SimError::Bound { field, time_s, .. } = &error else {
        panic!("{error}")
    };
    assert!(field.starts_with("grasp_drift") && *time_s > 0.0, "{error}");
    assert!(
        error
            .to_string()
            .contains("raise gripper.grip_force_n or gripper.friction"),
        "{error}"
    );
}

/// A payload that is too heavy for the grip is reported as slipping.
#[test]
fn a_payload_too_heavy_is_reported() {
    let mut experiment = short();
    experiment.gripper.grip_force_n = Some(60.0);
    experiment.payload.mass_kg = 1000.0;
    experiment.payload.inertia_kg_m2 = [100.0, 0.0, 0.0, 200.0, 0.0, 100.0];
    let error = run(&experiment).unwrap_err();
    let SimError::Bound { field, .. } = &error else {
        panic!("{error}")
    };
    assert!(field.starts_with("grasp_drift"), "{error}");
}

/// A light payload is held by the default grip, and a grip that its soft contacts cannot bear is
/// refused with advice.
#[test]
fn a_light_payload_is_gripped_gently() {
    let mut experiment = short();
    experiment.payload.mass_kg = 0.1;
    experiment.payload.center_of_mass_m = [0.22, 0.0, 0.1];
    experiment.payload.inertia_kg_m2 = [1e-4, 0.0, 0.0, 2e-4, 0.0, 1e-4];
    run(&experiment).unwrap();

    // Held far from its centre of mass, it resists a force as 1/(1/0.5 + 0.17²/6e-4) kg do.
    experiment.payload.mass_kg = 0.5;
    experiment.payload.center_of_mass_m = [0.05, 0.0, 0.075];
    experiment.payload.inertia_kg_m2 = [6e-4, 0.0, 0.0, 6e-4, 0.0, 6e-4];
    assert!((experiment.grip_force_n() - 19.934).abs() < 1e-3);
    run(&experiment).unwrap();

    experiment.gripper.grip_force_n = Some(1500.0);
    let error = run(&experiment).unwrap_err().to_string();
    assert!(error.contains("lower gripper.grip_force_n"), "{error}");
}

/// A handle that the pads cannot reach, and one that is not between them, are reported.
#[test]
fn a_handle_out_of_reach_is_reported() {
    let mut experiment = short();
    experiment.payload.handle.size_m[1] = 0.2;
    let error = run(&experiment).unwrap_err().to_string();
    assert!(
        error.contains("finger_left_joint") && error.contains("payload.handle"),
        "{error}"
    );

    let mut experiment = short();
    experiment.payload.handle.center_m[0] = 0.6;
    let error = run(&experiment).unwrap_err().to_string();
    assert!(
        error.contains("presses with 0.0 N in place of 1500 N"),
        "{error}"
    );
}

/// A drift of momentum above its bound aborts the run with the name of the bound.
#[test]
fn a_bound_that_is_exceeded_is_named() {
    let mut experiment = short();
    experiment.bounds.momentum_drift = 1e-9;
    let error = run(&experiment).unwrap_err().to_string();
    assert!(
        error.contains("bounds.momentum_drift") && error.contains("make step_s shorter"),
        "{error}"
    );
}

/// A robot that does not fit the experiment is reported with field, value, and what the robot has.
#[test]
fn a_robot_that_does_not_fit_is_reported() {
    type Change = fn(&mut Experiment);
    let cases: [(Change, &str); 7] = [
        (
            |e| e.robot.tool = "flange".into(),
            "robot.tool = \"flange\": there is no such link; the robot has base_link, ",
        ),
        (
            |e| e.robot.fingers[0] = "thumb".into(),
            "robot.fingers[0] = \"thumb\": there is no such joint: a finger needs a prismatic joint that closes the \
             gripper as its position increases; the robot has joint_1 (revolute), ",
        ),
        (
            |e| e.robot.fingers[1] = "joint_4".into(),
            "robot.fingers[1] = \"joint_4\": this joint is revolute: a finger needs a prismatic joint",
        ),
        (
            |e| e.excitation.joints[0].name = "elbow".into(),
            "excitation.joints[0].name = \"elbow\": there is no such joint; the arm has joint_1, joint_2, ",
        ),
        (
            |e| e.posture = tactid_sim::Posture::Joints(vec![0.0; 5]),
            "posture = [0.0, 0.0, 0.0, 0.0, 0.0]: has 5 joint positions, but the arm has 6 joints: give one for each of \
             joint_1, ",
        ),
        (
            |e| e.posture = tactid_sim::Posture::Joints(vec![0.0, 7.0, 0.0, 0.0, 0.0, 0.0]),
            "joint `joint_2` would begin at 7, outside its limits -6.28",
        ),
        (
            |e| e.robot.urdf = Some(PathBuf::from("/no/such.urdf")),
            "cannot read `/no/such.urdf`",
        ),
    ];
    for (change, expected) in cases {
        let mut experiment = short();
        change(&mut experiment);
        let error = run(&experiment).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// Reading refuses a file that does not fit its robot, with the line; a default is called so.
#[test]
fn a_file_is_checked_against_its_robot() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("experiment.toml");
    let urdf = tactid_sim::BUILT_IN_URDF.replace("joint_", "axis_");
    std::fs::write(folder.path().join("other.urdf"), urdf).unwrap();
    for (text, expected) in [
        (
            "[robot]\ntool = 'flange'\n",
            "line 2: robot.tool = \"flange\": there is no such link",
        ),
        (
            "[robot]\nfingers = ['a', 'b']",
            "line 2: robot.fingers[0] = \"a\": there is no such joint",
        ),
        (
            "[robot]\nurdf = 'other.urdf'\n",
            "excitation.joints[0].name = \"joint_3\" (the default): there is no such joint; the arm has axis_1, ",
        ),
        (
            "[[excitation.joints]]\nname = 'joint_1'\n[[excitation.joints]]\nname = 'elbow'",
            "line 4: excitation.joints[1].name = \"elbow\": there is no such joint",
        ),
        (
            "seed = 1\nposture = [0, 0]\n",
            "line 2: posture = [0.0, 0.0]: has 2 joint positions",
        ),
    ] {
        std::fs::write(&path, text).unwrap();
        let expected = format!("{}: {expected}", path.display());
        let error = Experiment::from_file(&path).unwrap_err().to_string();
        assert!(error.starts_with(&expected), "{text}: {error}");
    }
}

/// The simulation reads URDFs as `tactid_dynamics` does: names with an undeclared prefix are
/// ignored, and a fault is reported with the same error.
#[test]
fn urdfs_are_read_as_the_dynamics_read_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.urdf");
    let run_with = |urdf: &str| {
        std::fs::write(&path, urdf).unwrap();
        let mut experiment = short();
        experiment.robot.urdf = Some(path.clone());
        Simulation::new(&experiment).map(|simulation| simulation.joint_names().to_vec())
    };
    let built_in = Simulation::new(&short()).unwrap().joint_names().to_vec();
    let prefixed = tactid_sim::BUILT_IN_URDF.replace("<limit ", "<limit drake:acceleration='5' ");
    assert!(prefixed.len() > tactid_sim::BUILT_IN_URDF.len());
    assert_eq!(run_with(&prefixed).unwrap(), built_in);
    let broken = tactid_sim::BUILT_IN_URDF.replace("<box size=\"", "<box size=\"-");
    assert!(broken.len() > tactid_sim::BUILT_IN_URDF.len());
    let error = run_with(&broken).unwrap_err();
    assert!(matches!(error, SimError::Model(_)), "{error}");
}
