//! The batch identifier: samples in, one result at the end.

mod fits;

use std::sync::Arc;

use nalgebra::SVector;
use tactid_dynamics::Manipulator;
use tactid_identify::equations::{
    Channels, Equation, EquationSettings, EquationStream, PushOutcome, Sample, Unknowns,
};
use tactid_identify::solve::{ValueStdDevs, is_mass_known};
use tactid_identify::solve::{body_of, estimate};
use tactid_identify::{
    BoundingBox, IdentifyError, KnownBodies, KnownMass, KnownTool, Method, PayloadEstimate,
    is_physical,
};

use self::fits::Fits;
use crate::contact::LoadEstimate;
use crate::diagnosis::{
    ConsistentPayload, LEAST_WINDOWS, consistent_payload, data_findings, mass_finding,
    without_repetition, wrong_assumptions,
};
use crate::equation_batch::EquationBatch;
use crate::finding::{Finding, Hypothesis, WrongAssumption};
use crate::fit::further::{self, FurtherFit};
use crate::fit::{Delay, Fit, FitOptions};
use crate::forecast::Forecast;
use crate::hypotheses::Explanation;
use crate::linear_estimate::LinearEstimate;
use crate::other_load::{Parts, leave_out};
use crate::report::FitReport;
use crate::rests::{hides_offset, is_one_attitude, rests};
use crate::shown_offset::identified;
use crate::solve::PrincipalMoments;
use crate::solve::{Posterior, Report};
use crate::trajectory::{MotionEstimate, SampleBins};
use crate::{HistoryPoint, PriorKnowledge, WeightEstimate};

/// Prior knowledge and options of the batch identifier. By default nothing is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchSettings {
    /// A known body that the measured load contains besides the payload. It is subtracted, and its
    /// uncertainty is part of that of the payload.
    pub known_tool: Option<KnownTool>,
    /// Mass of the payload from a scale: one more row of least squares.
    pub known_mass: Option<KnownMass>,
    /// A box in the tool frame that contains the whole payload: the estimate is projected onto
    /// bodies that fit into it.
    pub bounding_box: Option<BoundingBox>,
    /// Whether the delay of the load relative to the motion is estimated, too. It does not change
    /// the other results.
    pub delay: bool,
    /// Whether a constant offset of the wrenches is identified where the data show one, as
    /// [`EquationSettings::wrench_offset`] does for every recording.
    pub shown_offset: bool,
    /// Why the motion is smoothed before, where settings and samples do not show it:
    /// [`MotionEstimate::GivenCutoff`] where the cutoff was chosen for this motion, and
    /// [`MotionEstimate::NoVelocities`] where velocities of the base follow from its poses. By
    /// default (`None`) motion and payload are estimated at once where that is more precise.
    pub smoothed: Option<MotionEstimate>,
}

/// What the equations say without a known mass, and with which unknowns.
struct Solution<'a> {
    channels: Channels,
    found: FurtherFit<'a>,
    /// Wrong assumptions beside the offset that the fit has.
    explanation: Option<Explanation>,
    /// The offset that the data have shown and the fit has.
    offset: Option<WrongAssumption>,
    /// Parts of the recording with another load, which the fit leaves out.
    other_load: Option<&'a Parts>,
    /// Whether the mass is known beside an offset that the motion hardly tells from the weight.
    known_beside_offset: Option<bool>,
}

type Solved<'a> = Result<Solution<'a>, IdentifyError>;

impl BatchSettings {
    /// Checks that the values are in range.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] if the mass is not positive, its standard deviation is
    /// negative, or the box has no volume.
    pub fn check(&self) -> Result<(), IdentifyError> {
        self.prior().check()
    }

    /// Returns what is known of the payload.
    #[must_use]
    pub fn prior(&self) -> PriorKnowledge {
        PriorKnowledge {
            known_mass: self.known_mass,
            bounding_box: self.bounding_box,
        }
    }
}

/// Identifies the payload by robust weighted least squares over all samples at once.
///
/// Memory is bounded: at most 30 000 equations are stored, and neighbours are merged beyond that.
/// Where motion and payload may be estimated at once, means of the first samples are stored beside
/// them, at most 6000 (100 s at 1 kHz), of more than eight joints fewer, and solved in some 60 MB.
#[derive(Clone, Debug)]
pub struct BatchIdentifier {
    frame: Arc<str>,
    stream: EquationStream,
    equations: EquationSettings,
    settings: BatchSettings,
    batch: EquationBatch,
    bins: SampleBins,
    windows: u64,
}

/// The result of a batch identification.
#[derive(Clone, Debug)]
pub struct BatchResult {
    /// The payload with its uncertainty.
    pub estimate: PayloadEstimate,
    /// Principal moments of inertia of the payload; `None` where its mass is zero.
    pub principal_moments: Option<PrincipalMoments>,
    /// The estimate over time, with at most 600 points.
    pub history: Vec<HistoryPoint>,
    /// What the recording says about the linear parameters of the payload, without prior knowledge:
    /// what a combination takes of each of several recordings.
    pub linear: LinearEstimate,
    /// What the recording says about all that its wrench sensors measure; `None` where no wrench is
    /// used, or a weight that was subtracted from them is an unknown.
    pub load: Option<LoadEstimate>,
    /// How well the payload explains the measurements.
    pub fit: FitReport,
    /// Delay of the load relative to the motion in the given samples, where
    /// [`BatchSettings::delay`] is set.
    pub delay: Option<Delay>,
    /// What the identification noticed about the data, for the user to decide on.
    pub findings: Vec<Finding>,
    /// Forecast of the uncertainty for a motion that continues; `None` where the mass is zero, and
    /// where motion and payload are of the beginning of the recording, to which more samples add
    /// nothing.
    pub forecast: Option<Forecast>,
}

impl BatchIdentifier {
    /// Creates an identifier for a robot whose end-effector frame is the link `tool` and whose
    /// wrenches are measured in the links `sensors`.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`] and of [`BatchSettings::check`].
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        equations: EquationSettings,
        settings: BatchSettings,
    ) -> Result<Self, IdentifyError> {
        settings.check()?;
        Ok(Self {
            frame: tool.into(),
            stream: EquationStream::with_geometry(robot, tool, sensors, &equations)?,
            bins: SampleBins::new(robot, sensors.len(), &equations, settings.smoothed),
            equations,
            settings,
            batch: EquationBatch::default(),
            windows: 0,
        })
    }

    /// Adds one sample.
    ///
    /// Cost: one pass over the robot's bodies, and a copy of the window that the sample ends.
    ///
    /// # Errors
    /// Returns [`IdentifyError::State`] if a slice does not fit the robot, and
    /// [`IdentifyError::Wrenches`] if the wrenches do not fit the sensors. Bad data are no error:
    /// see [`PushOutcome`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        let (outcome, equation) = self.stream.push(sample)?;
        if outcome != PushOutcome::Rejected && !self.bins.is_full() {
            self.bins.push(sample, outcome == PushOutcome::Started);
        }
        if let Some(equation) = equation {
            self.windows += 1;
            self.batch.push(equation);
        }
        Ok(outcome)
    }

    /// Number of averaging windows so far, before merging.
    #[must_use]
    pub fn windows(&self) -> u64 {
        self.windows
    }

    /// The equation stream behind the identifier.
    #[must_use]
    pub fn stream(&self) -> &EquationStream {
        &self.stream
    }

    /// Solves for the payload.
    ///
    /// Cost: several fits, each of up to 20 passes over all windows.
    ///
    /// # Errors
    /// Returns [`IdentifyError::TooLittle`] if the recording is too short, or its sample rate too
    /// low, for the cutoff.
    pub fn solve(&self) -> Result<BatchResult, IdentifyError> {
        let known = self.known_bodies();
        let other_load = Parts::find(self.batch.equations(), &self.stream);
        let solution = self.without_known_mass(other_load.as_ref())?;
        let (channels, equations) = (&solution.channels, &solution.found.equations[..]);
        let known_mass_fit = self.with_known_mass(&solution, &known)?;
        let fits = self.fits(&solution, known_mass_fit.as_ref());
        let (fit, fit_without_mass) = (fits.of_all(), fits.without_mass());
        let bounding_box = self.settings.bounding_box.as_ref();
        let consistent = consistent_payload(fit, &known, bounding_box);
        let cutoff_hz = self.equations.cutoff_hz;
        let frame = self.stream.offset_frame();
        let parameters = consistent.parameters;
        let posterior = Posterior::of_load(
            (&fit.parameters, &fit.covariance, fit.known_mass),
            &known,
            (parameters, consistent.widening),
            &fit.null_space,
        );
        let of_recording = consistent_payload(fit_without_mass, &known, None);
        let noise_fraction = fit.noise_fraction(&parameters, &known.covariance);
        let mut of_fit = FitReport::new(
            &self.batch,
            equations,
            (fit, &solution.found.values_of(fit)),
            noise_fraction,
            channels,
            cutoff_hz,
            frame,
        );
        let is_of_beginning = fits.motion == MotionEstimate::WithPayload && self.bins.is_full();
        of_fit.motion = fits.motion;
        of_fit.motion_until_s = self.bins.end_s().filter(|_| is_of_beginning);
        let Report {
            estimate,
            principal_moments,
        } = posterior.report(&self.frame, &self.settings.prior());
        let has_gripper = self.stream.gripper_to_subtract().is_some();
        let history = self.history(equations, &fits, &known, &estimate);
        Ok(BatchResult {
            estimate: PayloadEstimate {
                composite: posterior.composite(&known).filter(|_| has_gripper),
                ..self.counted(estimate)
            },
            linear: LinearEstimate::of_fit(fit_without_mass, &known, of_recording.widening),
            load: self.load(fit, equations, has_gripper),
            principal_moments,
            history,
            forecast: Forecast::new(equations, fit, &parameters, &of_fit)
                .filter(|_| !is_of_beginning),
            fit: of_fit,
            delay: self.remaining_delay(&solution),
            findings: self.findings(&solution, &fits, consistent, known.mass_kg()),
        })
    }

    /// Returns the body whose weight was subtracted from the wrenches, from a fit with this weight
    /// and an offset of the wrenches beside the payload. `None` where something else than wrenches
    /// is measured, or the windows are too few to show it.
    ///
    /// Cost: one fit.
    #[must_use]
    pub fn subtracted_weight(&self) -> Option<WeightEstimate> {
        let equations = self.batch.equations();
        let is_shown = self.equations.method == Method::Tactile && equations.len() >= LEAST_WINDOWS;
        let channels = self.stream.channels().with_offsets(true);
        let unknowns = Unknowns {
            weight: true,
            ..self.equations.unknowns
        };
        let fit = || {
            let options = FitOptions::new(&channels);
            further::fit(equations, options, &self.stream.gravity(), unknowns)
        };
        let found = is_shown.then(fit).flatten()?;
        found.values.weight_estimate()
    }

    /// Returns what a fit says about all that the wrench sensors measure. `has_gripper` says that
    /// the parameters are those of links of the robot, too, which the sensors need not carry.
    fn load(&self, fit: &Fit, equations: &[Equation], has_gripper: bool) -> Option<LoadEstimate> {
        let is_known = !has_gripper && !self.equations.unknowns.weight;
        (self.stream.measures_wrench() && is_known)
            .then(|| LoadEstimate::new(fit, equations, self.batch.merged()))
            .flatten()
    }

    /// Returns what was noticed, given the fits, the payload that is consistent with the one that is
    /// reported, and the mass of the known bodies with its standard deviation, kg.
    fn findings(
        &self,
        solution: &Solution<'_>,
        fits: &Fits<'_>,
        consistent: ConsistentPayload,
        known_bodies_kg: (f64, f64),
    ) -> Vec<Finding> {
        let (fit, without_mass) = (fits.of_all(), fits.without_mass());
        // Motion and payload leave at most twice the variance of the noise. What windows leave beyond
        // the differences of neighbouring samples is then noise that is not white.
        let is_noise = fits.motion == MotionEstimate::WithPayload && !self.bins.is_full();
        let of_data = data_findings(
            [self.batch.equations(), &solution.found.equations],
            without_mass,
            fit,
            &self.stream,
            known_bodies_kg,
            solution.explanation.as_ref(),
            is_noise,
        );
        let found = (
            without_mass.parameters[0] - known_bodies_kg.0,
            without_mass.mass_std_dev_kg().hypot(known_bodies_kg.1),
        );
        let of_mass = self.settings.known_mass.and_then(|mass| {
            mass_finding(
                mass,
                found,
                consistent.parameters[0],
                self.settings.bounding_box.is_some(),
                &of_data,
            )
        });
        let mut findings = without_repetition(of_mass, consistent.contradiction, of_data);
        findings.extend(solution.offset.clone().map(Finding::WrongAssumption));
        if let Some(is_known) = solution.known_beside_offset {
            // What it causes follows, and a mass of zero may be a zero of the sensor.
            findings.retain(|other| !matches!(other, Finding::NothingHeld { .. }));
            findings.insert(0, Finding::WeightOrOffset { is_known });
        }
        let of_rests = rests(self.batch.equations(), &self.stream.gravity());
        findings.extend(of_rests.map(Finding::ConsistsOfRests));
        let of_model = self.stream.model_findings();
        findings.extend(of_model.into_iter().map(Finding::Model));
        if let Some(parts) = solution.other_load {
            parts.report(fit, &mut findings);
        }
        findings
    }

    /// Fits the parameters without a known mass, and with an offset of the wrenches where the data
    /// show one, or would hide it.
    fn without_known_mass<'a>(&'a self, other_load: Option<&'a Parts>) -> Solved<'a> {
        let given = self.solution(self.stream.channels(), other_load)?;
        if !self.settings.shown_offset || given.channels.offsets > 0 {
            return Ok(given);
        }
        let with_offset = || self.solution(given.channels.clone().with_offsets(true), other_load);
        if given.known_beside_offset.is_some() {
            let both = with_offset()?;
            let is_known = both.known_beside_offset == Some(true);
            return Ok(if is_known { both } else { given });
        }
        let causes = given.explanation.as_ref().map(|found| &found.causes[..]);
        // Beside a graver cause that is not applied, the offset of a fit would explain what that
        // cause does.
        let shown = causes.unwrap_or_default().first();
        let Some(shown) = shown.filter(|found| found.cause == Hypothesis::Offset) else {
            return Ok(given);
        };
        let with_offset = with_offset()?;
        let offset = identified(shown, &with_offset.found.fit, self.stream.offset_frame());
        Ok(if offset.is_some() {
            Solution {
                offset,
                ..with_offset
            }
        } else {
            Solution {
                known_beside_offset: (self.stream.gravity().norm() > 0.0).then_some(false),
                ..given
            }
        })
    }

    /// Fits the parameters, and the further unknowns of the settings, with the offsets of some
    /// channels.
    fn solution<'a>(&'a self, channels: Channels, other_load: Option<&'a Parts>) -> Solved<'a> {
        let equations = self.batch.equations();
        let (gravity, unknowns) = (self.stream.gravity(), self.equations.unknowns);
        let options = FitOptions {
            used: other_load.map(Parts::is_rest),
            ..FitOptions::new(&channels)
        };
        let found = further::fit(equations, options, &gravity, unknowns);
        let mut found = found.ok_or_else(|| self.stream.too_few_windows(equations.len()))?;
        leave_out(other_load, &mut found.fit);
        let (fit, has_offset) = (&found.fit, channels.offsets > 0);
        let is_open = has_offset || self.settings.shown_offset;
        let is_hidden = is_open && hides_offset(equations, &self.stream);
        let is_known = has_offset && is_mass_known(fit.parameters[0], fit.mass_std_dev_kg());
        // Fewer windows, or one attitude under gravity, show no assumption to be wrong.
        let is_shown = equations.len() >= LEAST_WINDOWS
            && (is_known || !is_hidden)
            && !(gravity.norm() > 0.0 && is_one_attitude(equations));
        let explain = || wrong_assumptions(equations, fit, Some(&found.values), &self.stream);
        Ok(Solution {
            explanation: is_shown.then(explain).flatten(),
            known_beside_offset: is_hidden.then_some(is_known),
            offset: None,
            channels,
            found,
            other_load,
        })
    }

    /// Returns the estimate without any information: every value is unobservable.
    #[must_use]
    pub fn unknown(&self) -> PayloadEstimate {
        let (frame, nothing) = (self.frame.clone(), body_of(&SVector::zeros()));
        let (is_physical, std_devs) = (is_physical(&nothing), &ValueStdDevs::UNKNOWN);
        self.counted(estimate(frame, nothing, is_physical, std_devs, None))
    }

    /// Returns an estimate with the counts of this identifier.
    fn counted(&self, estimate: PayloadEstimate) -> PayloadEstimate {
        PayloadEstimate {
            windows: self.windows,
            rejected: self.stream.rejected(),
            gaps: self.stream.gaps(),
            ..estimate
        }
    }

    /// The known bodies that the measured load contains besides the payload.
    fn known_bodies(&self) -> KnownBodies {
        KnownBodies::new(self.stream.gripper_to_subtract(), self.settings.known_tool)
    }
}
