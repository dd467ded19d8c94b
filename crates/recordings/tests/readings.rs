//! What drivers do to wrenches and efforts before they record them: other axes, parts that are
//! subtracted.

use std::ops::ControlFlow;

use crate::arm::{Instant, JOINTS, Run, TOOL, arm, body};
use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use tactid_batch::Finding as Data;
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, Manipulator, MassProperties, Notice,
    Severity, Workspace, inverse_dynamics, motion,
};
use tactid_recordings::{
    Arrays, EffortContent, Finding, GravityChoice, Identification, Method, Request, SensorFrame,
    identify_arrays,
};

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

fn held() -> MassProperties {
    body(2.0, [0.02, -0.01, 0.1], [0.1, 0.15, 0.2])
}

fn instants() -> Vec<Instant> {
    let run = Run {
        base: BaseKind::Fixed,
        rate_hz: 200.0,
        payloads: vec![(0.0, held())],
        duration_s: 10.0,
        gap_s: None,
        motion_seed: 5,
    };
    run.instants()
}

/// What an arm recorded while it held [`held`].
struct Recorded {
    robot: Manipulator,
    instants: Vec<Instant>,
    wrenches: Vec<f64>,
    efforts: Vec<f64>,
}

impl Recorded {
    fn new() -> Self {
        Self {
            robot: arm(BaseKind::Fixed),
            instants: instants(),
            wrenches: Vec::new(),
            efforts: Vec::new(),
        }
    }

    /// With wrenches in axes of the sensor, or of the world.
    fn with_wrenches(world_axes: bool) -> Self {
        let mut recorded = Self::new();
        let mut random = SmallRng::seed_from_u64(7);
        let tool = recorded.robot.frame(TOOL).unwrap();
        let mut workspace = Workspace::new(&recorded.robot);
        let at_rest = FrameMotion::at_rest(Isometry3::identity());
        for instant in &recorded.instants {
            motion(&mut workspace, &at_rest, joints(instant)).unwrap();
            let turn = workspace.pose(tool).rotation;
            let turned = |v| if world_axes { turn * v } else { v };
            let (force, moment) = (turned(instant.wrench.force), turned(instant.wrench.moment));
            for (values, noise) in [(force, 0.2), (moment, 0.02)] {
                let noisy = values.map(|value| value + noise * random.random_range(-1.0..1.0));
                recorded.wrenches.extend(noisy.iter());
            }
        }
        recorded
    }

    /// With efforts that contain some of what the joints bear.
    fn with_efforts(content: EffortContent) -> Self {
        let mut recorded = Self::new();
        let mut random = SmallRng::seed_from_u64(8);
        let robot = &recorded.robot;
        let loaded = robot.with_payload(
            robot.frame(TOOL).unwrap(),
            &InertialParameters::from(held()),
        );
        let [mut loaded, mut unloaded] = [&loaded, robot].map(Workspace::new);
        let at_rest = FrameMotion::at_rest(Isometry3::identity());
        for instant in &recorded.instants {
            let still = JointMotion {
                velocity: &[0.0; JOINTS],
                acceleration: &[0.0; JOINTS],
                ..joints(instant)
            };
            inverse_dynamics(&mut loaded, &at_rest, joints(instant), &GRAVITY).unwrap();
            let all = loaded.joint_torques().unwrap();
            let subtracted = match content {
                EffortContent::Measured => None,
                EffortContent::WithoutGravity => Some(still),
                EffortContent::External => Some(joints(instant)),
            };
            let subtracted = match subtracted {
                None => vec![0.0; JOINTS],
                Some(motion) => {
                    inverse_dynamics(&mut unloaded, &at_rest, motion, &GRAVITY).unwrap();
                    unloaded.joint_torques().unwrap().to_vec()
                }
            };
            let noisy = all.iter().zip(subtracted);
            let noisy = noisy.map(|(all, own)| all - own + 0.2 * random.random_range(-1.0..1.0));
            recorded.efforts.extend(noisy);
        }
        recorded
    }

    fn identify(&self, request: &Request) -> Identification {
        let flat = |kind: usize| -> Vec<f64> {
            let rows = self.instants.iter().map(|instant| instant.joints[kind]);
            rows.flatten().collect()
        };
        let times_s: Vec<f64> = self.instants.iter().map(|instant| instant.time_s).collect();
        let (q, qd) = (flat(0), flat(1));
        let arrays = Arrays {
            robot: Some(&self.robot),
            time: &times_s,
            q: &q,
            qd: &qd,
            wrench: &self.wrenches,
            effort: &self.efforts,
            ..Arrays::default()
        };
        let request = Request {
            tip: Some(TOOL.to_owned()),
            ..request.clone()
        };
        let found = identify_arrays(&arrays, &request, &mut |_| ControlFlow::Continue(()));
        found.unwrap().into_least_squares().unwrap()
    }
}

fn joints(instant: &Instant) -> JointMotion<'_> {
    let [position, velocity, acceleration] = &instant.joints;
    JointMotion {
        position,
        velocity,
        acceleration,
    }
}

/// Asserts that mass and centre of mass are right, and that no wrong reading is found.
fn assert_right(found: &Identification) {
    let (body, held) = (&found.estimate.body, held());
    assert!((body.mass_kg - held.mass_kg).abs() < 0.02, "{body:?}");
    assert!((body.center_of_mass - held.center_of_mass).norm() < 2e-3);
    assert!(found.recording.findings.iter().all(|finding| !matches!(
        finding,
        Finding::AxesContradicted { .. } | Finding::EffortContentContradicted { .. }
    )));
}

fn axes(axes: Option<&str>) -> Request {
    Request {
        wrench_axes: axes.map(str::to_owned),
        ..Request::default()
    }
}

#[test]
fn wrenches_may_have_axes_of_a_link_or_of_the_world() {
    let in_world = Recorded::with_wrenches(true);
    for name in ["base", "world"] {
        assert_right(&in_world.identify(&axes(Some(name))));
    }
    let of_sensor = Recorded::with_wrenches(false);
    for name in [None, Some(TOOL)] {
        assert_right(&of_sensor.identify(&axes(name)));
    }
}

#[test]
fn wrong_axes_are_named_as_the_cause() {
    for (in_world, given, right) in [(true, None, Some("base")), (false, Some("base"), None)] {
        let found = Recorded::with_wrenches(in_world).identify(&axes(given));
        let cause = |finding: &Finding| match finding {
            Finding::AxesContradicted {
                axes,
                residual_ratio,
            } => {
                assert_eq!(axes.as_deref(), right);
                assert!((0.0..0.4).contains(residual_ratio), "{residual_ratio}");
                true
            }
            _ => false,
        };
        let findings = &found.recording.findings;
        assert!(findings.iter().any(cause), "{findings:?}");
    }
}

/// Moments about the origin of the base, as a wrench has them that was transformed to this frame.
#[test]
fn a_wrong_point_of_the_moments_is_named_as_the_cause() {
    let mut recorded = Recorded::with_wrenches(true);
    let tool = recorded.robot.frame(TOOL).unwrap();
    let mut workspace = Workspace::new(&recorded.robot);
    let at_rest = FrameMotion::at_rest(Isometry3::identity());
    let pairs = recorded.wrenches.chunks_exact_mut(6);
    for (six, instant) in pairs.zip(&recorded.instants) {
        motion(&mut workspace, &at_rest, joints(instant)).unwrap();
        let origin = workspace.pose(tool).translation.vector;
        let shift = origin.cross(&Vector3::from_column_slice(&six[..3]));
        six[3..]
            .iter_mut()
            .zip(&shift)
            .for_each(|(moment, shift)| *moment += shift);
    }
    let found = recorded.identify(&axes(Some("base")));
    let is_cause = |finding: &Finding| matches!(finding, Finding::PointContradicted { frame, .. } if frame == "base");
    let findings = &found.recording.findings;
    assert!(findings.iter().any(is_cause), "{findings:?}");
    let unit = [0.0, 0.0, 0.0, 1.0];
    assert_right(&recorded.identify(&Request {
        sensor_frame: Some(SensorFrame::new("base", [0.0; 3], unit).unwrap()),
        ..Request::default()
    }));
}

/// Messages often list the joints by the alphabet, and arrays have no names.
#[test]
fn exchanged_joints_are_named_as_the_cause() {
    for exchanged in [&[0, 2][..], &[1, 3], &[0, 1, 3], &[0, 3, 2]] {
        let mut recorded = Recorded::with_wrenches(false);
        for instant in &mut recorded.instants {
            for values in &mut instant.joints {
                for pair in exchanged.windows(2) {
                    values.swap(pair[0], pair[1]);
                }
            }
        }
        let found = recorded.identify(&Request::default());
        let names = exchanged.iter();
        let names: Vec<_> = names
            .map(|index| recorded.robot.joint_names()[*index].clone())
            .collect();
        let is_cause = |finding: &Finding| matches!(finding, Finding::JointsExchanged { joints, .. } if joints[..] == names);
        let findings = &found.recording.findings;
        assert!(findings.iter().any(is_cause), "{findings:?}");
    }
}

/// Drivers count some joints in the other direction than the URDF, and some list moments first.
#[test]
fn opposite_joints_and_exchanged_moments_are_named_as_the_cause() {
    let mut recorded = Recorded::with_wrenches(false);
    for instant in &mut recorded.instants {
        for values in &mut instant.joints {
            values[2] = -values[2];
        }
    }
    let name = &recorded.robot.joint_names()[2];
    let found = recorded.identify(&Request::default());
    let findings = &found.recording.findings;
    let is_cause = |finding: &Finding| matches!(finding, Finding::JointSignContradicted { joint, .. } if joint == name);
    assert!(findings.iter().any(is_cause), "{findings:?}");
    let mut recorded = Recorded::with_wrenches(false);
    for six in recorded.wrenches.chunks_exact_mut(6) {
        six.rotate_left(3);
    }
    let found = recorded.identify(&Request::default());
    let findings = &found.recording.findings;
    let is_cause = |finding: &Finding| matches!(finding, Finding::ForcesAndMomentsExchanged { .. });
    assert!(findings.iter().any(is_cause), "{findings:?}");
}

#[test]
fn axes_of_no_link_are_an_error() {
    let recorded = Recorded::with_wrenches(false);
    let arrays = Arrays {
        robot: Some(&recorded.robot),
        time: &[0.0],
        q: &[0.0; JOINTS],
        wrench: &[0.0; 6],
        ..Arrays::default()
    };
    let request = Request {
        tip: Some(TOOL.to_owned()),
        ..axes(Some("pedestal"))
    };
    let found = identify_arrays(&arrays, &request, &mut |_| ControlFlow::Continue(()));
    let message = found.unwrap_err().to_string();
    assert!(message.contains("pedestal"), "{message}");
}

const CONTENTS: [EffortContent; 3] = [
    EffortContent::Measured,
    EffortContent::WithoutGravity,
    EffortContent::External,
];

#[test]
fn each_content_of_efforts_gives_the_payload_and_a_wrong_one_is_named() {
    for content in CONTENTS {
        let recorded = Recorded::with_efforts(content);
        for given in CONTENTS {
            let found = recorded.identify(&Request {
                method: Some(Method::Effort),
                efforts_are: Some(given),
                ..Request::default()
            });
            if given == content {
                assert_right(&found);
                continue;
            }
            let named = |finding: &Finding| match finding {
                Finding::EffortContentContradicted { content, .. } => Some(*content),
                _ => None,
            };
            let named: Vec<_> = found.recording.findings.iter().filter_map(named).collect();
            assert_eq!(named, [content], "given as {given:?}");
        }
    }
}

/// Motor currents are far smaller than the torques of the arm, and contain its own part and friction
/// all the same.
#[test]
fn motor_currents_are_not_named_external_torques() {
    let mut recorded = Recorded::with_efforts(EffortContent::Measured);
    let efforts = recorded.efforts.chunks_exact_mut(JOINTS);
    for (efforts, instant) in efforts.zip(&recorded.instants) {
        for (effort, velocity) in efforts.iter_mut().zip(&instant.joints[1]) {
            *effort = (*effort + 3.0 * velocity.signum()) / 12.0;
        }
    }
    let found = recorded.identify(&Request {
        method: Some(Method::Effort),
        ..Request::default()
    });
    let findings = &found.recording.findings;
    let contradicts = |finding: &Finding| finding.severity() == Severity::Contradicts;
    assert!(findings.iter().any(contradicts), "{findings:?}");
    let is_named = |finding: &Finding| matches!(finding, Finding::EffortContentContradicted { .. });
    assert!(!findings.iter().any(is_named), "{findings:?}");
}

/// Gravity of another length or sign than that on Earth, or none, is named as the cause where the
/// efforts contain the weight of the arm, and none with wrenches, too.
#[test]
fn a_wrong_gravity_is_named_as_the_cause() {
    let request = |method, factor: f64| Request {
        method: Some(method),
        gravity: Some(GravityChoice::Given(GRAVITY * factor)),
        ..Request::default()
    };
    let of_efforts = Recorded::with_efforts(EffortContent::Measured);
    let of_wrenches = Recorded::with_wrenches(false);
    let cases = [
        (&of_efforts, Method::Effort, &[-1.0, 0.0, 0.1, 2.0, 5.0][..]),
        (&of_wrenches, Method::Tactile, &[0.0]),
    ];
    for (recorded, method, factors) in cases {
        for &factor in factors {
            let found = recorded.identify(&request(method, factor));
            let findings = &found.recording.findings;
            let is_cause = |finding: &Finding| match finding {
                Finding::Data(Data::GravityContradicted { better, .. }) => {
                    (Vector3::from(*better) - GRAVITY).norm() < 1e-9
                }
                _ => false,
            };
            let first = findings
                .iter()
                .find(|each| each.severity() != Severity::Notes);
            assert!(
                first.is_some_and(is_cause),
                "{method:?} {factor}: {findings:?}"
            );
        }
        assert_right(&recorded.identify(&request(method, 1.0)));
    }
}
