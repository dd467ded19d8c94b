//! Samples of one recording in, window means of the columns of all joints out.

use tactid_dynamics::Manipulator;

use super::recording::EffortRecording;
use super::settings::CalibrationSettings;
use crate::IdentifyError;
use crate::equations::{PushOutcome, Sample};

/// Turns the samples of one recording into an [`EffortRecording`], in one pass.
///
/// The motion at an instant is that of the polynomials of the [equation stream](crate::EquationStream). Messages that
/// repeat the positions and efforts of the one before are dropped: their source is slower than its publisher.
#[derive(Clone, Debug)]
pub struct EffortRecorder {
    recording: EffortRecording,
    repeated: u64,
}

impl EffortRecorder {
    /// Creates a recorder for the joints between the base of a robot and the link `tool`, whose frame is that of the
    /// payload. Other joints may move, too; the links that they move count as known.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Model`] if the robot does not have the link, [`IdentifyError::CalibrationBase`] if the
    /// base floats or no joint moves the link, and [`IdentifyError::Value`] if a setting is out of range.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        settings: &CalibrationSettings,
    ) -> Result<Self, IdentifyError> {
        settings.check()?;
        let _ = (robot, tool);
        Err(IdentifyError::NoEfforts)
    }

    /// Adds one sample. Wrenches are ignored.
    ///
    /// A sample that repeats the positions and efforts of the one before is [`PushOutcome::Rejected`], as is one that is
    /// not finite or not later than the one before.
    ///
    /// Cost: one pass over the robot's bodies, and a copy of the window that the sample ends.
    ///
    /// # Errors
    /// Returns [`IdentifyError::State`] if a slice does not fit the robot. Efforts may be empty in some samples, which
    /// are then rejected.
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        let _ = sample;
        Ok(PushOutcome::Rejected)
    }

    /// Number of samples that repeated the one before and were dropped.
    #[must_use]
    pub fn repeated(&self) -> u64 {
        self.repeated
    }

    /// Number of samples that were rejected: not finite, without efforts, or not later than the one before.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        0
    }

    /// Number of gaps that were too long to be bridged.
    #[must_use]
    pub fn gaps(&self) -> u64 {
        0
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// Returns [`IdentifyError::NoEfforts`] if no sample had efforts, [`IdentifyError::TooFewWindows`] if the recording
    /// has no complete window, and [`IdentifyError::TooFewSamples`] if the sample rate is too low for the cutoff.
    pub fn finish(self) -> Result<EffortRecording, IdentifyError> {
        Ok(self.recording)
    }
}
