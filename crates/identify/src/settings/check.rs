//! That settings make sense for a robot.

use tactid_dynamics::{BaseKind, Manipulator};

use super::{EstimatorKind, Settings, Way};
use crate::IdentifyError;

impl Settings {
    /// # Errors
    /// A value out of range, or a way that this robot or estimator does not allow.
    pub(crate) fn check(&self, robot: &Manipulator, sensors: &[&str]) -> Result<(), IdentifyError> {
        self.check_way(robot, sensors)?;
        self.check_values(robot)?;
        self.check_noise(robot, sensors)
    }

    fn check_way(&self, robot: &Manipulator, sensors: &[&str]) -> Result<(), IdentifyError> {
        let is_paper = matches!(self.estimator, EstimatorKind::Nlms { .. });
        if is_paper {
            let beyond = [
                (self.wrench_offset, "an unknown offset of the wrenches"),
                (self.gives_noise(), "the noise of the sensors"),
            ];
            if let Some((_, what)) = beyond.into_iter().find(|(given, _)| *given) {
                return Err(IdentifyError::KnowledgeNeedsLeastSquares(what));
            }
        }
        match self.way {
            Way::Tactile if sensors.is_empty() => Err(IdentifyError::NoWrench),
            Way::Effort | Way::Combined { .. } if is_paper => {
                Err(IdentifyError::NeedsLeastSquares(self.way.name()))
            }
            Way::Combined { effort: false }
                if sensors.is_empty() && robot.base_kind() == BaseKind::Fixed =>
            {
                Err(IdentifyError::NoWrench)
            }
            Way::JointSensing if robot.base_kind() == BaseKind::Fixed => {
                Err(IdentifyError::FixedBase)
            }
            _ => Ok(()),
        }
    }

    fn check_values(&self, robot: &Manipulator) -> Result<(), IdentifyError> {
        if !(self.average_s >= 0.0 && self.average_s.is_finite()) {
            return refuse("average_s", self.average_s, "zero or more");
        }
        if !(self.cutoff_hz > 0.0 && self.cutoff_hz.is_finite()) {
            return refuse("cutoff_hz", self.cutoff_hz, "more than zero");
        }
        if self.epochs == 0 {
            return refuse("epochs", 0.0, "one or more");
        }
        if self.max_gap_s.is_nan() || self.max_gap_s <= 0.0 {
            return refuse("max_gap_s", self.max_gap_s, "more than zero");
        }
        let gravity = self.gravity_for(robot.base_kind());
        match gravity.iter().find(|entry| !entry.is_finite()) {
            Some(&entry) => refuse("gravity", entry, "finite"),
            None => Ok(()),
        }
    }

    fn check_noise(&self, robot: &Manipulator, sensors: &[&str]) -> Result<(), IdentifyError> {
        let wrench: Vec<f64> = self.wrench_noise.iter().flatten().copied().collect();
        let given = [
            (
                "wrench_noise",
                self.wrench_noise.len(),
                "sensors",
                sensors.len(),
                &wrench,
            ),
            (
                "effort_noise",
                self.effort_noise.len(),
                "joints",
                robot.dof(),
                &self.effort_noise,
            ),
        ];
        for (name, given, of, expected, values) in given {
            if ![0, 1, expected].contains(&given) {
                return Err(IdentifyError::NoiseCount {
                    name,
                    given,
                    of,
                    expected,
                });
            }
            if let Some(&value) = values
                .iter()
                .find(|value| !(**value > 0.0 && value.is_finite()))
            {
                return refuse(name, value, "a positive standard deviation");
            }
        }
        Ok(())
    }
}

fn refuse(name: &'static str, given: f64, wanted: &'static str) -> Result<(), IdentifyError> {
    Err(IdentifyError::Value {
        name,
        given,
        wanted,
    })
}
