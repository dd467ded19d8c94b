//! The log depends on the experiment only, contains the samples, and is complete after an
//! interruption.

use std::ops::ControlFlow;
use std::path::PathBuf;

use tactid_logs::LogReader;
use tactid_logs::messages::{JointState, Odometry, PointCloud2, WrenchStamped};
use tactid_sim::{Experiment, SimError, Simulation, run};

/// A log file that is removed after the test.
struct TempFile(PathBuf);

impl TempFile {
    fn new(name: &str) -> Self {
        let name = format!("tactid-sim-{}-{name}.mcap", std::process::id());
        Self(std::env::temp_dir().join(name))
    }
}

impl Drop for TempFile {
    fn drop(&mut self) {
        std::fs::remove_file(&self.0).ok();
    }
}

fn short() -> Experiment {
    let mut experiment = Experiment::paper();
    experiment.duration_s = 1.2;
    experiment
}

fn record(experiment: &Experiment, name: &str) -> (TempFile, Vec<u8>) {
    let file = TempFile::new(name);
    run(experiment, &file.0, |_| ControlFlow::Continue(())).unwrap();
    let bytes = std::fs::read(&file.0).unwrap();
    (file, bytes)
}

/// The same experiment gives the same bytes, and another seed gives other commands and other
/// measurements.
#[test]
fn the_log_is_a_function_of_the_experiment() {
    let mut experiment = short();
    experiment.noise.finger_force_n = 0.1.into();
    let (_a, first) = record(&experiment, "first");
    let (_b, second) = record(&experiment, "second");
    assert!(first == second, "the same seed gave another log");
    experiment.seed = 1;
    let (_c, third) = record(&experiment, "third");
    assert!(first != third, "another seed gave the same log");
}

/// Every topic has its rate and the values of the samples.
#[test]
fn the_log_holds_the_samples() {
    let experiment = short();
    let (file, _) = record(&experiment, "samples");
    let log = LogReader::open(&file.0).unwrap();
    for (topic, count) in [
        ("/robot_description", 1),
        ("/tf_static", 1),
        ("/tf", 60),
        ("/joint_states", 1200),
        ("/base/odom", 1200),
        ("/base/imu", 1200),
        ("/finger_left/wrench", 1200),
        ("/finger_right/wrench", 1200),
        ("/finger_left/contacts", 12),
        ("/finger_right/contacts", 12),
    ] {
        assert_eq!(log.topic(topic).unwrap().count, count, "{topic}");
    }
    let mut simulation = Simulation::new(&experiment).unwrap();
    let mut joints = log.messages_on(["/joint_states"]).unwrap();
    let mut odometry = log.messages_on(["/base/odom"]).unwrap();
    let mut wrench = log.messages_on(["/finger_right/wrench"]).unwrap();
    for k in 0..100 {
        let sample = simulation.step().unwrap();
        let message: JointState = joints.next().unwrap().unwrap().decode().unwrap();
        assert_eq!(message.header.stamp.as_ns(), 1_000_000_000 + k * 1_000_000);
        assert_eq!(message.position, sample.joint_position);
        assert_eq!(message.velocity, sample.joint_velocity);
        assert_eq!(message.effort, sample.joint_torque);
        let message: Odometry = odometry.next().unwrap().unwrap().decode().unwrap();
        assert_eq!(
            (&*message.header.frame_id, &*message.child_frame_id),
            ("world", "base_link")
        );
        let in_base = sample.base.pose.rotation.inverse() * sample.base.velocity;
        assert_eq!(message.twist.twist.linear.x, in_base.x);
        let message: WrenchStamped = wrench.next().unwrap().unwrap().decode().unwrap();
        assert_eq!(message.header.frame_id, "finger_right_link");
        assert_eq!(message.wrench.force.z, sample.fingers[1].wrench.force.z);
        assert_eq!(message.wrench.torque.x, sample.fingers[1].wrench.moment.x);
    }
    let mut clouds = log.messages_on(["/finger_left/contacts"]).unwrap();
    let cloud: PointCloud2 = clouds.next().unwrap().unwrap().decode().unwrap();
    assert_eq!(
        (cloud.width, cloud.height, cloud.data.len()),
        (4, 1, 4 * 24)
    );
}

/// The metadata contains experiment, ground truth and report, and nothing that depends on the run.
#[test]
fn the_log_contains_experiment_truth_and_report() {
    let experiment = short();
    let (file, _) = record(&experiment, "metadata");
    let log = LogReader::open(&file.0).unwrap();
    let metadata = log.metadata();
    let toml = &metadata["tactid.experiment"]["toml"];
    assert_eq!(Experiment::from_toml(toml).unwrap(), experiment);
    let truth: serde_json::Value = serde_json::from_str(&metadata["tactid.truth"]["json"]).unwrap();
    assert_eq!(truth["frame"], "tool0");
    assert_eq!(truth["mass"], 100.0);
    assert!((truth["com"]["x"].as_f64().unwrap() - 0.5).abs() < 1e-6);
    assert!((truth["inertia"]["yy"].as_f64().unwrap() - 20.0).abs() < 1e-4);
    assert_eq!(truth["nominal"]["inertia"]["zz"], 10.0);
    let report: serde_json::Value =
        serde_json::from_str(&metadata["tactid.report"]["json"]).unwrap();
    assert_eq!(report["steps"], 1200);
    assert!(report["linear_momentum_drift"].as_f64().unwrap() < 1e-3);
    assert!(report.get("wall_time_s").is_none());
}

/// An observer that stops the run leaves a complete, shorter log.
#[test]
fn an_interrupted_run_leaves_a_log() {
    let file = TempFile::new("interrupted");
    let report = run(&short(), &file.0, |progress| {
        assert_eq!(progress.total_steps, 1200);
        if progress.time_s > 0.499 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })
    .unwrap();
    assert!(report.interrupted);
    assert_eq!(report.steps, 500);
    let log = LogReader::open(&file.0).unwrap();
    assert!(log.damage().is_empty());
    assert_eq!(log.messages_on(["/joint_states"]).unwrap().count(), 500);
}

/// An aborted run leaves its log up to the failure, with the reason, under a name that nobody takes
/// for a sound run's.
#[test]
fn a_failed_run_leaves_a_log() {
    let file = TempFile::new("failed");
    let mut experiment = short();
    experiment.gripper.friction = 0.01;
    let error = run(&experiment, &file.0, |_| ControlFlow::Continue(())).unwrap_err();
    let SimError::Aborted { reason, log } = &error else {
        panic!("{error}");
    };
    assert!(matches!(**reason, SimError::Bound { .. }), "{error}");
    assert!(!file.0.exists());
    let failed = TempFile(file.0.with_extension("failed.mcap"));
    assert_eq!(*log, failed.0);
    let log = LogReader::open(log).unwrap();
    assert!(log.messages_on(["/joint_states"]).unwrap().count() > 0);
    let report = &log.metadata()["tactid.report"]["json"];
    let report: serde_json::Value = serde_json::from_str(report).unwrap();
    assert_eq!(report["error"], reason.to_string());
    // The log of the next one does not replace it.
    let error = run(&experiment, &file.0, |_| ControlFlow::Continue(())).unwrap_err();
    let second = TempFile(file.0.with_extension("failed_2.mcap"));
    assert!(matches!(&error, SimError::Aborted { log, .. } if *log == second.0));
    assert!(failed.0.exists() && second.0.exists());
}

/// The error for a missing folder contains its path.
#[test]
fn a_log_that_cannot_be_written_is_reported() {
    let error = run(&short(), "/no/such/folder/run.mcap".as_ref(), |_| {
        ControlFlow::Continue(())
    })
    .unwrap_err();
    assert!(
        error.to_string().contains("/no/such/folder/run.mcap"),
        "{error}"
    );
}
