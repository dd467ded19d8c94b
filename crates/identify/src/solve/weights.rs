//! Robust weights of windows, by the squared Mahalanobis distance of their residuals.

/// Quantile of the normal distribution beyond which 0.1 % lie.
pub(crate) const RARE_QUANTILE: f64 = 3.09;

/// A window whose residual is this many times that of a rare one is an outlier.
pub const OUTLIER: f64 = 5.0;

/// Returns the squared Mahalanobis distance of the residuals of so many channels that 0.1 % of all
/// windows exceed.
pub fn rare_distance(channels: usize) -> f64 {
    let (mean, std_dev) = wilson_hilferty(channels);
    channels as f64 * (mean + RARE_QUANTILE * std_dev).powi(3)
}

/// Returns mean and standard deviation of the cube root of a chi-squared variable over its degrees
/// of freedom, which is nearly normal (Wilson and Hilferty 1931, doi 10.1073/pnas.17.12.684).
pub(crate) fn wilson_hilferty(freedom: usize) -> (f64, f64) {
    let variance = 2.0 / (9.0 * freedom as f64);
    (1.0 - variance, variance.sqrt())
}

/// Returns the robust weight of a window with this squared Mahalanobis distance. The window moves
/// the estimate no more than one at the `rare` squared distance, and not at all where its residual
/// is more than 25 times as large ([`OUTLIER`] squared).
pub fn robust_weight(distance: f64, rare: f64) -> f64 {
    if distance <= rare {
        1.0
    } else if distance <= rare * (OUTLIER * OUTLIER).powi(2) {
        rare / distance
    } else {
        0.0
    }
}
