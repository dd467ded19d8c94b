//! Robust weights of windows by the distance of their residuals.

/// Quantile of the normal distribution beyond which 0.1 % of all windows lie.
const RARE: f64 = 3.09;

/// A window whose residual is this many times what is rare counts as an outlier.
pub(crate) const OUTLIER: f64 = 5.0;

/// The squared distance of a window's residuals, in units of their noise, that is rare for so many
/// channels.
pub(crate) fn rare(channels: usize) -> f64 {
    let (mean, std_dev) = cube_root(channels);
    channels as f64 * (mean + RARE * std_dev).powi(3)
}

/// Mean and deviation of the cube root of the sum of squares of so many standard normal variables over
/// their number, which is nearly normal (Wilson and Hilferty 1931, doi 10.1073/pnas.17.12.684).
pub(crate) fn cube_root(channels: usize) -> (f64, f64) {
    let part = 2.0 / (9.0 * channels as f64);
    (1.0 - part, part.sqrt())
}

/// What a window of this squared distance counts: no more than a rare one pulls, and not at all where
/// it is an outlier.
pub(crate) fn weight(distance: f64, rare: f64) -> f64 {
    if distance <= rare {
        1.0
    } else if distance <= rare * (OUTLIER * OUTLIER).powi(2) {
        rare / distance
    } else {
        0.0
    }
}
