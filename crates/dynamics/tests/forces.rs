//! Forces (21)-(41), acceleration of the base and momentum, against the conservation laws.

use crate::common::{Cloud, RandomTree, State, assert_close, derivative, rng, robots, six, vector};
use nalgebra::{Isometry3, Vector3, Vector6};
use tactid_dynamics::{
    BaseKind, FreeRobot, InertialParameters, Manipulator, Momentum, Workspace, Wrench,
    base_acceleration, forces, free_base_motion, momentum,
};

fn loaded(robot: &Manipulator, state: &State, gravity: &Vector3<f64>) -> Workspace {
    let mut workspace = state.moved(robot);
    forces(&mut workspace, gravity);
    workspace
}

/// Returns the kinetic energy, J, summed over the links with the parameters of the tree.
fn kinetic_energy(tree: &RandomTree, robot: &Manipulator, workspace: &Workspace) -> f64 {
    let of_link = |index: usize| {
        let frame = robot.frame(&format!("link_{index}")).unwrap();
        let motion = workspace.frame_motion(frame);
        let to_link = motion.pose.rotation.inverse();
        let (v, w) = (to_link * motion.velocity, to_link * motion.angular_velocity);
        let link = &tree.0[index].parameters;
        0.5 * link.mass() * v.norm_squared()
            + v.dot(&w.cross(&link.first_moment()))
            + 0.5 * w.dot(&(link.inertia_about_origin() * w))
    };
    (0..tree.0.len()).map(of_link).sum()
}

/// Returns the momentum about the inertial frame's origin, summed over the links as in
/// [`kinetic_energy`].
fn momentum_of_links(
    tree: &RandomTree,
    robot: &Manipulator,
    workspace: &Workspace,
) -> Vector6<f64> {
    let mut total = Wrench::zero();
    for (index, link) in tree.0.iter().enumerate() {
        let frame = robot.frame(&format!("link_{index}")).unwrap();
        let motion = workspace.frame_motion(frame);
        let to_link = motion.pose.rotation.inverse();
        let (v, w) = (to_link * motion.velocity, to_link * motion.angular_velocity);
        let (h, inertia) = (
            link.parameters.first_moment(),
            link.parameters.inertia_about_origin(),
        );
        let of_link = Wrench {
            force: v * link.parameters.mass() + w.cross(&h),
            moment: inertia * w + h.cross(&v),
        };
        total = total + of_link.expressed_in(&motion.pose);
    }
    six(total)
}

fn stacked(momentum: Momentum) -> Vector6<f64> {
    six(Wrench {
        force: momentum.linear,
        moment: momentum.angular,
    })
}

/// The rate of the kinetic energy is the power of joints, base wrench and gravity, for revolute,
/// prismatic and mimic joints. A wrong sign, axis or multiplier would violate the balance.
#[test]
fn power_balance() {
    let rng = &mut rng(1);
    for tree in (0..40).map(RandomTree::new) {
        let robot = tree.robot();
        let state = State::random(rng, robot.dof());
        let gravity = vector(rng, 10.0);
        let workspace = loaded(&robot, &state, &gravity);
        let torques = workspace.joint_torques().unwrap().iter();
        let of_joints: f64 = torques.zip(&state.velocity).map(|(t, v)| t * v).sum();
        let base = workspace.base_wrench().unwrap();
        let of_base =
            base.force.dot(&state.base.velocity) + base.moment.dot(&state.base.angular_velocity);
        let of_gravity = gravity.dot(&momentum(&workspace).linear);
        let rate = derivative(|t| kinetic_energy(&tree, &robot, &state.at(t).moved(&robot)));
        let power = of_joints + of_base + of_gravity;
        let size = 1.0 + of_joints.abs() + of_base.abs() + of_gravity.abs();
        assert!(
            (rate - power).abs() < 1e-8 * size,
            "{rate} W, but the power is {power} W"
        );
    }
}

/// The momentum is the sum over the links about the inertial frame's origin.
#[test]
fn momentum_is_the_sum_over_links() {
    let rng = &mut rng(2);
    for tree in (0..40).map(RandomTree::new) {
        let robot = tree.robot();
        let workspace = State::random(rng, robot.dof()).moved(&robot);
        let expected = momentum_of_links(&tree, &robot, &workspace);
        assert_close(&stacked(momentum(&workspace)), &expected, 1e-13, "momentum");
    }
}

/// The rate of momentum is the base wrench about the inertial frame's origin for any motion of the
/// base, because (21)-(41) sum `f̂` and `n̂ + r × f̂` over all bodies.
#[test]
fn momentum_rate_is_the_base_wrench() {
    let rng = &mut rng(3);
    for robot in robots() {
        let state = State::random(rng, robot.dof());
        let workspace = loaded(&robot, &state, &Vector3::zeros());
        let to_base = Isometry3::from(state.base.pose.translation);
        let applied = workspace.base_wrench().unwrap().expressed_in(&to_base);
        let rate = derivative(|t| stacked(momentum(&state.at(t).moved(&robot))));
        assert_close(&rate, &six(applied), 1e-8, "rate of momentum");
    }
}

/// Gravity has the same effect on joints and base as an upward acceleration of the base.
#[test]
fn gravity_is_an_upward_acceleration_of_the_base() {
    let rng = &mut rng(4);
    for robot in robots() {
        let state = State::random(rng, robot.dof());
        let gravity = Vector3::new(0.5, -1.0, -9.81);
        let under_gravity = loaded(&robot, &state, &gravity);
        let mut lifted = state.clone();
        lifted.base.acceleration -= gravity;
        let lifted = loaded(&robot, &lifted, &Vector3::zeros());
        let (given, expected) = (
            six(under_gravity.base_wrench().unwrap()),
            six(lifted.base_wrench().unwrap()),
        );
        assert_close(&given, &expected, 1e-12, "base wrench");
        for (given, expected) in under_gravity
            .joint_torques()
            .unwrap()
            .iter()
            .zip(lifted.joint_torques().unwrap())
        {
            assert!((given - expected).abs() <= 1e-12 * (1.0 + expected.abs()));
        }
    }
}

/// A robot at rest is supported with its whole weight.
#[test]
fn at_rest_the_base_carries_the_weight() {
    let rng = &mut rng(5);
    for robot in robots() {
        let mut state = State::random(rng, robot.dof());
        state.base = tactid_dynamics::FrameMotion::at_rest(state.base.pose);
        state.velocity.fill(0.0);
        state.acceleration.fill(0.0);
        let workspace = loaded(&robot, &state, &Vector3::new(0.0, 0.0, -9.81));
        let weight = Vector3::new(0.0, 0.0, 9.81) * robot.mass();
        assert_close(
            &workspace.base_wrench().unwrap().force,
            &weight,
            1e-13,
            "weight",
        );
        assert!(workspace.base_wrench().unwrap().moment.z.abs() < 1e-12 * weight.norm());
    }
}

/// With the computed acceleration of its base, a free-floating robot needs no external wrench and
/// keeps its momentum while its joints move.
#[test]
fn base_acceleration_conserves_momentum() {
    let rng = &mut rng(6);
    for robot in robots() {
        let mut state = State::random(rng, robot.dof());
        let mut workspace = Workspace::new(&robot);
        let found = base_acceleration(&mut workspace, &state.base, state.joints()).unwrap();
        let left = workspace.base_wrench().unwrap();

        let mut held = state.clone();
        (held.base.acceleration, held.base.angular_acceleration) = Default::default();
        let needed = six(loaded(&robot, &held, &Vector3::zeros())
            .base_wrench()
            .unwrap())
        .norm();
        assert!(six(left).norm() < 1e-12 * needed, "{left:?} of {needed}");

        (state.base.acceleration, state.base.angular_acceleration) = (found.linear, found.angular);
        let again = loaded(&robot, &state, &Vector3::zeros());
        assert_eq!(
            again.base_wrench().unwrap(),
            left,
            "the workspace holds the motion that was found"
        );
        let rate = derivative(|t| stacked(momentum(&state.at(t).moved(&robot))));
        assert!(
            rate.norm() < 1e-8 * (1.0 + needed),
            "momentum changes by {rate}"
        );
    }
}

/// The motion of a base that started at rest makes the momentum vanish now and at all times:
/// neither the momentum nor its rate remains, wherever the base is.
#[test]
fn free_base_motion_has_no_momentum() {
    let rng = &mut rng(9);
    for robot in robots() {
        let mut state = State::random(rng, robot.dof());
        let mut workspace = Workspace::new(&robot);
        let pose = state.base.pose;
        let found = free_base_motion(&mut workspace, &pose, state.joints()).unwrap();
        let moving = stacked(momentum(&state.moved(&robot))).norm();
        assert!(moving > 1e-3, "{moving}");
        assert!(stacked(momentum(&workspace)).norm() < 1e-12 * moving);
        assert_eq!(found.pose, pose);
        state.base = found;
        let rate = derivative(|t| stacked(momentum(&state.at(t).moved(&robot))));
        assert!(rate.norm() < 1e-7, "momentum changes by {rate}");
    }
}

/// A payload that is added to a motion of the joints gives the motion of the robot with it,
/// wherever the base is.
#[test]
fn a_free_robot_takes_a_payload() {
    let rng = &mut rng(10);
    for robot in robots() {
        let state = State::random(rng, robot.dof());
        let tool = robot.frame(robot.frame_names().last().unwrap()).unwrap();
        let payload = InertialParameters::from(Cloud::random(rng).mass_properties());
        let mut unloaded = Workspace::new(&robot);
        let free = FreeRobot::new(&mut unloaded, state.joints()).unwrap();
        let frame = unloaded.frame_motion(tool);
        let mut loaded = Workspace::new(&robot.with_payload(tool, &payload));
        let (pose, joints) = (state.base.pose, state.joints());
        let expected = free_base_motion(&mut loaded, &pose, joints).unwrap();
        let efforts = loaded.joint_torques().unwrap().to_vec();
        let with_body = free.with_body(&frame, &payload);
        let found = with_body.base_motion(&mut loaded, &pose, joints).unwrap();
        for (found, expected) in [
            (found.velocity, expected.velocity),
            (found.angular_velocity, expected.angular_velocity),
            (found.acceleration, expected.acceleration),
            (found.angular_acceleration, expected.angular_acceleration),
        ] {
            assert!(
                (found - expected).norm() < 1e-10 * (1.0 + expected.norm()),
                "{found} {expected}"
            );
        }
        for (found, expected) in loaded.joint_torques().unwrap().iter().zip(&efforts) {
            assert!(
                (found - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                "{found} {expected}"
            );
        }
    }
}

/// The torque of a joint includes the torques of the joints that mimic it, times their multipliers.
#[test]
fn mimic_torques_count_towards_the_leader() {
    let rng = &mut rng(7);
    let mut followers = 0;
    for tree in (0..40).map(RandomTree::new) {
        let robot = tree.robot();
        let free = Manipulator::from_urdf(&tree.urdf(false), BaseKind::Floating).unwrap();
        let state = State::random(rng, robot.dof());
        let mut spread = state.clone();
        spread.position = vec![0.0; free.dof()];
        spread.velocity = spread.position.clone();
        spread.acceleration = spread.position.clone();
        // For each independent joint of `free`: the coordinate that moves it in `robot`, and the
        // multiplier.
        let mut sources = Vec::new();
        for (joint, name) in free.joint_names().iter().enumerate() {
            let link: usize = name.trim_start_matches("joint_").parse().unwrap();
            let (leader, ratio, offset) = tree.0[link].mimic.unwrap_or((link, 1.0, 0.0));
            let source = robot.joint_index(&format!("joint_{leader}")).unwrap();
            spread.position[joint] = ratio * state.position[source] + offset;
            spread.velocity[joint] = ratio * state.velocity[source];
            spread.acceleration[joint] = ratio * state.acceleration[source];
            sources.push((source, ratio));
            followers += usize::from(leader != link);
        }
        let gravity = vector(rng, 10.0);
        let given = loaded(&robot, &state, &gravity);
        let free = loaded(&free, &spread, &gravity);
        let mut expected = vec![0.0; robot.dof()];
        for (torque, (source, ratio)) in free.joint_torques().unwrap().iter().zip(sources) {
            expected[source] += ratio * torque;
        }
        for (given, expected) in given.joint_torques().unwrap().iter().zip(expected) {
            assert!((given - expected).abs() <= 1e-12 * (1.0 + expected.abs()));
        }
    }
    assert!(followers > 10, "only {followers} mimic joints were tried");
}

/// Forces do not depend on the inertial frame's origin, even at the distance of a low orbit.
#[test]
fn forces_do_not_depend_on_the_origin() {
    let rng = &mut rng(8);
    for robot in robots() {
        let state = State::random(rng, robot.dof());
        let mut far = state.clone();
        far.base.pose.translation.vector += Vector3::new(7e6, -3e6, 1e6);
        let near = loaded(&robot, &state, &Vector3::zeros());
        let far = loaded(&robot, &far, &Vector3::zeros());
        let expected = six(near.base_wrench().unwrap());
        assert_close(
            &six(far.base_wrench().unwrap()),
            &expected,
            1e-13,
            "base wrench",
        );
    }
}
