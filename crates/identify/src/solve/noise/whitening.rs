//! Whitening with a matrix that is computed once for many windows.

use nalgebra::DMatrix;

use super::Noise;

/// The inverse of a root of the noise's covariance across the channels. Rows times it have unit
/// noise without correlation, as after `Noise::whiten`, which solves a triangular system for each
/// window.
#[derive(Clone, Debug)]
pub struct Whitening {
    channels: usize,
    /// Lower triangular matrix, row by row.
    factors: Vec<f64>,
}

impl Whitening {
    /// Inverts the root of the covariance.
    pub fn new(noise: &Noise) -> Self {
        let channels = noise.channels();
        let mut inverse = DMatrix::<f64>::identity(channels, channels);
        noise.root.solve_lower_triangular_mut(&mut inverse);
        for (mut column, std_dev) in inverse.column_iter_mut().zip(&noise.std_devs) {
            // Sensors that measure nothing have next to no noise, whose inverse overflows: zero
            // times it must stay zero.
            column *= std_dev.recip().min(f64::MAX);
        }
        Self {
            channels,
            factors: inverse.transpose().as_slice().to_vec(),
        }
    }

    /// Returns the factors of the channels, up to `channel`, in a whitened row.
    #[inline(always)]
    fn factors(&self, channel: usize) -> &[f64] {
        let first = channel * self.channels;
        &self.factors[first..=first + channel]
    }

    /// Returns the factor of a channel in a whitened row.
    pub fn factor(&self, row: usize, channel: usize) -> f64 {
        self.factors[row * self.channels + channel]
    }

    /// Writes the whitened rows of a window, one for each channel.
    #[inline(always)]
    pub fn apply<const N: usize>(&self, rows: &[[f64; N]], whitened: &mut [[f64; N]]) {
        for (channel, whitened) in whitened.iter_mut().enumerate() {
            let mut sum = [0.0; N];
            for (&factor, row) in self.factors(channel).iter().zip(rows) {
                if factor != 0.0 {
                    for (sum, entry) in sum.iter_mut().zip(row) {
                        *sum += factor * entry;
                    }
                }
            }
            *whitened = sum;
        }
    }

    /// Returns the squared Mahalanobis distance of a window's residuals, one for each channel.
    #[inline(always)]
    pub fn squared_distance(&self, residuals: &[f64]) -> f64 {
        let whitened = |channel| -> f64 {
            let pairs = self.factors(channel).iter().zip(residuals);
            pairs.map(|(factor, residual)| factor * residual).sum()
        };
        (0..self.channels)
            .map(|channel| whitened(channel).powi(2))
            .sum()
    }
}
