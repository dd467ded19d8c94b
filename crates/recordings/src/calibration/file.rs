//! The file of a calibration, read and written.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::text;
use crate::ArmCalibration;
use crate::RecordingError;

impl ArmCalibration {
    /// Reads the file of a calibration.
    ///
    /// # Errors
    /// Returns [`RecordingError::Calibration`] if the file cannot be read, or, with the line where
    /// it is known, if it is not what [`Self::write`] writes.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let failed = |source| io_error("read", path, source);
        let text = tactid_dynamics::read_text(path).map_err(failed)?;
        Self::from_toml(&text, path)
    }

    /// Reads a calibration from the text of its file. `origin` is named in the error.
    ///
    /// # Errors
    /// Returns [`RecordingError::Calibration`] with the line, where it is known, if the text is not
    /// that of a calibration.
    pub fn from_toml(text: &str, origin: &Path) -> Result<Self, RecordingError> {
        text::parse(text).map_err(|fault| {
            let line = fault
                .line
                .map_or_else(String::new, |line| format!(":{line}"));
            wrong(format!("{}{line}: {}", origin.display(), fault.reason))
        })
    }

    /// Returns the text of the file of the calibration, which has every number bit by bit.
    ///
    /// # Errors
    /// Returns [`RecordingError::Calibration`] if the calibration has what TOML does not.
    pub fn to_toml(&self) -> Result<String, RecordingError> {
        text::text(self).map_err(|error| {
            wrong(format!(
                "the calibration cannot be written as TOML: {error}"
            ))
        })
    }

    /// Writes the calibration as a TOML file, from which [`Self::read`] gets the same numbers, bit
    /// by bit. The file is there whole or not at all.
    ///
    /// # Errors
    /// Returns [`RecordingError::Calibration`] if the file cannot be written, and the error of
    /// [`Self::to_toml`].
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        let failed = |source| io_error("write", path, source);
        let text = self.to_toml()?;
        let temporary = temporary_path(path);
        let written = fs::write(&temporary, text).and_then(|()| fs::rename(&temporary, path));
        written.map_err(|error| {
            // What is left of the file is of no use; that it cannot be removed is not the error to
            // report.
            let _ = fs::remove_file(&temporary);
            failed(error)
        })
    }
}

/// Returns a path in the same folder, for what is not complete yet.
fn temporary_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}", std::process::id()))
}

fn io_error(action: &str, path: &Path, source: io::Error) -> RecordingError {
    let path = path.display();
    wrong(format!("cannot {action} the calibration {path}: {source}"))
}

fn wrong(what: String) -> RecordingError {
    RecordingError::Calibration { what, option: None }
}
