//! How samples were taken.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Counts and times of the samples that an equation stream received.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sampling {
    /// Number of samples that were accepted.
    pub samples: u64,
    /// Number of samples that were rejected: not finite, or with derivatives that are not, or not
    /// later than the one before.
    pub rejected: u64,
    /// Number of times between two samples that were too long to be bridged.
    pub gaps: u64,
    /// Longest time between two samples that is bridged, s.
    pub max_gap_s: f64,
    /// Mean time between two accepted samples, s.
    pub period_s: f64,
    /// Length of a window, s.
    pub window_s: f64,
    /// Number of samples that a window needs at least.
    pub min_samples: u32,
}
