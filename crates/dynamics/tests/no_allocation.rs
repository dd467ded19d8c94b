//! Computations of a control loop do not allocate.

use crate::common::{Cloud, State, rng, robots};
use allocation_counter::measure;
use nalgebra::{SVector, Vector3};
use std::hint::black_box;
use tactid_dynamics::{
    FreeRobot, Workspace, base_acceleration, forces, free_base_motion, inertia_rows,
    inverse_dynamics, momentum, motion, tactile_mass_rows, wrench_on_end_effector,
    wrench_regressor,
};

/// With an existing workspace, motion, forces, acceleration of the base, momentum, wrench on the
/// end-effector and all regressors allocate nothing.
#[test]
fn the_loop_allocates_nothing() {
    let rng = &mut rng(1);
    for robot in robots() {
        let tool = robot.frame(robot.frame_names().last().unwrap()).unwrap();
        let state = State::random(rng, robot.dof());
        let payload = Cloud::random(rng).mass_properties();
        let mut workspace = Workspace::new(&robot);
        let mut rows = vec![SVector::zeros(); robot.dof()];
        let mut all_rows = vec![SVector::zeros(); robot.dof() * (robot.bodies().len() - 1)];
        let counted = measure(|| {
            motion(&mut workspace, &state.base, state.joints()).unwrap();
            forces(&mut workspace, &Vector3::new(0.0, 0.0, -9.81));
            base_acceleration(&mut workspace, &state.base, state.joints()).unwrap();
            free_base_motion(&mut workspace, &state.base.pose, state.joints()).unwrap();
            let free = FreeRobot::new(&mut workspace, state.joints()).unwrap();
            let free = free.with_body(&workspace.frame_motion(tool), &payload.into());
            free.base_motion(&mut workspace, &state.base.pose, state.joints())
                .unwrap();
            black_box(momentum(&workspace));
            black_box(workspace.subtree_parameters(robot.base_frame()));
            let wrench = wrench_on_end_effector(&workspace, tool);
            let seen = workspace.frame_motion(tool).in_frame(&Vector3::zeros());
            let first = tactile_mass_rows(&seen, &wrench.force);
            black_box(first.iter().map(|(_, target)| target).sum::<f64>());
            black_box(inertia_rows(&seen, &wrench, &payload.center_of_mass));
            black_box(wrench_regressor(&seen));
            let gravity = Vector3::new(0.0, 0.0, -9.81);
            workspace
                .body_torque_regressor(tool, &gravity, &mut rows)
                .unwrap();
            inverse_dynamics(&mut workspace, &state.base, state.joints(), &gravity).unwrap();
            black_box(workspace.tool_motion(tool, &gravity));
            workspace
                .joint_torque_regressor(&gravity, &mut all_rows)
                .unwrap();
        });
        assert_eq!(counted.count_total, 0, "{counted:?}");
    }
    let counted = measure(|| drop(black_box(vec![0_u8; 16])));
    assert_eq!(counted.count_total, 1, "the counter counts");
}
