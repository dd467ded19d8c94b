//! A calibrated arm: what the file of a calibration contains.

use tactid_calibrate::{Calibration, CalibrationReport, CalibrationSettings};

/// The calibrated model of an arm's joint efforts, with what was found out about it: what `tactid
/// calibrate` writes.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmCalibration {
    /// The model, with which payloads are identified.
    pub model: Calibration,
    /// How well it explains the recordings that it was calibrated with.
    pub report: CalibrationReport,
    /// Effort of each joint of the model for one unit of its recorded value before the calibration,
    /// N m or N. The gain of the model multiplies it.
    pub effort_gain: Vec<f64>,
}

impl ArmCalibration {
    /// Returns the settings with which recordings for an identification are recorded.
    pub(crate) fn settings(&self) -> CalibrationSettings {
        CalibrationSettings {
            gravity: Some(self.model.gravity),
            cutoff_hz: self.model.cutoff_hz,
            ..CalibrationSettings::default()
        }
    }

    /// Returns the effort of a joint for one unit of its recorded value, N m or N; `None` where the
    /// model does not have it.
    pub(crate) fn effort_gain_of(&self, joint: &str) -> Option<f64> {
        let index = self.model.joints.iter().position(|name| name == joint)?;
        self.effort_gain.get(index).copied()
    }
}
