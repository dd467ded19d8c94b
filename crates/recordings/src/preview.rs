//! Preview: the beginning of a recording, from which its filter and its delay are chosen.

use tactid_batch::Delay;
use tactid_batch::preview::{
    CoarseDelay, LONGEST_DELAY_S, coarse_delay, fitted_delay, motion_noise_power, motion_power,
    residual_size, target_size, without_unknowns,
};
use tactid_identify::equations::{Equation, MultiCutoffStream, window};
use tactid_identify::{Channels, EquationSettings};

use crate::alignment::{Aligned, Aligner, Event, Measured, Streams};
use crate::defaults::Options;
use crate::recording::Sources;
use crate::{Finding, RecordingError};

/// Number of samples of the slowest stream in the shortest window that is tried.
const FEWEST_SAMPLES: f64 = 16.0;
/// Length of the longest window that is tried, s.
const LONGEST_WINDOW_S: f64 = 1.0;
/// Fewest windows from which a cutoff is judged.
const FEWEST_WINDOWS: usize = 4;
/// Largest fraction of the motion's power that may be white noise.
const QUIET: f64 = 1e-4;
/// Number of samples in a window from which polynomials are fitted to every second sample. In
/// shorter windows neighbouring instants share samples, their differences do not show the noise,
/// and its bias is not corrected.
const FEWEST_INDEPENDENT: f64 = 36.0;
/// Largest fraction of the motion's power that may be noise in windows that do not show it.
/// Measured with stamps that jitter by a tenth of the sample period: a fraction of 1e-5 made a
/// small moment of inertia 20 % too small.
const QUIET_UNSEEN: f64 = 1e-6;
/// Power of the cutoff with which the variance of white noise grows in the mean of a first
/// derivative; of a second one it grows with two more.
const FIRST_DERIVATIVE: i32 = 3;
/// Smallest fraction of the motion's power that the filter keeps.
const KEPT: f64 = 0.8;

/// A delay is corrected from so many standard deviations on, if it is longer than
/// [`SHORTEST_DELAY_S`].
const SIGNIFICANT: f64 = 6.0;
/// Shorter delays are not worth an interpolation, s.
const SHORTEST_DELAY_S: f64 = 1e-4;
/// A delay below this fraction of [`SHORTEST_DELAY_S`] is not refined further: the error of a fit
/// is far smaller than what remains to that limit.
const CLEARLY_SHORT: f64 = 0.5;
/// Largest number of fits of the delay: each is linear in what the one before has left.
const DELAY_FITS: usize = 4;

/// A delay of two windows or more that leaves more than this fraction of the residual is doubtful:
/// wrenches that belong to the motion fit it far better at the right time.
const HARDLY_BETTER: f64 = 0.7;

/// Derived accelerations replace measured ones whose residual, or whose power, they reduce to less
/// than this fraction.
const CLEARLY_LESS: f64 = 0.9;

/// The beginning of a recording.
#[derive(Clone, Copy)]
pub(crate) struct Preview<'a> {
    pub(crate) sources: &'a Sources,
    pub(crate) options: &'a Options,
    pub(crate) events: &'a [Event],
}

/// What the beginning of a recording says about the delay of the wrenches' stamps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum DelayEstimate {
    /// The data do not determine it.
    Unknown,
    /// The delay.
    Found(Delay),
    /// A long delay fits better, but not as a true one does.
    Doubtful(CoarseDelay),
}

impl DelayEstimate {
    /// Returns the delay, if the data determine it.
    pub(crate) fn found(self) -> Option<Delay> {
        match self {
            Self::Found(delay) => Some(delay),
            Self::Unknown | Self::Doubtful(_) => None,
        }
    }

    /// Reports a doubtful delay.
    pub(crate) fn doubt(self) -> Option<Finding> {
        match self {
            Self::Doubtful(coarse) => Some(Finding::DelayDoubtful {
                delay_s: coarse.delay_s,
                residual_ratio: coarse.residual_ratio,
                is_at_end: coarse.is_at_end,
            }),
            Self::Unknown | Self::Found(_) => None,
        }
    }
}

/// The equations of the beginning for one cutoff, without a delay.
pub(crate) struct Beginning {
    pub(crate) cutoff_hz: f64,
    equations: Vec<Equation>,
    channels: Channels,
}

impl Beginning {
    /// Returns the size of the residuals and the power of the motion; `None` where there is too
    /// little.
    fn residual_and_power(&self) -> Option<(f64, f64)> {
        let residual = residual_size(&self.equations, &self.channels)?;
        Some((residual, motion_power(&self.equations)))
    }
}

/// A cutoff with the power of the motion that it keeps, and the white noise in that power, 1/s⁴.
struct Candidate {
    beginning: Beginning,
    power: f64,
    noise: f64,
    /// Whether the windows are long enough to show the noise.
    shows_noise: bool,
}

impl Preview<'_> {
    /// Chooses the highest cutoff that admits little of the motion's noise: motion that the filter
    /// removes costs information, noise that it admits costs a bias correction.
    ///
    /// White noise shows in the differences of neighbouring instants. Other noise shows only in
    /// that the power of the motion rises with the cutoff: no cutoff is chosen above the one where
    /// the power depends least on it. Where all admit noise, it is the lowest that keeps [`KEPT`]
    /// of that power. Short windows do not show their noise: it is extrapolated from the shortest
    /// that do and keep the motion.
    pub(crate) fn choose_cutoff(&self, streams: &Streams) -> Result<Beginning, RecordingError> {
        let mut candidates = self.candidates(streams)?;
        match self.chosen(&candidates) {
            Some(chosen) => Ok(candidates.swap_remove(chosen).beginning),
            None => self.at_cutoff(streams, EquationSettings::default().cutoff_hz),
        }
    }

    /// Returns the place of the cutoff that is chosen among the candidates, see
    /// [`choose_cutoff`](Self::choose_cutoff).
    fn chosen(&self, candidates: &[Candidate]) -> Option<usize> {
        let cutoff_hz = |candidate: &Candidate| candidate.beginning.cutoff_hz;
        let change = |pair: &[Candidate]| (pair[0].power - pair[1].power).abs() / pair[0].power;
        let flattest = candidates
            .windows(2)
            .enumerate()
            .filter(|(_, pair)| pair[0].power > 0.0)
            .min_by(|(_, a), (_, b)| change(a).total_cmp(&change(b)))
            .map_or(0, |(place, _)| place);
        let at_flattest = candidates.get(flattest)?;
        let keeps_motion = |candidate: &Candidate| candidate.power >= KEPT * at_flattest.power;
        let mut keeping = candidates
            .iter()
            .filter(|candidate| keeps_motion(candidate));
        let shown = keeping.find(|candidate| candidate.shows_noise);
        let is_quiet = |candidate: &Candidate| {
            let unseen = shown.filter(|_| !candidate.shows_noise);
            cutoff_hz(candidate) <= cutoff_hz(at_flattest)
                && candidate.noise <= QUIET * candidate.power
                && unseen.is_none_or(|shown| {
                    self.noise_at(cutoff_hz(candidate), shown) <= QUIET_UNSEEN * candidate.power
                })
        };
        let quiet = candidates.iter().position(is_quiet);
        let chosen = quiet.or_else(|| candidates.iter().rposition(keeps_motion));
        chosen.or(Some(flattest))
    }

    /// Returns the noise at a higher cutoff than that of a candidate that shows it, 1/s⁴.
    fn noise_at(&self, cutoff_hz: f64, shown: &Candidate) -> f64 {
        let has_no_velocity = |event: &Event| match &event.measured {
            Measured::Joints(values) => values.velocity.is_empty(),
            _ => false,
        };
        let is_second = self.events.iter().any(has_no_velocity);
        let exponent = FIRST_DERIVATIVE + if is_second { 2 } else { 0 };
        shown.noise * (cutoff_hz / shown.beginning.cutoff_hz).powi(exponent)
    }

    /// Tries windows of doubling lengths.
    fn candidates(&self, streams: &Streams) -> Result<Vec<Candidate>, RecordingError> {
        let shortest_s = (FEWEST_SAMPLES * self.options.period_s).min(LONGEST_WINDOW_S);
        let doubled = |length_s: &f64| Some(2.0 * length_s);
        let lengths_s: Vec<f64> = std::iter::successors(Some(shortest_s), doubled)
            .take_while(|length_s| *length_s <= LONGEST_WINDOW_S)
            .collect();
        let cutoffs_hz: Vec<f64> = lengths_s.iter().map(|s| window::cutoff_hz(*s)).collect();
        let (equations, channels) = self.equations(streams, 0.0, &cutoffs_hz)?;
        let tried = equations.into_iter().zip(lengths_s).zip(cutoffs_hz);
        let enough = tried.take_while(|((equations, _), _)| equations.len() >= FEWEST_WINDOWS);
        let candidate =
            |((equations, length_s), cutoff_hz): ((Vec<Equation>, f64), f64)| Candidate {
                power: motion_power(&equations),
                noise: motion_noise_power(&equations),
                shows_noise: length_s >= FEWEST_INDEPENDENT * self.options.period_s,
                beginning: Beginning {
                    cutoff_hz,
                    equations,
                    channels: channels.clone(),
                },
            };
        Ok(enough.map(candidate).collect())
    }

    /// Returns the beginning with a cutoff that is given.
    pub(crate) fn at_cutoff(
        &self,
        streams: &Streams,
        cutoff_hz: f64,
    ) -> Result<Beginning, RecordingError> {
        let (equations, channels) = self.equations_at(streams, 0.0, cutoff_hz)?;
        Ok(Beginning {
            cutoff_hz,
            equations,
            channels,
        })
    }

    /// Estimates the delay of the wrenches' stamps relative to the motion.
    pub(crate) fn delay(
        &self,
        streams: &Streams,
        beginning: Beginning,
    ) -> Result<DelayEstimate, RecordingError> {
        let Beginning {
            cutoff_hz,
            equations,
            channels,
        } = beginning;
        let equations = self.without_unknowns(equations, &channels);
        let channels = with_unknown_offset(channels);
        match coarse_delay(&equations, &channels, window::stride_s(cutoff_hz)) {
            None => Ok(DelayEstimate::Unknown),
            Some(coarse) if coarse.is_at_end => Ok(DelayEstimate::Doubtful(coarse)),
            Some(coarse) => {
                let is_far = coarse.delay_s.abs() > 1.5 * window::stride_s(cutoff_hz);
                let without = is_far.then(|| residual_size(&equations, &channels));
                let delay_s = coarse.delay_s;
                let found =
                    self.refined_delay(streams, cutoff_hz, delay_s, (equations, channels))?;
                match (found, without.flatten()) {
                    (DelayEstimate::Found(delay), Some(without)) => {
                        self.far_delay(streams, cutoff_hz, delay, without)
                    }
                    _ => Ok(found),
                }
            }
        }
    }

    /// Decides on a delay of several windows, given the size of the residual without it: other
    /// errors, too, leave less residual at some time by chance.
    fn far_delay(
        &self,
        streams: &Streams,
        cutoff_hz: f64,
        delay: Delay,
        without: f64,
    ) -> Result<DelayEstimate, RecordingError> {
        let (equations, channels) = self.equations_at(streams, delay.delay_s, cutoff_hz)?;
        let equations = self.without_unknowns(equations, &channels);
        let residual_ratio = match residual_size(&equations, &with_unknown_offset(channels)) {
            Some(with) if with < without => with / without,
            _ => return Ok(DelayEstimate::Unknown),
        };
        if residual_ratio < HARDLY_BETTER {
            return Ok(DelayEstimate::Found(delay));
        }
        Ok(DelayEstimate::Doubtful(CoarseDelay {
            delay_s: delay.delay_s,
            residual_ratio,
            is_at_end: false,
        }))
    }

    /// Refines a delay that is right to the length of a window. It stops where the delay is not
    /// worth correcting. The equations are those without a delay.
    fn refined_delay(
        &self,
        streams: &Streams,
        cutoff_hz: f64,
        mut delay_s: f64,
        (mut equations, channels): (Vec<Equation>, Channels),
    ) -> Result<DelayEstimate, RecordingError> {
        let mut found = DelayEstimate::Unknown;
        for _ in 0..DELAY_FITS {
            if delay_s != 0.0 {
                (equations, _) = self.equations_at(streams, delay_s, cutoff_hz)?;
                equations = self.without_unknowns(equations, &channels);
            }
            let Some(rest) = fitted_delay(&equations, &channels) else {
                return Ok(DelayEstimate::Unknown);
            };
            let sum_s = delay_s + rest.delay_s;
            if !rest.delay_s.is_finite() || sum_s.abs() > LONGEST_DELAY_S {
                return Ok(DelayEstimate::Unknown);
            }
            found = DelayEstimate::Found(Delay {
                delay_s: sum_s,
                std_dev_s: rest.std_dev_s,
            });
            let is_settled = rest.delay_s.abs() < 0.01 * SHORTEST_DELAY_S
                || rest.delay_s.abs() < 0.1 * rest.std_dev_s;
            if is_settled || sum_s.abs() < CLEARLY_SHORT * SHORTEST_DELAY_S {
                break;
            }
            delay_s = sum_s;
        }
        Ok(found)
    }

    /// Returns equations without what is unknown of the wrenches beside the payload, which would
    /// hide a delay.
    fn without_unknowns(&self, equations: Vec<Equation>, channels: &Channels) -> Vec<Equation> {
        let settings = &self.options.equations;
        let gravity = settings.gravity_for(self.sources.robot.base_kind());
        without_unknowns(equations, channels, &gravity, settings.unknowns)
    }

    /// Compares measured accelerations of the topic `topic` with those derived from the velocities.
    /// Returns a finding where the derived ones explain the wrenches better or have less noise.
    pub(crate) fn compare_accelerations(
        &self,
        streams: &Streams,
        topic: &str,
    ) -> Result<Option<Finding>, RecordingError> {
        let derived = Streams {
            acceleration: false,
            ..streams.clone()
        };
        let chosen = [self.choose_cutoff(streams)?, self.choose_cutoff(&derived)?];
        let cutoff_hz = f64::min(chosen[0].cutoff_hz, chosen[1].cutoff_hz);
        let [of_measured, of_derived] = chosen;
        let at_cutoff = |beginning: Beginning, streams: &Streams| {
            if beginning.cutoff_hz == cutoff_hz {
                Ok(beginning)
            } else {
                self.at_cutoff(streams, cutoff_hz)
            }
        };
        let measured = at_cutoff(of_measured, streams)?.residual_and_power();
        let derived = at_cutoff(of_derived, &derived)?.residual_and_power();
        let (Some(measured), Some(derived)) = (measured, derived) else {
            return Ok(None);
        };
        let explains_better = derived.0 < CLEARLY_LESS * measured.0;
        // The motion is the same in both: the one with less power has less noise.
        let is_quieter =
            derived.1 < CLEARLY_LESS * measured.1 && derived.0 * CLEARLY_LESS < measured.0;
        let finding = Finding::AccelerationNotUsed {
            topic: topic.to_owned(),
            explains_better,
            residual_ratio: derived.0 / measured.0,
            power_ratio: derived.1 / measured.1,
        };
        Ok((explains_better || is_quieter).then_some(finding))
    }

    /// Returns the sizes of the residuals and of the measurements for one delay and cutoff, with an
    /// offset of the wrenches among the unknowns; `None` where the equations are too few.
    pub(crate) fn residual_at(
        &self,
        streams: &Streams,
        delay_s: f64,
        cutoff_hz: f64,
    ) -> Result<Option<[f64; 2]>, RecordingError> {
        let (equations, channels) = self.equations_at(streams, delay_s, cutoff_hz)?;
        let channels = with_unknown_offset(channels);
        let residual = residual_size(&equations, &channels);
        Ok(residual.map(|residual| [residual, target_size(&equations)]))
    }

    /// Returns all equations of the beginning for one delay and cutoff, with their channels.
    fn equations_at(
        &self,
        streams: &Streams,
        delay_s: f64,
        cutoff_hz: f64,
    ) -> Result<(Vec<Equation>, Channels), RecordingError> {
        let (mut equations, channels) = self.equations(streams, delay_s, &[cutoff_hz])?;
        Ok((equations.pop().unwrap_or_default(), channels))
    }

    /// Returns all equations of the beginning for each cutoff, with their channels.
    fn equations(
        &self,
        streams: &Streams,
        delay_s: f64,
        cutoffs_hz: &[f64],
    ) -> Result<(Vec<Vec<Equation>>, Channels), RecordingError> {
        let (sources, options) = (self.sources, self.options);
        let sensors: Vec<&str> = sources.sensors.iter().map(String::as_str).collect();
        let settings = &options.equations;
        let (robot, tip) = (&sources.robot, &options.tip);
        let mut stream = MultiCutoffStream::new(robot, tip, &sensors, settings, cutoffs_hz)?;
        let mut aligner = Aligner::new(streams.clone(), robot, delay_s, settings.max_gap_s);
        let mut aligned = Aligned::empty();
        for event in self.events {
            aligner.push(event.clone());
            while aligner.next_into(&mut aligned) {
                stream.push(&aligned.sample())?;
            }
        }
        Ok(stream.finish())
    }
}

/// Returns channels with an unknown offset of the wrench, if they have one: what it leaves of a
/// model without it may fit better at another time.
fn with_unknown_offset(channels: Channels) -> Channels {
    let has_wrench = channels.begin_with_wrench();
    channels.with_offsets(has_wrench)
}

/// Returns whether a delay is worth correcting.
pub(crate) fn is_significant(delay: Delay) -> bool {
    delay.delay_s.abs() > SHORTEST_DELAY_S && delay.delay_s.abs() > SIGNIFICANT * delay.std_dev_s
}
