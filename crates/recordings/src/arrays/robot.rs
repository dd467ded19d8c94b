//! The robot of arrays: a model, a URDF, or a sensor alone.

use tactid_dynamics::{BaseKind, Manipulator};

use super::fields::Arrays;
use crate::sources::SENSOR_FRAME;
use crate::{RecordingError, Request};

/// Returns the error of the array `name`, which describes the motion of a base, where the base of
/// the robot is fixed.
#[must_use]
pub fn base_is_fixed(name: &str) -> RecordingError {
    RecordingError::Arrays(format!(
        "`{name}` is about a base that moves, but that of the robot is fixed: read the robot with `base` (floating); for a \
         fixed base that is tilted, give `gravity` in the axes of the base"
    ))
}

impl Arrays<'_> {
    /// Returns the robot of the arrays: the given one, that of the URDF of the request with a base
    /// that floats where its motion is measured and is fixed otherwise, or the body of a sensor
    /// alone.
    ///
    /// # Errors
    /// Returns [`RecordingError::Arrays`] if both a robot and a URDF are given, or the motion of a
    /// fixed base, and [`RecordingError::Identify`] if the URDF cannot be modelled.
    pub(super) fn resolve_robot(&self, request: &Request) -> Result<Manipulator, RecordingError> {
        match (self.robot, &request.urdf) {
            (Some(_), Some(_)) => Err(RecordingError::Arrays(
                "`robot` and `urdf` are both given: give one of them".to_owned(),
            )),
            (Some(robot), None) => {
                if let Some(name) = self.base_motion()
                    && robot.base_kind() == BaseKind::Fixed
                {
                    return Err(base_is_fixed(name));
                }
                Ok(robot.clone())
            }
            (None, Some(urdf)) => {
                let base = match self.base_motion() {
                    Some(_) => BaseKind::Floating,
                    None => BaseKind::Fixed,
                };
                Ok(urdf.manipulator(base)?)
            }
            (None, None) => {
                let name = request.tip.as_deref().unwrap_or(SENSOR_FRAME);
                Ok(Manipulator::lone_body(name))
            }
        }
    }

    /// Returns whether there is a robot, and not a sensor alone.
    pub(super) fn has_robot(&self, request: &Request) -> bool {
        self.robot.is_some() || request.urdf.is_some()
    }

    /// Returns the name of an array that describes the base, if there is any.
    fn base_motion(&self) -> Option<&'static str> {
        let given = [
            ("pose", !self.pose.is_empty()),
            ("twist", !self.twist.is_empty()),
            ("acceleration", !self.acceleration.is_empty()),
        ];
        let name = given.into_iter().find(|(_, is_given)| *is_given);
        name.map(|(name, _)| name)
    }
}
