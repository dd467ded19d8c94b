//! What the batch and the online identifier notice about wrong assumptions, from the same samples
//! of an arm on the ground with noise on the wrist sensor.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{Finding, Hypothesis, UnexplainedLoad, WrongAssumption};
use tactid_dynamics::{BaseKind, FrameMotion, JointMotion, Workspace, Wrench, forces, motion};
use tactid_identify::{EquationSettings, Method, WrenchOffset};

use crate::arm::{JOINTS, TOOL, arm};
use crate::recorded::{Recorded, payload, recorded, run};

/// Returns the findings for the arm on the ground, which both identifiers agree on.
fn findings_of(given: &Recorded, settings: &EquationSettings) -> Vec<Finding> {
    let robot = arm(BaseKind::Fixed);
    let batch = given.identify(&robot, TOOL, settings).findings;
    assert_eq!(batch, given.online_findings(&robot, TOOL, settings));
    batch
}

fn suspected(findings: &[Finding]) -> Option<WrenchOffset> {
    findings.iter().find_map(|finding| match finding {
        Finding::WrongAssumption(found) if found.cause == Hypothesis::Offset => {
            let values: [f64; 6] = found.values.clone().try_into().unwrap();
            let [fx, fy, fz, nx, ny, nz] = values;
            Some(WrenchOffset {
                frame: found.frame.clone(),
                wrench: Wrench {
                    force: Vector3::new(fx, fy, fz),
                    moment: Vector3::new(nx, ny, nz),
                },
                std_devs: Some(found.std_devs.clone().try_into().unwrap()),
            })
        }
        _ => None,
    })
}

/// Without a wrong assumption nothing is reported.
#[test]
fn nothing_is_reported_without_a_cause() {
    for seed in 0..8 {
        let findings = findings_of(&recorded(seed), &EquationSettings::default());
        assert_eq!(findings, [], "{seed}");
    }
}

/// An offset of 2 N is reported in the frame and with the sign of the sensor, within 10 %, whatever
/// frame of the flange's body the payload is expressed in. Without it, nothing is reported and the
/// payload is right.
#[test]
fn an_offset_is_reported_in_the_frame_of_the_sensor_for_every_tip() {
    let robot = arm(BaseKind::Fixed);
    let flange = robot.frame(TOOL).unwrap();
    let tips = [
        ("beside", Isometry3::translation(0.4, -0.3, 0.2)),
        (
            "turned",
            Isometry3::from_parts(
                Translation3::new(0.0, 0.0, 0.3),
                UnitQuaternion::from_scaled_axis(Vector3::new(1.0, -2.0, 0.5)),
            ),
        ),
        ("far", Isometry3::translation(0.0, 0.0, 3.0)),
    ];
    let robot = tips.iter().fold(robot, |robot, (name, pose)| {
        robot.with_frame(name, flange, pose)
    });
    let offsets = [
        (Vector3::new(2.0, 0.0, 0.0), Vector3::zeros()),
        (Vector3::new(0.0, -1.2, 1.6), Vector3::new(0.1, 0.0, -0.1)),
    ];
    let settings = EquationSettings::default();
    for (seed, (force, moment)) in (20..).zip(offsets) {
        let given = recorded(seed).with_offset(force, moment);
        for tip in [TOOL, "beside", "turned", "far"] {
            let findings = given.identify(&robot, tip, &settings).findings;
            assert_eq!(findings, given.online_findings(&robot, tip, &settings));
            let offset = suspected(&findings).unwrap();
            assert_eq!(&*offset.frame, TOOL);
            let error = (offset.wrench.force - force).norm();
            assert!(error < 0.1 * force.norm(), "{seed} {tip}: {offset:?}");
            let errors = [offset.wrench.force - force, offset.wrench.moment - moment];
            let errors = errors.iter().flatten().zip(offset.std_devs.unwrap());
            for (error, std_dev) in errors {
                assert!(error.abs() < 4.5 * std_dev, "{seed} {tip}: {offset:?}");
            }
            let tared = recorded(seed)
                .with_offset(force, moment)
                .with_offset(-offset.wrench.force, -offset.wrench.moment);
            let result = tared.identify(&robot, tip, &settings);
            assert_eq!(result.findings, [], "{seed} {tip}");
            let error_kg = result.estimate.body.mass_kg - payload().mass_kg;
            assert!(error_kg.abs() < 0.01, "{seed} {tip}: {error_kg}");
        }
    }
}

/// Returns the findings of both identifiers. The batch identifier also knows the joints of each
/// window.
fn findings_of_both(given: &Recorded, settings: &EquationSettings) -> [Vec<Finding>; 2] {
    let robot = arm(BaseKind::Fixed);
    [
        given.identify(&robot, TOOL, settings).findings,
        given.online_findings(&robot, TOOL, settings),
    ]
}

fn cause(findings: &[Finding], cause: Hypothesis) -> Option<&WrongAssumption> {
    findings.iter().find_map(|finding| match finding {
        Finding::WrongAssumption(found) if found.cause == cause => Some(found),
        _ => None,
    })
}

/// A sensor that is mounted with a turn of 30 degrees is reported with this turn.
#[test]
fn a_turned_sensor_is_reported() {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * 30f64.to_radians());
    let mut turned = recorded(1);
    for wrench in &mut turned.wrenches {
        *wrench = Wrench {
            force: turn * wrench.force,
            moment: turn * wrench.moment,
        };
    }
    for findings in findings_of_both(&turned, &EquationSettings::default()) {
        let found = cause(&findings, Hypothesis::SensorRotation).unwrap();
        let error = Vector3::from_column_slice(&found.values) + turn.scaled_axis();
        assert!(error.norm() < 0.005, "{found:?}");
    }
}

/// Two joints that are exchanged, and positions in degrees, leave a load that nothing explains.
#[test]
fn a_wrong_model_is_reported() {
    let (mut exchanged, mut degrees) = (recorded(2), recorded(3));
    for joints in exchanged.joints.iter_mut().flatten() {
        joints.swap(3, 4);
    }
    for joint in degrees.joints.iter_mut().flatten().flatten() {
        *joint = joint.to_degrees();
    }
    for (name, wrong) in [("exchanged", exchanged), ("degrees", degrees)] {
        let is_unexplained = |finding: &Finding| {
            let Finding::LoadUnexplained(load) = finding else {
                return false;
            };
            load.method == Method::Tactile
        };
        for findings in findings_of_both(&wrong, &EquationSettings::default()) {
            assert!(findings.iter().any(is_unexplained), "{name}: {findings:?}");
        }
    }
}

/// Wrenches and gravity of the wrong sign are reported.
#[test]
fn a_wrong_sign_is_reported() {
    let mut wrong = recorded(4);
    for wrench in &mut wrong.wrenches {
        (wrench.force, wrench.moment) = (-wrench.force, -wrench.moment);
    }
    let findings = findings_of(&wrong, &EquationSettings::default());
    let is_negative = |finding: &Finding| matches!(finding, Finding::NegativeMass { .. });
    assert!(findings.iter().any(is_negative), "{findings:?}");
    let upward = EquationSettings {
        gravity: Some(Vector3::new(0.0, 0.0, 9.81)),
        ..EquationSettings::default()
    };
    // The model is so wrong that the online identifier detects payload changes, and has fewer
    // windows: none where it has just found the payload before a change again.
    for findings in findings_of_both(&recorded(6), &upward) {
        let found = cause(&findings, Hypothesis::Gravity).unwrap();
        let error = Vector3::from_column_slice(&found.values) - Vector3::new(0.0, 0.0, -9.81);
        assert!(error.norm() < 0.1, "{found:?}");
    }
}

/// Returns the efforts that move the arm with its payload on the ground, with Coulomb friction, N
/// m, and noise of 0.1 N m.
fn recorded_efforts(seed: u64, friction: f64) -> Recorded {
    let robot = arm(BaseKind::Fixed);
    let held = robot.with_payload(robot.frame(TOOL).unwrap(), &payload().into());
    let mut workspace = Workspace::new(&held);
    let mut random = SmallRng::seed_from_u64(seed);
    let base = FrameMotion::at_rest(Isometry3::identity());
    let mut efforts_at = |joints: &[[f64; JOINTS]; 3]| {
        let [position, velocity, acceleration] = joints;
        let joints = JointMotion {
            position,
            velocity,
            acceleration,
        };
        motion(&mut workspace, &base, joints).unwrap();
        forces(&mut workspace, &Vector3::new(0.0, 0.0, -9.81));
        let torques = workspace.joint_torques().unwrap();
        std::array::from_fn(|k| {
            let noise: f64 = random.sample(StandardNormal);
            torques[k] + friction * velocity[k].signum() + 0.1 * noise
        })
    };
    let instants = run(seed).instants();
    Recorded {
        efforts: instants
            .iter()
            .map(|instant| efforts_at(&instant.joints))
            .collect(),
        wrenches: Vec::new(),
        ..recorded(seed)
    }
}

/// Friction in the joints leaves a load that the model of the efforts does not explain. Without it,
/// nothing is reported.
#[test]
fn friction_is_reported() {
    let settings = EquationSettings {
        method: Method::Effort,
        ..EquationSettings::default()
    };
    assert_eq!(findings_of(&recorded_efforts(6, 0.0), &settings), []);
    let (robot, rubbing) = (arm(BaseKind::Fixed), recorded_efforts(6, 3.0));
    let is_unexplained = |finding: &Finding| {
        matches!(
            finding,
            Finding::LoadUnexplained(UnexplainedLoad { unit, residual_rms, load_rms, .. })
                if unit == "N m" && *residual_rms > 1.0 && residual_rms < load_rms
        )
    };
    // Friction causes alarms of the online identifier, which then has fewer windows.
    let batch = rubbing.identify(&robot, TOOL, &settings).findings;
    let online = rubbing.online_findings(&robot, TOOL, &settings);
    for findings in [batch, online] {
        assert!(findings.iter().any(is_unexplained), "{findings:?}");
    }
}

/// A sensor that holds nothing but noise, and one whose load is all known, are reported; a wrong
/// sign is not, nor is noise that neighbouring samples share a load which the model leaves
/// unexplained.
#[test]
fn nothing_held_is_no_wrong_sign() {
    for (seed, sign, kept, largest_kg) in [
        (3, 1.0, 0.0, 0.01),
        (4, -1.0, 0.0, 0.01),
        (5, 1.0, 0.8, 0.03),
    ] {
        let mut empty = recorded(seed);
        let mut noise = SmallRng::seed_from_u64(seed);
        let mut last = [0.0; 6];
        for wrench in &mut empty.wrenches {
            for value in &mut last {
                *value = kept * *value + sign * noise.random_range(-0.3..0.3);
            }
            wrench.force = Vector3::from_column_slice(&last[..3]);
            wrench.moment = Vector3::from_column_slice(&last[3..]) * 0.1;
        }
        let findings = findings_of(&empty, &EquationSettings::default());
        let [
            Finding::NothingHeld {
                mass_kg,
                std_dev_kg,
            },
        ] = findings[..]
        else {
            panic!("{kept}: {findings:?}");
        };
        assert!(
            mass_kg.abs() < 3.0 * std_dev_kg && std_dev_kg < largest_kg,
            "{kept}: {mass_kg} {std_dev_kg}"
        );
    }
}
