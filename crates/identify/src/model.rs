//! From an instant to its row equations: which load, and whose motion.

use nalgebra::{SMatrix, Vector3, Vector6};
use tactid_dynamics::{
    FrameId, InertialParameters, JointMotion, Manipulator, StateError, ToolMotion, Workspace,
    Wrench, forces, motion, wrench_on_end_effector, wrench_regressor,
};

use crate::equation::Row;
use crate::sample::Instant;
use crate::{IdentifyError, Settings, Way};

/// The robot, and the way in which its measurements become rows.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    way: Way,
    gravity: Vector3<f64>,
    effort_is_net: bool,
    robot: Manipulator,
    /// The robot as the equations know it: without its end-effector for the joint-sensing way.
    known: Manipulator,
    tool: FrameId,
    sensors: Vec<FrameId>,
    /// The joints that feel the payload, for the effort way.
    loaded: Vec<usize>,
    workspace: Workspace,
    jacobian: Vec<Vector6<f64>>,
    rows: Vec<Row>,
}

impl Model {
    pub(crate) fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &Settings,
    ) -> Result<Self, IdentifyError> {
        let tool = robot.frame(tool)?;
        let sensors: Result<Vec<_>, _> = sensors.iter().map(|name| robot.frame(name)).collect();
        let loaded: Vec<usize> = (0..robot.dof()).filter(|&j| robot.moves(j, tool)).collect();
        let rows = match settings.way {
            Way::Effort => loaded.len(),
            Way::Tactile | Way::JointSensing => 6,
        };
        Ok(Self {
            way: settings.way,
            gravity: settings.gravity_for(robot.base_kind()),
            effort_is_net: settings.effort_is_net,
            known: match settings.way {
                Way::Tactile | Way::Effort => robot.clone(),
                Way::JointSensing => robot.without_subtree(tool),
            },
            robot: robot.clone(),
            tool,
            sensors: sensors?,
            loaded,
            workspace: Workspace::new(robot),
            jacobian: vec![Vector6::zeros(); robot.dof()],
            rows: vec![Row::zero(); rows],
        })
    }

    pub(crate) fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    pub(crate) fn robot(&self) -> &Manipulator {
        &self.robot
    }

    /// How many rows an instant gives.
    pub(crate) fn row_count(&self) -> usize {
        self.rows.len()
    }

    /// How many neighbouring rows are measured alike: those of a force, of a moment, or all efforts.
    pub(crate) fn alike(&self) -> usize {
        match self.way {
            Way::Effort => self.rows.len().max(1),
            Way::Tactile | Way::JointSensing => 3,
        }
    }

    pub(crate) fn needs_effort(&self) -> bool {
        self.way == Way::Effort
    }

    pub(crate) fn sensor_count(&self) -> usize {
        self.sensors.len()
    }

    /// What each row is measured in: name and unit.
    pub(crate) fn channels(&self) -> Vec<(String, &'static str)> {
        match self.way {
            Way::Effort => {
                let names = self.loaded.iter().map(|&j| &self.robot.joint_names()[j]);
                names
                    .map(|name| (format!("effort {name}"), "N m"))
                    .collect()
            }
            Way::Tactile | Way::JointSensing => [("force", "N"), ("moment", "N m")]
                .into_iter()
                .flat_map(|(name, unit)| {
                    ["x", "y", "z"].map(|axis| (format!("{name} {axis}"), unit))
                })
                .collect(),
        }
    }

    /// The rows of an instant.
    pub(crate) fn rows(&mut self, instant: &Instant) -> Result<&[Row], StateError> {
        let joints = JointMotion {
            position: &instant.joint_position,
            velocity: &instant.joint_velocity,
            acceleration: &instant.joint_acceleration,
        };
        motion(&self.known, &mut self.workspace, &instant.base, joints)?;
        let frame = self.workspace.frame_motion(&self.known, self.tool);
        let regressor = wrench_regressor(&frame.in_frame(&self.gravity));
        let gravity =
            gravity_regressor(&frame.pose.rotation.inverse_transform_vector(&self.gravity));
        if self.way == Way::Effort {
            self.effort_rows(instant, &regressor, &gravity);
        } else {
            let wrench = self.wrench_on_end_effector(instant);
            let wanted = wrench.force.iter().chain(wrench.moment.iter());
            for (k, (row, &wanted)) in self.rows.iter_mut().zip(wanted).enumerate() {
                row.regressor = regressor.row(k).transpose();
                row.wanted = wanted;
                row.gravity = gravity.row(k).transpose();
            }
        }
        Ok(&self.rows)
    }

    /// `Jᵀ Y π = τ - τ_arm`.
    fn effort_rows(
        &mut self,
        instant: &Instant,
        regressor: &SMatrix<f64, 6, 10>,
        gravity: &SMatrix<f64, 6, 4>,
    ) {
        let workspace = &mut self.workspace;
        workspace.jacobian(&self.known, self.tool, &mut self.jacobian);
        if !self.effort_is_net {
            forces(&self.known, workspace, &self.gravity);
        }
        for (row, &joint) in self.rows.iter_mut().zip(&self.loaded) {
            let column = &self.jacobian[joint];
            row.regressor = regressor.tr_mul(column);
            row.gravity = gravity.tr_mul(column);
            row.wanted = instant.joint_effort[joint];
            if !self.effort_is_net {
                row.wanted -= workspace.joint_torques()[joint];
            }
        }
    }

    /// On the body that is sought, in `Σ_U` and about its origin.
    fn wrench_on_end_effector(&self, instant: &Instant) -> Wrench {
        if self.way == Way::JointSensing {
            return wrench_on_end_effector(&self.known, &self.workspace, self.tool);
        }
        // (47): f_U and n_U are the sums over all fingers.
        let tool_from_world = self.workspace.pose(&self.known, self.tool).inverse();
        let wrenches = self.sensors.iter().zip(&instant.wrenches);
        wrenches.fold(Wrench::zero(), |sum, (&sensor, wrench)| {
            let world_from_sensor = self.workspace.pose(&self.known, sensor);
            sum + wrench.expressed_in(&(tool_from_world * world_from_sensor))
        })
    }

    /// The links below the tool, at the posture of the last instant.
    pub(crate) fn gripper(&self) -> InertialParameters {
        self.robot.subtree_parameters(&self.workspace, self.tool)
    }
}

/// The entries of mass and first moments for an acceleration alone, 6x4.
fn gravity_regressor(acceleration: &Vector3<f64>) -> SMatrix<f64, 6, 4> {
    let motion = ToolMotion {
        acceleration: *acceleration,
        angular_velocity: Vector3::zeros(),
        angular_acceleration: Vector3::zeros(),
    };
    wrench_regressor(&motion).fixed_columns::<4>(0).into_owned()
}
