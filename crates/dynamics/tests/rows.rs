//! The equations (30)-(32) and (44)-(48) and the regressor of a rigid body, with true parameters.

use crate::common::{
    self, Cloud, RandomTree, State, assert_close, rng, robots, six, tactid, vector,
};
use nalgebra::{DMatrix, DVector, Isometry3, SVector, UnitQuaternion, Vector3, Vector4, Vector6};
use rand::RngExt;
use tactid_dynamics::{
    FrameId, FrameMotion, InertialParameters, Manipulator, MassProperties, Rows, ToolMotion,
    Workspace, Wrench, base_acceleration, forces, inertia_regressor, inertia_rows, mass_rows,
    motion, omega_matrix, symmetric_entries, tactile_mass_rows, wrench_on_end_effector,
    wrench_regressor,
};

fn of_six(six: &Vector6<f64>) -> Wrench {
    Wrench {
        force: six.fixed_rows::<3>(0).into(),
        moment: six.fixed_rows::<3>(3).into(),
    }
}

/// Returns the wrench that a body needs for a motion, by Newton's and Euler's equations at the
/// centre of mass, moved to the origin, independently of the regressor.
fn newton_euler(body: &MassProperties, motion: &ToolMotion) -> Wrench {
    let (w, dw) = (motion.angular_velocity, motion.angular_acceleration);
    let a = body.center_of_mass;
    let center = motion.acceleration + dw.cross(&a) + w.cross(&w.cross(&a));
    let force = center * body.mass_kg;
    let moment = body.inertia * dw + w.cross(&(body.inertia * w)) + a.cross(&force);
    Wrench { force, moment }
}

fn tool_motion(rng: &mut rand::rngs::StdRng) -> ToolMotion {
    ToolMotion {
        acceleration: vector(rng, 2.0),
        angular_velocity: vector(rng, 2.0),
        angular_acceleration: vector(rng, 2.0),
    }
}

/// Returns the unknowns of the two stages: `[1/m, a]` and the six entries of the inertia.
fn two_stages(body: &MassProperties) -> (Vector4<f64>, SVector<f64, 6>) {
    let a = body.center_of_mass;
    let first = Vector4::new(1.0 / body.mass_kg, a.x, a.y, a.z);
    (first, SVector::from(symmetric_entries(&body.inertia)))
}

#[track_caller]
fn assert_satisfied<const N: usize>(rows: &Rows<N>, unknowns: &SVector<f64, N>, what: &str) {
    assert_close(&(rows.matrix * unknowns), &rows.target, 1e-12, what);
    for (k, (row, expected)) in rows.iter().enumerate() {
        assert_eq!(row.transpose(), rows.matrix.row(k));
        assert_eq!(expected, rows.target[k]);
    }
}

/// The regressor times the ten parameters is the wrench that moves the body.
#[test]
fn regressor_identity() {
    let rng = &mut rng(1);
    for _ in 0..200 {
        let (body, motion) = (Cloud::random(rng).mass_properties(), tool_motion(rng));
        let parameters = InertialParameters::from(body);
        let given = wrench_regressor(&motion) * parameters.as_vector();
        let expected = newton_euler(&body, &motion);
        assert_close(&given, &six(expected), 1e-13, "wrench");
    }
}

/// The true parameters satisfy the equations of both stages: (48) with the force on the body, (32)
/// with the force on all other bodies, (46) with the moment about the tool's origin.
#[test]
fn true_parameters_satisfy_the_rows() {
    let rng = &mut rng(2);
    for _ in 0..200 {
        let (body, motion) = (Cloud::random(rng).mass_properties(), tool_motion(rng));
        let wrench = newton_euler(&body, &motion);
        let (first, second) = two_stages(&body);
        assert_satisfied(&tactile_mass_rows(&motion, &wrench.force), &first, "(48)");
        assert_satisfied(&mass_rows(&motion, &-wrench.force), &first, "(32)");
        let rows = inertia_rows(&motion, &wrench, &body.center_of_mass);
        assert_satisfied(&rows, &second, "(46)");
        let (a, w) = (body.center_of_mass, motion.angular_velocity);
        let turning = motion.angular_acceleration.cross(&a) + w.cross(&w.cross(&a));
        assert_close(&(omega_matrix(&motion) * a), &turning, 1e-14, "(31)");
        let spun = body.inertia * motion.angular_acceleration + w.cross(&(body.inertia * w));
        assert_close(&(inertia_regressor(&motion) * second), &spun, 1e-13, "(45)");
    }
}

/// Returns the difference between the base wrenches with and without a payload, in the tool frame.
fn payload_wrench(
    robot: &Manipulator,
    state: &State,
    tool: FrameId,
    payload: &InertialParameters,
    gravity: &Vector3<f64>,
) -> Wrench {
    let at_base = |robot: &Manipulator| {
        let mut workspace = state.moved(robot);
        forces(&mut workspace, gravity);
        workspace.base_wrench().unwrap()
    };
    let on_payload = at_base(&robot.with_payload(tool, payload)) - at_base(robot);
    let world_from_tool = state.moved(robot).pose(tool);
    let world_from_base = Isometry3::from(state.base.pose.translation);
    on_payload.expressed_in(&(world_from_tool.inverse() * world_from_base))
}

/// The regressor of the tool's motion gives the wrench that a payload adds to the base wrench, so
/// motion, forces, gravity, change of frame and regressor are consistent.
#[test]
fn regressor_agrees_with_forces() {
    let rng = &mut rng(3);
    for robot in robots() {
        // Without the robot's own masses the payload's wrench is obtained to the last digits.
        let weightless = robot.without_subtree(robot.base_frame());
        let names: Vec<_> = robot.frame_names().collect();
        for _ in 0..10 {
            let tool = robot
                .frame(names[rng.random_range(0..names.len())])
                .unwrap();
            let payload = Cloud::random(rng).parameters();
            let state = State::random(rng, robot.dof());
            let gravity = vector(rng, 10.0);
            let frame_motion = state.moved(&robot).frame_motion(tool);
            let by_rows = wrench_regressor(&frame_motion.in_frame(&gravity)) * payload.as_vector();
            let by_forces = payload_wrench(&weightless, &state, tool, &payload, &gravity);
            // The base link keeps its own mass, which is large compared with the payload's.
            let tolerance = 1e-12 * (1.0 + weightless.mass() / payload.mass());
            assert_close(&six(by_forces), &by_rows, tolerance, robot.frame_name(tool));
            let loaded = payload_wrench(&robot, &state, tool, &payload, &gravity);
            assert_close(&six(loaded), &by_rows, 1e-9, robot.frame_name(tool));
        }
    }
}

/// Returns the motion expressed in the inertial frame, as the paper prints the equations.
fn unturned(motion: &FrameMotion) -> ToolMotion {
    ToolMotion {
        acceleration: motion.acceleration,
        angular_velocity: motion.angular_velocity,
        angular_acceleration: motion.angular_acceleration,
    }
}

/// Solves stacked equations by least squares and returns the solution and the residual relative to
/// the targets.
fn least_squares<const N: usize>(rows: &[Rows<N>]) -> (SVector<f64, N>, f64) {
    let matrix = DMatrix::from_fn(3 * rows.len(), N, |r, c| rows[r / 3].matrix[(r % 3, c)]);
    let targets = DVector::from_fn(3 * rows.len(), |r, _| rows[r / 3].target[r % 3]);
    let solution = matrix
        .clone()
        .svd(true, true)
        .solve(&targets, 1e-14)
        .unwrap();
    let residual = (matrix * &solution - &targets).norm() / targets.norm();
    (SVector::from_column_slice(solution.as_slice()), residual)
}

/// The unknowns are constant in the end-effector frame only: equations formed there have the true
/// parameters as common solution, equations formed in the inertial frame have none.
#[test]
fn rows_hold_in_the_end_effector_frame_alone() {
    let rng = &mut rng(4);
    let robot = tactid();
    let tool = robot.frame("tool0").unwrap();
    let body = Cloud::random(rng).mass_properties();
    let (first, second) = two_stages(&body);
    let (mut in_tool, mut in_world) = ((Vec::new(), Vec::new()), (Vec::new(), Vec::new()));
    for _ in 0..30 {
        let state = State::random(rng, robot.dof());
        let seen = state.moved(&robot).frame_motion(tool);
        let motion = seen.in_frame(&Vector3::zeros());
        let wrench = newton_euler(&body, &motion);
        in_tool.0.push(tactile_mass_rows(&motion, &wrench.force));
        in_tool
            .1
            .push(inertia_rows(&motion, &wrench, &body.center_of_mass));
        let turned = wrench.expressed_in(&Isometry3::from_parts(
            Vector3::zeros().into(),
            seen.pose.rotation,
        ));
        let motion = unturned(&seen);
        in_world.0.push(tactile_mass_rows(&motion, &turned.force));
        // The centre of mass is expressed in the inertial frame, too, so that only this stage is
        // tested.
        let a = seen.pose.rotation * body.center_of_mass;
        in_world.1.push(inertia_rows(&motion, &turned, &a));
    }
    let (mass_found, mass_residual) = least_squares(&in_tool.0);
    let (inertia_found, inertia_residual) = least_squares(&in_tool.1);
    assert!(mass_residual < 1e-13 && inertia_residual < 1e-13);
    assert_close(&mass_found, &first, 1e-12, "[1/m, a]");
    assert_close(&inertia_found, &second, 1e-12, "I");

    let (mass_found, mass_residual) = least_squares(&in_world.0);
    let (inertia_found, inertia_residual) = least_squares(&in_world.1);
    assert!(mass_residual > 0.01 && inertia_residual > 0.01);
    assert!((mass_found - first).norm() > 0.05 * first.norm());
    assert!((inertia_found - second).norm() > 0.05 * second.norm());
}

/// The equations of a motion do not change when the whole robot is rotated in the inertial frame.
#[test]
fn rows_do_not_depend_on_the_inertial_frame() {
    let rng = &mut rng(5);
    let robot = tactid();
    let tool = robot.frame("tool0").unwrap();
    for _ in 0..20 {
        let state = State::random(rng, robot.dof());
        let turn = UnitQuaternion::from_scaled_axis(vector(rng, 2.0));
        let mut turned = state.clone();
        turned.base = FrameMotion {
            pose: turn * state.base.pose,
            velocity: turn * state.base.velocity,
            angular_velocity: turn * state.base.angular_velocity,
            acceleration: turn * state.base.acceleration,
            angular_acceleration: turn * state.base.angular_acceleration,
        };
        let gravity = vector(rng, 10.0);
        let rows = |state: &State, gravity: &Vector3<f64>| {
            let seen = state.moved(&robot).frame_motion(tool);
            wrench_regressor(&seen.in_frame(gravity))
        };
        let (given, expected) = (rows(&turned, &(turn * gravity)), rows(&state, &gravity));
        assert_close(&given, &expected, 1e-13, "rows");
    }
}

/// Returns the motion of a free-floating robot without external wrench, with the joints `still` at
/// rest.
fn floating(robot: &Manipulator, mut state: State, still: &[&str]) -> State {
    for name in still {
        let joint = robot.joint_index(name).unwrap();
        (state.velocity[joint], state.acceleration[joint]) = (0.0, 0.0);
    }
    let mut workspace = Workspace::new(robot);
    let found = base_acceleration(&mut workspace, &state.base, state.joints()).unwrap();
    (state.base.acceleration, state.base.angular_acceleration) = (found.linear, found.angular);
    state
}

/// `f_U` and `n_U` of (30) and (44), computed from the motion of all other bodies, are the wrench
/// on gripper and payload as one body, about the tool's origin. A wrong sign of `n_U`, another
/// reference point (without `a_U × f_U`) or the printed inner sum from j = 2 would violate this.
#[test]
fn wrench_on_end_effector_moves_gripper_and_payload() {
    let rng = &mut rng(6);
    let empty = tactid();
    let tool = empty.frame("tool0").unwrap();
    for _ in 0..50 {
        let payload = Cloud::random(rng).parameters();
        let robot = empty.with_payload(tool, &payload);
        let still = ["finger_left_joint", "finger_right_joint"];
        let state = floating(&robot, State::random(rng, robot.dof()), &still);

        let workspace = state.moved(&robot);
        let composite = workspace.subtree_parameters(tool) + payload;
        let seen = workspace.frame_motion(tool).in_frame(&Vector3::zeros());
        let felt = wrench_regressor(&seen) * composite.as_vector();

        let rest = empty.without_subtree(tool);
        let mut workspace = Workspace::new(&rest);
        motion(&mut workspace, &state.base, state.joints()).unwrap();
        let found = wrench_on_end_effector(&workspace, tool);
        assert_close(&six(found), &felt, 1e-11, "[f_U; n_U]");

        // The equations of joint sensing hold as well: (32) with f_K = -f_U, and (46).
        let body = composite.mass_properties().unwrap();
        let (first, second) = two_stages(&body);
        let rows = mass_rows(&seen, &-found.force);
        assert_close(&(rows.matrix * first), &rows.target, 1e-11, "(32)");
        let rows = inertia_rows(&seen, &found, &body.center_of_mass);
        assert_close(&(rows.matrix * second), &rows.target, 1e-11, "(46)");
        // The term `a_U × f_U` is large enough for the test to detect its absence.
        let a_cross_f = body.center_of_mass.cross(&found.force);
        assert!(a_cross_f.norm() > 1e-6 * felt.norm());
    }
}

/// For any frame of any tree, `f_U` and `n_U` are the sum of the wrenches on the links below it,
/// also if joints below it move.
#[test]
fn wrench_on_end_effector_is_the_sum_over_the_links_below() {
    let rng = &mut rng(7);
    for tree in (0..40).map(RandomTree::new) {
        let robot = tree.robot();
        let state = floating(&robot, State::random(rng, robot.dof()), &[]);
        let workspace = state.moved(&robot);
        for index in 0..tree.0.len() {
            let tool = robot.frame(&format!("link_{index}")).unwrap();
            let tool_from_world = workspace.pose(tool).inverse();
            let mut expected = Wrench::zero();
            let mut parameters = InertialParameters::zero();
            for link in tree.below(index) {
                let frame = robot.frame(&format!("link_{link}")).unwrap();
                let seen = workspace.frame_motion(frame);
                let own = &tree.0[link].parameters;
                let needed = wrench_regressor(&seen.in_frame(&Vector3::zeros())) * own.as_vector();
                let tool_from_link = tool_from_world * seen.pose;
                expected = expected + of_six(&needed).expressed_in(&tool_from_link);
                parameters = parameters + own.expressed_in(&tool_from_link);
            }
            let removed = workspace.subtree_parameters(tool);
            assert_close(
                removed.as_vector(),
                parameters.as_vector(),
                1e-12,
                "removed",
            );
            let rest = robot.without_subtree(tool);
            assert!((rest.mass() + removed.mass() - robot.mass()).abs() < 1e-12 * robot.mass());
            let found = wrench_on_end_effector(&state.moved(&rest), tool);
            assert_close(&six(found), &six(expected), 1e-11, robot.frame_name(tool));
        }
    }
}

/// A wrench moved to another frame and back is unchanged, and its power is the same in both frames.
#[test]
fn wrenches_change_frames() {
    let rng = &mut rng(8);
    for _ in 0..50 {
        let a_from_b = common::isometry(rng);
        let wrench = Wrench {
            force: vector(rng, 5.0),
            moment: vector(rng, 5.0),
        };
        let moved = wrench.expressed_in(&a_from_b);
        let back = moved.expressed_in(&a_from_b.inverse());
        assert_close(&six(back), &six(wrench), 1e-14, "and back");
        let (v, w) = (vector(rng, 1.0), vector(rng, 1.0));
        let w_in_a = a_from_b * w;
        let v_in_a = a_from_b * v - w_in_a.cross(&a_from_b.translation.vector);
        let power = wrench.force.dot(&v) + wrench.moment.dot(&w);
        let power_in_a = moved.force.dot(&v_in_a) + moved.moment.dot(&w_in_a);
        assert!((power - power_in_a).abs() < 1e-13 * (1.0 + power.abs() * 10.0));
        assert!(wrench.is_finite() && (wrench - wrench) == Wrench::zero());
    }
    let mut broken = Wrench::zero();
    broken.moment.y = f64::NAN;
    assert!(!broken.is_finite());
}

/// The regressor of each body, in the frame of its first link, times its parameters sums to the
/// torques of all joints: of trees with branches, prismatic and mimic joints, links that are fixed
/// to others, and a base that moves.
#[test]
fn torque_regressors_sum_to_the_joint_torques() {
    let rng = &mut rng(21);
    let mut mimics = 0;
    for robot in robots() {
        let state = State::random(rng, robot.dof());
        let gravity = vector(rng, 10.0);
        let mut workspace = state.moved(&robot);
        let mut sum = vec![0.0; robot.dof()];
        let mut rows = vec![SVector::zeros(); robot.dof()];
        for (index, body) in robot.bodies().enumerate() {
            let name = robot.links().find(|link| link.body == index).unwrap().name;
            let frame = robot.frame(name).unwrap();
            workspace
                .body_torque_regressor(frame, &gravity, &mut rows)
                .unwrap();
            for (sum, row) in sum.iter_mut().zip(&rows) {
                *sum += row.dot(body.parameters.as_vector());
            }
        }
        mimics += robot.bodies().count() - 1 - robot.dof();
        forces(&mut workspace, &gravity);
        for (sum, torque) in sum.iter().zip(workspace.joint_torques().unwrap()) {
            assert!(
                (sum - torque).abs() < 1e-12 * (1.0 + torque.abs()),
                "{sum} {torque}"
            );
        }
    }
    assert!(mimics > 5, "some joints must mimic others");
    let error = Workspace::new(&tactid()).body_torque_regressor(
        tactid().base_frame(),
        &Vector3::zeros(),
        &mut [],
    );
    assert!(
        error
            .unwrap_err()
            .to_string()
            .starts_with("the regressor has 0 entries")
    );
}
