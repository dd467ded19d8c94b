//! Motion (1)-(20) against numerical derivatives of poses along a trajectory.

use std::sync::Arc;

use crate::common::{
    self, State, assert_close, derivative, rng, robots, second_derivative, six, vector,
};
use nalgebra::{Isometry3, Matrix3, Vector3};
use tactid_dynamics::{
    BaseKind, FrameMotion, JointMotion, Manipulator, StateError, Workspace, Wrench,
    base_acceleration, motion,
};

const TOLERANCE: f64 = 1e-8;

/// Returns the vector of the skew-symmetric part of a matrix.
fn vee(m: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12) * 0.5
}

/// Velocity and acceleration of every link are the first and second derivatives of its pose.
///
/// The poses are independent of (2)-(20), so that the test detects a missing transport term
/// `ω × θ̇ z` of (15), which the print omits, a missing Coriolis term `2 ω × v` of a prismatic
/// joint, a missing centripetal term `ω × (ω × a)`, a missing multiplier of a mimic joint's
/// velocity, and a spatial acceleration in place of the classical one.
#[test]
fn velocities_and_accelerations_are_differences_of_poses() {
    let rng = &mut rng(1);
    for robot in robots() {
        let state = State::random(rng, robot.dof());
        let workspace = state.moved(&robot);
        let samples = |t: f64| state.at(t).moved(&robot);
        for name in robot.frame_names() {
            let frame = robot.frame(name).unwrap();
            let position = |t| samples(t).pose(frame).translation.vector;
            let rotation = |t| {
                let pose = samples(t).pose(frame);
                pose.rotation.to_rotation_matrix().into_inner()
            };
            let given = workspace.frame_motion(frame);
            let to_body = rotation(0.0).transpose();
            // Ṙ Rᵀ = [ω]× and R̈ Rᵀ = [ω̇]× + [ω]×², the last symmetric.
            let w = vee(&(derivative(rotation) * to_body));
            let dw = vee(&(second_derivative(rotation) * to_body));
            assert_eq!(given.pose, workspace.pose(frame));
            assert_close(&given.velocity, &derivative(position), TOLERANCE, name);
            assert_close(&given.angular_velocity, &w, TOLERANCE, name);
            assert_close(
                &given.acceleration,
                &second_derivative(position),
                TOLERANCE,
                name,
            );
            assert_close(&given.angular_acceleration, &dw, TOLERANCE, name);
        }
    }
}

/// The pose of one frame in another, a wrench in it and a vector of the inertial frame in it are
/// those by way of the poses in the inertial frame, for frames of one chain and of different
/// branches.
#[test]
fn frames_relative_to_each_other() {
    let rng = &mut rng(5);
    for robot in robots() {
        let workspace = State::random(rng, robot.dof()).moved(&robot);
        let frames = || robot.frame_names().map(|name| robot.frame(name).unwrap());
        for a in frames() {
            let in_world = vector(rng, 10.0);
            let expected = workspace.pose(a).rotation.inverse() * in_world;
            assert_close(
                &workspace.vector_in_frame(a, &in_world),
                &expected,
                1e-13,
                "vector",
            );
            for b in frames() {
                let name = format!("{} in {}", robot.frame_name(b), robot.frame_name(a));
                let a_from_b = workspace.pose(a).inv_mul(&workspace.pose(b));
                let given = workspace.relative_pose(a, b);
                let [given, expected] = [given, a_from_b].map(|pose| pose.to_homogeneous());
                assert_close(&given, &expected, 1e-12, &name);
                let wrench = Wrench {
                    force: vector(rng, 10.0),
                    moment: vector(rng, 10.0),
                };
                let given = six(workspace.wrench_in_frame(a, b, &wrench));
                let expected = six(wrench.expressed_in(&a_from_b));
                assert_close(&given, &expected, 1e-12, &name);
            }
        }
    }
}

/// Returns a robot of one link on a joint of the given kind along or about x.
fn on_x(kind: &str) -> Manipulator {
    let xml = format!(
        "<robot name='one'><link name='base'/><link name='arm'><inertial><mass value='1'/>\
         <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>\
         <joint name='joint' type='{kind}'><parent link='base'/><child link='arm'/>\
         <axis xyz='1 0 0'/><limit lower='0' upper='1' effort='1' velocity='1'/></joint></robot>"
    );
    Manipulator::from_urdf(&xml, BaseKind::Fixed).unwrap()
}

/// Returns the arm's motion at position 0.5 and velocity 3 on a base that turns about z at 2 rad/s.
fn on_turning_base(kind: &str) -> FrameMotion {
    let robot = on_x(kind);
    let mut base = FrameMotion::at_rest(Isometry3::identity());
    base.angular_velocity.z = 2.0;
    let joints = JointMotion {
        position: &[0.5],
        velocity: &[3.0],
        acceleration: &[0.0],
    };
    let mut workspace = Workspace::new(&robot);
    motion(&mut workspace, &base, joints).unwrap();
    workspace.frame_motion(robot.frame("arm").unwrap())
}

/// A link that turns steadily about x on a base turning about z has the angular acceleration
/// `ω × θ̇ x = 6 y`: the transport term of (15), which the print omits.
#[test]
fn revolute_joint_has_its_transport_term() {
    let arm = on_turning_base("continuous");
    assert_close(
        &arm.angular_velocity,
        &Vector3::new(3.0, 0.0, 2.0),
        1e-15,
        "ω",
    );
    assert_close(
        &arm.angular_acceleration,
        &Vector3::new(0.0, 6.0, 0.0),
        1e-15,
        "ω̇",
    );
}

/// A link that slides steadily along x on a base turning about z has the Coriolis acceleration
/// `2 ω × v = 12 y` in addition to the centripetal one.
#[test]
fn prismatic_joint_has_its_coriolis_term() {
    let arm = on_turning_base("prismatic");
    assert_close(&arm.velocity, &Vector3::new(3.0, 1.0, 0.0), 1e-15, "ṗ");
    assert_close(
        &arm.acceleration,
        &Vector3::new(-2.0, 12.0, 0.0),
        1e-15,
        "p̈",
    );
}

/// A frame fixed to a body moves like the robot's frames on fixed joints, and its tool motion is
/// expressed in the frame with gravity subtracted.
#[test]
fn fixed_frames_and_tool_motion() {
    let rng = &mut rng(2);
    let robot = common::tactid();
    let state = State::random(rng, robot.dof());
    let workspace = state.moved(&robot);
    let (wrist, tool) = (
        robot.frame("wrist_3_link").unwrap(),
        robot.frame("tool0").unwrap(),
    );
    let wrist_from_tool = robot.fixed_transform(wrist, tool).unwrap();
    let by_hand = workspace.frame_motion(wrist).of_fixed(&wrist_from_tool);
    let given = workspace.frame_motion(tool);
    assert_close(&by_hand.acceleration, &given.acceleration, 1e-14, "p̈");
    assert_close(&by_hand.velocity, &given.velocity, 1e-14, "ṗ");
    assert!(robot.fixed_transform(robot.base_frame(), tool).is_none());

    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let in_tool = given.in_frame(&gravity);
    let rotation = given.pose.rotation;
    assert_close(
        &(rotation * in_tool.acceleration),
        &(given.acceleration - gravity),
        1e-14,
        "p̈ - g",
    );
    assert_close(
        &(rotation * in_tool.angular_velocity),
        &given.angular_velocity,
        1e-14,
        "ω",
    );
    assert_close(
        &(rotation * in_tool.angular_acceleration),
        &given.angular_acceleration,
        1e-14,
        "ω̇",
    );
}

/// The error for a slice of the wrong length contains its name, both lengths and the joints.
#[test]
fn wrong_lengths_are_refused() {
    let robot = on_x("prismatic");
    let mut workspace = Workspace::new(&robot);
    let base = FrameMotion::at_rest(Isometry3::identity());
    let cases: [(&str, [&[f64]; 3]); 3] = [
        ("position", [&[], &[0.0], &[0.0]]),
        ("velocity", [&[0.0], &[0.0, 1.0], &[0.0]]),
        ("acceleration", [&[0.0], &[0.0], &[1.0, 2.0, 3.0]]),
    ];
    for (what, [position, velocity, acceleration]) in cases {
        let joints = JointMotion {
            position,
            velocity,
            acceleration,
        };
        let given = [position, velocity, acceleration];
        let expected = StateError::Length {
            what,
            given: given
                .iter()
                .map(|slice| slice.len())
                .find(|&length| length != 1)
                .unwrap(),
            expected: 1,
            joints: Arc::new(vec!["joint".to_owned()]),
        };
        assert_eq!(motion(&mut workspace, &base, joints), Err(expected));
        let error = base_acceleration(&mut workspace, &base, joints).unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains(what) && message.contains("has 1 joint: joint"),
            "{message}"
        );
    }
}
