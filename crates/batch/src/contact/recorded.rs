//! The wrench of the contact at each sample of a recording, without delay.

use std::collections::VecDeque;
use std::f64::consts::PI;

use nalgebra::Vector6;
use tactid_dynamics::{Manipulator, Wrench};
use tactid_identify::contact::WrenchFrame;
use tactid_identify::contact::{ContactState, Entries, LoadAndContact, wrench_of};
use tactid_identify::equations::window::length_s;
use tactid_identify::equations::{EquationSettings, Model, MotionStep, MotionStream, Sample};
use tactid_identify::{ActsOn, IdentifyError, Method};

use super::load::{Load, LoadEstimate};

/// The wrenches at one sample of a recording.
#[derive(Clone, Copy, Debug)]
pub struct ContactSample {
    /// Time of the sample, s.
    pub time_s: f64,
    /// The wrenches; `None` for the first and last samples of a stretch without gaps, which have no
    /// derivatives.
    pub wrenches: Option<RecordedWrenches>,
}

/// The measured wrench through the filter, and what it consists of besides the offset.
#[derive(Clone, Copy, Debug)]
pub struct RecordedWrenches {
    /// Measured wrench, N and N m.
    pub measured: Wrench,
    /// Wrenches of load and contact. Their time is that of the sample.
    pub parts: LoadAndContact,
}

/// Computes the wrench of the load and that of the contact at each sample of a recording.
///
/// Measured wrench and motion pass the same filter, in which a load cancels: the mean with the
/// weight of the equations' windows, cos⁴ over 0.926 / `cutoff_hz` seconds, about each sample. It
/// is symmetric, so that nothing is delayed; about a sample near the begin or end of a stretch, the
/// mean is over the part of the window that there is. Memory is that of one window.
#[derive(Clone, Debug)]
pub struct RecordedContact {
    model: Model,
    motion: MotionStream,
    load: Load,
    frame: WrenchFrame,
    sign: f64,
    half_window_s: f64,
    /// Samples of the stretch that a mean may still need.
    samples: VecDeque<Instant>,
    /// Place of the first sample without its mean.
    next: usize,
    noise: MeanNoise,
}

/// Variance of the noise in the means so far, relative to that of white noise with the
/// size of the load's: that of derived accelerations grows with the frequency.
#[derive(Clone, Debug)]
struct MeanNoise {
    variances: Vector6<f64>,
    /// Time that they are the mean of, s.
    total_s: f64,
}

impl MeanNoise {
    /// Adds noise with its variance relative to that of white noise, of a sample that stands for a
    /// time.
    fn add(&mut self, variances: &Vector6<f64>, step_s: f64) {
        self.total_s += step_s;
        self.variances += (variances - self.variances) * (step_s / self.total_s);
    }

    /// Factor on the standard deviations of white noise; the load has shown that it is no less.
    fn excess(&self) -> Vector6<f64> {
        self.variances.map(|variance| variance.max(1.0).sqrt())
    }
}

/// A sample, with its entries where it has derivatives.
#[derive(Clone, Copy, Debug)]
struct Instant {
    time_s: f64,
    /// Whether an even number of samples came before it in the stretch: accelerations of even and
    /// of odd ones are derived from different samples.
    is_even: bool,
    entries: Option<Entries>,
}

impl RecordedContact {
    /// Creates the computation for a robot with the payload in its link `tool` and wrenches in the
    /// links `sensors`.
    ///
    /// Wrenches are returned in a frame with the sign of wrenches that act on the body `acts_on`;
    /// samples have those on the payload. For a load that was estimated from another recording,
    /// see [`LoadEstimate::of_another_recording`].
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`](tactid_identify::EquationStream::new).
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
        load: &LoadEstimate,
        frame: WrenchFrame,
        acts_on: ActsOn,
    ) -> Result<Self, IdentifyError> {
        let settings = EquationSettings {
            method: Method::Tactile,
            ..settings.clone()
        };
        let model = Model::new(robot, tool, sensors, &settings)?;
        let (cutoff_hz, max_gap_s) = (settings.cutoff_hz, settings.max_gap_s);
        Ok(Self {
            motion: MotionStream::new(robot, sensors.len(), cutoff_hz, max_gap_s),
            load: Load::new(load),
            frame,
            sign: acts_on.sign(),
            half_window_s: 0.5 * length_s(cutoff_hz),
            samples: VecDeque::new(),
            next: 0,
            noise: MeanNoise {
                variances: Vector6::repeat(1.0),
                total_s: 0.0,
            },
            model,
        })
    }

    /// Adds a sample, and calls `take` with each of the earlier samples whose mean is complete, in
    /// their order. A sample that is [rejected](tactid_identify::PushOutcome::Rejected) is left out.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::push`](tactid_identify::EquationStream::push).
    pub fn push(
        &mut self,
        sample: &Sample<'_>,
        take: &mut impl FnMut(ContactSample),
    ) -> Result<(), IdentifyError> {
        self.model.check_lengths(sample)?;
        let added = Instant {
            time_s: sample.time_s,
            is_even: self.samples.back().is_none_or(|last| !last.is_even),
            entries: None,
        };
        match self.motion.push(sample) {
            MotionStep::Rejected => {}
            MotionStep::Started => {
                self.finish(take);
                self.samples.push_back(added);
            }
            MotionStep::Waiting => self.samples.push_back(added),
            MotionStep::Instant(instant) => {
                self.model.entries(instant)?;
                let time_s = instant.time_s;
                self.samples.push_back(added);
                self.set_entries(time_s);
                self.take_complete(time_s, take);
            }
        }
        Ok(())
    }

    /// Ends the stretch: calls `take` with all samples that are left.
    pub fn finish(&mut self, take: &mut impl FnMut(ContactSample)) {
        self.take_complete(f64::INFINITY, take);
        self.samples.clear();
        self.next = 0;
    }

    /// Sets the entries of the sample at a time to those of the model.
    fn set_entries(&mut self, time_s: f64) {
        let place = self.samples.partition_point(|each| each.time_s < time_s);
        let before = place.checked_sub(1).and_then(|k| self.samples[k].entries);
        let entries = Entries::of_instant(&self.model, &before.unwrap_or(Entries::zeros()));
        if let Some(sample) = self.samples.get_mut(place) {
            sample.entries = entries;
        }
    }

    /// Calls `take` with the samples whose window ends at a time at the latest.
    fn take_complete(&mut self, time_s: f64, take: &mut impl FnMut(ContactSample)) {
        while let Some(sample) = self.samples.get(self.next) {
            if sample.time_s + self.half_window_s > time_s {
                break;
            }
            let Instant {
                time_s, entries, ..
            } = *sample;
            take(ContactSample {
                time_s,
                wrenches: entries.and_then(|_| self.wrenches(time_s)),
            });
            self.next += 1;
            // The sample before the window gives the first one in it its weight.
            let begin_s = self
                .samples
                .get(self.next)
                .map(|next| next.time_s - self.half_window_s);
            let is_left = |second: &Instant| begin_s.is_some_and(|begin_s| second.time_s < begin_s);
            while self.samples.get(1).is_some_and(is_left) {
                self.samples.pop_front();
                self.next -= 1;
            }
        }
    }

    /// Returns the wrenches about a time.
    fn wrenches(&mut self, middle_s: f64) -> Option<RecordedWrenches> {
        // Of the odd and of the even samples.
        let (mut sums, mut totals, mut squares) = ([Entries::zeros(); 2], [0.0; 2], 0.0);
        for (k, sample) in self.samples.iter().enumerate() {
            let since_s = sample.time_s - middle_s;
            let Some(entries) = sample
                .entries
                .filter(|_| since_s.abs() < self.half_window_s)
            else {
                continue;
            };
            let weight = (0.5 * PI * since_s / self.half_window_s).cos().powi(4) * self.step_s(k);
            let half = usize::from(sample.is_even);
            sums[half].0 += entries.0 * weight;
            totals[half] += weight;
            squares += weight * weight;
        }
        let total = totals[0] + totals[1];
        if total <= 0.0 {
            return None;
        }
        let noise_power = squares / (total * total);
        if totals.iter().all(|half| *half > 0.0) {
            let halves: [_; 2] = std::array::from_fn(|k| sums[k].0 / totals[k]);
            let noise = self.load.noise_in(&Entries((halves[0] - halves[1]) * 0.5));
            let white = self.load.noise_variances() * noise_power;
            let relative = noise.zip_map(&white, |noise, white| noise * noise / white);
            self.noise.add(&relative, self.step_s(self.next));
        }
        let mean = Entries((sums[0].0 + sums[1].0) / total);
        let projection = self.model.offset_frame().projection();
        let mut parts = self.load.parts(&mean, noise_power, &self.noise.excess());
        if let Some(measured) = &projection {
            parts.contact = measured * parts.contact;
        }
        let map = mean.map_to(&self.frame);
        let parts = parts.mapped(&map, projection.as_ref(), middle_s, ContactState::Settled);
        Some(RecordedWrenches {
            measured: wrench_of(&(map * mean.measured() * self.sign)),
            parts: parts.with_sign(self.sign),
        })
    }

    /// Returns the time that a sample stands for, s: from the middle to its neighbour before to
    /// that to the one after it.
    fn step_s(&self, place: usize) -> f64 {
        let last = self.samples.len() - 1;
        let (before, after) = (place.saturating_sub(1), (place + 1).min(last));
        let passed_s = self.samples[after].time_s - self.samples[before].time_s;
        passed_s / (after - before).max(1) as f64
    }
}
