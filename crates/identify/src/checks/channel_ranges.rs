//! Limits that channels do not pass, as those of a saturated sensor, and channels that are zero in
//! all samples.

use educe::Educe;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FEWEST_SAMPLES;

/// From where on the end of a range is a limit.
struct LimitSettings {
    /// Least fraction of the samples at it: robust weights bear fewer.
    at_limit: f64,
    /// Fraction of the samples at it up to which the result stays right.
    harmless: f64,
    /// Least number of samples at it relative to that at the next value that occurs.
    over_next: f64,
    /// Least range of the channel in units of the step between it and the next value: a channel of
    /// coarser steps stays at one of them without a limit.
    steps: f64,
    /// Least standard deviation of some other channel while one is at its limit, relative to that
    /// over all samples: at rest, all channels stay where they are.
    others_move: f64,
}

/// A sine in steps has at most 2.4 times as many samples at its top as at the next step, because it
/// turns slowly. The other limits are between motions in steps and with rests and those that are cut
/// off, of 200 random ones each. Up to a tenth of the samples at a limit, the mass of 50 random loads
/// is right to 0.6 % and 2.7 standard deviations; from 15 % on, it is wrong by up to 20 % without
/// another finding.
const LIMIT: LimitSettings = LimitSettings {
    at_limit: 0.02,
    harmless: 0.1,
    over_next: 5.0,
    steps: 50.0,
    others_move: 0.25,
};

/// Channels that are at a limit in many samples and beyond it in none, although others change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Saturation {
    /// The channels, such as `force x`, or the joints; twice where both limits are reached.
    pub channels: Vec<String>,
    /// The limit of each, N, or N m of moments and of the torques of joints.
    pub limits: Vec<f64>,
    /// Fraction of the samples at the limit of each, without a unit.
    pub fractions: Vec<f64>,
}

impl Saturation {
    /// Returns whether some channel is so often at its limit that the result is wrong.
    #[must_use]
    pub fn contradicts(&self) -> bool {
        self.fractions
            .iter()
            .any(|&fraction| fraction > LIMIT.harmless)
    }
}

/// Records the ends of the ranges of channels that are measured together. Nothing is allocated
/// after construction.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct RangeMonitor {
    /// The first sample.
    first: Vec<f64>,
    all: Vec<Moments>,
    /// Upper end, and lower end with the opposite sign, of each channel.
    ends: Vec<[End; 2]>,
    samples: u64,
}

/// Sums of the differences between values and the first one.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    sum: f64,
    squares: f64,
}

/// An end of the range of a channel.
#[derive(Debug, Educe)]
#[educe(Clone)]
struct End {
    value: f64,
    count: f64,
    /// The value next to the end that occurs, and how often it does.
    next: f64,
    next_count: f64,
    /// All channels in the samples at the end.
    at_end: Vec<Moments>,
}

impl Moments {
    fn add(&mut self, difference: f64) {
        self.sum += difference;
        self.squares += difference * difference;
    }

    fn variance(&self, count: f64) -> f64 {
        let mean = self.sum / count;
        (self.squares / count - mean * mean).max(0.0)
    }
}

impl End {
    fn new(channels: usize) -> Self {
        Self {
            value: f64::NEG_INFINITY,
            count: 0.0,
            next: f64::NEG_INFINITY,
            next_count: 0.0,
            at_end: vec![Moments::default(); channels],
        }
    }

    /// Adds a value, and returns whether it is at the end.
    fn push(&mut self, value: f64) -> bool {
        if value > self.value {
            (self.next, self.next_count) = (self.value, self.count);
            (self.value, self.count) = (value, 0.0);
            self.at_end.fill(Moments::default());
        }
        let is_at_end = value == self.value;
        if is_at_end {
            self.count += 1.0;
        } else if value > self.next {
            (self.next, self.next_count) = (value, 1.0);
        } else if value == self.next {
            self.next_count += 1.0;
        }
        is_at_end
    }
}

impl RangeMonitor {
    /// Creates the monitor of so many channels, of which those from `watched` on are only looked at
    /// while another one is at its limit.
    #[must_use]
    pub fn new(channels: usize, watched: usize) -> Self {
        let end = || End::new(channels);
        Self {
            first: vec![0.0; channels],
            all: vec![Moments::default(); channels],
            ends: (0..watched).map(|_| [end(), end()]).collect(),
            samples: 0,
        }
    }

    /// Adds a sample of all channels. One with another number of values, or with values that are
    /// not finite, counts for nothing.
    pub fn push(&mut self, values: impl Iterator<Item = f64> + Clone) {
        let is_finite = values.clone().all(f64::is_finite);
        if !is_finite || values.clone().count() != self.first.len() {
            return;
        }
        if self.samples == 0 {
            let firsts = self.first.iter_mut().zip(values.clone());
            firsts.for_each(|(first, value)| *first = value);
        }
        self.samples += 1;
        let differences = values
            .clone()
            .zip(&self.first)
            .map(|(now, first)| now - first);
        let all = self.all.iter_mut().zip(differences.clone());
        all.for_each(|(moments, difference)| moments.add(difference));
        for (ends, value) in self.ends.iter_mut().zip(values) {
            // A channel that has not changed yet has no limit, and most are between their ends.
            let [upper, lower] = &*ends;
            let is_constant = value == upper.value && -value == lower.value;
            if is_constant || (value < upper.next && -value < lower.next) {
                continue;
            }
            for (end, value) in ends.iter_mut().zip([value, -value]) {
                if end.push(value) {
                    let at_end = end.at_end.iter_mut().zip(differences.clone());
                    at_end.for_each(|(moments, difference)| moments.add(difference));
                }
            }
        }
    }

    /// Returns whether a channel is zero in all of at least 100 samples.
    #[must_use]
    pub fn is_zero(&self, channel: usize) -> bool {
        let is_zero = |ends: &[End; 2]| ends.iter().all(|end| end.value == 0.0);
        self.samples >= FEWEST_SAMPLES && self.ends.get(channel).is_some_and(is_zero)
    }

    /// Returns whether a channel has had two different values.
    #[must_use]
    pub fn changes(&self, channel: usize) -> bool {
        self.all.get(channel).is_some_and(|all| all.squares > 0.0)
    }

    /// Returns the channels that are saturated, of those that have a `name`, with values times
    /// `sign`.
    #[must_use]
    pub fn saturation<'a>(
        &self,
        name: impl Fn(usize) -> Option<&'a str>,
        sign: f64,
    ) -> Option<Saturation> {
        let mut found = Saturation {
            channels: Vec::new(),
            limits: Vec::new(),
            fractions: Vec::new(),
        };
        for (channel, ends) in self.ends.iter().enumerate() {
            let Some(name) = name(channel) else {
                continue;
            };
            let range = ends[0].value + ends[1].value;
            for (end, of_end) in ends.iter().zip([1.0, -1.0]) {
                if self.is_limit(channel, end, range) {
                    found.channels.push(name.to_owned());
                    found.limits.push(sign * of_end * end.value);
                    found.fractions.push(end.count / self.samples as f64);
                }
            }
        }
        (!found.channels.is_empty()).then_some(found)
    }

    /// Returns whether an end of a channel, whose values have a range, is a limit.
    fn is_limit(&self, channel: usize, end: &End, range: f64) -> bool {
        let samples = self.samples as f64;
        // Drivers give zero for forces that are too small to be shown, or are not measured.
        let is_often = end.value != 0.0 && end.count >= LIMIT.at_limit * samples;
        let moves = || {
            let of_channels = end.at_end.iter().zip(&self.all).enumerate();
            let mut others = of_channels.filter(|(other, _)| *other != channel);
            others.any(|(_, (at_end, all))| {
                let variance = all.variance(samples);
                variance > 0.0 && at_end.variance(end.count) >= LIMIT.others_move.powi(2) * variance
            })
        };
        self.samples >= FEWEST_SAMPLES
            && is_often
            && end.count >= LIMIT.over_next * end.next_count
            && range >= LIMIT.steps * (end.value - end.next)
            && moves()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns what 20 s at 100 Hz of two sines show, the first one after `measured`.
    fn found(measured: impl Fn(f64) -> f64) -> Option<Saturation> {
        let mut monitor = RangeMonitor::new(2, 2);
        for k in 0..2000 {
            let time_s = 0.01 * f64::from(k);
            let other = (1.7 * time_s).cos();
            monitor.push([measured((2.3 * time_s).sin()), other].into_iter());
        }
        monitor.saturation(|k| Some(["force x", "force y"][k]), -1.0)
    }

    fn in_steps(value: f64, step: f64) -> f64 {
        (value / step).round() * step
    }

    /// A channel that is cut off at its range is found, also in steps, with its sign, and at both
    /// ends; one that turns there in its own time, or in coarse steps, is not.
    #[test]
    fn a_limit_is_where_many_samples_are_and_none_beyond() {
        for step in [1e-9, 0.01] {
            let clipped = found(|force| in_steps(30.0 * force, 30.0 * step).min(21.0)).unwrap();
            assert_eq!(clipped.channels, ["force x"], "{step}");
            assert!((clipped.limits[0] + 21.0).abs() < 1e-9);
            // A quarter of a period, of eight tops in 7.3 periods, the last one in part.
            assert!((clipped.fractions[0] - 0.269).abs() < 0.01, "{clipped:?}");
            assert_eq!(found(|force| in_steps(force, step)), None, "{step}");
        }
        let both = found(|force| force.clamp(-0.7, 0.7)).unwrap();
        assert_eq!(both.limits, [-0.7, 0.7]);
        assert!(both.contradicts());
        assert!(!found(|force| force.min(0.98)).unwrap().contradicts());
        assert_eq!(found(|force| in_steps(force, 0.25).min(0.75)), None);
        // Too few samples at the limit, a channel that never changes, and one that is cut to zero.
        assert_eq!(found(|force| force.min(0.9999)), None);
        assert_eq!(found(|_| 5.0), None);
        assert_eq!(found(|force| force.min(0.0)), None);
    }

    /// At rest at an end of its range, a channel has no limit there: others are at rest, too.
    #[test]
    fn a_rest_is_no_limit() {
        for rest_s in [4.0, 12.0] {
            let mut monitor = RangeMonitor::new(2, 2);
            for k in 0..2000 {
                let angle = (0.01 * f64::from(k) - rest_s).max(0.0);
                monitor.push([angle.cos(), (2.0 * angle).sin()].into_iter());
            }
            assert_eq!(monitor.saturation(|k| Some(["a", "b"][k]), 1.0), None);
        }
    }

    /// Zero throughout is neither zero at first nor zero in few samples.
    #[test]
    fn zero_in_all_samples() {
        let zero = |samples: usize, last: f64| {
            let mut monitor = RangeMonitor::new(2, 1);
            for k in 0..samples {
                let value = if k + 1 == samples { last } else { 0.0 };
                monitor.push([value, k as f64].into_iter());
            }
            assert!(monitor.changes(1));
            monitor.is_zero(0)
        };
        assert!(zero(100, 0.0));
        assert!(!zero(100, 0.1));
        assert!(!zero(100, -0.1));
        assert!(!zero(99, 0.0));
    }
}
