//! The noise of the channels as it is now.

use nalgebra::DMatrix;

use super::sums::{MODEL, Prediction, Row, Window};
use crate::equations::Channels;
use crate::equations::Equation;
use crate::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};
use crate::solve::noise::Noise;
use crate::solve::subspace::Vector;

/// What is known of the noise is from about so many windows, the last ones.
const MEMORY: f64 = 500.0;

/// The part by which the slow mean of the residuals follows them: it sees what lasts for ten windows.
const FOLLOW: f64 = 0.1;

/// Noise is taken to be white as surely as if so many windows had shown it.
const PRIOR: f64 = 4.0;

/// Mean square of the slow mean of white noise.
const WHITE_SLOW: f64 = NOISE_CORRELATION * FOLLOW / (2.0 - FOLLOW);

/// By so much the variance is larger when it turns out to have been too small.
const GROWTH: f64 = 4.0;

/// It is then known as well as from so many windows.
const RELEARNT: f64 = 32.0;

/// Derivatives and means over windows are right to this part of what is measured.
const EXACT: f64 = 1e-6;

/// The least density that residuals have at any frequency, relative to white ones.
const LEAST: f64 = 0.05;

/// The noise of the channels, and how windows have it in common.
#[derive(Clone, Debug)]
pub(crate) struct RunningNoise {
    noise: Noise,
    /// Of the channels, in their units; its lower triangle.
    covariance: DMatrix<f64>,
    scratch: DMatrix<f64>,
    residuals: Vec<f64>,
    /// From how many windows all this is known, [`MEMORY`] at most.
    windows: f64,
    /// Of each channel.
    memories: Vec<Memory>,
    /// Mean squares of the slow residuals, and of all.
    slow_square: f64,
    square: f64,
    /// Slowly following the mean square of what is predicted.
    slow_load: f64,
}

/// What a channel's whitened residuals were.
#[derive(Clone, Copy, Debug)]
struct Memory {
    /// The last, and the one before.
    last: [f64; 2],
    /// Mean products of a residual with itself and with these.
    products: [f64; 3],
    /// Slowly following them.
    slow: f64,
}

impl Memory {
    /// Of white noise: windows that overlap by two thirds have it in common, others hardly.
    const WHITE: Self = Self {
        last: [0.0; 2],
        products: [1.0, 0.5 * (NOISE_CORRELATION - 1.0), 0.0],
        slow: 0.0,
    };

    fn follow(&mut self, residual: f64, share: f64) {
        let others = [residual, self.last[0], self.last[1]];
        for (product, other) in self.products.iter_mut().zip(others) {
            *product += share * (residual * other - *product);
        }
        self.last = [residual, self.last[0]];
        self.slow += FOLLOW * (residual - self.slow);
    }

    /// With the last window and the one before, such that noise has some power at every frequency.
    fn correlation(&self) -> [f64; 2] {
        let [square, next, second] = self.products;
        let (next, second) = (next / square, second / square);
        // 1 + 2 next cos(θ) + 2 second cos(2 θ)
        let density =
            |cosine: f64| 1.0 + 2.0 * next * cosine + 2.0 * second * (2.0 * cosine * cosine - 1.0);
        let inner = (-next / (4.0 * second)).clamp(-1.0, 1.0);
        let inner = if inner.is_nan() { 1.0 } else { inner };
        let least = density(1.0).min(density(-1.0)).min(density(inner));
        let kept = if least < LEAST {
            (1.0 - LEAST) / (1.0 - least)
        } else {
            1.0
        };
        [kept * next, kept * second]
    }
}

impl RunningNoise {
    pub(crate) fn new(channels: &Channels) -> Self {
        let count = channels.count();
        Self {
            noise: Noise::from_targets(&[], channels, EXACT),
            covariance: DMatrix::zeros(count, count),
            scratch: DMatrix::zeros(count, count),
            residuals: vec![0.0; count],
            windows: 0.0,
            memories: vec![Memory::WHITE; count],
            slow_square: WHITE_SLOW,
            square: 1.0,
            slow_load: 0.0,
        }
    }

    /// As large as what is measured, before there are residuals.
    pub(crate) fn begin(&mut self, equations: &[Equation]) {
        self.noise.reset(equations);
    }

    /// From the residuals of the windows that the parameters were learnt from. `window` and `prediction`
    /// are scratch.
    pub(crate) fn learn(
        &mut self,
        equations: &[Equation],
        parameters: &Vector,
        window: &mut Window,
        prediction: &mut Prediction,
    ) {
        self.windows = equations.len() as f64;
        let independent = self.windows / NOISE_CORRELATION * self.residuals.len() as f64;
        let freedom = (independent - 10.0).max(1.0);
        self.covariance.fill(0.0);
        for equation in equations {
            self.measure(equation, parameters);
            self.add(independent / freedom / self.windows);
        }
        self.believe();
        self.memories.fill(Memory::WHITE);
        (self.slow_square, self.square) = (WHITE_SLOW, 1.0);
        for (before, equation) in equations.iter().enumerate() {
            window.copy_from(equation);
            self.whiten(&mut window.rows);
            prediction.predict(&window.rows, parameters);
            self.remember(prediction, 1.0, before as f64);
        }
    }

    /// From the window that was [measured](Self::measure) last, of which this was predicted, with its share
    /// in what it shows.
    pub(crate) fn follow(&mut self, prediction: &Prediction, weight: f64) {
        self.windows = (self.windows + 1.0).min(MEMORY);
        self.remember(prediction, weight, self.windows);
        let share = self.windows.recip();
        self.covariance *= 1.0 - share;
        self.add(share * weight);
        self.believe();
    }

    /// After it has turned out larger than it was known. It is then learnt as anew.
    pub(crate) fn grow(&mut self) {
        self.covariance *= GROWTH;
        self.windows = self.windows.min(RELEARNT);
        self.believe();
    }

    /// Of a channel's residual, with that of the last window and of the one before.
    pub(crate) fn correlation(&self, channel: usize) -> [f64; 2] {
        self.memories[channel].correlation()
    }

    /// By how much residuals that last for longer than the filter have more power than white ones, one
    /// at least.
    pub(crate) fn lasting(&self) -> f64 {
        (self.slow_square / (WHITE_SLOW * self.square)).max(1.0)
    }

    /// The sum of the squares of the channels' slow residuals, over their variance and that of the model.
    pub(crate) fn slow_distance(&self) -> f64 {
        let squares = self.memories.iter().map(|memory| memory.slow.powi(2));
        squares.sum::<f64>() / (self.slow_square + MODEL * MODEL * self.slow_load)
    }

    /// By how much variances in its units are larger than one, as it is itself an estimate.
    pub(crate) fn inflation(&self) -> f64 {
        self.noise.inflation(self.windows / PRODUCT_CORRELATION)
    }

    /// Brings rows to units of the noise, uncorrelated.
    pub(crate) fn whiten(&self, rows: &mut [Row]) {
        self.noise.whiten(rows);
    }

    /// What parameters leave of a window, in the channels' units.
    pub(crate) fn measure(&mut self, equation: &Equation, parameters: &Vector) {
        for (residual, row) in self.residuals.iter_mut().zip(&equation.rows) {
            *residual = row.target - row.regressor.dot(parameters);
        }
    }

    /// Adds a share of the residuals' products.
    fn add(&mut self, share: f64) {
        for (i, left) in self.residuals.iter().enumerate() {
            for (j, right) in self.residuals[..=i].iter().enumerate() {
                self.covariance[(i, j)] += share * left * right;
            }
        }
    }

    fn believe(&mut self) {
        self.scratch.copy_from(&self.covariance);
        self.noise.set_covariance(&mut self.scratch, self.windows);
    }

    /// How a window's residuals go with those before them.
    fn remember(&mut self, prediction: &Prediction, weight: f64, before: f64) {
        let share = 1.0 / (before + PRIOR);
        let root = weight.sqrt();
        let (mut slow_square, mut square) = (0.0, 0.0);
        for (memory, residual) in self.memories.iter_mut().zip(&prediction.residuals) {
            memory.follow(root * residual, share);
            slow_square += memory.slow * memory.slow;
            square += weight * residual * residual;
        }
        let channels = prediction.residuals.len() as f64;
        self.slow_square += share * (slow_square / channels - self.slow_square);
        self.square += share * (square / channels - self.square);
        self.slow_load += FOLLOW * (prediction.load - self.slow_load);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use rand_distr::StandardNormal;

    use super::*;

    /// Of white noise it is that of overlapping windows; of its differences it is so negative that next
    /// to no power is left for what is slow, but some.
    #[test]
    fn correlation_of_noise_and_of_its_differences() {
        let mut random = SmallRng::seed_from_u64(1);
        let mut draw = || -> f64 { random.sample(StandardNormal) };
        let white: Vec<f64> = (0..4000).map(|_| draw()).collect();
        let remember = |residuals: &mut dyn Iterator<Item = f64>| {
            let mut memory = Memory::WHITE;
            for (k, residual) in residuals.enumerate() {
                memory.follow(residual, 1.0 / (k as f64 + PRIOR));
            }
            memory.correlation()
        };
        let [next, second] = remember(&mut white.iter().copied());
        assert!(next.abs() < 0.05 && second.abs() < 0.05, "{next} {second}");
        let [next, second] = remember(&mut white.windows(2).map(|pair| pair[1] - pair[0]));
        assert!((next + 0.46).abs() < 0.03, "{next}");
        let slow = 1.0 + 2.0 * next + 2.0 * second;
        assert!((LEAST - 1e-9..0.1).contains(&slow), "{slow}");
    }

    /// Whatever the products, the density is positive at every frequency.
    #[test]
    fn every_frequency_has_power() {
        let mut random = SmallRng::seed_from_u64(2);
        for _ in 0..1000 {
            let mut memory = Memory::WHITE;
            memory.products = [
                1.0,
                random.random_range(-1.0..1.0),
                random.random_range(-1.0..1.0),
            ];
            let [next, second] = memory.correlation();
            for k in 0..=100 {
                let angle = std::f64::consts::PI * f64::from(k) / 100.0;
                let density = 1.0 + 2.0 * next * angle.cos() + 2.0 * second * (2.0 * angle).cos();
                assert!(density > LEAST - 1e-9, "{density}");
            }
        }
    }
}
