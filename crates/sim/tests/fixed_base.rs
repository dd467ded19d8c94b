//! A robot that is bolted to the ground, under gravity.

use std::ops::ControlFlow;

use crate::common;
use nalgebra::{Isometry3, Vector3};
use tactid_logs::LogReader;
use tactid_logs::messages::TFMessage;
use tactid_sim::{BaseMount, Experiment, Sample, Simulation, run};

/// Returns an experiment with the built-in arm on the ground, which holds 4 kg and drives three
/// joints together.
fn bench() -> Experiment {
    Experiment::from_toml(
        "duration_s = 9.0
        [robot]
        base = 'fixed'
        [payload]
        mass_kg = 4.0
        center_of_mass_m = [0.25, 0.01, 0.08]
        inertia_kg_m2 = [0.02, 0.005, 0.0, 0.03, 0.0, 0.02]
        [excitation]
        mode = 'together'
        [[excitation.joints]]
        name = 'joint_3'
        frequency_hz = 0.5
        [[excitation.joints]]
        name = 'joint_5'
        frequency_hz = 0.7
        amplitude_rad_s2 = 4.0
        [[excitation.joints]]
        name = 'joint_6'
        frequency_hz = 0.9
        amplitude_rad_s2 = 8.0",
    )
    .unwrap()
}

/// Returns the experiment without motion of the joints.
fn still() -> Experiment {
    let mut experiment = bench();
    for joint in &mut experiment.excitation.joints {
        joint.amplitude_rad_s2 = 0.0;
    }
    experiment.duration_s = 3.0;
    experiment
}

/// Returns the force on the payload in the world frame.
fn force_in_world(sample: &Sample) -> Vector3<f64> {
    let fingers = sample.fingers.iter();
    fingers
        .map(|finger| finger.pose.rotation * finger.wrench.force)
        .sum()
}

/// The base does not move, the payload stays in the grasp, the fingers bear its weight, and the arm
/// holds its posture against it.
#[test]
fn the_arm_holds_the_weight() {
    let experiment = still();
    let mut simulation = Simulation::new(&experiment).unwrap();
    let weight = experiment.payload.mass_kg * 9.81;
    for _ in 0..simulation.total_steps() {
        let sample = simulation.step().unwrap();
        assert_eq!(sample.base.pose, Isometry3::identity());
        assert_eq!(sample.base.velocity, Vector3::zeros());
        let force = force_in_world(sample);
        let error = (force - weight * Vector3::z()).norm();
        assert!(error < 0.01 * weight, "at {} s: {force}", sample.time_s);
        let specific_force = sample.imu.acceleration;
        assert_eq!(specific_force, 9.81 * Vector3::z());
        let positions = sample.joint_position.iter();
        for (position, start) in positions.zip(experiment.posture.positions()) {
            assert!((position - start).abs() < 1e-4, "at {} s", sample.time_s);
        }
    }
    let checks = simulation.checks();
    assert_eq!(checks.linear_momentum_drift, None);
    assert!(checks.grasp_drift_m < 1e-4, "{checks:?}");
    assert!(checks.grasp_drift_rad < 1e-4, "{checks:?}");
    assert!(checks.newton_residual < 1e-9, "{checks:?}");
}

/// Returns the largest error of mass, centre of mass and inertia, each as a fraction of the largest
/// value of its kind, and the error of the joint torques against the inverse dynamics.
fn errors(experiment: &Experiment) -> (f64, f64) {
    let mut simulation = Simulation::new(experiment).unwrap();
    let mut identifier = common::Identifier::new(&simulation).unwrap();
    for _ in 0..simulation.total_steps() {
        identifier.push(simulation.step().unwrap()).unwrap();
    }
    // The weight moves the payload in the grasp by some micrometres.
    let (truth, nominal) = (
        simulation.payload_in_tool(),
        experiment.payload.mass_properties(),
    );
    assert!((truth.center_of_mass - nominal.center_of_mass).norm() < 5e-5);
    let found = identifier.tactile().unwrap();
    let mass = (found.mass_kg / truth.mass_kg - 1.0).abs();
    let center = (found.center_of_mass - truth.center_of_mass).amax() / truth.center_of_mass.amax();
    let inertia = (found.inertia - truth.inertia).amax() / truth.inertia.amax();
    (mass.max(center).max(inertia), identifier.torque_error())
}

/// Least squares on the samples determines the payload as well as on a floating base, and the joint
/// torques agree with the inverse dynamics with gravity.
#[test]
fn the_samples_identify_the_payload() {
    let mut experiment = bench();
    let (fixed, torque_error) = errors(&experiment);
    assert!(torque_error < 0.02, "{torque_error}");
    experiment.robot.base = BaseMount::Floating;
    let (floating, _) = errors(&experiment);
    assert!(fixed < 1e-3 && fixed < 1.5 * floating, "{fixed} {floating}");
}

/// Gravity acts where the experiment says, and the base needs no mass.
#[test]
fn gravity_points_where_it_is_said_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.urdf");
    let inertial = tactid_sim::BUILT_IN_URDF.find("<inertial>").unwrap();
    let end = tactid_sim::BUILT_IN_URDF.find("</inertial>").unwrap() + "</inertial>".len();
    let mut urdf = tactid_sim::BUILT_IN_URDF.to_owned();
    urdf.replace_range(inertial..end, "");
    std::fs::write(&path, urdf).unwrap();
    let mut experiment = still();
    experiment.robot.urdf = Some(path.clone());
    experiment.gravity_m_s2 = Some([0.0, 3.0, 1.0]);
    let mut simulation = Simulation::new(&experiment).unwrap();
    let force = force_in_world(simulation.step().unwrap());
    let expected: Vector3<f64> = -4.0 * Vector3::new(0.0, 3.0, 1.0);
    assert!((force - expected).norm() < 0.5, "{force:?}");

    experiment.gravity_m_s2 = None;
    experiment.robot.base = BaseMount::Floating;
    let error = Simulation::new(&experiment).err().unwrap().to_string();
    assert!(
        error.contains("the floating base `base_link` has no mass"),
        "{error}"
    );
}

/// The log has neither odometry nor an inertial unit, and a static transform for the base.
#[test]
fn the_log_has_no_odometry() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let experiment = Experiment {
        duration_s: 0.2,
        ..bench()
    };
    run(&experiment, &path, |_| ControlFlow::Continue(())).unwrap();
    let log = LogReader::open(&path).unwrap();
    for topic in ["/base/odom", "/base/imu"] {
        assert!(log.topic(topic).is_none(), "{topic}");
    }
    let mut transforms = log.messages_on(["/tf_static"]).unwrap();
    let transforms: TFMessage = transforms.next().unwrap().unwrap().decode().unwrap();
    let base = &transforms.transforms[0];
    assert_eq!(
        (&*base.header.frame_id, &*base.child_frame_id),
        ("world", "base_link")
    );
    assert_eq!(base.transform.translation.x, 0.0);
    let report: serde_json::Value =
        serde_json::from_str(&log.metadata()["tactid.report"]["json"]).unwrap();
    assert!(report["linear_momentum_drift"].is_null());
}
