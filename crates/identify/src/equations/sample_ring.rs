//! The last samples without a gap, and which of them a polynomial is fitted to.

use std::f64::consts::TAU;

use super::differentiation::{MAX_NODES, MIN_NODES};
use super::instant::{Nodes, StoredSample};
use super::sample::Sample;

/// Number of stored samples: polynomials are fitted to every second one of them.
const STORED_SAMPLES: usize = 2 * MAX_NODES - 1;
/// Fewest stored samples from which an instant is computed.
const MIN_STORED: usize = 2 * MIN_NODES - 1;

/// Half width of the polynomials' support, in radians at the cutoff. The relative error of a
/// derivative is then below 4e-4 at the cutoff, and falls with the fourth power of frequency.
const HALF_WIDTH: f64 = 0.65;

/// The last samples of a stretch without gaps, in a ring.
#[derive(Clone, Debug)]
pub(crate) struct SampleRing {
    samples: [StoredSample; STORED_SAMPLES],
    /// Place of the newest sample.
    newest: usize,
    /// Number of valid samples.
    stored: usize,
    /// Number of samples in a row, the newest the last, whose bases have the same rotation and
    /// velocities.
    steady: usize,
    /// Half width of the polynomials' support, s.
    half_width_s: f64,
    /// Number of samples by which an instant lags the newest; `None` before the first of a stretch.
    lag: Option<usize>,
}

impl SampleRing {
    /// Creates an empty ring for samples of so many joints and wrenches, and polynomials that are
    /// accurate up to `cutoff_hz`.
    pub(crate) fn new(joints: usize, wrenches: usize, cutoff_hz: f64) -> Self {
        Self {
            samples: std::array::from_fn(|_| StoredSample::new(joints, wrenches)),
            newest: 0,
            stored: 0,
            steady: 0,
            half_width_s: HALF_WIDTH / (TAU * cutoff_hz),
            lag: None,
        }
    }

    /// Time of the newest sample, s; minus infinity before the first.
    pub(crate) fn time_s(&self) -> f64 {
        self.samples[self.newest].time_s
    }

    /// Starts a new stretch with the next sample. The time of the newest sample is kept.
    pub(crate) fn start_stretch(&mut self) {
        self.stored = 0;
        self.lag = None;
    }

    /// Discards all samples and the time of the newest.
    pub(crate) fn clear(&mut self) {
        self.start_stretch();
        self.samples[self.newest].time_s = f64::NEG_INFINITY;
    }

    /// Stores a copy of a sample.
    pub(crate) fn push(&mut self, sample: &Sample<'_>) {
        let before = *self.samples[self.newest].base_vectors();
        self.newest = (self.newest + 1) % STORED_SAMPLES;
        let newest = &mut self.samples[self.newest];
        newest.set(sample, &before);
        let is_same = *newest.base_vectors() == before;
        self.steady = 1 + if is_same { self.steady } else { 0 };
        self.stored = STORED_SAMPLES.min(self.stored + 1);
    }

    /// Returns the samples around the instant that the newest one completes. `None` where the
    /// stretch is still too short.
    pub(crate) fn nodes(&mut self) -> Option<Nodes<'_>> {
        let lag = self.lag.or_else(|| self.initial_lag())?;
        self.lag = Some(lag);
        let is_wide = |side| self.span_s(lag + 2 * side, lag - 2 * side) > 2.0 * self.half_width_s;
        // Every second sample to both sides as far as the half width, or neighbours where samples
        // are sparse.
        let mut side = lag / 2;
        let mut wide = is_wide(side);
        while wide && side > MIN_NODES / 2 {
            side -= 1;
            wide = is_wide(side);
        }
        let step = if wide { 1 } else { 2 };
        let count = 2 * side + 1;
        let mut place = self.place(lag + step * side);
        let mut nodes = [&self.samples[place]; MAX_NODES];
        for node in &mut nodes[1..count] {
            place += step;
            place -= if place < STORED_SAMPLES {
                0
            } else {
                STORED_SAMPLES
            };
            *node = &self.samples[place];
        }
        Some(Nodes {
            samples: nodes,
            count,
            are_alternate: step == 2,
            is_base_steady: self.steady >= self.stored,
        })
    }

    /// Returns the lag of a stretch once it has enough samples: they fill the ring, or reach over
    /// the width of the polynomials. The lag is even, so that both sides have the same number of
    /// whole steps.
    fn initial_lag(&self) -> Option<usize> {
        let is_wide = || self.span_s(self.stored - 1, 0) > 2.0 * self.half_width_s;
        let is_enough = self.stored == STORED_SAMPLES || self.stored >= MIN_STORED && is_wide();
        is_enough.then(|| (self.stored - 1) / 4 * 2)
    }

    /// Returns the sample that came so many before the newest.
    fn back(&self, count: usize) -> &StoredSample {
        &self.samples[self.place(count)]
    }

    /// Returns the place of the sample that came so many before the newest.
    fn place(&self, count: usize) -> usize {
        (self.newest + STORED_SAMPLES - count) % STORED_SAMPLES
    }

    /// Time between two samples that came so many before the newest, s.
    fn span_s(&self, first: usize, last: usize) -> f64 {
        self.back(last).time_s - self.back(first).time_s
    }
}
