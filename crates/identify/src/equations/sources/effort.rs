//! The joint efforts beyond those of the arm, `Jᵀ [f_U; n_U]`: the payload alone.
//!
//! These rows, `Jᵀ Y π`, are not in the paper. They follow from the principle of virtual work.

use nalgebra::{DMatrix, DVector, Vector6};
use tactid_dynamics::{FrameId, JointKind, Manipulator, StateError};

use super::regressor::WrenchRegressor;
use super::source::{MeasurementSource, RobotState};
use crate::equations::channels::Channel;
use crate::equations::equation::Row;
use crate::equations::instant::Instant;
use crate::equations::settings::{EffortContent, EquationSettings, expand};

/// Number of entries of a joint beside its target: the regressor of the parameters, that of
/// gravity, and the gain error.
const JOINT_ENTRIES: usize = 15;

/// The efforts of the joints that move the tool.
#[derive(Clone, Debug)]
pub(crate) struct EffortSource {
    /// Indices of the joints that move the tool, and so bear the payload.
    loaded_joints: Vec<usize>,
    channels: Vec<Channel>,
    /// Standard deviation of one sample of the effort of each joint of the robot, N m or N. Empty
    /// where they are unknown.
    noise: Vec<f64>,
    /// Standard deviation of the relative error of the gain of each joint of the robot; empty where
    /// the gains are exact.
    gain_std_devs: Vec<f64>,
    /// Whether the measured efforts contain those of the arm itself, as far as the workspace has
    /// them.
    contains_arm: bool,
    /// Columns of the tool's Jacobian, one for each joint of the robot.
    jacobian: Vec<Vector6<f64>>,
}

impl EffortSource {
    /// Creates the source for the joints that move the tool.
    pub(crate) fn new(robot: &Manipulator, tool: FrameId, settings: &EquationSettings) -> Self {
        let loaded_joints: Vec<usize> =
            (0..robot.dof()).filter(|&j| robot.moves(j, tool)).collect();
        let channel = |&joint: &usize| Channel {
            name: format!("effort {}", robot.joint_names()[joint]),
            unit: match robot.joint_kind(joint) {
                Some(JointKind::Prismatic) => "N",
                Some(JointKind::Revolute) | None => "N m",
            },
        };
        Self {
            channels: loaded_joints.iter().map(channel).collect(),
            loaded_joints,
            noise: expand(&settings.effort_noise, robot.dof()),
            gain_std_devs: expand(&settings.effort_gain_std_dev, robot.dof()),
            contains_arm: settings.effort_content != EffortContent::External,
            jacobian: vec![Vector6::zeros(); robot.dof()],
        }
    }
}

impl MeasurementSource for EffortSource {
    fn channels(&self) -> Vec<Channel> {
        self.channels.clone()
    }

    fn kinds(&self) -> Vec<usize> {
        vec![self.channels.len()]
    }

    fn entries(&self) -> usize {
        JOINT_ENTRIES * self.channels.len()
    }

    fn fill(
        &mut self,
        instant: &Instant,
        robot: &RobotState<'_>,
        targets: &mut [f64],
        entries: &mut [f64],
    ) -> Result<(), StateError> {
        let workspace = robot.workspace;
        workspace.jacobian(robot.tool, &mut self.jacobian)?;
        // Jᵀ Y π = τ - τ_arm, not in the paper: principle of virtual work, with τ_i = z_i · n_i of
        // (34) for the arm alone.
        let regressor = WrenchRegressor::new(&robot.terms);
        let places = targets
            .iter_mut()
            .zip(entries.chunks_exact_mut(JOINT_ENTRIES));
        for ((target, entries), &joint) in places.zip(&self.loaded_joints) {
            let column = &self.jacobian[joint];
            let (parameters, others) = entries.split_at_mut(10);
            parameters.copy_from_slice(regressor.parameters.tr_mul(column).as_slice());
            others[..4].copy_from_slice(regressor.gravity.tr_mul(column).as_slice());
            *target = instant.joint_effort[joint];
            let of_gain = self.gain_std_devs.get(joint).copied();
            others[4] = of_gain.unwrap_or(0.0) * *target;
            if self.contains_arm {
                *target -= workspace.joint_torques()?[joint];
            }
        }
        Ok(())
    }

    fn set_rows(&self, entries: &[f64], rows: &mut [Row]) {
        for (row, entries) in rows.iter_mut().zip(entries.chunks_exact(JOINT_ENTRIES)) {
            row.regressor.copy_from_slice(&entries[..10]);
            row.gravity.copy_from_slice(&entries[10..14]);
            row.gain_error = entries[14];
        }
    }

    fn known_noise(&self, _robot: &RobotState<'_>) -> Option<DMatrix<f64>> {
        if self.noise.is_empty() {
            return None;
        }
        let loaded = self.loaded_joints.iter();
        let variances = loaded.map(|&joint| self.noise[joint].powi(2));
        let variances = DVector::from_iterator(self.loaded_joints.len(), variances);
        Some(DMatrix::from_diagonal(&variances))
    }

    fn needs_forces(&self) -> bool {
        self.contains_arm
    }
}
