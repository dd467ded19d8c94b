//! The equation stream: from samples to averaged equations of motion.

use nalgebra::Vector3;
use tactid_dynamics::{InertialParameters, Manipulator, ModelFinding};

use super::channels::Channels;
use super::equation::Equation;
use super::model::Model;
use super::motion_rows::MotionRows;
use super::motion_stream::{MotionStep, MotionStream};
use super::offset_frame::OffsetFrame;
use super::sample::Sample;
use super::settings::EquationSettings;
use super::window::{MIN_INSTANTS, WindowMean, Windows};
use crate::sampling::Sampling;
use crate::{IdentifyError, Method};

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PushOutcome {
    /// The sample was added to the open averaging windows.
    Used,
    /// The sample was used, and the window that it ended shows a payload change, or noise far
    /// larger than before: the estimate starts again. Only
    /// [`Identifier::push`](crate::Identifier::push) returns it.
    PayloadChanged,
    /// The sample was used, and the windows up to the one that it ended show that the payload
    /// before the last change is held again, or that the change was a contact which has ended: the
    /// estimate before the change continues. Only [`Identifier::push`](crate::Identifier::push)
    /// returns it.
    PayloadReturned,
    /// The sample starts a new stretch without gaps: it is the first, comes after a gap, or follows
    /// samples that were earlier, because the clock had gone back.
    Started,
    /// The sample has a number that is not finite, or has a magnitude of 1e30 or more, or it is not
    /// later than the one before, and was ignored.
    Rejected,
}

/// Turns samples, one at a time, into averaged equations of motion, without allocation.
///
/// An equation lags its last sample by four to ten samples, which the polynomials need on their
/// right. They are fitted to every second sample where these are dense: neighbouring instants then
/// have independent noise, which lets the noise be separated from the motion (see
/// [`Equation::differences`]).
#[derive(Clone, Debug)]
pub struct EquationStream {
    model: Model,
    motion: MotionStream,
    windows: Windows<WindowMean>,
    equation: Equation,
    /// Time of the instant that the last sample completed, s; `None` where it completed none.
    instant_s: Option<f64>,
}

impl EquationStream {
    /// Creates the stream for a robot whose end-effector frame is the link `tool` and whose
    /// wrenches are measured in the links `sensors`.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Model`] if the robot does not have one of the links,
    /// [`IdentifyError::Option`] if a setting is out of range, and [`IdentifyError::Method`] if the
    /// method has nothing to measure, or needs a free-floating base or masses that the robot's
    /// description does not have.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Result<Self, IdentifyError> {
        let model = Model::new(robot, tool, sensors, settings)?;
        Ok(Self::with_model(robot, sensors, settings, model))
    }

    /// Creates a stream as [`new`](Self::new) does, which keeps the [`Geometry`](super::Geometry)
    /// of the windows where wrenches are measured.
    pub fn with_geometry(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Result<Self, IdentifyError> {
        let mut model = Model::new(robot, tool, sensors, settings)?;
        model.keep_geometry();
        Ok(Self::with_model(robot, sensors, settings, model))
    }

    fn with_model(
        robot: &Manipulator,
        sensors: &[&str],
        settings: &EquationSettings,
        model: Model,
    ) -> Self {
        Self {
            motion: MotionStream::new(robot, sensors.len(), settings.cutoff_hz, settings.max_gap_s),
            windows: Windows::of_means(
                settings.cutoff_hz,
                model.entry_count(),
                model.row_count(),
                settings.shared_noise_s,
            ),
            equation: Equation::new(model.row_count()),
            instant_s: None,
            model,
        }
    }

    /// Adds a sample and returns the equation that it completes, if any.
    ///
    /// Cost: one pass over the robot's bodies; no allocation.
    ///
    /// # Errors
    /// Returns [`IdentifyError::State`] if a slice does not fit the robot, and
    /// [`IdentifyError::Wrenches`] if the wrenches do not fit the sensors. Bad data are no error:
    /// see [`PushOutcome`].
    pub fn push(
        &mut self,
        sample: &Sample<'_>,
    ) -> Result<(PushOutcome, Option<&Equation>), IdentifyError> {
        self.model.check_lengths(sample)?;
        self.instant_s = None;
        let instant = match self.motion.push(sample) {
            MotionStep::Rejected => return Ok((PushOutcome::Rejected, None)),
            MotionStep::Started => {
                self.windows.clear();
                return Ok((PushOutcome::Started, None));
            }
            MotionStep::Waiting => return Ok((PushOutcome::Used, None)),
            MotionStep::Instant(instant) => instant,
        };
        let entries = self.model.entries(instant)?;
        self.instant_s = Some(instant.time_s);
        let Some(window) = self.windows.push(instant.time_s, entries) else {
            return Ok((PushOutcome::Used, None));
        };
        self.model.set_equation(&mut self.equation, window);
        Ok((PushOutcome::Used, Some(&self.equation)))
    }

    /// Discards the instants of the windows that have not ended: later windows begin with later
    /// samples.
    pub(crate) fn start_windows(&mut self) {
        self.windows.clear();
    }

    /// Returns what is wrong in the description of the robot, as far as the method uses it.
    #[must_use]
    pub fn model_findings(&self) -> Vec<ModelFinding> {
        self.model.findings().collect()
    }

    /// Discards all samples and resets the counts, so that the same samples can be presented again.
    pub fn rewind(&mut self) {
        self.motion.rewind();
        self.windows.rewind();
    }

    /// Time of the last sample that was used, s; minus infinity before the first.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.motion.time_s()
    }

    /// Lets the next sample start a stretch, because it does not follow the last one by the time
    /// that they say.
    pub(crate) fn interrupt(&mut self) {
        self.motion.interrupt();
    }

    /// Number of samples that were rejected: with a number that is not finite or beyond 1e30, or
    /// not later than the one before. It includes samples whose derivatives, or the products of
    /// these in the equations, are such numbers.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.motion.rejected() + self.windows.left_out()
    }

    /// Number of gaps that were too long to be bridged.
    #[must_use]
    pub fn gaps(&self) -> u64 {
        self.motion.gaps()
    }

    /// Gravitational acceleration in the inertial frame, m/s², as configured or by the kind of
    /// base.
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        self.model.gravity()
    }

    /// The channels of the equations: names, units, grouping and known noise. The noise is that at
    /// the posture of the last instant.
    #[must_use]
    pub fn channels(&self) -> Channels {
        self.model.channels()
    }

    /// The measurements that the payload is identified from.
    #[must_use]
    pub fn method(&self) -> Method {
        self.model.method()
    }

    /// Returns what computes the rows of single states of the robot.
    pub fn motion_rows(&self) -> MotionRows {
        MotionRows::of_model(self.model.clone())
    }

    /// The last equation.
    pub(crate) fn equation(&self) -> &Equation {
        &self.equation
    }

    /// The robot with its measurements at the last instant.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Time of the instant that the last sample completed, s; `None` where it completed none.
    pub(crate) fn instant_s(&self) -> Option<f64> {
        self.instant_s
    }

    /// The robot.
    pub fn robot(&self) -> &Manipulator {
        self.model.robot()
    }

    /// Whether there are wrench sensors.
    pub(crate) fn has_sensors(&self) -> bool {
        self.model.sensor_count() > 0
    }

    /// Whether wrenches are used that sensors measure.
    pub fn measures_wrench(&self) -> bool {
        self.has_sensors() && self.method().uses_wrench()
    }

    /// The frame in which a constant offset of the wrenches is stated.
    pub fn offset_frame(&self) -> &OffsetFrame {
        self.model.offset_frame()
    }

    /// Returns how the samples were taken.
    pub(crate) fn sampling(&self) -> Sampling {
        let motion = &self.motion;
        Sampling {
            samples: motion.accepted() - self.windows.left_out(),
            rejected: self.rejected(),
            gaps: motion.gaps(),
            max_gap_s: motion.max_gap_s(),
            period_s: motion.duration_s() / motion.accepted().saturating_sub(1).max(1) as f64,
            window_s: self.windows.length_s(),
            min_samples: MIN_INSTANTS,
        }
    }

    /// Returns why the stream has given so few equations, `windows`: most windows have too few
    /// samples, or the recording is too short.
    #[must_use]
    pub fn too_few_windows(&self, windows: usize) -> IdentifyError {
        self.windows.too_few(windows)
    }

    /// Inertial parameters of the known links below the tool that are part of the identified body,
    /// at the posture of the last instant, in the tool frame; `None` where the equations hold for
    /// the payload alone.
    #[must_use]
    pub fn gripper_to_subtract(&self) -> Option<InertialParameters> {
        self.model.gripper_to_subtract()
    }
}
