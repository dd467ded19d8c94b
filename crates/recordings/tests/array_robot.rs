//! The robot of arrays, whose base is fixed unless its motion is given, and their unloaded
//! reference.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use crate::common::{Experiment, Instant, TOOL, URDF, payload};
use crate::recorded_arrays::{Recording, quick, recorded};
use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, Manipulator, Notice, Severity, Urdf,
    Workspace, forces, motion,
};
use tactid_recordings::{
    Arrays, Finding, Identification, Method, RecordingError, Request, UnloadedArrays,
    identify_arrays,
};

const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// A URDF in the request is the robot of arrays: its base floats where poses are given.
#[test]
fn a_urdf_is_the_robot_of_arrays() {
    let mut recording = recorded();
    let expected = recording.identify(&quick()).unwrap();
    let request = Request {
        urdf: Some(Urdf::from_xml(URDF).unwrap()),
        ..quick()
    };
    let error = recording.identify(&request).unwrap_err();
    let text = error.to_string();
    assert!(
        text.starts_with("`robot` and `urdf` are both given"),
        "{text}"
    );
    recording.robot = None;
    let found = recording.identify(&request).unwrap();
    assert_eq!(found.estimate.body, expected.estimate.body);
    assert_eq!(found.recording.gravity_m_s2, Vector3::zeros());
}

/// The motion of the base is an error for a robot whose base is fixed, whichever array has it.
#[test]
fn a_fixed_base_has_no_motion() {
    let mut recording = recorded();
    recording.robot = Some(Manipulator::from_urdf(URDF, BaseKind::Fixed).unwrap());
    let assert_names = |change: fn(&mut Recording), expected: &str| {
        let text = recording.error(change).to_string();
        let expected = format!("`{expected}` is about a base that moves");
        assert!(text.starts_with(&expected), "{text}");
    };
    assert_names(|_| {}, "pose");
    assert_names(|r| r.poses.clear(), "twist");
    assert_names(
        |r| {
            r.poses.clear();
            r.accelerations.append(&mut r.twists);
        },
        "acceleration",
    );
}

/// An arm on a fixed base whose joints have friction, with the efforts of its joints.
struct Arm {
    times_s: Vec<f64>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

impl Arm {
    /// The arm in a motion that begins `start_s` after the first sample.
    fn new(loaded: bool, start_s: f64) -> Self {
        let experiment = Experiment {
            base: BaseKind::Fixed,
            duration_s: 8.0,
            step_s: 4e-3,
            ..Experiment::default()
        };
        let robot = experiment.robot();
        let tip = robot.frame(TOOL).unwrap();
        let held = InertialParameters::from(payload());
        let robot = if loaded {
            robot.with_payload(tip, &held)
        } else {
            robot
        };
        let instants = experiment.run();
        let step_s = experiment.step_s;
        let still = (start_s / step_s).round() as usize;
        let first = instants.iter().take(1).cycle().take(still);
        let mut arm = Self {
            times_s: Vec::new(),
            position: Vec::new(),
            velocity: Vec::new(),
            effort: Vec::new(),
        };
        for (k, instant) in first.chain(&instants).enumerate() {
            arm.times_s.push(step_s * k as f64);
            arm.position.extend(&instant.position);
            arm.velocity.extend(&instant.velocity);
            let accelerations = accelerations(&instants, instant, step_s);
            arm.effort.extend(efforts(&robot, instant, &accelerations));
        }
        arm
    }

    /// Lets the angle of the first joint start again, by a whole turn, halfway through its range.
    fn start_again_in_the_middle(&mut self) {
        let angles = self.position.iter().step_by(8);
        let (low, high) = angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), angle| {
            (low.min(*angle), high.max(*angle))
        });
        for angle in self.position.iter_mut().step_by(8) {
            if *angle > 0.5 * (low + high) {
                *angle -= TAU;
            }
        }
    }

    fn identify(
        &self,
        unloaded: &Self,
        request: &Request,
    ) -> Result<Identification, RecordingError> {
        let robot = Manipulator::from_urdf(URDF, BaseKind::Fixed).unwrap();
        let arrays = Arrays {
            robot: Some(&robot),
            time: &self.times_s,
            q: &self.position,
            qd: &self.velocity,
            effort: &self.effort,
            unloaded: Some(UnloadedArrays {
                time: &unloaded.times_s,
                q: &unloaded.position,
                effort: &unloaded.effort,
            }),
            ..Arrays::default()
        };
        let found = identify_arrays(&arrays, request, &mut |_| ControlFlow::Continue(()));
        found.map(|found| found.into_least_squares().unwrap())
    }
}

/// Returns the accelerations of the joints at an instant, by differences of the velocities.
fn accelerations(instants: &[Instant], at: &Instant, step_s: f64) -> Vec<f64> {
    let k = (at.time_s / step_s).round() as usize;
    let (before, after) = (k.saturating_sub(1), (k + 1).min(instants.len() - 1));
    let span_s = instants[after].time_s - instants[before].time_s;
    let pairs = instants[before]
        .velocity
        .iter()
        .zip(&instants[after].velocity);
    pairs
        .map(|(before, after)| (after - before) / span_s)
        .collect()
}

/// Returns the efforts that a motion needs, with friction of 20 N m.
fn efforts(robot: &Manipulator, instant: &Instant, acceleration: &[f64]) -> Vec<f64> {
    let mut workspace = Workspace::new(robot);
    let joints = JointMotion {
        position: &instant.position,
        velocity: &instant.velocity,
        acceleration,
    };
    motion(
        &mut workspace,
        &FrameMotion::at_rest(Isometry3::identity()),
        joints,
    )
    .unwrap();
    forces(&mut workspace, &DOWN);
    let needed = workspace.joint_torques().unwrap();
    let friction = instant
        .velocity
        .iter()
        .map(|rate| 20.0 * (rate / 0.02).tanh());
    needed.iter().zip(friction).map(|(a, b)| a + b).collect()
}

/// Whether a result says that the efforts of the unloaded arm have another unit.
fn is_scaled(found: &Identification) -> bool {
    let findings = &found.recording.findings;
    findings
        .iter()
        .any(|finding| matches!(finding, Finding::UnloadedEffortsScaled { .. }))
}

/// Motor currents contradict the weight of the unloaded arm: the load would be wrong by the same
/// ratios, without another sign of it. Their signs and their ratios may differ between joints.
#[test]
fn currents_without_gains_are_named() {
    let with_gains = |gains: [f64; 8]| {
        let request = Request {
            method: Some(Method::Effort),
            ..quick()
        };
        let arms = [Arm::new(true, 0.0), Arm::new(false, 1.3)];
        let [loaded, unloaded] = arms.map(|mut arm| {
            for (k, effort) in arm.effort.iter_mut().enumerate() {
                *effort *= gains[k % 8];
            }
            arm
        });
        loaded.identify(&unloaded, &request).unwrap()
    };
    assert!(!is_scaled(&with_gains([1.0; 8])));
    let of_arm = |second: f64, third: f64| [1.0, second, third, 1.0, 1.0, 1.0, 1.0, 1.0];
    for (gains, severity) in [
        (of_arm(0.1, 0.08), Severity::Contradicts),
        (of_arm(-0.1, 0.08), Severity::Contradicts),
        (of_arm(10.0, 12.0), Severity::Doubts),
    ] {
        let found = with_gains(gains);
        let finding = found
            .recording
            .findings
            .iter()
            .find(|finding| matches!(finding, Finding::UnloadedEffortsScaled { .. }));
        let finding = finding.unwrap();
        assert_eq!(finding.severity(), severity, "{finding}");
        let Finding::UnloadedEffortsScaled { joints, ratios, .. } = finding else {
            unreachable!()
        };
        assert_eq!(joints, &["joint_2", "joint_3"]);
        for (ratio, gain) in ratios.iter().zip(&gains[1..]) {
            // Friction is up to two thirds of what the weight needs.
            assert!((ratio / gain - 1.0).abs() < 0.35, "{ratio}");
        }
    }
}

/// The efforts of an unloaded reference are subtracted, whenever its motion begins: with them
/// friction does not matter, and without them it does.
#[test]
fn an_unloaded_reference_is_subtracted() {
    let (loaded, unloaded) = (Arm::new(true, 0.0), Arm::new(false, 1.3));
    let request = Request {
        method: Some(Method::Effort),
        ..quick()
    };
    let found = loaded.identify(&unloaded, &request).unwrap();
    let mass_kg = found.estimate.body.mass_kg;
    assert!((mass_kg - 100.0).abs() < 0.2, "{mass_kg}");
    assert_eq!(found.recording.gravity_m_s2, DOWN);
    let gains = Request {
        effort_gain: Some(vec![0.5; 8]),
        ..request
    };
    let halved = loaded.identify(&unloaded, &gains).unwrap();
    assert!(!is_scaled(&halved));
    let mass_kg = halved.estimate.body.mass_kg;
    assert!((mass_kg - 50.0).abs() < 0.2, "{mass_kg}");
    // Given gains have a standard deviation of 5 %; with 10 % they cause twice as much. The effects
    // of the eight gains sum to the mass, so the root of the sum of their squares is at least the
    // mass divided by √8: 0.88 kg with 5 %.
    let of_gains_kg = |std_dev: Option<f64>| {
        let request = Request {
            effort_gain_std_dev: std_dev.map(|std_dev| vec![std_dev]),
            ..gains.clone()
        };
        let found = loaded.identify(&unloaded, &request).unwrap();
        let noise_fraction = found.fit.noise_fraction[0];
        found.estimate.std_devs[0] * (1.0 - noise_fraction).sqrt()
    };
    let claimed_kg = of_gains_kg(None);
    assert!((0.88..5.0).contains(&claimed_kg), "{claimed_kg}");
    assert!((of_gains_kg(Some(0.1)) / claimed_kg - 2.0).abs() < 1e-6);
    assert!(of_gains_kg(Some(0.0)) == 0.0);
}

/// An angle that starts again after a turn, in both motions or in one alone, is the same angle.
#[test]
fn an_unloaded_reference_may_start_angles_again() {
    let request = Request {
        method: Some(Method::Effort),
        ..quick()
    };
    let arms = || (Arm::new(true, 0.0), Arm::new(false, 1.3));
    let (loaded, unloaded) = arms();
    let expected = loaded.identify(&unloaded, &request).unwrap().estimate.body;
    for starts_again in [[true, true], [true, false], [false, true]] {
        let (mut loaded, mut unloaded) = arms();
        for (arm, starts_again) in [&mut loaded, &mut unloaded].into_iter().zip(starts_again) {
            if starts_again {
                arm.start_again_in_the_middle();
            }
        }
        let found = loaded.identify(&unloaded, &request).unwrap().estimate.body;
        let error_kg = found.mass_kg - expected.mass_kg;
        assert!(error_kg.abs() < 1e-3, "{starts_again:?}: {error_kg}");
    }
}

/// Arrays are not their own unloaded reference: nothing would be left of the load.
#[test]
fn the_recording_itself_is_no_unloaded_reference() {
    let loaded = Arm::new(true, 0.0);
    let request = Request {
        method: Some(Method::Effort),
        ..quick()
    };
    let error = loaded.identify(&loaded, &request).unwrap_err();
    assert!(matches!(error, RecordingError::Together(_)), "{error}");
}

/// An unloaded reference of another method, of another length or of another motion is an error.
#[test]
fn an_unloaded_reference_that_does_not_fit_is_an_error() {
    let (loaded, mut unloaded) = (Arm::new(true, 0.0), Arm::new(false, 0.0));
    let tactile = Request {
        method: Some(Method::JointSensing),
        ..quick()
    };
    let error = loaded.identify(&unloaded, &tactile).unwrap_err();
    assert!(!error.to_string().is_empty());
    let combined = Request {
        method: Some(Method::Combined { effort: true }),
        ..quick()
    };
    let error = loaded.identify(&unloaded, &combined).unwrap_err();
    assert_eq!(error.option(), Some("method"), "{error}");
    let advice =
        "use this method, or leave the unloaded recording out; `method` chooses the method";
    assert!(error.to_string().ends_with(advice), "{error}");
    unloaded.position[3] = f64::NAN;
    let found = loaded.identify(&unloaded, &quick()).unwrap();
    let counted = found
        .recording
        .faults
        .iter()
        .any(|fault| fault.topic == "unloaded" && fault.count == 1);
    assert!(counted, "{:?}", found.recording.faults);
    unloaded.effort.pop();
    let error = loaded.identify(&unloaded, &quick()).unwrap_err();
    assert!(
        error.to_string().starts_with("`unloaded.effort` has"),
        "{error}"
    );
    let mut short = Arm::new(false, 0.0);
    short.times_s.truncate(2);
    short.position.truncate(16);
    short.effort.truncate(16);
    let error = loaded.identify(&short, &quick()).unwrap_err();
    let advice = "record the whole motion once more without the payload";
    assert!(error.to_string().ends_with(advice), "{error}");
    let mut other = Arm::new(false, 0.0);
    for (k, position) in other.position.iter_mut().enumerate() {
        *position *= if k % 8 == 1 { 0.8 } else { 1.0 };
    }
    let error = loaded.identify(&other, &quick()).unwrap_err();
    assert_eq!(error.option(), Some("unloaded"), "{error}");
    let text = error.to_string();
    assert!(
        text.contains("has another motion: joint `joint_2` differs by"),
        "{text}"
    );
    let advice = "repeat the commanded motion of the loaded recording without the payload";
    assert!(text.ends_with(advice), "{text}");
}
