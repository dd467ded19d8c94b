//! Equations of the same samples for several cutoffs.

use tactid_dynamics::Manipulator;

use super::channels::Channels;
use super::equation::Equation;
use super::instant::Instant;
use super::model::Model;
use super::motion_stream::{MotionStep, MotionStream};
use super::sample::Sample;
use super::settings::EquationSettings;
use super::stream::check_lengths;
use super::window::Windows;
use crate::IdentifyError;

/// Turns samples into the equations of several cutoffs in one pass, to choose one of them: those that an
/// [`EquationStream`](super::EquationStream) of each cutoff returns, bit by bit.
///
/// The cutoff sets the length of the windows, and how far the polynomials of the motion reach. Cutoffs whose polynomials
/// have the same samples share the rows, which cost most.
#[derive(Clone, Debug)]
pub struct MultiCutoffStream {
    model: Model,
    /// The instant of the rows that the model has computed last.
    computed: Instant,
    cutoffs: Vec<OfCutoff>,
}

/// The equations of one cutoff so far.
#[derive(Clone, Debug)]
struct OfCutoff {
    motion: MotionStream,
    windows: Windows<Equation>,
    equations: Vec<Equation>,
}

impl MultiCutoffStream {
    /// Creates the streams of some cutoffs, Hz, for the arguments of
    /// [`EquationStream::new`](super::EquationStream::new). The cutoff of the settings is not used.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`](super::EquationStream::new).
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
        cutoffs_hz: &[f64],
    ) -> Result<Self, IdentifyError> {
        for &cutoff_hz in cutoffs_hz {
            let of_cutoff = EquationSettings {
                cutoff_hz,
                ..settings.clone()
            };
            of_cutoff.check(robot, sensors)?;
        }
        let model = Model::new(robot, tool, sensors, settings)?;
        let (joints, wrenches) = (robot.dof(), sensors.len());
        let of_cutoff = |&cutoff_hz: &f64| OfCutoff {
            motion: MotionStream::new(joints, wrenches, cutoff_hz, settings.max_gap_s),
            windows: Windows::new(cutoff_hz, model.row_count()),
            equations: Vec::new(),
        };
        Ok(Self {
            cutoffs: cutoffs_hz.iter().map(of_cutoff).collect(),
            computed: Instant::new(joints, wrenches),
            model,
        })
    }

    /// Adds a sample.
    ///
    /// Cost: one pass over the robot's bodies for each reach of the polynomials, and a copy of each equation that the sample
    /// completes.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::push`](super::EquationStream::push).
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<(), IdentifyError> {
        check_lengths(&self.model, sample)?;
        let mut is_computed = false;
        for of_cutoff in &mut self.cutoffs {
            match of_cutoff.motion.push(sample) {
                MotionStep::Rejected | MotionStep::Waiting => {}
                MotionStep::Started => of_cutoff.windows.clear(),
                MotionStep::Instant(instant) => {
                    if !(is_computed && instant.is_same(&self.computed)) {
                        self.model.rows(instant)?;
                        self.computed.copy_from(instant);
                        is_computed = true;
                    }
                    let window = of_cutoff
                        .windows
                        .push(instant.time_s, self.model.last_rows());
                    of_cutoff.equations.extend(window.cloned());
                }
            }
        }
        Ok(())
    }

    /// Returns the equations of each cutoff, in their order, and the channels.
    #[must_use]
    pub fn finish(self) -> (Vec<Vec<Equation>>, Channels) {
        let channels = self.model.channels();
        let equations = self.cutoffs.into_iter();
        (equations.map(|cutoff| cutoff.equations).collect(), channels)
    }
}
