//! The low-pass that both sides of the equations pass: a weighted mean over overlapping windows.
//!
//! The weight of an instant is cos⁴ over the window, so the filter has finite support, no overshoot
//! and strong attenuation beyond its cutoff. The -3 dB frequency times the window's length is
//! 0.926.

use std::f64::consts::PI;

use super::sample::is_measurable;
use crate::IdentifyError;
use tactid_dynamics::words::three_digits;

/// Number of windows that overlap: one begins at each third of the length. The weights of
/// overlapping windows then sum to a constant, so that every instant counts the same.
const OVERLAP: usize = 3;

/// Cosine and sine of the phase of the weight, π over the length, from the middle of a window to
/// that of the next: π/3.
const STRIDE_COS: f64 = 0.5;
const STRIDE_SIN: f64 = 0.866_025_403_784_438_6;

/// Fewest instants of a window; a window with fewer is dropped.
pub const MIN_INSTANTS: u32 = 6;

/// Frequency at which the mean with weight cos⁴ has lost 3 dB, times the length of the window.
const CUTOFF_TIMES_LENGTH: f64 = 0.926;

/// Returns the length, s, of the window whose mean has lost 3 dB at a frequency, Hz.
#[must_use]
pub fn length_s(cutoff_hz: f64) -> f64 {
    CUTOFF_TIMES_LENGTH / cutoff_hz
}

/// Returns the frequency, Hz, at which the mean over a window of a length, s, has lost 3 dB.
#[must_use]
pub fn cutoff_hz(length_s: f64) -> f64 {
    CUTOFF_TIMES_LENGTH / length_s
}

/// Returns the time between two windows, s, for a cutoff, Hz.
#[must_use]
pub fn stride_s(cutoff_hz: f64) -> f64 {
    length_s(cutoff_hz) / OVERLAP as f64
}

/// Variance of the mean of white noise over a window, times the number of instants in it.
pub const NOISE_BANDWIDTH: f64 = 35.0 / 18.0;

/// Sum over all lags of the correlation between the means of white noise in overlapping windows.
/// The variance of an estimate from all windows is larger by this factor than if they were
/// independent.
pub const NOISE_CORRELATION: f64 = 54.0 / 35.0;

/// Correlation between the means of white noise in windows that begin one and two strides apart:
/// the normalized autocorrelation of the window cos⁴ at one and two strides.
pub const NOISE_CORRELATIONS: [f64; 2] = [0.269_558_810_573_74, 0.001_869_760_854_83];

/// Sum over all lags of the squares of the correlations of [`NOISE_CORRELATION`]. The variance of a
/// mean product of two channels' noise, and so of an estimated correlation, is larger by this
/// factor.
pub const PRODUCT_CORRELATION: f64 = 1.1453;

/// Place of an instant in a window.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Sine of the time since the middle of the window, in units of the window's length over π.
    pub sin: f64,
    /// Cosine of the same angle.
    pub cos: f64,
    /// Time that the instant stands for, s.
    pub step_s: f64,
    /// Length of the window, s.
    length_s: f64,
    /// Half of the instants to which this one belongs, 1 or -1.
    half: f64,
}

impl Place {
    /// Weight in the mean, s.
    pub fn weight(&self) -> f64 {
        let cube = self.cos * self.cos * self.cos;
        cube * self.cos * self.step_s
    }

    /// Weight in the derivative of the mean: minus the derivative of the weight.
    fn slope_weight(&self) -> f64 {
        let cube = self.cos * self.cos * self.cos;
        4.0 * PI / self.length_s * cube * self.sin * self.step_s
    }
}

/// Sums over the instants of one window, which become means.
pub trait WindowSums: Clone {
    /// Removes all instants and sets the middle of the window, s.
    fn clear(&mut self, time_s: f64);

    /// Adds the entries of an instant at its place in the window.
    fn add(&mut self, entries: &[f64], place: &Place);

    /// Turns the sums into means.
    fn finish(&mut self);

    /// Number of instants that were added.
    fn instants(&self) -> u32;
}

/// Entries of the instants, averaged over one window.
#[derive(Clone, Debug)]
pub struct WindowMean {
    /// Middle of the window, on the clock of the instants, s.
    pub time_s: f64,
    /// Number of instants in the window.
    pub instants: u32,
    /// Mean of each entry.
    pub means: Box<[f64]>,
    /// Half the difference between the means of each entry over every second instant, or every
    /// second run of instants, and over the others.
    pub differences: Box<[f64]>,
    /// Time derivative of the first entries through the same filter, per second.
    pub rates: Box<[f64]>,
    /// Half the difference between these derivatives from either half of the instants.
    pub rate_differences: Box<[f64]>,
    /// Sums of the weights in the mean and in the derivative, of all instants and of one half less
    /// the other.
    weights: [f64; 2],
    slope_weights: [f64; 2],
}

impl WindowMean {
    /// Creates a window of so many entries, the first of which have a derivative, without any
    /// instant.
    pub fn new(entries: usize, rates: usize) -> Self {
        Self {
            time_s: 0.0,
            instants: 0,
            means: vec![0.0; entries].into(),
            differences: vec![0.0; entries].into(),
            rates: vec![0.0; rates].into(),
            rate_differences: vec![0.0; rates].into(),
            weights: [0.0; 2],
            slope_weights: [0.0; 2],
        }
    }
}

impl WindowSums for WindowMean {
    fn clear(&mut self, time_s: f64) {
        self.time_s = time_s;
        self.instants = 0;
        self.means.fill(0.0);
        self.differences.fill(0.0);
        self.rates.fill(0.0);
        self.rate_differences.fill(0.0);
        (self.weights, self.slope_weights) = ([0.0; 2], [0.0; 2]);
    }

    /// Until the end, `means` and `rates` have the sums of one half of the instants, and
    /// `differences` and `rate_differences` those of the other.
    fn add(&mut self, entries: &[f64], place: &Place) {
        let (weight, slope_weight) = (place.weight(), place.slope_weight());
        let (sums, rates) = if place.half > 0.0 {
            (&mut self.means, &mut self.rates)
        } else {
            (&mut self.differences, &mut self.rate_differences)
        };
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum += weight * entry;
        }
        for (rate, entry) in rates.iter_mut().zip(entries) {
            *rate += slope_weight * entry;
        }
        for (sum, half) in [1.0, place.half].into_iter().enumerate() {
            self.weights[sum] += half * weight;
            self.slope_weights[sum] += half * slope_weight;
        }
        self.instants += 1;
    }

    fn finish(&mut self) {
        let normalization = 1.0 / self.weights[0];
        for (mean, difference) in self.means.iter_mut().zip(&mut self.differences) {
            let [half, other_half] = [*mean, *difference];
            *mean = (half + other_half) * normalization;
            // Both halves have the same weight but for the ends of the window and uneven times.
            *difference = (half - other_half - self.weights[1] * *mean) * normalization;
        }
        let rates = self.rates.iter_mut().zip(&mut self.rate_differences);
        for ((rate, difference), mean) in rates.zip(&self.means) {
            let [half, other_half] = [*rate, *difference];
            // The weights of the derivative sum to zero but for rounding and uneven times.
            *rate = (half + other_half - self.slope_weights[0] * mean) * normalization;
            *difference = (half - other_half - self.slope_weights[1] * mean) * normalization;
        }
    }

    fn instants(&self) -> u32 {
        self.instants
    }
}

/// Causal means with weight cos⁴ over overlapping windows: a window is complete with the sample
/// that ends it.
///
/// Integrals use the trapezoidal rule. The weight vanishes with three derivatives at both ends, for
/// which the rule is far more accurate than its order at equidistant times, and nearly so at
/// others. Nothing is allocated after construction.
#[derive(Clone, Debug)]
pub struct Windows<W> {
    length_s: f64,
    /// Begin of the stretch without a gap, on the clock of the instants; `None` before its first
    /// instant.
    begin_s: Option<f64>,
    /// Number of the oldest open window, counted from the begin of the stretch.
    oldest: u64,
    open: [W; OVERLAP],
    finished: W,
    /// The last instant. Its weight depends on the time of the next one.
    pending: Box<[f64]>,
    /// Time of the pending instant since the begin of the stretch.
    pending_s: f64,
    /// Time of the instant before the pending one since the begin of the stretch.
    previous_s: f64,
    /// Number of windows that were dropped because of too few instants, without those that a gap
    /// ends.
    sparse: u64,
    /// Number of instants that were left out, since an entry was no measurement.
    left_out: u64,
    /// Half of the instants to which the pending one belongs, 1 or -1.
    half: f64,
    /// Time during which instants belong to the same half, s.
    run_s: f64,
    /// Start of the present run since the start of the stretch, s.
    run_start_s: f64,
}

impl Windows<WindowMean> {
    /// Creates windows over instants of so many entries, the first of which have a derivative. The
    /// instants of `run_s` seconds belong to the same half, but a window has [`MIN_INSTANTS`] such
    /// runs at least.
    pub(crate) fn of_means(cutoff_hz: f64, entries: usize, rates: usize, run_s: f64) -> Self {
        let windows = Self::new(cutoff_hz, entries, &WindowMean::new(entries, rates));
        Self {
            run_s: run_s.min(windows.length_s / f64::from(MIN_INSTANTS)),
            ..windows
        }
    }
}

impl<W: WindowSums> Windows<W> {
    /// Creates windows over instants of so many entries, from a window without any instant.
    pub fn new(cutoff_hz: f64, entries: usize, empty: &W) -> Self {
        Self {
            length_s: length_s(cutoff_hz),
            begin_s: None,
            oldest: 0,
            open: std::array::from_fn(|_| empty.clone()),
            finished: empty.clone(),
            pending: vec![0.0; entries].into(),
            pending_s: 0.0,
            previous_s: 0.0,
            sparse: 0,
            left_out: 0,
            half: 1.0,
            run_s: 0.0,
            run_start_s: 0.0,
        }
    }

    /// Discards the open windows, after a gap.
    pub fn clear(&mut self) {
        self.begin_s = None;
    }

    /// Discards the open windows and resets the counts.
    pub fn rewind(&mut self) {
        self.clear();
        (self.sparse, self.left_out) = (0, 0);
    }

    /// Number of instants that were left out, since an entry was not measurable.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Length of a window, s.
    pub fn length_s(&self) -> f64 {
        self.length_s
    }

    /// Returns why there are so few windows: most have too few instants, or there are too few
    /// samples.
    pub fn too_few(&self, windows: usize) -> IdentifyError {
        let window_s = self.length_s;
        if self.sparse > windows as u64 {
            IdentifyError::TooLittle(format!(
                "too few samples: most windows of {} s have fewer than {MIN_INSTANTS}; lower the cutoff, or raise the \
                 sample rate",
                three_digits(window_s)
            ))
        } else {
            IdentifyError::too_few_windows(windows, window_s)
        }
    }

    /// Adds an instant, later than the one before, and returns the window that ended with it.
    ///
    /// An instant of which an entry is not measurable is left out: samples with finite numbers can
    /// have derivatives and products that are not finite, and one of these would stay in the
    /// estimate for ever.
    pub fn push(&mut self, time_s: f64, entries: &[f64]) -> Option<&W> {
        // All entries are compared without a branch, which is faster than to stop at the first one.
        if !entries
            .iter()
            .fold(true, |all, &entry| all & is_measurable(entry))
        {
            self.left_out += 1;
            return None;
        }
        let stride_s = self.length_s / OVERLAP as f64;
        // A clock that began decades ago has few digits left for a window: times count from the
        // begin of the stretch.
        let passed_s = self.begin_s.map(|begin_s| (begin_s, time_s - begin_s));
        let passed_s = passed_s.filter(|(_, since_s)| since_s - self.pending_s <= stride_s);
        let Some((begin_s, time_s)) = passed_s else {
            self.sparse += u64::from(self.begin_s.is_some());
            self.begin(time_s, entries);
            return None;
        };
        let trapezoid = 0.5 * (time_s - self.previous_s);
        let mut ended = false;
        // The pending instant belongs to at most three windows.
        let newest = (self.pending_s / stride_s).floor().max(0.0) as u64;
        let middle_s = |number: u64| (number as f64 + 0.5 * OVERLAP as f64) * stride_s;
        let oldest = newest.saturating_sub(OVERLAP as u64 - 1);
        let phase = PI * (self.pending_s - middle_s(oldest)) / self.length_s;
        let (mut sin, mut cos) = phase.sin_cos();
        for number in oldest..=newest {
            let window = &mut self.open[(number % OVERLAP as u64) as usize];
            if number >= self.oldest + OVERLAP as u64 {
                self.oldest += 1;
                std::mem::swap(&mut self.finished, window);
                ended = self.finished.instants() >= MIN_INSTANTS;
                self.sparse += u64::from(!ended);
                window.clear(begin_s + middle_s(number));
            }
            let place = Place {
                sin,
                cos,
                step_s: trapezoid,
                length_s: self.length_s,
                half: self.half,
            };
            window.add(&self.pending, &place);
            // The middle of the next window is a stride later.
            (sin, cos) = (
                sin * STRIDE_COS - cos * STRIDE_SIN,
                cos * STRIDE_COS + sin * STRIDE_SIN,
            );
        }
        self.set_pending(time_s, entries);
        if !ended {
            return None;
        }
        self.finished.finish();
        Some(&self.finished)
    }

    /// Opens the first windows of a stretch that begins with this instant.
    fn begin(&mut self, time_s: f64, entries: &[f64]) {
        self.begin_s = Some(time_s);
        self.oldest = 0;
        for (number, window) in self.open.iter_mut().enumerate() {
            window.clear(time_s + (number as f64 / OVERLAP as f64 + 0.5) * self.length_s);
        }
        self.pending_s = 0.0;
        self.set_pending(0.0, entries);
    }

    fn set_pending(&mut self, time_s: f64, entries: &[f64]) {
        self.previous_s = self.pending_s;
        self.pending_s = time_s;
        // A run ends where the next instant would exceed it, so that a window has enough of them.
        let next_s = time_s + (time_s - self.previous_s).max(0.0);
        if next_s - self.run_start_s > self.run_s || time_s < self.run_start_s {
            self.half = -self.half;
            self.run_start_s = time_s;
        }
        self.pending.copy_from_slice(entries);
    }
}

#[cfg(test)]
mod tests;
