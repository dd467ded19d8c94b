//! Covariance of the noise across the channels of a sample, and rows that are whitened by it.

use nalgebra::{DMatrix, DVector};
use tactid_identify::equations::Row;
use tactid_identify::{Channels, Method};

use crate::ExcitationError;
use crate::problem::Sensing;

/// Number of parameters of a payload.
pub(crate) const PARAMETERS: usize = 10;

/// Writes the product of a lower triangular whitening with regressors of rows, ten entries each.
pub(crate) fn whiten(whitening: &DMatrix<f64>, rows: &[Row], white: &mut [f64]) {
    for (channel, white) in white.chunks_exact_mut(PARAMETERS).enumerate() {
        white.fill(0.0);
        for (other, row) in rows.iter().enumerate().take(channel + 1) {
            let factor = whitening[(channel, other)];
            for (entry, value) in white.iter_mut().zip(&row.regressor) {
                *entry += factor * value;
            }
        }
    }
}

/// Returns the covariance of the sensors' noise of one sample across the channels.
pub(crate) fn covariance(
    channels: &Channels,
    sensing: &Sensing,
) -> Result<DMatrix<f64>, ExcitationError> {
    let count = channels.count();
    let mut covariance = DMatrix::<f64>::zeros(count, count);
    let mut first = 0;
    for &size in &channels.sources {
        let channel = &channels.channels[first].name;
        let known = channels
            .known_noise
            .iter()
            .find(|noise| noise.first_channel == first);
        let of_base =
            sensing.equations.method == Method::JointSensing || channel.starts_with("base ");
        let mut block = covariance.view_mut((first, first), (size, size));
        match (known, sensing.base_noise) {
            (Some(known), _) => block.copy_from(&known.covariance),
            (None, Some(std_devs)) if of_base => {
                let variances = std_devs.map(|std_dev| std_dev * std_dev);
                block.set_diagonal(&DVector::from_column_slice(&variances));
            }
            _ => return Err(unknown_noise(channel)),
        }
        first += size;
    }
    Ok(covariance)
}

/// Returns the inverse of the Cholesky factor of a covariance across the channels.
pub(crate) fn whitening(
    covariance: DMatrix<f64>,
    channels: &Channels,
) -> Result<DMatrix<f64>, ExcitationError> {
    let factor = covariance.cholesky();
    let inverse = factor.and_then(|factor| factor.l().try_inverse());
    inverse.ok_or_else(|| unknown_noise(&channels.channels[0].name))
}

fn unknown_noise(channel: &str) -> ExcitationError {
    ExcitationError::Option {
        option: "base_noise",
        what: format!(
            "the noise of {channel} is unknown, so that no interval can be predicted: give `base_noise`"
        ),
    }
}
