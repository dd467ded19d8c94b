//! Kernels of the dynamics: each computes all states, one by one unless its name says otherwise.

use nalgebra::{Isometry3, Quaternion, SVector, Translation3, UnitQuaternion, Vector3};
use tactid_dynamics::{
    BaseKind, FrameId, FrameMotion, JointMotion, Manipulator, Workspace, forces, motion,
    wrench_regressor,
};

/// Gravitational acceleration of all comparisons, m/s².
const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// Numbers of a base's pose, twist and acceleration.
const BASE_NUMBERS: usize = 19;

/// A robot and the states to compute.
pub struct Dynamics {
    workspace: Workspace,
    tool: FrameId,
    bases: Vec<FrameMotion>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    rows: Vec<SVector<f64, 10>>,
    links: Vec<FrameId>,
}

/// Computes all states and writes their results one after another.
pub type Kernel = fn(&mut Dynamics, &mut [f64]);

/// Returns the kernel of a name.
pub fn kernel(name: &str) -> Option<Kernel> {
    Some(match name {
        "inverse_dynamics" => inverse_dynamics,
        "floating_inverse_dynamics" => floating_inverse_dynamics,
        "tool_kinematics" => tool_kinematics,
        "payload_rows" => payload_rows,
        "torque_regressor" => torque_regressor,
        _ => return None,
    })
}

impl Dynamics {
    /// Creates the robot without states.
    pub fn new(urdf: &str, is_floating: bool, tool: &str) -> Option<Self> {
        let kind = if is_floating {
            BaseKind::Floating
        } else {
            BaseKind::Fixed
        };
        let robot = Manipulator::from_urdf(urdf, kind).ok()?;
        let moving = 1..robot.bodies().len();
        let first_link = |body: usize| robot.links().find(|link| link.body == body);
        let names = moving.filter_map(|body| Some(first_link(body)?.name.to_owned()));
        let names: Vec<String> = names.collect();
        let links = names.iter().filter_map(|name| robot.frame(name).ok());
        Some(Self {
            tool: robot.frame(tool).ok()?,
            bases: Vec::new(),
            position: Vec::new(),
            velocity: Vec::new(),
            acceleration: Vec::new(),
            rows: vec![SVector::zeros(); robot.dof()],
            links: links.collect(),
            workspace: Workspace::new(&robot),
        })
    }

    /// Numbers of one state.
    pub fn numbers_per_state(&self) -> usize {
        BASE_NUMBERS + 3 * self.dof()
    }

    /// Number of states.
    pub fn count(&self) -> usize {
        self.bases.len()
    }

    /// Replaces the states.
    pub fn set_states(&mut self, numbers: &[f64]) {
        let dof = self.dof();
        for state in numbers.chunks_exact(self.numbers_per_state()) {
            let (base, joints) = state.split_at(BASE_NUMBERS);
            let vector = |at: usize| Vector3::from_column_slice(&base[at..at + 3]);
            let rotation = Quaternion::new(base[6], base[3], base[4], base[5]);
            self.bases.push(FrameMotion {
                pose: Isometry3::from_parts(
                    Translation3::from(vector(0)),
                    UnitQuaternion::from_quaternion(rotation),
                ),
                velocity: vector(7),
                angular_velocity: vector(10),
                acceleration: vector(13),
                angular_acceleration: vector(16),
            });
            self.position.extend_from_slice(&joints[..dof]);
            self.velocity.extend_from_slice(&joints[dof..2 * dof]);
            self.acceleration.extend_from_slice(&joints[2 * dof..]);
        }
    }

    fn dof(&self) -> usize {
        self.rows.len()
    }

    /// Moves the robot to each state in turn and calls `look` with the part of `out` that belongs to it.
    fn each(
        &mut self,
        out: &mut [f64],
        mut look: impl FnMut(&mut Workspace, &mut [SVector<f64, 10>], &mut [f64]),
    ) {
        let dof = self.dof();
        let each = out.len() / self.count();
        for (k, (base, out)) in self
            .bases
            .iter()
            .zip(out.chunks_exact_mut(each))
            .enumerate()
        {
            let joints = k * dof..(k + 1) * dof;
            let joints = JointMotion {
                position: &self.position[joints.clone()],
                velocity: &self.velocity[joints.clone()],
                acceleration: &self.acceleration[joints],
            };
            // The lengths are right, so it cannot fail.
            let _ = motion(&mut self.workspace, base, joints);
            look(&mut self.workspace, &mut self.rows, out);
        }
    }
}

fn inverse_dynamics(dynamics: &mut Dynamics, out: &mut [f64]) {
    dynamics.each(out, |workspace, _, out| {
        forces(workspace, &GRAVITY);
        out.copy_from_slice(workspace.joint_torques().unwrap_or(&[]));
    });
}

/// The wrench on the base, in world axes, then the torques.
fn floating_inverse_dynamics(dynamics: &mut Dynamics, out: &mut [f64]) {
    dynamics.each(out, |workspace, _, out| {
        forces(workspace, &GRAVITY);
        let (base, joints) = out.split_at_mut(6);
        if let (Ok(wrench), Ok(torques)) = (workspace.base_wrench(), workspace.joint_torques()) {
            base[..3].copy_from_slice(wrench.force.as_slice());
            base[3..].copy_from_slice(wrench.moment.as_slice());
            joints.copy_from_slice(torques);
        }
    });
}

/// Position and quaternion (x, y, z, w), velocity, angular velocity, acceleration, angular acceleration in world axes.
fn tool_kinematics(dynamics: &mut Dynamics, out: &mut [f64]) {
    let tool = dynamics.tool;
    dynamics.each(out, |workspace, _, out| {
        let seen = workspace.frame_motion(tool);
        out[..3].copy_from_slice(seen.pose.translation.vector.as_slice());
        out[3..7].copy_from_slice(seen.pose.rotation.coords.as_slice());
        out[7..10].copy_from_slice(seen.velocity.as_slice());
        out[10..13].copy_from_slice(seen.angular_velocity.as_slice());
        out[13..16].copy_from_slice(seen.acceleration.as_slice());
        out[16..19].copy_from_slice(seen.angular_acceleration.as_slice());
    });
}

/// The 6x10 regressor of a payload at the tool, column by column.
fn payload_rows(dynamics: &mut Dynamics, out: &mut [f64]) {
    let tool = dynamics.tool;
    dynamics.each(out, |workspace, _, out| {
        let seen = workspace.frame_motion(tool).in_frame(&GRAVITY);
        out.copy_from_slice(wrench_regressor(&seen).as_slice());
    });
}

/// The regressor of all joint torques for the parameters of all moving links: a row of each joint for each link.
fn torque_regressor(dynamics: &mut Dynamics, out: &mut [f64]) {
    let links = dynamics.links.clone();
    dynamics.each(out, |workspace, rows, out| {
        let of_link = out.len() / links.len();
        for (&link, out) in links.iter().zip(out.chunks_exact_mut(of_link)) {
            let _ = workspace.torque_regressor(link, &GRAVITY, rows);
            for (row, out) in rows.iter().zip(out.chunks_exact_mut(10)) {
                out.copy_from_slice(row.as_slice());
            }
        }
    });
}
