//! Window means of the joint efforts of one recording.

use tactid_calibrate::{CalibrationSettings, EffortRecorder, EffortRecording};

use crate::plan::Plan;
use crate::recording::Recording;
use crate::run::Run;
use crate::shortage::{explain, no_overlap};
use crate::{Observer, RecordingError, Request};

/// A recording of joint efforts that was read.
pub(super) struct Recorded<'a> {
    pub(super) plan: Plan<'a>,
    pub(super) run: Run,
    pub(super) windows: EffortRecording,
}

impl<'a> Recorded<'a> {
    /// Reads a recording from beginning to end. `request` is that of [`Request::for_efforts`].
    ///
    /// # Errors
    /// Returns the errors of an identification by the effort method, and those of the
    /// [`EffortRecorder`].
    pub(super) fn new(
        recording: &'a impl Recording,
        request: &'a Request,
        settings: &CalibrationSettings,
        observer: &mut Observer<'_>,
    ) -> Result<Self, RecordingError> {
        let plan = Plan::new(recording, request, observer)?;
        let settings = CalibrationSettings {
            max_gap_s: plan.equations.max_gap_s,
            ..settings.clone()
        };
        let mut recorder = EffortRecorder::new(&plan.sources.robot, &plan.tip, &settings)?;
        let run = Run::new(recording, &plan, &mut recorder, observer)?;
        if let Some(nothing) = no_overlap(&plan, &run) {
            return Err(explain(nothing, &plan, &run));
        }
        match recorder.finish() {
            Ok(windows) => Ok(Self { plan, run, windows }),
            Err(_) if run.interrupted => Err(RecordingError::Interrupted),
            Err(error) => Err(explain(error.into(), &plan, &run)),
        }
    }
}
