//! Motion and payload at once, while samples come.

use std::sync::Arc;

use nalgebra::{SMatrix, SVector};
use tactid_dynamics::{InertialParameters, Manipulator};
use tactid_identify::equations::{EquationSettings, PushOutcome, Sample};
use tactid_identify::solve::NullSpace;
use tactid_identify::{Identifier, IdentifyError, Observability, PayloadEstimate};

use super::bins::{SampleBins, values_at_times};
use super::choice::is_smaller;
use super::dynamics::Dynamics;
use super::estimate::{Estimate, Left, Problem};
use super::noise::Noise;
use super::past::Past;
use super::segment::{Knots, Segment};
use super::{MotionEstimate, SETTINGS};
use crate::PriorKnowledge;
use crate::diagnosis::nearest_consistent;
use crate::solve::{Posterior, widened};

type Parameters = SVector<f64, 10>;
type Matrix = SMatrix<f64, 10, 10>;

/// Settings of a [`LagIdentifier`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LagSettings {
    /// Time before the last sample in which the motion may still change, s. Rounded up to intervals
    /// of 0.05 s, of which there is at least one. Time and memory grow with it. Default: 0.1 s.
    pub lag_s: f64,
}

impl Default for LagSettings {
    fn default() -> Self {
        Self { lag_s: 0.1 }
    }
}

/// Estimates the motion of a free-floating robot together with its payload, while samples come: the
/// estimate of [`BatchIdentifier`](crate::BatchIdentifier) for [`MotionEstimate::WithPayload`],
/// with a memory that does not grow.
///
/// An online identifier of its own gives it the first parameters and detects payload changes, after
/// which it begins again. The first estimate needs 0.8 s, also after a gap, and every 0.05 s it is
/// renewed with the samples until then. Motion that is older than the lag is eliminated: it is not
/// changed by later samples, and what it says of the payload is kept.
///
/// There is an estimate where there is one of a recording, with three differences. Rows have the
/// weights that follow from the samples until they were eliminated, so that those of the first
/// second are less precise. Residuals, and with them the intervals, are those of the motion at that
/// time. Wrong assumptions are not looked for, but where residuals are larger than noise: see
/// [`online_findings`](crate::online_findings).
///
/// It allocates, and the sample that completes 0.05 s takes some 5 ms for a robot with eight joints
/// and all sources, that of the first estimate 0.1 s (measured in the profile of the tests): it
/// belongs in a thread beside the control loop, which gets copies of the samples.
#[derive(Clone, Debug)]
pub struct LagIdentifier {
    frame: Arc<str>,
    online: Identifier,
    bins: SampleBins,
    dynamics: Dynamics,
    /// Number of intervals between knots that may still change.
    lag: usize,
    stretch: Stretch,
    known: Known,
    found: Result<PayloadEstimate, MotionEstimate>,
}

/// The intervals between knots since the last gap.
#[derive(Clone, Debug, Default)]
struct Stretch {
    /// Time of the first knot, s; `None` before the first bin.
    first_s: Option<f64>,
    /// Number of intervals of which all samples are there.
    complete: usize,
    /// Number of intervals that were eliminated.
    eliminated: usize,
}

impl Stretch {
    fn knots(&self) -> Knots {
        Knots {
            first_s: self.first_s.unwrap_or_default(),
            rate_hz: SETTINGS.knots_hz,
        }
    }

    /// First interval of those from which the motion is smoothed.
    fn smoothed(&self) -> usize {
        let recent = self.complete.saturating_sub(SETTINGS.window);
        self.eliminated.min(recent)
    }
}

/// What is known of the present payload.
#[derive(Clone, Debug)]
struct Known {
    past: Past,
    left: Left,
    /// Mean noise of the channels, and the number of intervals from which it is.
    noise: Option<(Noise, usize)>,
    /// Parameters of the whole load.
    parameters: Option<Parameters>,
}

impl Known {
    fn nothing(coordinates: usize) -> Self {
        Self {
            past: Past::new(coordinates),
            left: Left::default(),
            noise: None,
            parameters: None,
        }
    }

    /// Returns the mean noise with that of the last intervals, of which there are `complete` since
    /// the last gap, and the number of intervals from which it is.
    fn mean_noise(&mut self, of_last: Noise, complete: usize) -> &(Noise, usize) {
        let noise = self
            .noise
            .get_or_insert_with(|| (of_last.clone(), complete - 1));
        noise.1 = (noise.1 + 1).min(SETTINGS.remembered);
        noise.0.average(&of_last, (noise.1 as f64).recip());
        noise
    }
}

impl LagIdentifier {
    /// Creates an identifier for a robot whose end-effector frame is the link `tool` and whose
    /// wrenches are measured in the links `sensors`.
    ///
    /// # Errors
    /// Returns the errors of [`Identifier::new`]. A robot for which there is no such estimate is no
    /// error: [`motion`](Self::motion) says why.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        equations: &EquationSettings,
        settings: LagSettings,
    ) -> Result<Self, IdentifyError> {
        let online = Identifier::new(robot, tool, sensors, equations)?;
        let bins = SampleBins::new(robot, sensors.len(), equations, None);
        let model = online.snapshot().stream.model().clone();
        Ok(Self {
            frame: tool.into(),
            online,
            dynamics: Dynamics::new(model, bins.layout()),
            lag: (settings.lag_s * SETTINGS.knots_hz).ceil().max(1.0) as usize,
            stretch: Stretch::default(),
            known: Known::nothing(bins.layout().coordinates()),
            found: Err(bins.unsuited().unwrap_or(MotionEstimate::TooFew)),
            bins,
        })
    }

    /// Adds one sample.
    ///
    /// # Errors
    /// Returns the errors of [`Identifier::push`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        let outcome = self.online.push(sample)?;
        match outcome {
            PushOutcome::Rejected => return Ok(outcome),
            PushOutcome::Used => {}
            PushOutcome::Started => self.end_stretch(),
            PushOutcome::PayloadChanged | PushOutcome::PayloadReturned => {
                self.start_again(MotionEstimate::TooFew);
            }
        }
        let before = self.bins.newest().len();
        self.bins.push(sample, outcome != PushOutcome::Used);
        if let Some(reason) = self.bins.unsuited() {
            self.found = Err(reason);
        } else if self.bins.newest().len() > before {
            self.add_bin();
        }
        Ok(outcome)
    }

    /// Returns the estimate of the payload in the end-effector frame; `None` where
    /// [`motion`](Self::motion) says why.
    #[must_use]
    pub fn estimate(&self) -> Option<&PayloadEstimate> {
        self.found.as_ref().ok()
    }

    /// Returns that the motion is estimated together with the payload, or why it is not.
    #[must_use]
    pub fn motion(&self) -> MotionEstimate {
        let reason = self.found.as_ref().err();
        reason.copied().unwrap_or(MotionEstimate::WithPayload)
    }

    /// Number of intervals before an estimate.
    fn first_intervals(&self) -> usize {
        SETTINGS.first_intervals.max(self.lag + 1)
    }

    /// Forgets what is known of the payload.
    fn start_again(&mut self, reason: MotionEstimate) {
        self.known = Known::nothing(self.bins.layout().coordinates());
        self.found = Err(reason);
        self.clear();
    }

    /// Forgets all bins.
    fn clear(&mut self) {
        self.bins.forget(f64::INFINITY);
        self.stretch = Stretch::default();
    }

    /// Eliminates all splines: a gap follows.
    fn end_stretch(&mut self) {
        if self.stretch.complete >= self.first_intervals() {
            let known = self.solve(0).and_then(|()| {
                let known = &mut self.known;
                known.left.end_stretch(known.past.coefficients());
                known.past.end_stretch().ok_or(MotionEstimate::TooFew)
            });
            if let Err(reason) = known {
                self.start_again(reason);
            }
        }
        self.clear();
    }

    /// Renews the estimate where the last bin shows that an interval is complete.
    fn add_bin(&mut self) {
        let Some(newest) = self.bins.newest().last() else {
            return;
        };
        self.stretch.first_s.get_or_insert(newest.time_s);
        let passed = self.stretch.knots().intervals_until(newest.time_s);
        let before = std::mem::replace(&mut self.stretch.complete, passed as usize);
        let complete = self.stretch.complete;
        if complete == before || complete < self.first_intervals() {
            return;
        }
        let Err(reason) = self.solve(self.lag) else {
            return;
        };
        // A longer motion may show more of the noise.
        if self.known.parameters.is_none() && complete < self.first_intervals() + SETTINGS.window {
            self.known.noise = None;
            self.found = Err(reason);
        } else {
            self.start_again(reason);
        }
    }

    /// Returns the splines of the intervals from which the motion is smoothed, all zero.
    fn segment(&self) -> Segment {
        let knots = self.stretch.knots();
        let intervals = self.stretch.smoothed()..self.stretch.complete;
        let mut bins = self.bins.newest().to_vec();
        values_at_times(&mut bins);
        bins.retain(|bin| {
            let passed = knots.intervals_until(bin.time_s);
            passed >= intervals.start as f64 && passed <= intervals.end as f64
        });
        Segment::with_knots(bins, self.bins.layout().coordinates(), knots, intervals)
    }

    /// Renews the estimate, and eliminates all intervals but the last `lag`.
    fn solve(&mut self, lag: usize) -> Result<(), MotionEstimate> {
        let start = self.start()?;
        let mut segments = vec![self.segment()];
        let (dynamics, known) = (&mut self.dynamics, &mut self.known);
        let Stretch {
            complete,
            eliminated,
            ..
        } = self.stretch;
        let noise = Noise::smoothed(&mut segments, dynamics, &start)?;
        let (noise, intervals) = known.mean_noise(noise, complete);
        let bins = *intervals * SETTINGS.bins_of_interval as usize;
        let weights = noise.weights(dynamics.layout(), bins)?;
        let earlier = eliminated - self.stretch.smoothed();
        let segments = segments.into_iter();
        let segments = segments.map(|segment| segment.without_first(earlier));
        let past = known.past.clone();
        let mut problem = Problem::linearised(segments.collect(), dynamics, weights, past, &start)?;
        let pass = problem.pass().ok_or(MotionEstimate::TooFew)?;
        let of_windows = self.online.covariance();
        let is_better =
            |covariance: &Matrix| of_windows.is_none_or(|other| is_smaller(covariance, &other));
        if known.parameters.is_none() && !is_better(&pass.inverse) {
            return Err(MotionEstimate::Exact);
        }
        let pass = problem.converge(pass).ok_or(MotionEstimate::Unexplained)?;
        let found = problem.estimate(&pass, known.left.clone());
        let explained = |found: &Estimate| found.residual_ratio <= SETTINGS.explained;
        let found = found.filter(explained).ok_or(MotionEstimate::Unexplained)?;
        known.parameters = Some(found.parameters);
        let count = (complete - eliminated).saturating_sub(lag);
        let past = problem.eliminate(count, &pass, &mut known.left);
        known.past = past.ok_or(MotionEstimate::TooFew)?;
        self.stretch.eliminated += count;
        // The value at a bin depends on the one before.
        let kept = self.stretch.smoothed() as f64 - 1.0;
        let knots = self.stretch.knots();
        self.bins.forget(knots.first_s + kept / knots.rate_hz);
        self.found = match is_better(&found.covariance) {
            true => Ok(self.reported(&found)),
            false => Err(MotionEstimate::Exact),
        };
        Ok(())
    }

    /// Returns parameters of the whole load that are near to the true ones.
    fn start(&self) -> Result<Parameters, MotionEstimate> {
        let estimate = self.online.estimate();
        if estimate
            .observability
            .contains(&Observability::Unobservable)
        {
            return Err(MotionEstimate::Smoothed);
        }
        let whole = InertialParameters::from(estimate.composite.unwrap_or(estimate.body));
        Ok(self.known.parameters.unwrap_or(*whole.as_vector()))
    }

    /// Returns what a user reads of an estimate.
    fn reported(&self, found: &Estimate) -> PayloadEstimate {
        let online = self.online.estimate();
        let linear = |body| *InertialParameters::from(body).as_vector();
        let gripper = online
            .composite
            .map(|whole| linear(whole) - linear(online.body));
        let gripper = gripper.unwrap_or_default();
        let scales = found.of_white_noise.diagonal().map(f64::sqrt);
        let payload = found.parameters - gripper;
        let consistent = nearest_consistent(payload, &found.metric, &scales, None);
        let posterior = Posterior {
            parameters: consistent.parameters,
            covariance: widened(&found.covariance, consistent.widening, None),
            null_space: &NullSpace::new(scales, std::iter::empty()),
            factors: [1.0; 10],
        };
        let report = posterior.report(&self.frame, &PriorKnowledge::default());
        let whole = InertialParameters::from_vector(consistent.parameters + gripper);
        PayloadEstimate {
            composite: online.composite.and(whole.mass_properties()),
            windows: online.windows,
            payload_changes: online.payload_changes,
            since_s: online.since_s,
            rejected: online.rejected,
            gaps: online.gaps,
            ..report.estimate
        }
    }
}
