//! Repeats one kernel of the dynamics on the project's robot, for `bench/instructions.py` to count
//! its instructions.
//!
//! `kernels NAME COUNT` runs it COUNT times; `kernels` prints the names.

#![allow(clippy::unwrap_used, clippy::panic)]
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::hint::black_box;

use nalgebra::{Isometry3, SMatrix, SVector, Vector3};
use tactid_dynamics::{
    BaseKind, BatchDynamics, FrameMotion, JointMotion, Manipulator, StateSeries, VectorUnit,
    Workspace, inverse_dynamics, motion, motion_under_gravity, wrench_regressor,
};

const NAMES: [&str; 6] = [
    "inverse_dynamics",
    "tool_kinematics",
    "payload_rows",
    "torque_regressor",
    "batch_inverse_dynamics",
    "batch_payload_rows",
];

/// Number of states of a batch. The set-up of a call is a small part of its instructions then.
const STATES: usize = 64;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let (Some(name), Some(count)) = (arguments.next(), arguments.next()) else {
        return println!("{}", NAMES.join("\n"));
    };
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../sim/robots/tactid.urdf");
    let robot = Manipulator::from_urdf_file(path.as_ref(), BaseKind::Floating).unwrap();
    let tool = robot.frame("tool0").unwrap();
    let (dof, moving) = (robot.dof(), robot.bodies().len() - 1);
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let base = FrameMotion::at_rest(Isometry3::identity());
    let numbers: Vec<f64> = (0..STATES * dof)
        .map(|k| (0.1 + 0.07 * k as f64) % 3.0)
        .collect();
    let one = JointMotion {
        position: &numbers[..dof],
        velocity: &numbers[..dof],
        acceleration: &numbers[..dof],
    };
    let batch = StateSeries {
        base: std::slice::from_ref(&base),
        joints: JointMotion {
            position: &numbers,
            velocity: &numbers,
            acceleration: &numbers,
        },
    };
    let mut workspace = Workspace::new(&robot);
    let dynamics = BatchDynamics::new(&robot).with_unit(VectorUnit::Baseline);
    let mut rows = vec![SVector::zeros(); dof * moving];
    let (mut torques, mut wrenches) = (vec![0.0; STATES * dof], [[0.0; 6]; STATES]);
    let mut regressors = [SMatrix::zeros(); STATES];
    for _ in 0..count.parse::<usize>().unwrap() {
        let one = black_box(one);
        let done = match name.as_str() {
            "inverse_dynamics" => inverse_dynamics(&mut workspace, &base, one, &gravity),
            "tool_kinematics" => motion(&mut workspace, &base, one).map(|()| {
                black_box(workspace.frame_motion(tool));
            }),
            "payload_rows" => {
                motion_under_gravity(&mut workspace, &base, one, &gravity).map(|()| {
                    black_box(wrench_regressor(&workspace.tool_motion(tool, &gravity)));
                })
            }
            "torque_regressor" => motion_under_gravity(&mut workspace, &base, one, &gravity)
                .and_then(|()| workspace.joint_torque_regressor(&gravity, &mut rows)),
            "batch_inverse_dynamics" => {
                dynamics.inverse_dynamics(&batch, &gravity, &mut torques, &mut wrenches)
            }
            "batch_payload_rows" => {
                dynamics.wrench_regressors(tool, &batch, &gravity, &mut regressors)
            }
            _ => panic!("no kernel {name}"),
        };
        done.unwrap();
        black_box((&workspace, &rows, &torques, &regressors));
    }
}
