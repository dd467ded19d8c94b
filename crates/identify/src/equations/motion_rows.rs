//! The rows of a motion that is known, before anything is measured.

use tactid_dynamics::{FrameMotion, JointMotion, Manipulator};

use super::channels::Channels;
use super::equation::Row;
use super::instant::Instant;
use super::model::Model;
use super::settings::EquationSettings;
use crate::IdentifyError;

/// Computes the regressor rows that an [`EquationStream`](super::EquationStream) averages, for
/// single states of a motion that is planned and not measured. The information of a planned motion
/// is computed from them.
///
/// The targets of the rows are those of a robot that measures zero efforts and wrenches.
#[derive(Clone, Debug)]
pub struct MotionRows {
    model: Model,
    instant: Instant,
    rows: Vec<Row>,
}

impl MotionRows {
    /// Creates the rows of a robot whose end-effector frame is the link `tool` and whose wrenches
    /// are measured in the links `sensors`.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`](super::EquationStream::new).
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Result<Self, IdentifyError> {
        settings.check_known()?;
        Ok(Self::of_model(Model::new(robot, tool, sensors, settings)?))
    }

    /// Creates the rows of a model.
    pub(crate) fn of_model(model: Model) -> Self {
        Self {
            instant: Instant::new(model.robot().dof(), model.sensor_count()),
            rows: vec![Row::zero(); model.row_count()],
            model,
        }
    }

    /// Returns the rows at one state, in the order of the [`channels`](Self::channels). `base` is
    /// the motion of the base frame in the inertial frame, gravity is that of the settings, and the
    /// regressors are those of the payload's parameters in the tool frame. Cost: one pass over the
    /// robot's bodies; no allocation.
    ///
    /// # Errors
    /// Returns [`IdentifyError::State`] if a slice of `joints` does not have one entry for each
    /// joint.
    pub fn at(
        &mut self,
        base: &FrameMotion,
        joints: JointMotion<'_>,
    ) -> Result<&[Row], IdentifyError> {
        let instant = &mut self.instant;
        let robot = self.model.robot();
        let parts = [
            (&mut instant.joint_position, "position", joints.position),
            (&mut instant.joint_velocity, "velocity", joints.velocity),
            (
                &mut instant.joint_acceleration,
                "acceleration",
                joints.acceleration,
            ),
        ];
        for (own, what, given) in parts {
            robot.check_length(what, given)?;
            own.copy_from_slice(given);
        }
        instant.base = *base;
        self.model.entries(instant)?;
        self.model
            .set_rows(&mut self.rows, self.model.last_entries());
        Ok(&self.rows)
    }

    /// Returns the channels of the rows, with the known noise of the sensors at the last state.
    #[must_use]
    pub fn channels(&self) -> Channels {
        self.model.channels()
    }
}
