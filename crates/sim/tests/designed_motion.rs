//! An arm that follows the motion in a file.

use std::path::Path;

use tactid_sim::{Experiment, Posture, Simulation};

/// Posture in which the motion begins, rad.
const START: [f64; 6] = [0.1, -1.0, 1.4, -0.4, 1.5, 0.2];

/// Duration of the motion, s, which ends within a step.
const DURATION_S: f64 = 0.4996;

/// Returns the position of a joint: a cosine from rest to rest, rad.
fn position(joint: usize, time_s: f64) -> f64 {
    let phase = std::f64::consts::PI * (time_s / DURATION_S).min(1.0);
    START[joint] + 0.002 * (joint as f64 + 1.0) * (1.0 - phase.cos())
}

/// Writes the motion with a row for each 10 ms, and one at the end.
fn write(file: &Path) {
    let columns = |prefix: &str| {
        (1..=6)
            .map(|k| format!(",{prefix}joint_{k}"))
            .collect::<String>()
    };
    let mut text = format!("time_s{}{}\n", columns("q_"), columns("qd_"));
    for row in 0..=50 {
        let time_s = (0.01 * f64::from(row)).min(DURATION_S);
        let rate = |joint: usize| {
            let h = 1e-5;
            let (low, high) = ((time_s - h).max(0.0), time_s + h);
            (position(joint, high) - position(joint, low)) / (high - low)
        };
        text += &time_s.to_string();
        (0..6).for_each(|joint| text += &format!(",{}", position(joint, time_s)));
        (0..6).for_each(|joint| text += &format!(",{}", rate(joint)));
        text.push('\n');
    }
    std::fs::write(file, text).unwrap();
}

/// The arm begins where the motion begins and follows it, and the experiment ends with it.
#[test]
fn the_arm_follows_its_motion() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("trajectory.csv"));
    let file = folder.path().join("experiment.toml");
    std::fs::write(
        &file,
        "[excitation]\nkind = 'designed'\nfile = 'trajectory.csv'\n",
    )
    .unwrap();
    let experiment = Experiment::from_file(&file).unwrap();
    let Posture::Joints(posture) = &experiment.posture else {
        panic!("the posture comes from the motion")
    };
    assert!(
        posture
            .iter()
            .zip(START)
            .all(|(a, b)| (a - b).abs() < 1e-15)
    );
    assert!((experiment.duration_s - 0.5).abs() < 1e-12);
    let mut followed = Experiment::paper();
    followed
        .follow(&folder.path().join("trajectory.csv"))
        .unwrap();
    assert_eq!(experiment, followed);

    let mut simulation = Simulation::new(&experiment).unwrap();
    assert_eq!(simulation.total_steps(), 500);
    let mut largest = 0.0_f64;
    for _ in 0..500 {
        let sample = simulation.step().unwrap();
        for joint in 0..6 {
            let error = sample.joint_position[joint] - position(joint, sample.time_s);
            largest = largest.max(error.abs());
        }
    }
    assert!(largest < 1e-5, "{largest}");
    assert!(simulation.checks().grasp_drift_m < 1e-4);
}

/// Fields that contradict the motion, and motions that do not fit the arm, are refused.
#[test]
fn faults_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(&path.join("trajectory.csv"));
    let text = std::fs::read_to_string(path.join("trajectory.csv")).unwrap();
    std::fs::write(path.join("five.csv"), text.replace("joint_6", "joint_7")).unwrap();
    let far = text.replacen("\n0.01,", "\n0.01,700", 1);
    std::fs::write(path.join("far.csv"), far).unwrap();
    let file = path.join("experiment.toml");
    for (fields, expected) in [
        (
            "kind = 'designed'",
            "line 2: excitation.kind = \"designed\": needs the motion",
        ),
        (
            "file = 'trajectory.csv'",
            "line 2: excitation.file = \"trajectory.csv\": is used only with",
        ),
        ("kind = 'designed'\nfile = 'none.csv'", "none.csv`: "),
        (
            "kind = 'designed'\nfile = 'five.csv'",
            "five.csv: the arm has the joint joint_6, which the motion lacks; it moves joint_1, ",
        ),
        (
            "kind = 'designed'\nfile = 'far.csv'",
            "far.csv: line 3: joint_1 is at 7000.1",
        ),
    ] {
        std::fs::write(&file, format!("[excitation]\n{fields}\n")).unwrap();
        let message = Experiment::from_file(&file).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    let posture =
        "posture = [0, 0, 0, 0, 0, 0]\n[excitation]\nkind = 'designed'\nfile = 'trajectory.csv'\n";
    std::fs::write(&file, posture).unwrap();
    let message = Experiment::from_file(&file).unwrap_err().to_string();
    assert!(message.contains("line 1: posture = "), "{message}");
    assert!(
        message.contains("the motion of excitation.file begins at [0.1, -1.0,"),
        "{message}"
    );
}
