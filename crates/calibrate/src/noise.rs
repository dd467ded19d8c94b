//! Noise of one joint's window means, and its whitening.
//!
//! The covariance between windows `i` and `k` is
//! `w² [i = k] + c² exp(-|Δt| / T) + f² lᵢ lₖ exp(-|Δt| / 0.3 s)`: white noise, slow noise, and the
//! friction at standstill, which the motion does not determine (`l` is 0 while a joint moves in one
//! direction, and 1 at rest). It describes a process with two states, so that a Kalman filter
//! whitens all columns in a time that grows with the number of windows: its gains do not depend on
//! the data.

use nalgebra::DMatrix;

/// Correlation time of the friction at standstill, s. Between 0.15 and 0.6 s it does not matter.
const STANDSTILL_TIME_S: f64 = 0.3;

/// Noise of the window means of one joint's effort, which has three independent pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffortNoise {
    /// Standard deviation of the white noise, N m or N.
    pub white: f64,
    /// Standard deviation of the slow noise, N m or N.
    pub slow: f64,
    /// Correlation time of the slow noise, s.
    pub slow_time_s: f64,
    /// Standard deviation of the friction at standstill, N m or N: the motion does not determine it
    /// between the two Coulomb values.
    pub standstill: f64,
}

impl EffortNoise {
    /// Returns the noise that is typical of a joint with this friction, N m or N: the start of the
    /// search for its four numbers, and the middle of their prior.
    pub(crate) fn typical(friction: f64) -> Self {
        Self {
            white: 0.03 * friction,
            slow: 0.1 * friction,
            slow_time_s: 0.5,
            standstill: 0.2 * friction,
        }
    }

    /// Returns the logarithms of white and slow noise, correlation time, and noise at standstill.
    pub(crate) fn logs(&self) -> [f64; 4] {
        [self.white, self.slow, self.slow_time_s, self.standstill].map(f64::ln)
    }

    /// Returns the noise with these logarithms.
    pub(crate) fn from_logs(logs: &[f64; 4]) -> Self {
        let [white, slow, slow_time_s, standstill] = logs.map(f64::exp);
        Self {
            white,
            slow,
            slow_time_s,
            standstill,
        }
    }

    /// Returns the noise with the variances of this one times a factor.
    pub(crate) fn enlarged(&self, variance_factor: f64) -> Self {
        let factor = variance_factor.sqrt();
        Self {
            white: self.white * factor,
            slow: self.slow * factor,
            standstill: self.standstill * factor,
            ..*self
        }
    }
}

/// The filter's numbers of one window.
#[derive(Clone, Copy, Debug)]
struct Step {
    decay: [f64; 2],
    gain: [f64; 2],
    standstill: f64,
    inverse_std_dev: f64,
}

/// Whitens columns over the windows of one recording: multiplies them by the inverse Cholesky
/// factor of the covariance.
#[derive(Clone, Debug)]
pub(crate) struct Whitening {
    steps: Vec<Step>,
    /// Logarithm of the determinant of the covariance.
    pub(crate) log_det: f64,
}

impl Whitening {
    /// Computes the filter's gains for windows at increasing times, s, with their standstill (`l`).
    pub(crate) fn new(noise: &EffortNoise, windows: impl Iterator<Item = (f64, f64)>) -> Self {
        let variances = [noise.slow.powi(2), noise.standstill.powi(2)];
        let times_s = [noise.slow_time_s, STANDSTILL_TIME_S];
        // Covariance of the two states: the two variances and the product.
        let mut p = [variances[0], variances[1], 0.0];
        let mut last_s = f64::NEG_INFINITY;
        let mut log_det = 0.0;
        let steps = windows
            .map(|(time_s, standstill)| {
                let [a, b] = times_s.map(|t| (-(time_s - last_s) / t).exp());
                last_s = time_s;
                p = [
                    a * a * p[0] + variances[0] * (1.0 - a * a),
                    b * b * p[1] + variances[1] * (1.0 - b * b),
                    a * b * p[2],
                ];
                let product = [p[0] + p[2] * standstill, p[2] + p[1] * standstill];
                let variance = product[0] + standstill * product[1] + noise.white.powi(2);
                let gain = product.map(|product| product / variance);
                p[0] -= gain[0] * product[0];
                p[1] -= gain[1] * product[1];
                p[2] -= gain[0] * product[1];
                log_det += variance.ln();
                Step {
                    decay: [a, b],
                    gain,
                    standstill,
                    inverse_std_dev: variance.sqrt().recip(),
                }
            })
            .collect();
        Self { steps, log_det }
    }

    /// Whitens each column of a matrix with windows as rows.
    ///
    /// A step of the filter depends on the step before, so the processor is idle with one column:
    /// four are filtered together.
    pub(crate) fn apply(&self, columns: &mut DMatrix<f64>) {
        const TOGETHER: usize = 4;
        let windows = self.steps.len();
        for columns in columns
            .as_mut_slice()
            .chunks_mut((TOGETHER * windows).max(1))
        {
            let mut states = [[0.0; 2]; TOGETHER];
            for (window, step) in self.steps.iter().enumerate() {
                let values = columns[window..].iter_mut().step_by(windows);
                for (state, value) in states.iter_mut().zip(values) {
                    state[0] *= step.decay[0];
                    state[1] *= step.decay[1];
                    let innovation = *value - state[0] - step.standstill * state[1];
                    state[0] += step.gain[0] * innovation;
                    state[1] += step.gain[1] * innovation;
                    *value = innovation * step.inverse_std_dev;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    /// The filter multiplies by the dense covariance's inverse Cholesky factor, across a gap, too.
    #[test]
    fn whitening_is_that_of_the_dense_covariance() {
        let mut random = SmallRng::seed_from_u64(3);
        let noise = EffortNoise {
            white: 0.1,
            slow: 0.5,
            slow_time_s: 0.8,
            standstill: 2.0,
        };
        let count = 150;
        let mut time_s = 0.0;
        let windows: Vec<(f64, f64)> = (0..count)
            .map(|k| {
                time_s += random.random_range(0.1..0.2) + if k == 70 { 3.0 } else { 0.0 };
                (time_s, random.random_range(0.0..1.0))
            })
            .collect();
        let covariance = DMatrix::from_fn(count, count, |i, k| {
            let ((t, l), (u, m)) = (windows[i], windows[k]);
            let lag = (t - u).abs();
            f64::from(i == k) * 0.01 + 0.25 * (-lag / 0.8).exp() + 4.0 * l * m * (-lag / 0.3).exp()
        });
        let factor = covariance.cholesky().unwrap().l();
        let mut columns = DMatrix::from_fn(count, 6, |_, _| random.random_range(-1.0..1.0));
        let expected = factor.solve_lower_triangular(&columns).unwrap();
        let whitening = Whitening::new(&noise, windows.into_iter());
        whitening.apply(&mut columns);
        assert!((&columns - expected).amax() < 1e-11);
        let log_det = 2.0 * factor.diagonal().map(f64::ln).sum();
        assert!((whitening.log_det - log_det).abs() < 1e-10);
    }
}
