//! Window means of efforts that lag the motion by a delay which is found later.
//!
//! The weight of a window is cos⁴ of the time `x` since its middle, in units of its length over π.
//! Shifted by `d`, it is `cos⁴(x - d) = (cos x cos d + sin x sin d)⁴`, a sum of five products: five
//! sums over a window give its mean for every delay. A shifted window reaches beyond the sums by
//! `d`, where it has the weight of the other end: an error of `0.2 d⁵`, a thousandth of the
//! effort's change over the window at an eighth of its length.

use std::f64::consts::PI;

use tactid_identify::equations::window::{Place, WindowMean, WindowSums};

/// Longest delay in either direction, as a fraction of the length of a window.
pub(crate) const LONGEST: f64 = 0.125;

/// Binomial coefficients of the fourth power.
const BINOMIALS: [f64; 5] = [1.0, 4.0, 6.0, 4.0, 1.0];

/// Means of one joint's effort over one window with the weights `cos⁴⁻ᵏ sinᵏ`, k = 0 to 4.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct EffortMoments([f64; 5]);

impl EffortMoments {
    /// Returns the moments of the effort times a factor.
    pub(crate) fn times(&self, factor: f64) -> Self {
        Self(self.0.map(|moment| factor * moment))
    }

    /// Returns the mean effort of the motion in a window, given its length and the delay, s.
    pub(crate) fn effort(&self, delay_s: f64, window_s: f64) -> f64 {
        let (sin, cos) = (PI * delay_s / window_s).sin_cos();
        let terms = self.0.iter().zip(BINOMIALS).enumerate();
        terms
            .map(|(k, (moment, binomial))| {
                binomial * moment * cos.powi(4 - k as i32) * sin.powi(k as i32)
            })
            .sum()
    }

    /// Returns the derivative of [`Self::effort`] with respect to the delay.
    pub(crate) fn slope(&self, delay_s: f64, window_s: f64) -> f64 {
        let (sin, cos) = (PI * delay_s / window_s).sin_cos();
        // The derivative of cos⁴⁻ᵏ sinᵏ.
        let derivative = |k: i32| {
            let up = if k > 0 {
                f64::from(k) * cos.powi(5 - k) * sin.powi(k - 1)
            } else {
                0.0
            };
            let down = if k < 4 {
                f64::from(4 - k) * cos.powi(3 - k) * sin.powi(k + 1)
            } else {
                0.0
            };
            up - down
        };
        let terms = self.0.iter().zip(BINOMIALS).zip(0..);
        let sum: f64 = terms
            .map(|((moment, binomial), k)| binomial * moment * derivative(k))
            .sum();
        PI / window_s * sum
    }
}

/// Means of the entries of all joints over one window, and the moments of their efforts, which are
/// the last entries of an instant.
#[derive(Clone, Debug)]
pub(crate) struct EffortWindow {
    pub(crate) mean: WindowMean,
    pub(crate) moments: Box<[EffortMoments]>,
    weight: f64,
}

impl EffortWindow {
    /// Creates a window without instants, for so many entries beside the efforts of so many joints.
    pub(crate) fn new(entries: usize, joints: usize) -> Self {
        Self {
            mean: WindowMean::new(entries, 0),
            moments: vec![EffortMoments::default(); joints].into(),
            weight: 0.0,
        }
    }
}

impl WindowSums for EffortWindow {
    fn clear(&mut self, time_s: f64) {
        self.mean.clear(time_s);
        self.moments.fill(EffortMoments::default());
        self.weight = 0.0;
    }

    fn add(&mut self, entries: &[f64], place: &Place) {
        let (others, efforts) = entries.split_at(entries.len() - self.moments.len());
        self.mean.add(others, place);
        let weights: [f64; 5] = std::array::from_fn(|k| {
            place.cos.powi(4 - k as i32) * place.sin.powi(k as i32) * place.step_s
        });
        for (moments, effort) in self.moments.iter_mut().zip(efforts) {
            for (moment, weight) in moments.0.iter_mut().zip(weights) {
                *moment += weight * effort;
            }
        }
        self.weight += place.weight();
    }

    fn finish(&mut self) {
        self.mean.finish();
        for moments in &mut self.moments {
            moments
                .0
                .iter_mut()
                .for_each(|moment| *moment /= self.weight);
        }
    }

    fn instants(&self) -> u32 {
        self.mean.instants()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tactid_identify::equations::window::Windows;

    const CUTOFF_HZ: f64 = 2.0;

    /// Returns the moments of each window of an effort that is sampled at 125 Hz.
    fn windows(effort: impl Fn(f64) -> f64) -> Vec<EffortMoments> {
        let mut windows = Windows::new(CUTOFF_HZ, 1, &EffortWindow::new(0, 1));
        let times = (0..500).map(|k| 0.008 * f64::from(k));
        times
            .filter_map(|t| windows.push(t, &[effort(t)]).map(|w| w.moments[0]))
            .collect()
    }

    /// The mean of a delayed effort, with its delay, is the mean of the effort without: for
    /// friction that jumps at a reversal, too. Without the delay it differs by a tenth.
    #[test]
    fn the_mean_of_a_delayed_effort_is_that_of_the_effort() {
        let effort = |t: f64| 5.0 * (2.4 * t).cos() + 3.0 * ((2.4 * t).sin() / 0.03).tanh();
        let window_s = tactid_identify::equations::window::length_s(CUTOFF_HZ);
        let expected = windows(effort);
        for delay_s in [-0.04, -0.008, 0.02, 0.05] {
            let delayed = windows(|t| effort(t - delay_s));
            assert!(delayed.len() > 20);
            let mut uncorrected: f64 = 0.0;
            for (expected, delayed) in expected.iter().zip(&delayed) {
                let expected = expected.effort(0.0, window_s);
                let error = delayed.effort(delay_s, window_s) - expected;
                assert!(error.abs() < 0.01, "{error} at {delay_s} s");
                uncorrected = uncorrected.max((delayed.effort(0.0, window_s) - expected).abs());
                let step = 1e-5;
                let [after, before] = [step, -step].map(|s| delayed.effort(delay_s + s, window_s));
                let slope = delayed.slope(delay_s, window_s);
                assert!((slope - (after - before) / (2.0 * step)).abs() < 1e-6);
            }
            assert!(
                uncorrected > 20.0 * delay_s.abs(),
                "{uncorrected} at {delay_s} s"
            );
        }
    }
}
