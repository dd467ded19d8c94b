//! Checks of the lengths of arrays.

use tactid_dynamics::{BaseKind, Manipulator};
use tactid_identify::IdentifyError;

use super::fields::Arrays;
use crate::{Method, RecordingError};

impl Arrays<'_> {
    /// Checks the arrays that describe the motion of a robot, or of a sensor alone unless there is a robot.
    ///
    /// # Errors
    /// Returns [`RecordingError::NoSamples`] if there is no time, [`RecordingError::ArrayLength`] if a length does not
    /// fit the times and the robot, and [`RecordingError::MissingArray`] if joint positions are missing, or the
    /// poses of a floating base or of a sensor without a robot.
    pub(super) fn check_motion(
        &self,
        robot: &Manipulator,
        has_robot: bool,
    ) -> Result<(), RecordingError> {
        let (samples, joints) = (self.time.len(), robot.dof());
        if samples == 0 {
            return Err(RecordingError::NoSamples);
        }
        if joints > 0 && self.q.is_empty() {
            return Err(RecordingError::MissingArray {
                name: "q",
                reason: "the robot has joints",
            });
        }
        if !has_robot && self.pose.is_empty() {
            return Err(RecordingError::MissingArray {
                name: "pose",
                reason: "without a robot nothing else says how the sensor moves and where down is: give its pose at \
                         each sample, or one pose for a sensor at rest",
            });
        }
        if robot.base_kind() == BaseKind::Floating && self.pose.is_empty() {
            return Err(RecordingError::MissingArray {
                name: "pose",
                reason: "the base floats: give its pose at each sample, or one pose for a base that does not move",
            });
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
    /// Returns [`RecordingError::MissingArray`] if there are neither wrenches nor joint efforts.
    pub(super) fn check_load(&self) -> Result<(), RecordingError> {
        if self.wrench.is_empty() && self.effort.is_empty() {
            return Err(RecordingError::MissingArray {
                name: "wrench",
                reason: "nothing measures the load: give wrenches, or the efforts of the joints",
            });
        }
        Ok(())
    }

    /// Checks that there are the arrays that a method needs.
    ///
    /// # Errors
    /// Returns [`RecordingError::MissingArray`] if the efforts or the motion of the base are missing, and
    /// [`IdentifyError::FixedBase`] if the method needs a base that moves.
    pub(super) fn check_method(
        &self,
        method: Method,
        robot: &Manipulator,
    ) -> Result<(), RecordingError> {
        if method == Method::JointSensing && robot.base_kind() == BaseKind::Fixed {
            return Err(IdentifyError::FixedBase.into());
        }
        if method == Method::Effort && self.effort.is_empty() {
            return Err(RecordingError::MissingArray {
                name: "effort",
                reason: "the effort method needs it",
            });
        }
        if method == Method::JointSensing && self.pose.len() <= 1 && self.twist.is_empty() {
            return Err(RecordingError::MissingArray {
                name: "twist",
                reason: "the joint-sensing method needs the motion of the base",
            });
        }
        Ok(())
    }

    /// Checks the wrenches against the number of sensors.
    ///
    /// # Errors
    /// Returns [`RecordingError::ArrayLength`] if the length does not fit, and [`RecordingError::MissingArray`] if there
    /// are sensors without wrenches.
    pub(super) fn check_wrenches(&self, sensors: usize) -> Result<(), RecordingError> {
        if self.wrench.is_empty() && sensors > 0 {
            return Err(RecordingError::MissingArray {
                name: "wrench",
                reason: "there are sensors",
            });
        }
        let factors = [
            (self.time.len(), "samples"),
            (sensors, "sensors"),
            (6, "components"),
        ];
        check_length("wrench", self.wrench.len(), &factors)
    }
}

/// Checks that an array has as many entries as the product of some factors, given with their names.
pub(super) fn check_length(
    name: &'static str,
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
    Err(RecordingError::ArrayLength {
        name,
        given,
        expected: format!("{expected} ({})", factors.collect::<Vec<_>>().join(" x ")),
    })
}
