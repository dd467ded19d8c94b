//! Detection of payload changes from the innovations of windows.

use tactid_nlms::{ChangeDetector, ChangeSettings, SettingError};

use super::noise_tracker::NoiseTracker;
use crate::equations::window::PRODUCT_CORRELATION;
use crate::solve::weights::wilson_hilferty;

/// Settings of the detector of sudden changes, whose input is the score of each window.
///
/// A false alarm is expected once in 1e8 windows, 36 days at a cutoff of 10 Hz. An alarm needs at
/// least four windows, more than one bump disturbs: each adds at most `(4 · 3.5 - 8) / 1.15` to a
/// sum that must reach `ln(3e8 / 1.15)`. Scores below two standard deviations add nothing, because
/// noise may grow with the motion.
const SUDDEN_CHANGE: ChangeSettings = ChangeSettings {
    rows_between_false_alarms: 1e8,
    correlation_rows: PRODUCT_CORRELATION,
    shift: 4.0,
    growth: 6.0,
    clip: 3.5,
};

/// Settings of the detector of changes below the noise of a window. Its input is the larger one of
/// two scores: that of the slow means of the residuals, exponential means with a gain of 0.1, which
/// are correlated over `(1 + 0.9) / (1 - 0.9)` windows, and that of the last block of 32 windows,
/// which is the same for as many windows. One block alone raises no alarm: it adds at most
/// `32 (3 · 3.5 - 4.5) / 19` to a sum that must reach `ln(3e8 / 19)`.
const SLOW_CHANGE: ChangeSettings = ChangeSettings {
    correlation_rows: 19.0,
    shift: 3.0,
    ..SUDDEN_CHANGE
};

/// The detectors of payload changes, whose input is the [score] of each window.
#[derive(Clone, Debug)]
pub(crate) struct Changes {
    sudden: ChangeDetector,
    slow: ChangeDetector,
}

impl Changes {
    /// Creates detectors that have seen no window.
    ///
    /// # Errors
    /// Returns [`SettingError`] if a setting of the detectors is out of range.
    pub(crate) fn new() -> Result<Self, SettingError> {
        Ok(Self {
            sudden: ChangeDetector::new(SUDDEN_CHANGE)?,
            slow: ChangeDetector::new(SLOW_CHANGE)?,
        })
    }

    /// Adds the score of a window and that of the windows up to it, and returns whether the windows
    /// so far show a payload change.
    pub(crate) fn detects(&mut self, score: f64, slow_score: f64) -> bool {
        let sudden = self.sudden.update(score);
        let slow = self.slow.update(slow_score);
        sudden || slow
    }

    /// Returns whether the windows so far are any evidence of a payload change.
    pub(crate) fn has_evidence(&self) -> bool {
        self.sudden.has_evidence() || self.slow.has_evidence()
    }

    /// Discards all windows.
    pub(crate) fn restart(&mut self) {
        self.sudden.restart();
        self.slow.restart();
    }
}

/// Returns a score of a squared Mahalanobis distance: a standard normal variable by the
/// transformation of Wilson and Hilferty. Distances that are smaller than expected are no sign of a
/// payload change, and have the score zero.
pub(crate) fn score(distance: f64, channels: usize, noise: &NoiseTracker) -> f64 {
    let (mean, std_dev) = wilson_hilferty(channels);
    let ratio = distance / (channels as f64 * noise.inflation());
    ((ratio.cbrt() - mean) / std_dev).max(0.0)
}

/// Returns whether the score of a window is evidence of a sudden change.
pub(crate) fn is_evident(score: f64) -> bool {
    score >= SUDDEN_CHANGE.shift / 2.0
}
