//! Equations of the same samples for several cutoffs.

use tactid_dynamics::Manipulator;

use super::channels::Channels;
use super::equation::Equation;
use super::instant::Instant;
use super::model::Model;
use super::motion_stream::{MotionStep, MotionStream};
use super::sample::Sample;
use super::settings::EquationSettings;
use super::window::{WindowMean, Windows};
use crate::IdentifyError;

/// Turns samples into the equations of several cutoffs in one pass, to choose one of them: those
/// that an [`EquationStream`](super::EquationStream) of each cutoff returns, bit by bit.
///
/// The cutoff sets the length of the windows, and how far the polynomials of the motion reach.
/// Cutoffs whose polynomials have the same samples share what the rows are made of, which costs
/// most.
#[derive(Clone, Debug)]
pub struct MultiCutoffStream {
    model: Model,
    /// The instant of the entries that the model has computed last.
    computed: Instant,
    cutoffs: Vec<OfCutoff>,
}

/// The equations of one cutoff so far.
#[derive(Clone, Debug)]
struct OfCutoff {
    motion: MotionStream,
    windows: Windows<WindowMean>,
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
            motion: MotionStream::new(robot, wrenches, cutoff_hz, settings.max_gap_s),
            windows: Windows::of_means(
                cutoff_hz,
                model.entry_count(),
                model.row_count(),
                settings.shared_noise_s,
            ),
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
    /// Cost: one pass over the robot's bodies for each reach of the polynomials, and the allocation
    /// of each equation that the sample completes.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::push`](super::EquationStream::push).
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<(), IdentifyError> {
        self.model.check_lengths(sample)?;
        let mut is_computed = false;
        for of_cutoff in &mut self.cutoffs {
            match of_cutoff.motion.push(sample) {
                MotionStep::Rejected | MotionStep::Waiting => {}
                MotionStep::Started => of_cutoff.windows.clear(),
                MotionStep::Instant(instant) => {
                    if !(is_computed && instant.is_same(&self.computed)) {
                        self.model.entries(instant)?;
                        self.computed.copy_from(instant);
                        is_computed = true;
                    }
                    let entries = self.model.last_entries();
                    if let Some(window) = of_cutoff.windows.push(instant.time_s, entries) {
                        let mut equation = Equation::new(self.model.row_count());
                        self.model.set_equation(&mut equation, window);
                        of_cutoff.equations.push(equation);
                    }
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
