//! A calibrated arm: what the file of a calibration contains.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tactid_identify::calibration::{Calibration, CalibrationReport, CalibrationSettings};

use super::file;
use crate::RecordingError;

/// The calibrated model of an arm's joint efforts, with what was found out about it: what `tactid calibrate` writes.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmCalibration {
    /// The model, with which payloads are identified.
    pub model: Calibration,
    /// How well it explains the recordings that it was calibrated with.
    pub report: CalibrationReport,
    /// Effort of each joint of the model for one unit of its recorded value before the calibration, N m or N. The gain of
    /// the model multiplies it.
    pub effort_gain: Vec<f64>,
}

impl ArmCalibration {
    /// Reads the file of a calibration.
    ///
    /// # Errors
    /// Returns [`RecordingError::CalibrationIo`] if the file cannot be read, and [`RecordingError::CalibrationFile`] with
    /// the line, where it is known, if it is not what [`Self::write`] writes.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let failed = |source| io_error("read", path, source);
        let text = fs::read_to_string(path).map_err(failed)?;
        file::parse(&text).map_err(|fault| RecordingError::CalibrationFile {
            path: path.to_owned(),
            line: fault.line,
            reason: fault.reason,
        })
    }

    /// Writes the calibration as a TOML file, from which [`Self::read`] gets the same numbers, bit by bit. The file is
    /// there whole or not at all.
    ///
    /// # Errors
    /// Returns [`RecordingError::CalibrationIo`] if the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        let failed = |source| io_error("write", path, source);
        let text = file::text(self).map_err(|error| failed(io::Error::other(error)))?;
        let temporary = temporary_path(path);
        let written = fs::write(&temporary, text).and_then(|()| fs::rename(&temporary, path));
        written.map_err(|error| {
            // What is left of the file is of no use; that it cannot be removed is not the error to report.
            let _ = fs::remove_file(&temporary);
            failed(error)
        })
    }

    /// Returns the settings with which recordings for an identification are recorded.
    pub(crate) fn settings(&self) -> CalibrationSettings {
        CalibrationSettings {
            gravity: Some(self.model.gravity),
            cutoff_hz: self.model.cutoff_hz,
            ..CalibrationSettings::default()
        }
    }

    /// Returns the effort of a joint for one unit of its recorded value, N m or N; `None` where the model does not have it.
    pub(crate) fn effort_gain_of(&self, joint: &str) -> Option<f64> {
        let index = self.model.joints.iter().position(|name| name == joint)?;
        self.effort_gain.get(index).copied()
    }
}

/// Returns a path in the same folder, for what is not complete yet.
fn temporary_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}", std::process::id()))
}

fn io_error(action: &'static str, path: &Path, source: io::Error) -> RecordingError {
    RecordingError::CalibrationIo {
        action,
        path: path.to_owned(),
        source,
    }
}
