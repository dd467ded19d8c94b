//! Known noise of the sensors of one source, in the form in which the noise model uses it.

use std::ops::Range;

use nalgebra::DMatrix;

use super::correlation::{cholesky_in_place, to_correlation};
use crate::equations::KnownNoise;

/// Standard deviations and correlation of the known noise of one source.
#[derive(Clone, Debug)]
pub(crate) struct KnownSensor {
    /// Index of the source's first channel.
    pub(crate) first_channel: usize,
    /// Standard deviation of one sample of each channel, in the channel's unit.
    pub(crate) std_devs: Vec<f64>,
    /// Lower triangle of the correlation matrix of the channels.
    pub(crate) correlation: DMatrix<f64>,
    /// Cholesky factor of the correlation matrix.
    pub(crate) root: DMatrix<f64>,
}

impl KnownSensor {
    /// Splits a covariance matrix into standard deviations and correlation.
    pub(crate) fn new(noise: &KnownNoise) -> Self {
        let std_devs = noise.covariance.diagonal().map(f64::sqrt);
        let mut correlation = noise.covariance.clone();
        to_correlation(&mut correlation);
        let mut root = correlation.clone();
        if !cholesky_in_place(&mut root) {
            // The lever arms of several sensors can make the matrix singular to rounding.
            root.fill_with_identity();
        }
        Self {
            first_channel: noise.first_channel,
            std_devs: std_devs.as_slice().to_vec(),
            correlation,
            root,
        }
    }

    /// Range of the channels of this source.
    pub(crate) fn channels(&self) -> Range<usize> {
        self.first_channel..self.first_channel + self.std_devs.len()
    }

    /// Writes the standard deviations of one sample times `scale`.
    pub(crate) fn write_scaled(&self, scale: f64, std_devs: &mut [f64]) {
        for (std_dev, of_sample) in std_devs.iter_mut().zip(&self.std_devs) {
            *std_dev = scale * of_sample;
        }
    }
}
