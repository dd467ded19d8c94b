//! Measured velocities against the positions that they belong to: a velocity that is not the derivative of its
//! position is in other axes, in other units, of the opposite sign or of another joint.
//!
//! Velocities are integrated over short intervals and compared with the change of the position, because a derivative
//! of noisy positions is far noisier than an integral of noisy velocities.

mod increments;
mod joints;
mod twist;

use crate::Finding;
use crate::alignment::Event;
use crate::recording::Sources;

/// Relative rms difference between the change of a position and the integral of its velocity from which they
/// contradict each other.
const CONTRADICTION: f64 = 0.5;
/// Relative rms difference from which they contradict each other where a cause explains it.
const EXPLAINED_CONTRADICTION: f64 = 0.1;
/// A cause explains a difference of which it leaves less than this fraction.
const EXPLAINED: f64 = 0.3;

/// Returns findings about measured velocities that are not the derivatives of the measured positions. Times between
/// two events that are longer than `max_gap_s` are not bridged.
pub(crate) fn contradicted_rates(
    sources: &Sources,
    events: &[Event],
    max_gap_s: f64,
) -> Vec<Finding> {
    let mut findings = joints::contradicted(sources, events, max_gap_s);
    findings.extend(twist::contradicted(sources, events, max_gap_s));
    findings
}

/// Returns whether a relative difference is a contradiction, and which of the possible causes explains it: that which
/// leaves the smallest difference, if it leaves little.
fn judge<C>(difference: f64, causes: impl Iterator<Item = (f64, C)>) -> Option<Option<C>> {
    let best = causes.min_by(|a, b| a.0.total_cmp(&b.0));
    let cause = best.filter(|(rest, _)| *rest < EXPLAINED * difference);
    let threshold = match cause {
        Some(_) => EXPLAINED_CONTRADICTION,
        None => CONTRADICTION,
    };
    (difference > threshold).then(|| cause.map(|(_, cause)| cause))
}
