//! Correlation of one channel's noise between neighbouring windows, estimated online.

use crate::equations::window::NOISE_CORRELATION;
use crate::solve::noise::VARIANCE_FLOOR;

/// Gain of the slow mean of the residuals. The mean follows errors that last for ten windows or
/// more, 0.3 s at a cutoff of 10 Hz.
pub(crate) const SLOW_GAIN: f64 = 0.1;

/// Mean square of the slow mean for white noise of variance one: `g / (2 - g)` for an exponential
/// mean with the gain `g` of independent values, times the factor for overlapping windows.
pub(crate) const WHITE_SLOW_SQUARE: f64 = NOISE_CORRELATION * SLOW_GAIN / (2.0 - SLOW_GAIN);

/// Number of windows that the correlation of white noise counts for. It limits the gain of the
/// first window to a quarter.
const PRIOR_WINDOWS: f64 = 4.0;

/// Mean products of a residual with itself and with the residuals of the two windows before it.
pub(crate) type Products = [f64; 3];

/// Returns the gain of a mean over the windows so far that begins with the prior of white noise.
pub(crate) fn mean_gain(windows_before: f64) -> f64 {
    1.0 / (windows_before + PRIOR_WINDOWS)
}

/// Correlation of the whitened residuals of one channel with those of the two windows before, and
/// their slow mean.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ResidualCorrelation {
    /// Residuals of the last window and of the one before it.
    last: [f64; 2],
    /// Mean products of a residual with itself and with the residuals of the two windows before it.
    pub(crate) products: Products,
    /// Exponential mean of the residuals with the gain [`SLOW_GAIN`].
    pub(crate) slow_mean: f64,
}

impl ResidualCorrelation {
    /// The correlation of white noise. Neighbouring windows overlap by two thirds and share noise;
    /// windows that are further apart hardly do.
    pub(crate) const WHITE: Self = Self {
        last: [0.0; 2],
        products: [1.0, 0.5 * (NOISE_CORRELATION - 1.0), 0.0],
        slow_mean: 0.0,
    };

    /// Adds the residual of the next window to the mean products with some gain.
    pub(crate) fn update(&mut self, residual: f64, gain: f64) {
        let factors = [residual, self.last[0], self.last[1]];
        for (product, factor) in self.products.iter_mut().zip(factors) {
            *product += gain * (residual * factor - *product);
        }
        self.last = [residual, self.last[0]];
        self.slow_mean += SLOW_GAIN * (residual - self.slow_mean);
    }
}

/// Returns the correlation with the last window and with the one before it that mean products show,
/// shrunk until the spectral density is positive at every frequency.
pub(crate) fn correlation_of([square, next, second]: Products) -> [f64; 2] {
    let (next, second) = (next / square, second / square);
    // Spectral density at the frequency θ: 1 + 2 next cos(θ) + 2 second cos(2 θ).
    let density =
        |cosine: f64| 1.0 + 2.0 * next * cosine + 2.0 * second * (2.0 * cosine * cosine - 1.0);
    let stationary = (-next / (4.0 * second)).clamp(-1.0, 1.0);
    let stationary = if stationary.is_nan() { 1.0 } else { stationary };
    let least = density(1.0).min(density(-1.0)).min(density(stationary));
    let factor = if least < VARIANCE_FLOOR {
        (1.0 - VARIANCE_FLOOR) / (1.0 - least)
    } else {
        1.0
    };
    [factor * next, factor * second]
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use rand_distr::StandardNormal;

    use super::*;

    /// Independent residuals have no correlation. Their differences have one so negative that the
    /// spectral density at low frequencies is at its lower limit.
    #[test]
    fn correlation_of_noise_and_of_its_differences() {
        let mut random = SmallRng::seed_from_u64(1);
        let mut draw = || -> f64 { random.sample(StandardNormal) };
        let white: Vec<f64> = (0..4000).map(|_| draw()).collect();
        let correlation_of = |residuals: &mut dyn Iterator<Item = f64>| {
            let mut correlation = ResidualCorrelation::WHITE;
            for (k, residual) in residuals.enumerate() {
                correlation.update(residual, mean_gain(k as f64));
            }
            correlation_of(correlation.products)
        };
        let [next, second] = correlation_of(&mut white.iter().copied());
        assert!(next.abs() < 0.05 && second.abs() < 0.05, "{next} {second}");
        let [next, second] = correlation_of(&mut white.windows(2).map(|pair| pair[1] - pair[0]));
        assert!((next + 0.46).abs() < 0.03, "{next}");
        let slow = 1.0 + 2.0 * next + 2.0 * second;
        assert!((VARIANCE_FLOOR - 1e-9..0.1).contains(&slow), "{slow}");
    }

    /// The spectral density is positive at every frequency, whatever the mean products.
    #[test]
    fn density_is_positive_at_every_frequency() {
        let mut random = SmallRng::seed_from_u64(2);
        for _ in 0..1000 {
            let mut correlation = ResidualCorrelation::WHITE;
            correlation.products = [
                1.0,
                random.random_range(-1.0..1.0),
                random.random_range(-1.0..1.0),
            ];
            let [next, second] = correlation_of(correlation.products);
            for k in 0..=100 {
                let angle = std::f64::consts::PI * f64::from(k) / 100.0;
                let density = 1.0 + 2.0 * next * angle.cos() + 2.0 * second * (2.0 * angle).cos();
                assert!(density > VARIANCE_FLOOR - 1e-9, "{density}");
            }
        }
    }
}
