//! The recordings of a calibration, as its file has them.

use serde::{Deserialize, Serialize};
use tactid_calibrate::CalibratingRecording;

use super::check::{Fault, Place};

/// A [`CalibratingRecording`], whose fingerprint has 16 hexadecimal digits.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Used {
    fingerprint: String,
    is_loaded: bool,
}

impl Used {
    pub(super) fn of(recording: &CalibratingRecording) -> Self {
        Self {
            fingerprint: format!("{:016x}", recording.fingerprint),
            is_loaded: recording.is_loaded,
        }
    }

    /// Returns the recording with an index in a text.
    pub(super) fn report(&self, text: &str, index: usize) -> Result<CalibratingRecording, Fault> {
        let fingerprint = u64::from_str_radix(&self.fingerprint, 16).map_err(|_| {
            let reason = format!("`{}` is no hexadecimal number of 64 bits", self.fingerprint);
            Place::numbered(text, "recording", index).fault("fingerprint", &reason)
        })?;
        Ok(CalibratingRecording {
            fingerprint,
            is_loaded: self.is_loaded,
        })
    }
}
