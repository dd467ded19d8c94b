//! Samples of one recording in, window means of the columns of all joints out.

use std::sync::Arc;

use tactid_dynamics::Manipulator;
use tactid_identify::equations::window::Windows;
use tactid_identify::equations::{BaseState, MotionStep, MotionStream, PushOutcome, Sample};

use super::arm::{Arm, ArmColumns};
use super::delay::EffortWindow;
use super::recording::EffortRecording;
use super::settings::CalibrationSettings;
use crate::CalibrateError;

/// Longest time, as a fraction of the longest time without a gap, after which a sample counts even
/// where it repeats the one before: a robot at rest must not look like a gap.
const LONGEST_REPEAT: f64 = 0.5;

/// Turns the samples of one recording into an [`EffortRecording`], in one pass.
///
/// The motion at an instant follows from the polynomials of the
/// [equation stream](tactid_identify::EquationStream). Messages that repeat the positions and
/// efforts of the one before are dropped: their source is slower than its publisher.
#[derive(Clone, Debug)]
pub struct EffortRecorder {
    columns: ArmColumns,
    motion: MotionStream,
    windows: Windows<EffortWindow>,
    recording: EffortRecording,
    /// Positions and efforts of the last sample that was used.
    last: Vec<f64>,
    repeated: u64,
    without_effort: u64,
}

impl EffortRecorder {
    /// Creates a recorder for the joints between the base of a robot and the link `tool`, which has
    /// the frame of the payload. Other joints may move, too; their links count as known.
    ///
    /// # Errors
    /// Returns [`CalibrateError::Identify`] if the robot does not have the link or a setting is out
    /// of range, and [`CalibrateError::Robot`] if the base floats or no joint moves the link.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        settings: &CalibrationSettings,
    ) -> Result<Self, CalibrateError> {
        settings.check()?;
        let arm = Arc::new(Arm::new(robot, tool, settings)?);
        Ok(Self {
            columns: ArmColumns::new(robot, &arm)?,
            motion: MotionStream::new(robot, 0, settings.cutoff_hz, settings.max_gap_s),
            windows: Windows::new(
                settings.cutoff_hz,
                arm.entries() + arm.joints.len(),
                &EffortWindow::new(arm.entries(), arm.joints.len()),
            ),
            recording: EffortRecording::new(arm),
            last: Vec::with_capacity(2 * robot.dof()),
            repeated: 0,
            without_effort: 0,
        })
    }

    /// Adds one sample. Its base and wrenches are ignored.
    ///
    /// A sample that repeats the positions and efforts of the one before is
    /// [`PushOutcome::Rejected`], as is one that has no efforts, is not finite, or is not later
    /// than the one before.
    ///
    /// Cost: one pass over the bodies above each body of the arm, and a copy of a window that ends.
    ///
    /// # Errors
    /// Returns [`CalibrateError::Identify`] if a slice does not fit the robot.
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, CalibrateError> {
        let robot = self.columns.robot();
        robot.check_length("joint_position", sample.joint_position)?;
        if !sample.joint_velocity.is_empty() {
            robot.check_length("joint_velocity", sample.joint_velocity)?;
        }
        if sample.joint_effort.is_empty() {
            self.without_effort += 1;
            return Ok(PushOutcome::Rejected);
        }
        robot.check_length("joint_effort", sample.joint_effort)?;
        if self.is_repeated(sample) {
            self.repeated += 1;
            return Ok(PushOutcome::Rejected);
        }
        let sample = Sample {
            base: BaseState::fixed(),
            wrenches: &[],
            ..*sample
        };
        let instant = match self.motion.push(&sample) {
            MotionStep::Rejected => return Ok(PushOutcome::Rejected),
            MotionStep::Started => {
                self.windows.clear();
                self.keep(&sample);
                return Ok(PushOutcome::Started);
            }
            MotionStep::Waiting => None,
            MotionStep::Instant(instant) => Some(instant),
        };
        if let Some(instant) = instant {
            let entries = self.columns.at(&self.recording.arm, instant)?;
            if let Some(window) = self.windows.push(instant.time_s, entries) {
                self.recording.push(window);
            }
        }
        self.keep(&sample);
        Ok(PushOutcome::Used)
    }

    /// Number of samples that repeated the one before and were dropped.
    #[must_use]
    pub fn repeated(&self) -> u64 {
        self.repeated
    }

    /// Number of samples that were rejected: not finite, or with derivatives that are not, without
    /// efforts, or not later than the one before.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.motion.rejected() + self.windows.left_out() + self.without_effort
    }

    /// Number of gaps that were too long to be bridged.
    #[must_use]
    pub fn gaps(&self) -> u64 {
        self.motion.gaps()
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// Returns [`CalibrateError::Data`] if no sample had efforts, and [`CalibrateError::Identify`]
    /// if the recording has no complete window, or its sample rate is too low for the cutoff.
    pub fn finish(self) -> Result<EffortRecording, CalibrateError> {
        let windows = self.recording.windows();
        if windows == 0 && self.motion.accepted() == 0 && self.without_effort > 0 {
            return Err(CalibrateError::no_efforts());
        }
        if windows == 0 {
            return Err(self.windows.too_few(0).into());
        }
        let (rejected, gaps) = (self.rejected(), self.gaps());
        let mut recording = self.recording;
        (recording.rejected, recording.gaps) = (rejected, gaps);
        Ok(recording)
    }

    /// Whether a sample has the positions and efforts of the last one that was used.
    fn is_repeated(&self, sample: &Sample<'_>) -> bool {
        let passed_s = sample.time_s - self.motion.time_s();
        let values = sample.joint_position.iter().chain(sample.joint_effort);
        passed_s <= LONGEST_REPEAT * self.motion.max_gap_s() && self.last.iter().eq(values)
    }

    fn keep(&mut self, sample: &Sample<'_>) {
        self.last.clear();
        self.last.extend_from_slice(sample.joint_position);
        self.last.extend_from_slice(sample.joint_effort);
    }
}
