//! Kernels of the dynamics: each computes all states, one by one unless its name says otherwise.

use nalgebra::{Isometry3, Quaternion, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};
use tactid_dynamics::{
    BaseKind, BatchDynamics, FrameId, FrameMotion, JointMotion, Manipulator, StateSeries,
    VectorUnit, Workspace, inverse_dynamics, motion, motion_under_gravity, wrench_regressor,
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
    batch: BatchDynamics,
    baseline_batch: BatchDynamics,
    base_wrenches: Vec<[f64; 6]>,
}

/// Computes all states and writes their results one after another; `None` where an error stops it.
pub type Kernel = fn(&mut Dynamics, &mut [f64]) -> Option<()>;

/// Returns the kernel of a name.
pub fn kernel(name: &str) -> Option<Kernel> {
    Some(match name {
        "inverse_dynamics" => fixed_inverse_dynamics,
        "floating_inverse_dynamics" => floating_inverse_dynamics,
        "tool_kinematics" => tool_kinematics,
        "payload_rows" => payload_rows,
        "torque_regressor" => torque_regressor,
        "series_inverse_dynamics" => series_inverse_dynamics,
        "baseline_series_inverse_dynamics" => baseline_series_inverse_dynamics,
        "series_payload_rows" => series_payload_rows,
        "baseline_series_payload_rows" => baseline_series_payload_rows,
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
        let moving = robot.bodies().len() - 1;
        Some(Self {
            tool: robot.frame(tool).ok()?,
            bases: Vec::new(),
            position: Vec::new(),
            velocity: Vec::new(),
            acceleration: Vec::new(),
            rows: vec![SVector::zeros(); moving * robot.dof()],
            base_wrenches: Vec::new(),
            batch: BatchDynamics::new(&robot),
            baseline_batch: BatchDynamics::new(&robot).with_unit(VectorUnit::Baseline),
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

    /// Adds states.
    pub fn add_states(&mut self, numbers: &[f64]) {
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
        self.base_wrenches = vec![[0.0; 6]; self.count()];
    }

    fn dof(&self) -> usize {
        self.workspace.robot().dof()
    }

    /// Computes each state in turn, with the part of `out` that belongs to it.
    fn each(
        &mut self,
        out: &mut [f64],
        mut compute: impl FnMut(&mut Workspace, &FrameMotion, JointMotion<'_>, &mut [f64]) -> Option<()>,
    ) -> Option<()> {
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
            compute(&mut self.workspace, base, joints, out)?;
        }
        Some(())
    }
}

fn fixed_inverse_dynamics(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    dynamics.each(out, |workspace, base, joints, out| {
        inverse_dynamics(workspace, base, joints, &GRAVITY).ok()?;
        out.copy_from_slice(workspace.joint_torques().ok()?);
        Some(())
    })
}

/// The wrench on the base, in world axes, then the torques.
fn floating_inverse_dynamics(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    dynamics.each(out, |workspace, base, joints, out| {
        inverse_dynamics(workspace, base, joints, &GRAVITY).ok()?;
        let (on_base, on_joints) = out.split_at_mut(6);
        let wrench = workspace.base_wrench().ok()?;
        on_base[..3].copy_from_slice(wrench.force.as_slice());
        on_base[3..].copy_from_slice(wrench.moment.as_slice());
        on_joints.copy_from_slice(workspace.joint_torques().ok()?);
        Some(())
    })
}

/// Position and quaternion (x, y, z, w), velocity, angular velocity, acceleration, angular
/// acceleration in world axes.
fn tool_kinematics(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    let tool = dynamics.tool;
    dynamics.each(out, |workspace, base, joints, out| {
        motion(workspace, base, joints).ok()?;
        let seen = workspace.frame_motion(tool);
        out[..3].copy_from_slice(seen.pose.translation.vector.as_slice());
        out[3..7].copy_from_slice(seen.pose.rotation.coords.as_slice());
        out[7..10].copy_from_slice(seen.velocity.as_slice());
        out[10..13].copy_from_slice(seen.angular_velocity.as_slice());
        out[13..16].copy_from_slice(seen.acceleration.as_slice());
        out[16..19].copy_from_slice(seen.angular_acceleration.as_slice());
        Some(())
    })
}

/// The 6x10 regressor of a payload at the tool, column by column.
fn payload_rows(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    let tool = dynamics.tool;
    dynamics.each(out, |workspace, base, joints, out| {
        motion_under_gravity(workspace, base, joints, &GRAVITY).ok()?;
        let seen = workspace.tool_motion(tool, &GRAVITY);
        out.copy_from_slice(wrench_regressor(&seen).as_slice());
        Some(())
    })
}

/// The regressor of all joint torques for the parameters of all moving links: for each joint a row
/// for each link.
fn torque_regressor(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    let mut rows = std::mem::take(&mut dynamics.rows);
    let done = dynamics.each(out, |workspace, base, joints, out| {
        motion_under_gravity(workspace, base, joints, &GRAVITY).ok()?;
        workspace.joint_torque_regressor(&GRAVITY, &mut rows).ok()?;
        for (row, out) in rows.iter().zip(out.chunks_exact_mut(10)) {
            out.copy_from_slice(row.as_slice());
        }
        Some(())
    });
    dynamics.rows = rows;
    done
}

/// The states of all joints on one base.
fn series(dynamics: &Dynamics) -> StateSeries<'_> {
    StateSeries {
        base: &dynamics.bases[..1],
        joints: JointMotion {
            position: &dynamics.position,
            velocity: &dynamics.velocity,
            acceleration: &dynamics.acceleration,
        },
    }
}

fn series_inverse_dynamics(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    inverse_dynamics_by(dynamics, |dynamics| &dynamics.batch, out)
}

fn baseline_series_inverse_dynamics(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    inverse_dynamics_by(dynamics, |dynamics| &dynamics.baseline_batch, out)
}

fn inverse_dynamics_by(
    dynamics: &mut Dynamics,
    batch: fn(&Dynamics) -> &BatchDynamics,
    out: &mut [f64],
) -> Option<()> {
    let mut wrenches = std::mem::take(&mut dynamics.base_wrenches);
    let series = series(dynamics);
    let done = batch(dynamics).inverse_dynamics(&series, &GRAVITY, out, &mut wrenches);
    dynamics.base_wrenches = wrenches;
    done.ok()
}

fn series_payload_rows(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    payload_rows_by(dynamics, &dynamics.batch, out)
}

fn baseline_series_payload_rows(dynamics: &mut Dynamics, out: &mut [f64]) -> Option<()> {
    payload_rows_by(dynamics, &dynamics.baseline_batch, out)
}

fn payload_rows_by(dynamics: &Dynamics, batch: &BatchDynamics, out: &mut [f64]) -> Option<()> {
    let regressors = out.as_mut_ptr().cast::<SMatrix<f64, 6, 10>>();
    // SAFETY: a matrix of fixed size is its entries, column by column, and nothing else.
    let regressors = unsafe { std::slice::from_raw_parts_mut(regressors, out.len() / 60) };
    batch
        .wrench_regressors(dynamics.tool, &series(dynamics), &GRAVITY, regressors)
        .ok()
}
