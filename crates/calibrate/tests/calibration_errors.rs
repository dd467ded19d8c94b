//! What a calibration refuses, and how it counts samples.

use nalgebra::Vector3;
use tactid_batch::BatchSettings;
use tactid_calibrate::{
    CalibrateError, Calibration, CalibrationSettings, EffortRecorder, KnownPayload, calibrate,
};
use tactid_dynamics::{BaseKind, Manipulator};
use tactid_identify::{BaseState, PushOutcome, Sample};

use crate::effort_arm::{JOINTS, RATE_HZ, TOOL, World, arm, described, record, recorded};

fn recorder(robot: &Manipulator, tool: &str) -> Result<EffortRecorder, CalibrateError> {
    EffortRecorder::new(robot, tool, &CalibrationSettings::default())
}

/// Asserts that a result is an error with a phrase in its text.
#[track_caller]
fn assert_error<T>(result: Result<T, CalibrateError>, phrase: &str) {
    match result {
        Ok(_) => panic!("no error, expected: {phrase}"),
        Err(error) => assert!(error.to_string().contains(phrase), "{error}"),
    }
}

/// A floating base, a tool that no joint moves, unknown links and settings out of range are errors.
#[test]
fn a_recorder_refuses_what_it_cannot_record() {
    assert_error(
        recorder(&arm(&[1.0; JOINTS], BaseKind::Floating), TOOL),
        "the base floats",
    );
    assert_error(recorder(&described(), "link_0"), "no joint moves the tool");
    assert_error(recorder(&described(), "hand"), "no link `hand`");
    let settings = CalibrationSettings::default();
    for (name, settings) in [
        (
            "cutoff_hz",
            CalibrationSettings {
                cutoff_hz: 0.0,
                ..settings
            },
        ),
        (
            "max_gap_s",
            CalibrationSettings {
                max_gap_s: f64::NAN,
                ..settings
            },
        ),
        (
            "gain_std_dev",
            CalibrationSettings {
                gain_std_dev: 1.0,
                ..settings
            },
        ),
        (
            "gravity",
            CalibrationSettings {
                gravity: Some(Vector3::repeat(f64::INFINITY)),
                ..settings
            },
        ),
    ] {
        assert_error(EffortRecorder::new(&described(), TOOL, &settings), name);
    }
}

/// Recordings without efforts, without windows, with samples too far apart, without motion, or too
/// short in all.
#[test]
fn too_little_data_is_an_error() {
    let push = |count: usize, period_s: f64, effort: &[f64]| {
        let mut recorder = recorder(&described(), TOOL).unwrap();
        for k in 0..count {
            let at = [0.1 * (k as f64 * period_s).sin(); JOINTS];
            let effort: Vec<f64> = effort.iter().map(|effort| effort + at[0]).collect();
            let sample = Sample {
                time_s: k as f64 * period_s,
                base: BaseState::fixed(),
                joint_position: &at,
                joint_velocity: &[],
                joint_effort: &effort,
                wrenches: &[],
            };
            recorder.push(&sample).unwrap();
        }
        recorder.finish()
    };
    let effort = [1.0; JOINTS];
    assert_error(push(100, 0.01, &[]), "no joint efforts");
    assert_error(push(20, 0.01, &effort), "too few windows");
    assert_error(push(100, 0.099, &effort), "too few samples");

    let settings = CalibrationSettings::default();
    assert_error(calibrate(&[], &settings), "too few windows");
    let mut world = World::new(1);
    let short = record(&mut world, None, 2.5);
    assert_error(
        calibrate(&[(short.clone(), None)], &settings),
        "too few windows",
    );
    let light = KnownPayload::of_mass(0.0, 0.0);
    assert_error(
        calibrate(&[(short.clone(), Some(light))], &settings),
        "payload_mass_kg",
    );
    world.motion = [0.0; JOINTS];
    let still = record(&mut world, None, 10.0);
    assert_error(calibrate(&[(still, None)], &settings), "no joint moves");

    world.motion = [1.0; JOINTS];
    let calibration = calibrated(&mut world);
    let brief = record(&mut world, None, 1.3);
    let settings = BatchSettings::default();
    assert!(brief.windows() > 0);
    assert_error(
        calibration.identify(&[brief], &[], &settings),
        "too few windows",
    );
    assert_error(
        calibration.identify(&[], &[short], &settings),
        "too few windows",
    );
}

fn calibrated(world: &mut World) -> Calibration {
    let unloaded = record(world, None, 8.0);
    calibrate(&[(unloaded, None)], &CalibrationSettings::default())
        .unwrap()
        .calibration
}

/// A calibration of another robot, tool, cutoff or gravity is refused by name.
#[test]
fn a_calibration_is_checked_against_robot_and_recordings() {
    let mut world = World::new(2);
    let calibration = calibrated(&mut world);
    let robot = described();
    calibration.check(&robot, TOOL).unwrap();
    assert_error(calibration.check(&robot, "link_4"), "the tool `tool`");
    let other = Calibration {
        joints: ["joint_1", "joint_2", "elbow", "joint_4"]
            .map(String::from)
            .to_vec(),
        ..calibration.clone()
    };
    assert_error(
        other.check(&robot, TOOL),
        "the joint `elbow`, where the robot has `joint_3`",
    );
    assert_error(
        calibration.check(&robot, "link_3"),
        "the joint `joint_4`, where the robot has none: use a calibration of this robot to this tip",
    );

    let measured = world.measure(None, 8.0);
    let settings = BatchSettings::default();
    let heavier = arm(&[1.0, 1.2, 1.0, 1.0], BaseKind::Fixed);
    let of_heavier = recorded(&heavier, &measured, &CalibrationSettings::default());
    for error in [
        calibration.check(&heavier, TOOL).unwrap_err(),
        calibration
            .identify(&[of_heavier], &[], &settings)
            .unwrap_err(),
    ] {
        let expected = "of another robot, whose link `link_2` has the mass 13 kg instead of 15.6";
        assert!(error.to_string().contains(expected), "{error}");
    }

    let faster = CalibrationSettings {
        cutoff_hz: 3.0,
        ..CalibrationSettings::default()
    };
    let faster = recorded(&robot, &measured, &faster);
    assert_error(
        calibration.identify(std::slice::from_ref(&faster), &[], &settings),
        "cutoff_hz",
    );
    let usual = recorded(&robot, &measured, &CalibrationSettings::default());
    let mixed = [(usual, None), (faster, None)];
    assert_error(
        calibrate(&mixed, &CalibrationSettings::default()),
        "cutoff_hz",
    );
    let weightless = CalibrationSettings {
        gravity: Some(Vector3::zeros()),
        ..CalibrationSettings::default()
    };
    let weightless = recorded(&robot, &measured, &weightless);
    assert_error(calibration.compare(&weightless, None), "gravity");
}

/// Data that do not fit together are refused with the name of the field. Every unknown has a name.
#[test]
fn faulty_calibrations_are_refused() {
    type Fault = fn(&mut Calibration);
    let calibration = calibrated(&mut World::new(3));
    let broken: [(&str, Fault); 11] = [
        ("`parameters`", |c| c.parameters.truncate(3)),
        ("`precision`", |c| c.precision[7] = f64::NAN),
        ("`precision`", |c| c.precision[0] = -1.0),
        ("`scales`", |c| c.scales[0] = -1.0),
        ("`scales`", |c| c.scales[0] = 0.0),
        ("`parameters`", |c| {
            let of_last_joint = c.parameters.len() - 2;
            c.parameters[of_last_joint] = 0.0;
        }),
        ("`gravity`", |c| c.gravity.x = f64::NAN),
        ("`noise`", |c| c.noise[1].white = 0.0),
        ("`friction_widths`", |c| c.friction_widths = vec![0.3]),
        ("`reference_torques`", |c| c.reference_torques.push(1.0)),
        ("friction of `joint_2` at 1 rad/s (m/s) is -", |c| {
            let names = c.parameter_names().unwrap();
            for (name, parameter) in names.iter().zip(&mut c.parameters) {
                if name.starts_with("joint_2 friction") || name == "joint_2 viscous friction" {
                    *parameter = -*parameter;
                }
            }
        }),
    ];
    for (field, fault) in broken {
        let mut faulty = calibration.clone();
        fault(&mut faulty);
        assert_error(faulty.check(&described(), TOOL), field);
    }
    let names = calibration.parameter_names().unwrap();
    assert_eq!(names.len(), calibration.parameters.len());
    let last = &*names[names.len() - 1];
    assert_eq!((&*names[0], last), ("link_1 mass", "delay"));
    assert_eq!(names[names.len() - 2], "joint_4 inverse gain");
}

/// A joint at rest with an effort of zero leaves everything finite; one that moves without is an
/// error, as are efforts that are all constant.
#[test]
fn joints_without_effort_do_no_harm() {
    let settings = CalibrationSettings::default();
    let mut world = World::new(4);
    let mut without_effort = |scale: f64| {
        world.motion[3] = scale;
        let mut measured = world.measure(None, 8.0);
        measured.iter_mut().for_each(|[.., effort]| effort[3] = 0.0);
        measured
    };
    let moving = recorded(&described(), &without_effort(1.0), &settings);
    assert_error(
        calibrate(&[(moving, None)], &settings),
        "`joint_4` never changes",
    );
    let mut measured = without_effort(0.0);
    let recording = recorded(&described(), &measured, &settings);
    let loaded = [recording.clone()];
    let result = calibrate(&[(recording, None)], &settings).unwrap();
    let joints = result.report.joints;
    assert!(joints.iter().all(|joint| joint.residual_after.is_finite()));
    let found = result
        .calibration
        .identify(&loaded, &[], &BatchSettings::default())
        .unwrap();
    assert!(found.parameters.iter().all(|entry| entry.is_finite()));
    measured
        .iter_mut()
        .for_each(|[.., effort]| *effort = [0.0; JOINTS]);
    let recording = recorded(&described(), &measured, &settings);
    assert_error(
        calibrate(&[(recording, None)], &settings),
        "no joint efforts",
    );
}

/// Repeated messages are dropped, unless the robot rests for long; faulty ones are counted.
#[test]
fn repeated_and_rejected_samples_are_counted() {
    let mut recorder = recorder(&described(), TOOL).unwrap();
    let push = |recorder: &mut EffortRecorder, time_s: f64, at: f64, effort: &[f64]| {
        let sample = Sample {
            time_s,
            base: BaseState::fixed(),
            joint_position: &[at; JOINTS],
            joint_velocity: &[],
            joint_effort: effort,
            wrenches: &[],
        };
        recorder.push(&sample).unwrap()
    };
    let effort = [1.0; JOINTS];
    let period_s = 1.0 / RATE_HZ;
    assert_eq!(push(&mut recorder, 0.0, 0.0, &effort), PushOutcome::Started);
    assert_eq!(
        push(&mut recorder, period_s, 0.1, &effort),
        PushOutcome::Used
    );
    assert_eq!(
        push(&mut recorder, 2.0 * period_s, 0.1, &effort),
        PushOutcome::Rejected
    );
    assert_eq!((recorder.repeated(), recorder.rejected()), (1, 0));
    assert_eq!(
        push(&mut recorder, 1.5 * period_s, 0.2, &[]),
        PushOutcome::Rejected
    );
    assert_eq!(
        push(&mut recorder, 0.0, 0.2, &effort),
        PushOutcome::Rejected
    );
    assert_eq!(
        push(&mut recorder, 3.0 * period_s, f64::NAN, &effort),
        PushOutcome::Rejected
    );
    assert_eq!((recorder.repeated(), recorder.rejected()), (1, 3));
    // A robot at rest for two seconds: no gap.
    for k in 4..254 {
        push(&mut recorder, f64::from(k) * period_s, 0.1, &effort);
    }
    assert_eq!(recorder.gaps(), 0);
    assert!(recorder.repeated() > 100);
    assert_eq!(push(&mut recorder, 3.0, 0.3, &effort), PushOutcome::Started);
    assert_eq!(recorder.gaps(), 1);
    let error = recorder.push(&Sample {
        time_s: 4.0,
        base: BaseState::fixed(),
        joint_position: &[0.0],
        joint_velocity: &[],
        joint_effort: &[],
        wrenches: &[],
    });
    assert_error(error, "joint_position has 1 entries");
}
