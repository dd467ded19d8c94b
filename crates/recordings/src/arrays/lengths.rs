//! Checks of the lengths of arrays.

use tactid_dynamics::{BaseKind, Manipulator};

use super::fields::Arrays;
use crate::{Method, RecordingError};

impl Arrays<'_> {
    /// Checks the arrays that describe the motion of a robot, or of a sensor alone unless there is
    /// a robot.
    ///
    /// # Errors
    /// Returns [`RecordingError::Arrays`] if there is no time, a length does not fit the times and
    /// the robot, or joint positions or the poses of a floating base or of a sensor without a robot
    /// are missing.
    pub(super) fn check_motion(
        &self,
        robot: &Manipulator,
        has_robot: bool,
    ) -> Result<(), RecordingError> {
        let (samples, joints) = (self.time.len(), robot.dof());
        if samples == 0 {
            return Err(RecordingError::Arrays(
                "`time` is empty: there is no sample".to_owned(),
            ));
        }
        if joints > 0 && self.q.is_empty() {
            return Err(missing("q", "the robot has joints"));
        }
        if !has_robot && self.pose.is_empty() {
            return Err(missing(
                "pose",
                "without a robot nothing else says how the sensor moves and where down is: give its pose at each sample, \
                 or one pose for a sensor at rest",
            ));
        }
        if robot.base_kind() == BaseKind::Floating && self.pose.is_empty() {
            return Err(missing(
                "pose",
                "the base floats: give its pose at each sample, or one pose for a base that does not move",
            ));
        }
        let matrices = [
            ("q", self.q, joints, "joints"),
            ("qd", self.qd, joints, "joints"),
            ("effort", self.effort, joints, "joints"),
            ("twist", self.twist, 6, "components"),
            ("acceleration", self.acceleration, 6, "components"),
        ];
        for (name, array, columns, what) in matrices {
            if !array.is_empty() {
                check_length(name, array.len(), &[(samples, "samples"), (columns, what)])?;
            }
        }
        if self.pose.len() > 1 {
            check_length("pose", self.pose.len(), &[(samples, "samples")])?;
        }
        Ok(())
    }

    /// Checks that something measures the load.
    ///
    /// # Errors
    /// Returns [`RecordingError::Arrays`] if there are neither wrenches nor joint efforts.
    pub(super) fn check_load(&self) -> Result<(), RecordingError> {
        if self.wrench.is_empty() && self.effort.is_empty() {
            return Err(missing(
                "wrench",
                "nothing measures the load: give wrenches, or the efforts of the joints",
            ));
        }
        Ok(())
    }

    /// Checks that there are the arrays that a method needs.
    ///
    /// # Errors
    /// Returns [`RecordingError::Arrays`] if the efforts or the motion of the base are missing.
    pub(super) fn check_method(
        &self,
        method: Method,
        robot: &Manipulator,
    ) -> Result<(), RecordingError> {
        if method == Method::Effort && self.effort.is_empty() {
            return Err(missing("effort", "the effort method needs it"));
        }
        let is_still = self.pose.len() <= 1 && self.twist.is_empty();
        // That the base is fixed is another error.
        if method == Method::JointSensing && is_still && robot.base_kind() == BaseKind::Floating {
            return Err(missing(
                "twist",
                "the joint-sensing method needs the motion of the base",
            ));
        }
        Ok(())
    }

    /// Checks the wrenches against the number of sensors.
    ///
    /// # Errors
    /// Returns [`RecordingError::Arrays`] if the length does not fit, or there are sensors without
    /// wrenches.
    pub(super) fn check_wrenches(&self, sensors: usize) -> Result<(), RecordingError> {
        if self.wrench.is_empty() && sensors > 0 {
            return Err(missing("wrench", "there are sensors"));
        }
        let factors = [
            (self.time.len(), "samples"),
            (sensors, "sensors"),
            (6, "components"),
        ];
        check_length("wrench", self.wrench.len(), &factors)
    }
}

/// Returns the error of an array that is needed and empty.
fn missing(name: &str, why: &str) -> RecordingError {
    RecordingError::Arrays(format!("`{name}` is missing: {why}"))
}

/// Checks that an array has as many entries as the product of some factors, given with their names.
pub(super) fn check_length(
    name: &str,
    given: usize,
    factors: &[(usize, &str)],
) -> Result<(), RecordingError> {
    let expected: usize = factors.iter().map(|(factor, _)| factor).product();
    if given == expected {
        return Ok(());
    }
    let factors = factors
        .iter()
        .map(|(factor, what)| format!("{factor} {what}"));
    Err(RecordingError::Arrays(format!(
        "`{name}` has {given} entries, but must have {expected} ({})",
        factors.collect::<Vec<_>>().join(" x ")
    )))
}
