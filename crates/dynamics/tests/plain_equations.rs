//! Motion and forces against the equations of the paper in their plain form: vectors in the
//! inertial frame, from centre of mass to centre of mass. The library computes them in the frames
//! of the joints.

use crate::common::{self, RandomTree, State, assert_close, rng, six, tactid, vector};
use nalgebra::{DVector, Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use tactid_dynamics::{
    BaseKind, FrameMotion, JointKind, JointView, Manipulator, StateError, Workspace, Wrench,
    inverse_dynamics,
};

/// Motion of one body in the inertial frame, and the wrench on it about its origin.
struct Plain {
    origin: FrameMotion,
    /// From the origin to the centre of mass.
    a: Vector3<f64>,
    center_acceleration: Vector3<f64>,
    axis: Vector3<f64>,
    wrench: Wrench,
}

/// Robots in which no joint mimics another.
fn free_robots() -> Vec<Manipulator> {
    let tree =
        |seed| Manipulator::from_urdf(&RandomTree::new(seed).urdf(false), BaseKind::Floating);
    let trees = (0..30).map(|seed| tree(seed).unwrap());
    std::iter::once(tactid()).chain(trees).collect()
}

/// Returns the motion of a body that a joint moves relative to its parent, and the joint's axis.
fn driven(
    parent: &FrameMotion,
    joint: &JointView<'_>,
    state: &State,
    coordinate: usize,
) -> (FrameMotion, Vector3<f64>) {
    let (position, rate) = (state.position[coordinate], state.velocity[coordinate]);
    let moved = match joint.kind {
        JointKind::Revolute => {
            UnitQuaternion::from_axis_angle(&joint.axis, position) * Isometry3::identity()
        }
        JointKind::Prismatic => {
            Isometry3::from(Translation3::from(joint.axis.into_inner() * position))
        }
    };
    let w = parent.angular_velocity;
    let mut origin = parent.of_fixed(&(joint.parent_from_body * moved)); // (3), (13) and their like
    let axis = origin.pose * joint.axis.into_inner();
    let relative = axis * rate;
    let driven = axis * state.acceleration[coordinate];
    match joint.kind {
        JointKind::Revolute => {
            origin.angular_velocity += relative; // (2)
            origin.angular_acceleration += driven + w.cross(&relative); // (12)
        }
        JointKind::Prismatic => {
            origin.velocity += relative;
            origin.acceleration += driven + w.cross(&relative) * 2.0;
        }
    }
    (origin, axis)
}

/// Moves the bodies by (1)-(20) and loads them by (21)-(41), as printed but for the corrections
/// that the library states.
fn plain(robot: &Manipulator, state: &State, gravity: &Vector3<f64>) -> (Vec<Plain>, Vec<f64>) {
    let mut bodies: Vec<Plain> = Vec::new();
    for body in robot.bodies() {
        let (origin, axis) = match &body.joint {
            Some(joint) => {
                let coordinate = robot.joint_index(joint.name).unwrap();
                driven(&bodies[joint.parent].origin, joint, state, coordinate)
            }
            None => (state.base, Vector3::zeros()),
        };
        let mass = body.parameters.mass_properties();
        let a = origin.pose * mass.map_or_else(Vector3::zeros, |mass| mass.center_of_mass);
        let (w, dw) = (origin.angular_velocity, origin.angular_acceleration);
        let center_acceleration = origin.acceleration + dw.cross(&a) + w.cross(&w.cross(&a)); // (11)
        let mut wrench = Wrench::zero();
        if let Some(mass) = mass {
            let rotation = origin.pose.rotation.to_rotation_matrix();
            let inertia = rotation * mass.inertia * rotation.transpose();
            wrench.force = (center_acceleration - gravity) * mass.mass_kg; // (25)-(27)
            let about_center = inertia * dw + w.cross(&(inertia * w)); // (38)-(41)
            wrench.moment = about_center + a.cross(&wrench.force); // (37)
        }
        bodies.push(Plain {
            origin,
            a,
            center_acceleration,
            axis,
            wrench,
        });
    }
    let mut torques = vec![0.0; robot.dof()];
    let views: Vec<_> = robot.bodies().collect();
    for (index, view) in views.iter().enumerate().rev() {
        let Some(joint) = &view.joint else { continue };
        let (wrench, at) = (
            bodies[index].wrench,
            bodies[index].origin.pose.translation.vector,
        );
        let parent = &mut bodies[joint.parent];
        let arm = at - parent.origin.pose.translation.vector;
        parent.wrench.force += wrench.force; // (22)
        parent.wrench.moment += wrench.moment + arm.cross(&wrench.force); // (33)
        torques[robot.joint_index(joint.name).unwrap()] = match joint.kind {
            JointKind::Revolute => bodies[index].axis.dot(&wrench.moment),
            JointKind::Prismatic => bodies[index].axis.dot(&wrench.force),
        };
    }
    (bodies, torques)
}

/// Returns the first link of each body, which has the frame of the body.
fn first_links(robot: &Manipulator) -> Vec<String> {
    let first = |body| {
        robot
            .links()
            .find(|link| link.body == body)
            .unwrap()
            .name
            .to_owned()
    };
    (0..robot.bodies().len()).map(first).collect()
}

/// Motion, torques and the wrench on the base equal the results of the plain equations.
#[test]
fn recursion_computes_the_plain_equations() {
    let rng = &mut rng(1);
    for robot in free_robots() {
        let state = State::random(rng, robot.dof());
        let gravity = vector(rng, 10.0);
        let (bodies, torques) = plain(&robot, &state, &gravity);
        let mut workspace = Workspace::new(&robot);
        inverse_dynamics(&mut workspace, &state.base, state.joints(), &gravity).unwrap();
        for (name, body) in first_links(&robot).iter().zip(&bodies) {
            let moved = workspace.frame_motion(robot.frame(name).unwrap());
            let expected = &body.origin;
            let pose = moved.pose.inverse() * expected.pose;
            assert!(pose.translation.vector.norm() < 1e-13, "{name}");
            assert!(pose.rotation.angle() < 1e-13, "{name}");
            assert_close(&moved.velocity, &expected.velocity, 1e-13, name);
            assert_close(&moved.acceleration, &expected.acceleration, 1e-13, name);
            assert_close(
                &moved.angular_velocity,
                &expected.angular_velocity,
                1e-13,
                name,
            );
            let angular = &expected.angular_acceleration;
            assert_close(&moved.angular_acceleration, angular, 1e-13, name);
            let (w, dw) = (moved.angular_velocity, moved.angular_acceleration);
            let center = moved.acceleration + dw.cross(&body.a) + w.cross(&w.cross(&body.a));
            assert_close(&center, &body.center_acceleration, 1e-12, name);
        }
        let given = DVector::from_column_slice(workspace.joint_torques().unwrap());
        let expected = DVector::from_vec(torques);
        assert!((given - &expected).norm() < 1e-12 * (1.0 + expected.norm()));
        let on_base = six(workspace.base_wrench().unwrap());
        assert_close(&on_base, &six(bodies[0].wrench), 1e-12, "base wrench");
    }
}

/// The regressor of the whole arm has the row of each body that `body_torque_regressor` gives, and
/// with the parameters of all bodies it gives the joint torques. It does not matter which gravity
/// the workspace was used with before.
#[test]
fn joint_torque_regressor_gives_the_torques() {
    let rng = &mut rng(2);
    for robot in common::robots() {
        let state = State::random(rng, robot.dof());
        let gravity = vector(rng, 10.0);
        let mut workspace = state.moved(&robot);
        let moving = robot.bodies().len() - 1;
        let mut rows = vec![SVector::zeros(); moving * robot.dof()];
        workspace
            .joint_torque_regressor(&gravity, &mut rows)
            .unwrap();

        let mut loaded = Workspace::new(&robot);
        inverse_dynamics(&mut loaded, &state.base, state.joints(), &gravity).unwrap();
        let mut of_body = vec![SVector::zeros(); robot.dof()];
        for (k, name) in first_links(&robot)[1..].iter().enumerate() {
            let frame = robot.frame(name).unwrap();
            loaded
                .body_torque_regressor(frame, &gravity, &mut of_body)
                .unwrap();
            for (joint, expected) in of_body.iter().enumerate() {
                assert_close(&rows[joint * moving + k], expected, 1e-12, name);
            }
        }
        let parameters: Vec<_> = robot.bodies().skip(1).map(|body| body.parameters).collect();
        for (row, expected) in rows.chunks(moving).zip(loaded.joint_torques().unwrap()) {
            let products = row.iter().zip(&parameters);
            let torque: f64 = products.map(|(row, body)| row.dot(body.as_vector())).sum();
            assert!((torque - expected).abs() < 1e-11 * (1.0 + expected.abs()));
        }
        let error = workspace
            .joint_torque_regressor(&gravity, &mut rows[1..])
            .unwrap_err();
        assert!(matches!(error, StateError::Rows { given, expected } if given + 1 == expected));
    }
}

/// The motion that regressors need is the frame's, expressed in it, whichever gravity the workspace
/// was used with.
#[test]
fn tool_motion_is_the_motion_of_the_frame() {
    let rng = &mut rng(3);
    for robot in common::robots() {
        let state = State::random(rng, robot.dof());
        let (gravity, other) = (vector(rng, 10.0), vector(rng, 10.0));
        let mut workspace = Workspace::new(&robot);
        for held in [Vector3::zeros(), gravity, other] {
            inverse_dynamics(&mut workspace, &state.base, state.joints(), &held).unwrap();
            for name in robot.frame_names() {
                let frame = robot.frame(name).unwrap();
                let expected = workspace.frame_motion(frame).in_frame(&gravity);
                let given = workspace.tool_motion(frame, &gravity);
                assert_close(&given.acceleration, &expected.acceleration, 1e-13, name);
                assert_close(
                    &given.angular_velocity,
                    &expected.angular_velocity,
                    1e-13,
                    name,
                );
                let angular = &expected.angular_acceleration;
                assert_close(&given.angular_acceleration, angular, 1e-13, name);
            }
        }
    }
}
