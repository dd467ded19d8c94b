//! The number that identifies a recording of efforts by its content.

use tactid_identify::fingerprint;

use super::recording::EffortRecording;

impl EffortRecording {
    /// Returns a number that identifies the recording by its times, efforts and velocities, bit by
    /// bit. Recordings with different numbers differ; those with equal ones are the same but for a
    /// chance of 1 in 2⁶⁴.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        fingerprint(self.numbers().map(f64::to_bits))
    }
}
