//! The motion of a free-floating base: what moves the payload comes from the robot's own momentum.

use nalgebra::SMatrix;
use tactid_dynamics::{StateError, Wrench};

use super::regressor::{WrenchRegressor, set_wrench};
use super::source::{MeasurementSource, RobotState};
use crate::equations::channels::{Channel, wrench_channels};
use crate::equations::equation::Row;
use crate::equations::instant::Instant;

/// Number of entries of the 6x10 regressor of the parameters; those of gravity, 6x4, follow.
const PARAMETER_ENTRIES: usize = 60;

/// The wrenches on the base of the whole robot and of the payload, in the frame of the base and
/// about its origin: on a base that floats freely they sum to zero, (21)-(44).
///
/// The rows are in the frame of the base and not of the tool, so that the noise of the base's
/// motion stays in the channel that it belongs to.
#[derive(Clone, Debug)]
pub(crate) struct BaseSource;

impl MeasurementSource for BaseSource {
    fn channels(&self) -> Vec<Channel> {
        wrench_channels("base ")
    }

    fn entries(&self) -> usize {
        PARAMETER_ENTRIES + 6 * 4
    }

    fn fill(
        &mut self,
        instant: &Instant,
        robot: &RobotState<'_>,
        targets: &mut [f64],
        entries: &mut [f64],
    ) -> Result<(), StateError> {
        let base_from_world = instant.base.pose.rotation.inverse();
        let on_known = robot.workspace.base_wrench()?;
        // (28), (33): the wrench of the known bodies and that of the payload sum to zero.
        let target = Wrench {
            force: base_from_world * -on_known.force,
            moment: base_from_world * -on_known.moment,
        };
        let base = robot.workspace.robot().base_frame();
        let base_from_tool = robot.workspace.relative_pose(base, robot.tool);
        let in_base = WrenchRegressor::new(&robot.terms).expressed_in(&base_from_tool);
        set_wrench(targets, &target);
        let (parameters, gravity) = entries.split_at_mut(PARAMETER_ENTRIES);
        parameters.copy_from_slice(in_base.parameters.as_slice());
        gravity.copy_from_slice(in_base.gravity.as_slice());
        Ok(())
    }

    fn set_rows(&self, entries: &[f64], rows: &mut [Row]) {
        let (parameters, gravity) = entries.split_at(PARAMETER_ENTRIES);
        let in_base = WrenchRegressor {
            parameters: SMatrix::from_column_slice(parameters),
            gravity: SMatrix::from_column_slice(gravity),
        };
        in_base.set_rows(rows);
    }

    fn has_sensor(&self) -> bool {
        false
    }

    fn needs_forces(&self) -> bool {
        true
    }

    fn needs_base_mass(&self) -> bool {
        true
    }
}
