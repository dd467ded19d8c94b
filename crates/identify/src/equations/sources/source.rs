//! What every measurement source provides, and the state of the robot that it computes its rows
//! from.

use nalgebra::{DMatrix, Vector3};
use tactid_dynamics::{FrameId, StateError, Workspace};

use super::regressor::{MOTION_TERMS, MotionTerms, WrenchRegressor, motion_terms};
use crate::equations::channels::Channel;
use crate::equations::equation::Row;
use crate::equations::instant::Instant;

/// What a source measures, and how it fills its rows.
pub(crate) trait MeasurementSource {
    /// Names and units of the channels, one for each row.
    fn channels(&self) -> Vec<Channel>;

    /// Numbers of consecutive channels whose noise is of similar size. The default is that of a
    /// wrench: the axes of the force, and those of the moment.
    fn kinds(&self) -> Vec<usize> {
        vec![3, 3]
    }

    /// Number of entries of an instant beside the targets, of which [`set_rows`](Self::set_rows)
    /// makes the regressors. The default is that of a wrench in the tool frame: the terms of the
    /// tool's motion.
    fn entries(&self) -> usize {
        MOTION_TERMS
    }

    /// Computes the targets of an instant, one for each channel, and the other entries. Both enter
    /// means over windows. Allocates nothing.
    ///
    /// # Errors
    /// Returns [`StateError::NoForces`] if the source uses forces and
    /// [`needs_forces`](Self::needs_forces) is false.
    fn fill(
        &mut self,
        instant: &Instant,
        robot: &RobotState<'_>,
        targets: &mut [f64],
        entries: &mut [f64],
    ) -> Result<(), StateError>;

    /// Sets everything but the targets of the rows, one for each channel, from the means of the
    /// other entries over a window, or from half-differences of such means: the rows are linear in
    /// the entries. The default is that of a wrench in the tool frame.
    fn set_rows(&self, entries: &[f64], rows: &mut [Row]) {
        WrenchRegressor::new(&MotionTerms::from_column_slice(entries)).set_rows(rows);
    }

    /// Covariance of the noise of one sample across the channels, where it is known, at the robot's
    /// posture.
    fn known_noise(&self, _robot: &RobotState<'_>) -> Option<DMatrix<f64>> {
        None
    }

    /// Whether the targets contain a measurement beside those of the motion: otherwise the rows are
    /// exact but for the noise of the motion.
    fn has_sensor(&self) -> bool {
        true
    }

    /// Whether the rows use the forces that move the known bodies, (21)-(44).
    fn needs_forces(&self) -> bool {
        false
    }

    /// Whether the rows depend on the masses of the robot's own links.
    fn needs_masses(&self) -> bool {
        self.needs_forces()
    }

    /// Whether the rows depend on the mass of a floating base.
    fn needs_base_mass(&self) -> bool {
        false
    }

    /// Whether the rows hold for the links below the tool and the payload as one body. These links
    /// then do not count as known.
    fn includes_gripper(&self) -> bool {
        false
    }

    /// Whether each channel may have an unknown constant offset.
    fn has_offsets(&self) -> bool {
        false
    }
}

/// Motion of the known bodies of the robot at one instant.
#[derive(Debug)]
pub(crate) struct RobotState<'a> {
    /// Motion of the bodies whose parameters are known (the whole robot, or all but the links below
    /// the tool) and, where a source needs them, the forces that move them.
    pub(crate) workspace: &'a Workspace,
    /// The end-effector frame `Σ_U`.
    pub(crate) tool: FrameId,
    /// Terms of the motion of the tool frame.
    pub(crate) terms: MotionTerms,
}

impl<'a> RobotState<'a> {
    /// Returns the state that a workspace has. `gravity` is the gravitational acceleration in the
    /// inertial frame, m/s².
    pub(crate) fn new(workspace: &'a Workspace, tool: FrameId, gravity: &Vector3<f64>) -> Self {
        let in_tool = if *gravity == Vector3::zeros() {
            *gravity
        } else {
            workspace.vector_in_frame(tool, gravity)
        };
        Self {
            workspace,
            tool,
            terms: motion_terms(&workspace.tool_motion(tool, gravity), &in_tool),
        }
    }
}
