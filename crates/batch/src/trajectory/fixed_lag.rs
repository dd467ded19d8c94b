//! Fixed-lag smoothing: splines that are older than the lag are marginalised out.

use nalgebra::{SMatrix, SVector};
use tactid_dynamics::InertialParameters;
use tactid_identify::Identifier;
use tactid_identify::equations::{Model, PushOutcome, Sample};

use super::bins::{SampleBins, has_accelerations};
use super::choice::is_smaller;
use super::dynamics::Dynamics;
use super::estimate::{Estimate, Problem, Residuals};
use super::marginal_prior::MarginalPrior;
use super::noise::Noise;
use super::rows::Weights;
use super::segment::{Knots, Segment};
use super::{MotionEstimate, SETTINGS};

type Parameters = SVector<f64, 10>;
type Matrix = SMatrix<f64, 10, 10>;

/// Smooths the motion within a lag together with the parameters of the whole load.
#[derive(Clone, Debug)]
pub(super) struct FixedLagSmoother {
    model: Model,
    bins: SampleBins,
    /// Number of intervals between knots that may still change.
    lag: usize,
    stretch: Stretch,
    known: Known,
    /// Which accelerations of the base the samples have; `None` before the first.
    accelerations: Option<[bool; 2]>,
    /// Time since which the online identifier uses samples, s.
    since_s: f64,
    found: Result<Estimate, MotionEstimate>,
    /// Time until which samples are in the last estimate, s.
    until_s: f64,
}

/// The intervals between knots since the last gap.
#[derive(Clone, Debug, Default)]
struct Stretch {
    /// Time of the first knot, s; `None` before the first bin.
    first_s: Option<f64>,
    /// Number of intervals of which all samples are there.
    complete: usize,
    /// Number of intervals that were marginalised out.
    marginalised: usize,
}

impl Stretch {
    fn knots(&self) -> Knots {
        Knots {
            first_s: self.first_s.unwrap_or_default(),
            rate_hz: SETTINGS.knots_hz,
        }
    }
}

/// What is known of the present payload.
#[derive(Clone, Debug)]
struct Known {
    prior: MarginalPrior,
    /// Residuals of what was marginalised out.
    residuals: Residuals,
    /// Mean noise of the channels, and the number of intervals from which it is.
    noise: Option<(Noise, usize)>,
    /// Parameters of the whole load.
    parameters: Option<Parameters>,
}

impl Known {
    fn nothing(coordinates: usize) -> Self {
        Self {
            prior: MarginalPrior::new(coordinates),
            residuals: Residuals::default(),
            noise: None,
            parameters: None,
        }
    }
}

impl FixedLagSmoother {
    /// Creates the smoother of a model whose samples are in such bins.
    pub(super) fn new(model: Model, bins: SampleBins, lag_s: f64) -> Self {
        Self {
            model,
            lag: (lag_s * SETTINGS.knots_hz).ceil() as usize,
            stretch: Stretch::default(),
            known: Known::nothing(bins.layout().coordinates()),
            accelerations: None,
            since_s: f64::NEG_INFINITY,
            found: Err(MotionEstimate::TooFew),
            until_s: f64::NEG_INFINITY,
            bins,
        }
    }

    /// The estimate of the whole load, or why there is none.
    pub(super) fn found(&self) -> Result<&Estimate, MotionEstimate> {
        self.found.as_ref().map_err(|reason| *reason)
    }

    /// Time until which samples are in the last estimate, s; minus infinity before the first.
    pub(super) fn until_s(&self) -> f64 {
        self.until_s
    }

    /// Adds a sample with the outcome that the online identifier returned for it.
    pub(super) fn push(&mut self, online: &Identifier, sample: &Sample<'_>, outcome: PushOutcome) {
        if outcome == PushOutcome::Rejected {
            return;
        }
        let since_s = online.estimate().since_s;
        if since_s != std::mem::replace(&mut self.since_s, since_s) {
            self.restart(MotionEstimate::TooFew);
        }
        if outcome == PushOutcome::Started {
            self.end_stretch(online);
        }
        if sample.joint_velocity.len() != self.bins.layout().joints {
            self.fail(online, MotionEstimate::NoVelocities);
            return;
        }
        let accelerations = has_accelerations(sample);
        let before = self.accelerations.replace(accelerations);
        if before.is_some_and(|before| before != accelerations) {
            self.restart(MotionEstimate::Smoothed);
        }
        let before = self.bins.newest().len();
        self.bins.push(sample, false);
        if self.bins.newest().len() > before {
            self.add_bin(online);
        }
    }

    /// Ends the open bin.
    pub(super) fn finish(&mut self, online: &Identifier) {
        self.bins.finish();
        self.add_bin(online);
    }

    /// Forgets what is known of the payload.
    fn restart(&mut self, reason: MotionEstimate) {
        self.known = Known::nothing(self.bins.layout().coordinates());
        self.found = Err(reason);
        self.clear();
    }

    /// Lets a new stretch begin with the next sample.
    fn clear(&mut self) {
        self.bins.clear();
        self.stretch = Stretch::default();
    }

    /// Marginalises out all splines: a gap follows.
    fn end_stretch(&mut self, online: &Identifier) {
        let reason = self.renew(online, 0).err();
        self.fail(online, reason.unwrap_or(MotionEstimate::TooFew));
    }

    /// Ends a stretch that cannot be continued. What is known of the payload stays, unless residuals
    /// contradict it.
    fn fail(&mut self, online: &Identifier, reason: MotionEstimate) {
        let is_contradicted = matches!(reason, MotionEstimate::Unexplained | MotionEstimate::Exact);
        let known = &mut self.known;
        let has_splines = self.stretch.marginalised > 0;
        if has_splines {
            known.residuals.end_stretch(known.prior.coefficients());
        }
        if is_contradicted || has_splines && known.prior.end_stretch().is_none() {
            self.restart(reason);
            return;
        }
        // The online identifier may have become better in the meantime.
        if !matches!(&self.found, Ok(found) if is_better(&found.covariance, online)) {
            self.found = Err(reason);
        }
        self.clear();
    }

    /// Renews the estimate where the last bin completes an interval.
    fn add_bin(&mut self, online: &Identifier) {
        let Some(newest) = self.bins.newest().last() else {
            return;
        };
        self.stretch.first_s.get_or_insert(newest.time_s);
        let passed = self.stretch.knots().intervals_until(newest.time_s) as usize;
        if passed == std::mem::replace(&mut self.stretch.complete, passed) {
            return;
        }
        if let Err(reason) = self.renew(online, self.lag) {
            self.fail(online, reason);
        }
    }

    /// Renews the estimate from all complete intervals, and marginalises out all but the last `lag`,
    /// unless that has to wait for more samples.
    fn renew(&mut self, online: &Identifier, lag: usize) -> Result<(), MotionEstimate> {
        if self.stretch.complete < SETTINGS.first_intervals.max(lag + 1) {
            return Ok(());
        }
        let segment = self.segment();
        match self.start(&segment, online) {
            Ok(start) => self.solve(segment, &start, online, lag),
            Err(_) if self.bins.newest().len() < SETTINGS.window => Ok(()),
            Err(reason) => Err(reason),
        }
    }

    /// First interval of those from which the motion is smoothed.
    fn first_smoothed(&self) -> usize {
        let bins = self.bins.newest();
        let first = bins.len().saturating_sub(SETTINGS.window);
        let passed = bins
            .get(first)
            .map_or(0.0, |bin| self.stretch.knots().intervals_until(bin.time_s));
        self.stretch.marginalised.min(passed as usize)
    }

    /// Returns the splines of the intervals from which the motion is smoothed, all zero.
    fn segment(&self) -> Segment {
        let knots = self.stretch.knots();
        let intervals = self.first_smoothed()..self.stretch.complete;
        let mut bins = self.bins.newest().to_vec();
        bins.retain(|bin| {
            let passed = knots.intervals_until(bin.time_s);
            passed >= intervals.start as f64 && passed <= intervals.end as f64
        });
        Segment::with_knots(bins, self.bins.layout().coordinates(), knots, intervals)
    }

    /// Returns parameters of the whole load that are near to the true ones.
    fn start(&self, segment: &Segment, online: &Identifier) -> Result<Parameters, MotionEstimate> {
        if segment.freedom() < SETTINGS.freedom_of_window {
            return Err(MotionEstimate::TooFew);
        }
        let of_windows = || {
            let estimate = online.estimate();
            let unobservable = estimate.unobservable().next().is_some();
            let payload = InertialParameters::from(estimate.body);
            let whole = *payload.as_vector() + online.known_bodies().parameters;
            (!unobservable).then_some(whole)
        };
        let known = self.known.parameters.or_else(of_windows);
        known.ok_or(MotionEstimate::Smoothed)
    }

    /// Smooths the motion of a segment alone, and returns it with the weights of its rows.
    fn smoothed(
        &mut self,
        segment: Segment,
        dynamics: &mut Dynamics,
        start: &Parameters,
    ) -> Result<(Segment, Weights), MotionEstimate> {
        let (complete, bins) = (self.stretch.complete, segment.bins.len());
        let bins_of_interval = bins as f64 / (complete - self.first_smoothed()) as f64;
        let mut segments = vec![segment];
        let of_last = Noise::smoothed(&mut segments, dynamics, start)?;
        // The splines must follow the motion of this segment, and with it that of all before.
        of_last.weights(dynamics.layout(), bins)?;
        let (noise, intervals) = self
            .known
            .noise
            .get_or_insert_with(|| (of_last.clone(), complete - 1));
        *intervals = (*intervals + 1).min(SETTINGS.remembered);
        noise.average(&of_last, (*intervals as f64).recip());
        let bins = *intervals as f64 * bins_of_interval;
        let weights = noise.weights(dynamics.layout(), bins as usize)?;
        let segment = segments.pop().ok_or(MotionEstimate::TooFew)?;
        Ok((segment, weights))
    }

    /// Renews the estimate, given near parameters.
    fn solve(
        &mut self,
        segment: Segment,
        start: &Parameters,
        online: &Identifier,
        lag: usize,
    ) -> Result<(), MotionEstimate> {
        let mut dynamics = Dynamics::new(self.model.clone(), self.bins.layout());
        let earlier = self.stretch.marginalised - self.first_smoothed();
        let (segment, weights) = self.smoothed(segment, &mut dynamics, start)?;
        let segments = vec![segment.without_first(earlier)];
        let prior = self.known.prior.clone();
        let mut problem = Problem::linearised(segments, &mut dynamics, weights, prior, start)?;
        let pass = problem.pass().ok_or(MotionEstimate::TooFew)?;
        // Splines leave more than the noise where that is next to nothing.
        let unexplained = match is_better(&pass.inverse, online) {
            true => MotionEstimate::Unexplained,
            false => MotionEstimate::Exact,
        };
        let pass = problem.converge(pass).ok_or(unexplained)?;
        let found = problem.estimate(&pass, self.known.residuals.clone());
        let found = found.filter(Estimate::is_explained).ok_or(unexplained)?;
        let complete = self.stretch.complete;
        let count = (complete - self.stretch.marginalised).saturating_sub(lag);
        let prior = problem.marginalise(count, &pass, &mut self.known.residuals);
        self.known.prior = prior.ok_or(MotionEstimate::TooFew)?;
        self.known.parameters = Some(found.parameters);
        self.stretch.marginalised += count;
        let knots = self.stretch.knots();
        self.until_s = knots.first_s + complete as f64 / knots.rate_hz;
        // One interval more than is used.
        let kept = self.first_smoothed() as f64 - 1.0;
        self.bins.forget(knots.first_s + kept / knots.rate_hz);
        self.found = match is_better(&found.covariance, online) {
            true => Ok(found),
            false => Err(MotionEstimate::Exact),
        };
        Ok(())
    }
}

/// Returns whether this covariance of the whole load makes the payload more precise than the online
/// identifier has it.
fn is_better(covariance: &Matrix, online: &Identifier) -> bool {
    let of_payload = covariance + online.known_bodies().covariance;
    let of_windows = online.covariance();
    of_windows.is_none_or(|other| is_smaller(&of_payload, &other))
}
