//! Samples as an identifier needs them: wrenches on the payload, at the times of the motion.

use tactid_dynamics::Wrench;

use crate::equations::clock_watch::{ClockWatch, Order};
use crate::equations::{ActsOn, BaseState, InterpolationAt, Sample, interpolation};

/// A copy of a sample.
#[derive(Clone, Debug)]
struct OwnedSample {
    time_s: f64,
    base: BaseState,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
    wrenches: Vec<Wrench>,
}

impl OwnedSample {
    fn new(joints: usize, sensors: usize) -> Self {
        Self {
            time_s: f64::NEG_INFINITY,
            base: BaseState::fixed(),
            position: Vec::with_capacity(joints),
            velocity: Vec::with_capacity(joints),
            effort: Vec::with_capacity(joints),
            wrenches: Vec::with_capacity(sensors),
        }
    }

    /// Copies a sample whose slices have the right lengths, without allocation.
    fn set(&mut self, sample: &Sample<'_>) {
        (self.time_s, self.base) = (sample.time_s, sample.base);
        for (own, given) in [
            (&mut self.position, sample.joint_position),
            (&mut self.velocity, sample.joint_velocity),
            (&mut self.effort, sample.joint_effort),
        ] {
            own.clear();
            own.extend_from_slice(given);
        }
        self.wrenches.clear();
        self.wrenches.extend_from_slice(sample.wrenches);
    }
}

/// Turns measured wrenches into those on the payload at the times of the motion, in a fixed amount
/// of memory.
#[derive(Clone, Debug)]
pub(crate) struct Inputs {
    /// Sign of the measured wrenches, relative to that of those on the payload.
    sign: f64,
    delay_s: f64,
    max_gap_s: f64,
    /// The last samples, in a ring; one where there is no delay.
    samples: Vec<OwnedSample>,
    /// Place of the oldest sample, and number of samples.
    oldest: usize,
    count: usize,
    /// Number of samples from the oldest one to the next whose motion is used.
    next: usize,
    /// Time of the newest sample, s.
    newest_s: f64,
    clock: ClockWatch,
    /// Wrenches of the sample that was taken last.
    wrenches: Vec<Wrench>,
}

impl Inputs {
    /// Creates the inputs of a robot with so many joints and sensors. `delay_s` is subtracted from
    /// the times of the wrenches.
    pub(crate) fn new(
        [joints, sensors]: [usize; 2],
        acts_on: ActsOn,
        delay_s: f64,
        max_gap_s: f64,
    ) -> Self {
        let capacity = match delay_s == 0.0 {
            true => 1,
            false => (delay_s.abs() * 4000.0) as usize + 8,
        };
        Self {
            sign: acts_on.sign(),
            delay_s,
            max_gap_s,
            samples: vec![OwnedSample::new(joints, sensors); capacity],
            oldest: 0,
            count: 0,
            next: 0,
            newest_s: f64::NEG_INFINITY,
            clock: ClockWatch::default(),
            wrenches: vec![Wrench::zero(); sensors],
        }
    }

    /// Whether samples are used as they are.
    pub(crate) fn are_direct(&self) -> bool {
        self.delay_s == 0.0 && self.sign == 1.0
    }

    /// Time of the newest sample, s.
    pub(crate) fn newest_s(&self) -> f64 {
        self.newest_s
    }

    /// Adds a sample, unless it is rejected, and returns what it is to the one before.
    pub(crate) fn push(&mut self, sample: &Sample<'_>) -> Order {
        let order = self.clock.observe(sample, self.newest_s);
        match order {
            Order::Rejected => return order,
            Order::Follows => {}
            Order::Interrupted => (self.count, self.next) = (0, 0),
        }
        self.newest_s = sample.time_s;
        if self.count == self.samples.len() {
            self.discard_oldest();
        }
        let place = (self.oldest + self.count) % self.samples.len();
        self.samples[place].set(sample);
        self.count += 1;
        order
    }

    /// Returns the next sample whose wrenches are known at the time of its motion; `None` until
    /// later samples have come. A sample in a gap of the wrenches is left out.
    pub(crate) fn pop(&mut self) -> Option<Sample<'_>> {
        while self.next < self.count {
            let time_s = self.at(self.next).time_s;
            let time_of = |k: usize| self.at(k).time_s - self.delay_s;
            let found = match self.delay_s == 0.0 {
                true => InterpolationAt::Sample(self.next),
                false => interpolation(self.count, time_of, time_s, self.max_gap_s, f64::INFINITY),
            };
            if found == InterpolationAt::NotYet {
                return None;
            }
            self.set_wrenches(found);
            self.next += 1;
            if found != InterpolationAt::Never {
                let place = (self.oldest + self.next - 1) % self.samples.len();
                // The two samples before the time of the wrenches are needed for the next one, too.
                while self.next > 1 && self.is_past(2, time_s) {
                    self.discard_oldest();
                }
                return Some(self.sample(place));
            }
        }
        None
    }

    fn sample(&self, place: usize) -> Sample<'_> {
        let sample = &self.samples[place];
        Sample {
            time_s: sample.time_s,
            base: sample.base,
            joint_position: &sample.position,
            joint_velocity: &sample.velocity,
            joint_effort: &sample.effort,
            wrenches: &self.wrenches,
        }
    }

    /// Whether the wrench of a sample is not later than a time.
    fn is_past(&self, index: usize, time_s: f64) -> bool {
        index < self.count && self.at(index).time_s - self.delay_s <= time_s
    }

    fn discard_oldest(&mut self) {
        self.oldest = (self.oldest + 1) % self.samples.len();
        (self.count, self.next) = (self.count - 1, self.next.saturating_sub(1));
    }

    /// The sample that came so many after the oldest one.
    fn at(&self, index: usize) -> &OwnedSample {
        &self.samples[(self.oldest + index) % self.samples.len()]
    }

    fn set_wrenches(&mut self, found: InterpolationAt) {
        let (first, count, weights) = match found {
            InterpolationAt::Sample(index) => (index, 1, [1.0, 0.0, 0.0, 0.0]),
            InterpolationAt::Between {
                first,
                count,
                weights,
            } => (first, count, weights),
            InterpolationAt::NotYet | InterpolationAt::Never => return,
        };
        for sensor in 0..self.wrenches.len() {
            let mut sum = Wrench::zero();
            for (k, weight) in weights.iter().enumerate().take(count) {
                let wrench = self.at(first + k).wrenches[sensor];
                sum.force += wrench.force * *weight;
                sum.moment += wrench.moment * *weight;
            }
            (sum.force, sum.moment) = (sum.force * self.sign, sum.moment * self.sign);
            self.wrenches[sensor] = sum;
        }
    }
}
