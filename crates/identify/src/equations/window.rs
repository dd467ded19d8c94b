//! The filter that both sides of the equations pass: a weighted mean over a sliding window.

use std::f64::consts::PI;

use super::equation::{Equation, Row};

/// A window begins each third of its length; the weights of those that overlap then sum to a
/// constant, and no instant counts more than another.
const OVERLAP: usize = 3;

/// A window with fewer instants is no mean, and is dropped.
const MIN_INSTANTS: u32 = 6;

/// Frequency at which the mean has lost 3 dB, times the window's length. Of the weight cos⁴.
const CUTOFF_TIMES_LENGTH: f64 = 0.926;

/// The length of the window whose mean loses 3 dB at a frequency.
#[must_use]
pub fn length_s(cutoff_hz: f64) -> f64 {
    CUTOFF_TIMES_LENGTH / cutoff_hz
}

/// The frequency at which the mean over a window has lost 3 dB.
#[must_use]
pub fn cutoff_hz(length_s: f64) -> f64 {
    CUTOFF_TIMES_LENGTH / length_s
}

/// The time between two windows of a cutoff.
#[must_use]
pub fn stride_s(cutoff_hz: f64) -> f64 {
    length_s(cutoff_hz) / OVERLAP as f64
}

/// The variance of the mean of white noise over a window, times how many instants are in it.
pub(crate) const NOISE_BANDWIDTH: f64 = 35.0 / 18.0;

/// Sum over neighbours of the correlation between the means of white noise in overlapping windows:
/// by so much is the variance of a slow quantity larger than if each were a measurement of its own.
pub(crate) const NOISE_CORRELATION: f64 = 54.0 / 35.0;

/// The same sum of the correlations' squares: by so much is the variance of a product of two channels'
/// noise larger, and so of what is learnt of how they are correlated.
pub(crate) const PRODUCT_CORRELATION: f64 = 1.1453;

/// Means with weight `cos⁴` over windows that overlap, causal: one is complete with the sample that
/// ends it.
///
/// Integrals are by the trapezoidal rule, which for a weight that vanishes with three derivatives
/// at both ends is far more exact than its order says, on even times and nearly so on uneven ones.
/// Nothing is allocated after construction.
#[derive(Clone, Debug)]
pub(crate) struct Windows {
    length_s: f64,
    /// Where the present stretch without a gap begins; none before its first instant.
    begin_s: Option<f64>,
    /// The number of the oldest window that is open.
    oldest: u64,
    open: Vec<Equation>,
    finished: Equation,
    /// The instant that waits for its right neighbour, which decides its weight.
    waiting: Vec<Row>,
    waiting_s: f64,
    before_s: f64,
    /// On which side of the differences the waiting instant is, 1 or -1.
    side: f64,
}

impl Windows {
    pub(crate) fn new(cutoff_hz: f64, rows: usize) -> Self {
        Self {
            length_s: length_s(cutoff_hz),
            begin_s: None,
            oldest: 0,
            open: vec![Equation::new(rows); OVERLAP],
            finished: Equation::new(rows),
            waiting: vec![Row::zero(); rows],
            waiting_s: 0.0,
            before_s: 0.0,
            side: 1.0,
        }
    }

    /// Forgets what is open: after a gap.
    pub(crate) fn clear(&mut self) {
        self.begin_s = None;
    }

    /// Takes an instant later than the one before, and gives the window that ended with it.
    pub(crate) fn push(&mut self, time_s: f64, rows: &[Row]) -> Option<&Equation> {
        let stride_s = self.length_s / OVERLAP as f64;
        if self.begin_s.is_none() || time_s - self.waiting_s > stride_s {
            self.begin(time_s, rows);
            return None;
        }
        let begin_s = self.begin_s?;
        let trapezoid = 0.5 * (time_s - self.before_s);
        let mut ended = false;
        // The instant that waited belongs to at most three windows.
        let newest = ((self.waiting_s - begin_s) / stride_s).floor().max(0.0) as u64;
        for number in newest.saturating_sub(OVERLAP as u64 - 1)..=newest {
            let middle_s = begin_s + (number as f64 + 0.5 * OVERLAP as f64) * stride_s;
            let phase = PI * (self.waiting_s - middle_s) / self.length_s;
            let slot = &mut self.open[(number % OVERLAP as u64) as usize];
            if number >= self.oldest + OVERLAP as u64 {
                self.oldest += 1;
                std::mem::swap(&mut self.finished, slot);
                ended = self.finished.instants >= MIN_INSTANTS;
                slot.clear(middle_s);
            }
            let (sin, cos) = phase.sin_cos();
            let weight = cos.powi(4);
            let slope = 4.0 * PI / self.length_s * cos.powi(3) * sin; // -dφ/dt
            slot.add(
                &self.waiting,
                weight * trapezoid,
                slope * trapezoid,
                self.side,
            );
        }
        self.wait(time_s, rows);
        if !ended {
            return None;
        }
        self.finished.finish();
        Some(&self.finished)
    }

    fn begin(&mut self, time_s: f64, rows: &[Row]) {
        self.begin_s = Some(time_s);
        self.oldest = 0;
        for (number, window) in self.open.iter_mut().enumerate() {
            window.clear(time_s + (number as f64 / OVERLAP as f64 + 0.5) * self.length_s);
        }
        self.waiting_s = time_s;
        self.wait(time_s, rows);
    }

    fn wait(&mut self, time_s: f64, rows: &[Row]) {
        self.before_s = self.waiting_s;
        self.waiting_s = time_s;
        self.side = -self.side;
        self.waiting.copy_from_slice(rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUTOFF_HZ: f64 = 9.26; // a window of 0.1 s

    /// A window for each of one quantity's values over time: time, mean, mean of the derivative.
    fn filter(times: &[f64], value: impl Fn(f64) -> f64) -> Vec<(f64, f64, f64)> {
        let mut windows = Windows::new(CUTOFF_HZ, 1);
        let mut found = Vec::new();
        for &time_s in times {
            let row = Row {
                target: value(time_s),
                ..Row::zero()
            };
            if let Some(mean) = windows.push(time_s, &[row]) {
                found.push((mean.time_s, mean.rows[0].target, mean.rates[0]));
            }
        }
        found
    }

    fn even(count: usize, step_s: f64) -> Vec<f64> {
        (0..count).map(|k| k as f64 * step_s).collect()
    }

    /// A constant is its own mean and has no slope; of a ramp the mean is the value in the middle.
    #[test]
    fn means_of_lines_are_exact() {
        let found = filter(&even(1001, 1e-3), |t| 4.0 - 3.0 * t);
        assert_eq!(found.len(), 27);
        for (k, (time_s, mean, rate)) in found.into_iter().enumerate() {
            assert!((time_s - 0.05 - 0.1 / 3.0 * k as f64).abs() < 1e-9);
            assert!((mean - (4.0 - 3.0 * time_s)).abs() < 1e-7, "{mean}");
            assert!((rate + 3.0).abs() < 1e-4, "{rate}");
        }
    }

    /// At the cutoff a sine has lost 3 dB, whatever the rate of the samples; uneven times change the
    /// mean by little.
    #[test]
    fn loses_three_decibel_at_the_cutoff() {
        let sine = |t: f64| (std::f64::consts::TAU * CUTOFF_HZ * t).cos();
        let uneven = |times: Vec<f64>| -> Vec<f64> {
            let shift = |k: usize| 1e-4 * (k as f64 * 1.7).sin();
            times
                .iter()
                .enumerate()
                .map(|(k, t)| t + shift(k))
                .collect()
        };
        let cases = [
            (even(2000, 1e-3), 1e-3),
            (even(400, 5e-3), 1e-3),
            (uneven(even(2000, 1e-3)), 5e-3),
        ];
        for (times, bound) in cases {
            for (time_s, mean, _) in filter(&times, sine) {
                let gain = std::f64::consts::FRAC_1_SQRT_2;
                assert!((mean - gain * sine(time_s)).abs() < bound, "{mean}");
            }
        }
    }

    /// No window spans a gap, and one that is too short for a mean is not given.
    #[test]
    fn no_window_spans_a_gap() {
        let mut times = even(300, 1e-3);
        times.extend(even(300, 1e-3).iter().map(|t| t + 0.4));
        for (time_s, ..) in filter(&times, |t| t) {
            assert!(!(0.25..=0.449).contains(&time_s), "{time_s}");
        }
        assert!(filter(&even(100, 0.03), |t| t).is_empty());
    }

    /// Means of white noise are correlated between windows as the constants say.
    #[test]
    fn correlation_of_noise() {
        let mut state = 1u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let values: Vec<f64> = (0..2_000_000).map(|_| noise()).collect();
        let found = filter(&even(values.len(), 1e-3), |t| {
            values[(t * 1e3).round() as usize]
        });
        let mean: Vec<f64> = found.iter().map(|f| f.1).collect();
        let product = |lag: usize| -> f64 {
            mean.iter()
                .zip(&mean[lag..])
                .map(|(a, b)| a * b)
                .sum::<f64>()
                / mean.len() as f64
        };
        let [first, second] = [1, 2].map(|lag| product(lag) / product(0));
        let bandwidth = product(0) * 12.0 * 100.0; // uniform noise, 100 instants a window
        assert!((bandwidth - NOISE_BANDWIDTH).abs() < 0.05, "{bandwidth}");
        let sum = 1.0 + 2.0 * (first + second);
        assert!((sum - NOISE_CORRELATION).abs() < 0.03, "{sum}");
        let squares = 1.0 + 2.0 * (first * first + second * second);
        assert!((squares - PRODUCT_CORRELATION).abs() < 0.015, "{squares}");
    }
}
