//! Velocities that are not the derivatives of the positions: joints that are swapped, of the wrong
//! sign or in degrees, and twists in the wrong axes.

use std::ops::ControlFlow;

use nalgebra::Vector3;
use rand::{SeedableRng, rngs::SmallRng};
use tactid_batch::Finding as DataFinding;
use tactid_dynamics::Wrench;
use tactid_identify::checks::{
    TwistAxes, TwistContradiction, VelocityCause, VelocityContradiction,
};
use tactid_identify::{BaseState, states_of_poses};
use tactid_recordings::{Finding, Request, identify_log};

use crate::common::{Experiment, Instant, Noise};
use crate::recorded_arrays::{Recording, carried, quick, recorded};
use crate::recorded_log;

const JOINTS: usize = 8;

/// The findings about velocities among those of a recording.
fn about_velocities(recording: &Recording) -> Vec<Finding> {
    let mut findings = recording.identify(&quick()).unwrap().recording.findings;
    findings.retain(is_about_velocities);
    findings
}

fn is_about_velocities(finding: &Finding) -> bool {
    matches!(
        finding,
        Finding::Data(
            DataFinding::VelocitiesContradicted(_) | DataFinding::TwistContradicted { .. }
        )
    )
}

/// Velocities that fit are not reported, whatever the noise.
#[test]
fn velocities_that_fit_are_not_reported() {
    assert_eq!(about_velocities(&recorded()), []);
    let experiment = Experiment {
        duration_s: 2.0,
        ..Experiment::default()
    };
    let instants = experiment.run();
    for fraction in [0.001, 0.01, 0.05] {
        let mut random = SmallRng::seed_from_u64(1);
        let noise = Noise::fraction(fraction);
        let noisy: Vec<Instant> = instants
            .iter()
            .map(|instant| noise.on(instant, &mut random))
            .collect();
        assert_eq!(about_velocities(&Recording::of(&noisy)), [], "{fraction}");
    }
}

/// Each way in which joint velocities are commonly wrong is named.
#[test]
fn joint_velocities_that_do_not_fit_are_reported_with_the_cause() {
    type Change = fn(&mut Recording);
    let cases: [(Change, &[&str], Option<VelocityCause>); 4] = [
        (
            |r| change_velocities(r, |qd| qd[2] = -qd[2]),
            &["joint_3"],
            Some(VelocityCause::OppositeSign),
        ),
        (
            |r| change_velocities(r, |qd| qd[..6].iter_mut().for_each(|v| *v = v.to_degrees())),
            &[
                "joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6",
            ],
            Some(VelocityCause::Degrees),
        ),
        (
            |r| {
                r.joint_position
                    .iter_mut()
                    .for_each(|q| *q = q.to_degrees())
            },
            &[
                "joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6",
            ],
            Some(VelocityCause::PositionsInDegrees),
        ),
        (
            |r| change_velocities(r, |qd| qd[3] = 0.0),
            &["joint_4"],
            None,
        ),
    ];
    for (change, joints, cause) in cases {
        let mut recording = recorded();
        change(&mut recording);
        match &about_velocities(&recording)[..] {
            [
                Finding::Data(DataFinding::VelocitiesContradicted(VelocityContradiction {
                    joints: found,
                    cause: why,
                    ..
                })),
            ] => {
                assert_eq!(found.as_slice(), joints);
                assert_eq!(why, &cause);
            }
            other => panic!("{joints:?}: {other:?}"),
        }
    }
}

/// Joints whose velocities are swapped are reported each with the joint whose velocities it has.
#[test]
fn swapped_joint_velocities_are_reported() {
    let mut recording = recorded();
    change_velocities(&mut recording, |qd| qd.swap(0, 4));
    let findings = about_velocities(&recording);
    for (joint, other) in [("joint_1", "joint_5"), ("joint_5", "joint_1")] {
        let is_named = |finding: &Finding| {
            matches!(finding, Finding::Data(DataFinding::VelocitiesContradicted(found))
                if found.joints == [joint] && found.cause == Some(VelocityCause::OtherJoint) && found.other.as_deref() == Some(other))
        };
        assert!(findings.iter().any(is_named), "{findings:?}");
    }
}

fn change_velocities(recording: &mut Recording, change: impl Fn(&mut [f64])) {
    recording
        .joint_velocity
        .chunks_exact_mut(JOINTS)
        .for_each(change);
}

/// Instants of a sensor that is carried about, with its twist in world axes.
fn carried_instants() -> Vec<Instant> {
    let recording = carried();
    let states = states_of_poses(&recording.times_s, &recording.poses);
    let wrenches = recording.wrenches.chunks_exact(6);
    let instants = recording.times_s.iter().zip(states).zip(wrenches);
    instants
        .map(|((&time_s, base), six)| Instant {
            time_s,
            base,
            position: vec![],
            velocity: vec![],
            effort: vec![],
            wrenches: vec![Wrench {
                force: Vector3::from_column_slice(&six[..3]),
                moment: Vector3::from_column_slice(&six[3..]),
            }],
        })
        .collect()
}

/// Twists in the axes of the body, where arrays have those of the world, are reported with the axes
/// that fit; twists of zero, and those beside a pose that does not change, without.
#[test]
fn twists_in_the_wrong_axes_are_reported() {
    let instants = carried_instants();
    let with_twists = |twist: fn(&BaseState) -> [Vector3<f64>; 2]| {
        let six = |instant: &Instant| twist(&instant.base).map(<[f64; 3]>::from);
        Recording {
            twists: instants.iter().flat_map(six).flatten().collect(),
            ..carried()
        }
    };
    let right = with_twists(|base| [base.velocity, base.angular_velocity]);
    assert_eq!(about_velocities(&right), []);
    let in_body = with_twists(|base| {
        let world_from_body = base.pose.rotation;
        [base.velocity, base.angular_velocity].map(|rate| world_from_body.inverse() * rate)
    });
    let at_rest = with_twists(|_| [Vector3::zeros(); 2]);
    let one_pose = Recording {
        poses: right.poses[..1].to_vec(),
        ..right.clone()
    };
    let wrong = [
        (in_body, Some(TwistAxes::Body)),
        (at_rest, None),
        (one_pose, None),
    ];
    for (wrong, axes) in wrong {
        match &about_velocities(&wrong)[..] {
            [
                Finding::Data(DataFinding::TwistContradicted {
                    source,
                    contradiction: TwistContradiction { better_axes, .. },
                }),
            ] => {
                assert_eq!((source.as_str(), *better_axes), ("twist", axes));
            }
            other => panic!("{axes:?}: {other:?}"),
        }
    }
}

/// The twist of odometry is in the axes of the body. One in those of the world is reported under
/// its topic.
#[test]
fn odometry_in_world_axes_is_reported() {
    let right = carried_instants();
    let mut wrong = right.clone();
    for instant in &mut wrong {
        // The messages have the inverse rotation of this: the twist in world axes.
        let world_from_body = instant.base.pose.rotation;
        instant.base.velocity = world_from_body * instant.base.velocity;
        instant.base.angular_velocity = world_from_body * instant.base.angular_velocity;
    }
    for (instants, is_wrong) in [(&right, false), (&wrong, true)] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut recording = recorded_log::Recording::of(instants);
        recording.joint_topics = &[];
        recording.sensors = &["base_link"];
        recording.write(&path);
        let mut observer = |_| ControlFlow::Continue(());
        let result = identify_log(&path, &Request::default(), &mut observer).unwrap();
        let findings = &result.recording().findings;
        let found: Vec<&Finding> = findings.iter().filter(|f| is_about_velocities(f)).collect();
        let is_named = |finding: &&Finding| {
            matches!(finding, Finding::Data(DataFinding::TwistContradicted { source, contradiction })
                if source == "/base/odom" && contradiction.better_axes == Some(TwistAxes::World))
        };
        assert_eq!(found.len(), usize::from(is_wrong), "{found:?}");
        assert!(found.iter().all(is_named), "{found:?}");
    }
}
