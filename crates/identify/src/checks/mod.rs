//! Checks of the samples themselves, before any equation: velocities against the positions that
//! they belong to, positions and efforts against the limits of the joints, jumps of positions,
//! channels that never change, and channels that are saturated.
//!
//! A velocity that is not the derivative of its position is in other axes, in other units, of the
//! opposite sign or of another joint. Velocities are integrated over short intervals and compared
//! with the change of the position, because a derivative of noisy positions is far noisier than an
//! integral of noisy velocities.

mod channel_ranges;
mod constant_channels;
mod effort_limits;
mod effort_ranges;
mod increments;
mod joint_rates;
mod joint_steps;
mod position_limits;
mod sample_checks;
mod twist_rates;

pub use channel_ranges::{RangeMonitor, Saturation};
pub use constant_channels::{ChannelMonitor, ConstantChannels, FEWEST_SAMPLES, WRENCH_CHANNELS};
pub use effort_limits::{EffortMonitor, EffortsBeyondLimits};
pub use effort_ranges::EffortRanges;
pub use increments::{FOURTH_ROUGHNESS, INTERVAL_S};
pub use joint_rates::{JointRates, VelocityCause, VelocityContradiction, grouped_by_cause};
pub use joint_steps::{PositionJumps, StepMonitor};
pub use position_limits::{PositionMonitor, PositionsBeyondLimits};
pub use sample_checks::SampleChecks;
pub use twist_rates::{TwistAxes, TwistContradiction, TwistRates};

/// Differences and residuals are no noise where their rms is this many times that of the noise
/// between neighbouring instants. Filtered or interpolated measurements share noise with their
/// neighbours, which shows less than there is.
pub const BEYOND_NOISE: f64 = 3.0;

/// Error of a sound model, relative to the measured load (rms over the channels): gains of force
/// sensors and inertias of robot models are rarely known better. What it explains is neither a
/// payload change nor a load that is unexplained.
pub const MODEL_ERROR: f64 = 0.03;

/// Relative rms difference between the change of a position and the integral of its velocity from
/// which they contradict each other without a known cause.
const UNEXPLAINED_CONTRADICTION: f64 = 0.5;
/// Relative rms difference from which they contradict each other where a cause explains it.
const EXPLAINED_CONTRADICTION: f64 = 0.1;
/// A cause explains a difference of which it leaves less than this fraction.
const EXPLAINED: f64 = 0.3;

/// Returns whether a relative difference is a contradiction, and which of the possible causes
/// explains it: that which leaves the smallest difference, if it leaves little.
fn judge<C>(difference: f64, causes: impl Iterator<Item = (f64, C)>) -> Option<Option<C>> {
    let best = causes.min_by(|a, b| a.0.total_cmp(&b.0));
    let cause = best.filter(|(rest, _)| *rest < EXPLAINED * difference);
    let threshold = match cause {
        Some(_) => EXPLAINED_CONTRADICTION,
        None => UNEXPLAINED_CONTRADICTION,
    };
    (difference > threshold).then(|| cause.map(|(_, cause)| cause))
}
