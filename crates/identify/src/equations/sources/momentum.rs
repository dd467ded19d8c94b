//! The motion of all bodies but the end-effector, (30) and (44): gripper and payload as one body.

use tactid_dynamics::{StateError, wrench_on_end_effector};

use super::regressor::set_wrench;
use super::source::{MeasurementSource, RobotState};
use crate::equations::channels::{Channel, wrench_channels};
use crate::equations::instant::Instant;

/// The wrench on the end-effector that the momentum of all other bodies requires, on a base that
/// floats freely.
#[derive(Clone, Debug)]
pub(crate) struct MomentumSource;

impl MeasurementSource for MomentumSource {
    fn channels(&self) -> Vec<Channel> {
        wrench_channels("")
    }

    fn fill(
        &mut self,
        _instant: &Instant,
        robot: &RobotState<'_>,
        targets: &mut [f64],
        entries: &mut [f64],
    ) -> Result<(), StateError> {
        // f_U = -f_K of (29)-(30), n_U of (44)
        let wrench = wrench_on_end_effector(robot.workspace, robot.tool);
        set_wrench(targets, &wrench);
        entries.copy_from_slice(robot.terms.as_slice());
        Ok(())
    }

    fn has_sensor(&self) -> bool {
        false
    }

    fn needs_masses(&self) -> bool {
        true
    }

    fn includes_gripper(&self) -> bool {
        true
    }

    fn needs_base_mass(&self) -> bool {
        true
    }
}
