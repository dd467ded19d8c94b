//! The motion of a free-floating base: what moves the payload comes from the robot's own momentum.

use tactid_dynamics::{StateError, Wrench};

use super::regressor::WrenchRegressor;
use super::source::{MeasurementSource, RobotState};
use crate::equations::channels::{Channel, wrench_channels};
use crate::equations::equation::Row;
use crate::equations::instant::Instant;

/// The wrenches on the base of the whole robot and of the payload, in the frame of the base and about its
/// origin: on a base that floats freely they sum to zero, (21)-(44).
///
/// The rows are in the frame of the base and not of the tool, so that the noise of the base's motion stays
/// in the channel that it belongs to.
#[derive(Clone, Debug)]
pub(crate) struct BaseSource;

impl MeasurementSource for BaseSource {
    fn channels(&self) -> Vec<Channel> {
        wrench_channels("base ")
    }

    fn fill(
        &mut self,
        instant: &Instant,
        robot: &RobotState<'_>,
        regressor: &WrenchRegressor,
        rows: &mut [Row],
    ) -> Result<(), StateError> {
        let world_from_base = &instant.base.pose;
        let base_from_world = world_from_base.rotation.inverse();
        let on_known = robot.workspace.base_wrench()?;
        // (28), (33): the wrench of the known bodies and that of the payload sum to zero.
        let target = Wrench {
            force: base_from_world * -on_known.force,
            moment: base_from_world * -on_known.moment,
        };
        let base_from_tool = world_from_base.inv_mul(&robot.world_from_tool());
        let in_base = regressor.expressed_in(&base_from_tool);
        in_base.fill_rows(&target, rows);
        Ok(())
    }

    fn needs_forces(&self) -> bool {
        true
    }

    fn needs_base_mass(&self) -> bool {
        true
    }
}
