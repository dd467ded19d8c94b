//! Robots that are derived from another: with a frame, with a payload or without a subtree, against
//! the same robots built directly from their URDF; with locked joints, against the whole robot.

use crate::common::{self, Cloud, RandomTree, State, assert_close, isometry, rng, six, vector};
use nalgebra::Isometry3;
use tactid_dynamics::{
    BaseKind, FrameId, InertialParameters, Manipulator, StateError, Workspace, base_acceleration,
    forces, momentum,
};

fn frame_of(robot: &Manipulator, link: usize) -> FrameId {
    robot.frame(&format!("link_{link}")).unwrap()
}

/// Appends `<link name='sensor'>` as the last child of a link. The inertial element may be empty.
fn urdf_with_sensor(
    tree: &RandomTree,
    parent: usize,
    parent_from_sensor: &Isometry3<f64>,
    inertial: &str,
) -> String {
    let x = parent_from_sensor.translation;
    let (roll, pitch, yaw) = parent_from_sensor.rotation.euler_angles();
    let addition = format!(
        "<link name='sensor'>{inertial}</link>\
         <joint name='to_sensor' type='fixed'><parent link='link_{parent}'/><child link='sensor'/>\
         <origin xyz='{} {} {}' rpy='{roll} {pitch} {yaw}'/></joint></robot>",
        x.x, x.y, x.z
    );
    tree.urdf(true).replace("</robot>", &addition)
}

fn inertial_element(payload: &InertialParameters) -> String {
    let body = payload.mass_properties().unwrap();
    let (a, i) = (body.center_of_mass, body.inertia);
    format!(
        "<inertial><origin xyz='{} {} {}'/><mass value='{}'/>\
         <inertia ixx='{}' ixy='{}' ixz='{}' iyy='{}' iyz='{}' izz='{}'/></inertial>",
        a.x, a.y, a.z, body.mass_kg, i.m11, i.m12, i.m13, i.m22, i.m23, i.m33
    )
}

/// Asserts that parents precede children, that each subtree is contiguous, and that bodies are
/// ordered likewise.
#[track_caller]
fn assert_depth_first(robot: &Manipulator) {
    // The path of open links from the root: in depth-first order each link's parent is on it.
    let mut path: Vec<usize> = Vec::new();
    let mut bodies = 0;
    for (position, link) in robot.links().enumerate() {
        if let Some(parent) = link.parent {
            assert!(parent < position, "{} precedes its parent", link.name);
            while path.last() != Some(&parent) {
                assert!(
                    path.pop().is_some(),
                    "{} is apart from its subtree",
                    link.name
                );
            }
        }
        path.push(position);
        assert!(link.body <= bodies, "{} is on a later body", link.name);
        bodies = bodies.max(link.body + 1);
    }
    assert_eq!(bodies, robot.bodies().len());
    for (index, body) in robot.bodies().enumerate() {
        assert!(body.joint.is_none_or(|joint| joint.parent < index));
    }
}

/// Asserts that two robots have the same links in the same order, the same loads in a random state,
/// and the same parameters below each link.
#[track_caller]
fn assert_same_dynamics(given: &Manipulator, expected: &Manipulator, seed: u64) {
    assert_depth_first(given);
    let names = |robot: &Manipulator| robot.frame_names().map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(names(given), names(expected));
    let rng = &mut rng(seed);
    let (state, gravity) = (State::random(rng, given.dof()), vector(rng, 10.0));
    let [given, expected] = [given, expected].map(|robot| {
        let mut workspace = state.moved(robot);
        forces(&mut workspace, &gravity);
        workspace
    });
    let (wrench, expected_wrench) = (
        given.base_wrench().unwrap(),
        expected.base_wrench().unwrap(),
    );
    assert_close(&six(wrench), &six(expected_wrench), 1e-11, "base wrench");
    let torques = given.joint_torques().unwrap().iter();
    for (torque, expected) in torques.zip(expected.joint_torques().unwrap()) {
        assert!((torque - expected).abs() < 1e-11 * (1.0 + expected_wrench.moment.norm()));
    }
    for name in names(given.robot()) {
        let [frame, other] = [&given, &expected].map(|w| w.robot().frame(&name).unwrap());
        let below = expected.subtree_parameters(other);
        let found = given.subtree_parameters(frame);
        assert_close(found.as_vector(), below.as_vector(), 1e-11, &name);
    }
}

/// A frame that is added to any link becomes its last child, as in the URDF with that link.
#[test]
fn with_frame_is_the_robot_with_that_link() {
    let rng = &mut rng(1);
    for (seed, tree) in (0..40).map(|seed| (seed, RandomTree::new(seed))) {
        let robot = tree.robot();
        for parent in 0..tree.0.len() {
            let pose = isometry(rng);
            let given = robot.with_frame("sensor", frame_of(&robot, parent), &pose);
            let xml = urdf_with_sensor(&tree, parent, &pose, "");
            let expected = Manipulator::from_urdf(&xml, BaseKind::Floating).unwrap();
            assert_same_dynamics(&given, &expected, seed);
        }
    }
}

/// Frames of the original robot name the same links in the robot with one more frame.
#[test]
fn frames_hold_for_derived_robots() {
    for tree in (0..20).map(RandomTree::new) {
        let robot = tree.robot();
        for parent in 0..tree.0.len() {
            let above = frame_of(&robot, parent);
            let extended = robot.with_frame("sensor", above, &Isometry3::identity());
            for name in robot.frame_names() {
                assert_eq!(extended.frame_name(robot.frame(name).unwrap()), name);
            }
            let sensor = extended.frame("sensor").unwrap();
            assert_eq!(extended.frame_name(sensor), "sensor");
        }
    }
}

/// A payload at an added frame is the robot with a link of that mass.
#[test]
fn with_payload_is_the_robot_with_that_mass() {
    let rng = &mut rng(2);
    for (seed, tree) in (0..40).map(|seed| (seed, RandomTree::new(seed))) {
        let robot = tree.robot();
        for parent in 0..tree.0.len() {
            let (pose, payload) = (isometry(rng), Cloud::random(rng).parameters());
            let extended = robot.with_frame("sensor", frame_of(&robot, parent), &pose);
            let given = extended.with_payload(extended.frame("sensor").unwrap(), &payload);
            let xml = urdf_with_sensor(&tree, parent, &pose, &inertial_element(&payload));
            let expected = Manipulator::from_urdf(&xml, BaseKind::Floating).unwrap();
            assert_same_dynamics(&given, &expected, seed);
        }
    }
}

/// A robot without a subtree lacks the masses of the links below, also of a payload at a frame that
/// was added there, and its workspace still returns the parameters that were removed.
#[test]
fn without_subtree_removes_all_masses_below() {
    let rng = &mut rng(3);
    for tree in (0..40).map(RandomTree::new) {
        let robot = tree.robot();
        let state = State::random(rng, robot.dof());
        for root in 0..tree.0.len() {
            let payload = Cloud::random(rng).parameters();
            let place = *tree.below(root).last().unwrap_or(&root);
            let extended = robot.with_frame("sensor", frame_of(&robot, place), &isometry(rng));
            let loaded = extended.with_payload(extended.frame("sensor").unwrap(), &payload);
            let tool = frame_of(&loaded, root);
            let given = loaded.without_subtree(tool);
            assert_depth_first(&given);
            let before = state.moved(&loaded).subtree_parameters(tool);
            let removed = state.moved(&given).subtree_parameters(tool);
            assert_close(removed.as_vector(), before.as_vector(), 1e-12, "removed");
            let links: f64 = tree
                .below(root)
                .iter()
                .map(|&l| tree.0[l].parameters.mass())
                .sum();
            assert!((before.mass() - links - payload.mass()).abs() < 1e-11 * loaded.mass());
            let left = loaded.mass() - before.mass();
            assert!((given.mass() - left).abs() < 1e-11 * loaded.mass());
        }
    }
}

/// A robot without a subtree has the dynamics of the URDF in which the links there have no mass.
/// Moving links below are skipped, because a URDF cannot have a moving link without mass.
#[test]
fn without_subtree_is_the_robot_without_these_masses() {
    let rng = &mut rng(4);
    let mut compared = 0;
    for seed in 0..200 {
        let robot = RandomTree::new(seed).robot();
        let (state, gravity) = (State::random(rng, robot.dof()), vector(rng, 10.0));
        for root in 0..robot.links().len() {
            let mut tree = RandomTree::new(seed);
            let below = tree.below(root);
            below.iter().for_each(|&link| tree.remove_mass(link));
            let Ok(direct) = Manipulator::from_urdf(&tree.urdf(true), BaseKind::Floating) else {
                continue;
            };
            let given = robot.without_subtree(frame_of(&robot, root));
            let [wrench, expected] = [&given, &direct].map(|robot| {
                let mut workspace = state.moved(robot);
                forces(&mut workspace, &gravity);
                six(workspace.base_wrench().unwrap())
            });
            assert_close(&wrench, &expected, 1e-11, "base wrench");
            compared += usize::from(!below.is_empty());
        }
    }
    assert!(compared > 40, "only {compared} robots were compared");
}

/// A new workspace holds the robot at rest at joint positions zero, so that poses are defined
/// before the first motion.
#[test]
fn a_new_workspace_is_at_rest_at_zero() {
    for tree in (0..20).map(RandomTree::new) {
        let robot = tree.robot();
        let zeros = vec![0.0; robot.dof()];
        let state = State {
            base: tactid_dynamics::FrameMotion::at_rest(Isometry3::identity()),
            position: zeros.clone(),
            velocity: zeros.clone(),
            acceleration: zeros,
        };
        let (given, expected) = (Workspace::new(&robot), state.moved(&robot));
        for name in robot.frame_names() {
            let frame = robot.frame(name).unwrap();
            assert_eq!(given.frame_motion(frame), expected.frame_motion(frame));
        }
    }
}

/// Forces exist after `forces` until the next motion. A refused motion leaves the state unchanged.
#[test]
fn stale_forces_are_an_error() {
    let rng = &mut rng(5);
    let robot = RandomTree::new(1).robot();
    let state = State::random(rng, robot.dof());
    let mut workspace = Workspace::new(&robot);
    let assert_stale = |workspace: &Workspace| {
        assert_eq!(workspace.joint_torques(), Err(StateError::NoForces));
        assert_eq!(workspace.base_wrench(), Err(StateError::NoForces));
    };
    assert_stale(&workspace);
    forces(&mut workspace, &vector(rng, 10.0));
    assert!(workspace.joint_torques().is_ok());
    let short = tactid_dynamics::JointMotion {
        position: &[],
        ..state.joints()
    };
    tactid_dynamics::motion(&mut workspace, &state.base, short).unwrap_err();
    assert!(workspace.base_wrench().is_ok());
    tactid_dynamics::motion(&mut workspace, &state.base, state.joints()).unwrap();
    assert_stale(&workspace);
    base_acceleration(&mut workspace, &state.base, state.joints()).unwrap();
    assert!(workspace.base_wrench().is_ok());
    let error = workspace.jacobian(robot.base_frame(), &mut []).unwrap_err();
    assert!(
        matches!(error, StateError::Length { given: 0, .. }),
        "{error}"
    );
}

/// Frames of a robot that is locked beyond them move as on the whole robot, whatever the locked
/// joints are given. The mass stays.
#[test]
fn locked_joints_do_not_matter_to_the_frames_they_do_not_move() {
    let rng = &mut rng(12);
    let mut has_locked = false;
    for robot in common::robots() {
        let names: Vec<&str> = robot.frame_names().collect();
        for pair in names.windows(2) {
            let frames = [0, 1].map(|k| robot.frame(pair[k]).unwrap());
            let locked = robot.locked_beyond(&frames);
            assert_depth_first(&locked);
            let moves = |joint| frames.iter().any(|&frame| robot.moves(joint, frame));
            let state = State::random(rng, robot.dof());
            for joint in (0..robot.dof()).filter(|&joint| !moves(joint)) {
                assert_eq!(locked.joint_kind(joint), None);
                has_locked = true;
            }
            assert!((locked.mass() - robot.mass()).abs() < 1e-9);
            let (given, expected) = (state.moved(&locked), state.moved(&robot));
            for frame in frames {
                assert_eq!(given.frame_motion(frame), expected.frame_motion(frame));
            }
        }
    }
    assert!(has_locked);
}

/// A robot with locked joints has the momentum of the whole robot with the locked joints at rest at
/// position zero. Joints that follow others could not rest alone, so that all of these move on
/// their own.
#[test]
fn locked_joints_carry_their_masses_along() {
    let rng = &mut rng(13);
    let mut has_locked = false;
    for seed in 0..20 {
        let urdf = RandomTree::new(seed).urdf(false);
        let robot = Manipulator::from_urdf(&urdf, BaseKind::Floating).unwrap();
        for name in robot.frame_names() {
            let frame = robot.frame(name).unwrap();
            let locked = robot.locked_beyond(&[frame]);
            let mut state = State::random(rng, robot.dof());
            for joint in (0..robot.dof()).filter(|&joint| !robot.moves(joint, frame)) {
                state.position[joint] = 0.0;
                state.velocity[joint] = 0.0;
                state.acceleration[joint] = 0.0;
                has_locked = true;
            }
            let [given, expected] = [&locked, &robot].map(|robot| momentum(&state.moved(robot)));
            assert_close(&given.linear, &expected.linear, 1e-10, name);
            assert_close(&given.angular, &expected.angular, 1e-10, name);
        }
    }
    assert!(has_locked);
}
