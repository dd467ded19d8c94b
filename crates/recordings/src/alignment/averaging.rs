//! Averaging of streams that are faster than the joints: which ones, over which period, and with
//! which weights.

use super::event::{Averaging, Event, Measured, Streams};

/// A stream with at least this number of samples in a period of the joints is averaged over it.
/// Below, the four samples that interpolation takes are as many as an average would have.
const FASTER: f64 = 2.0;

/// A wrench with at least this period relative to that of the joints is interpolated so that
/// neighbouring samples share noise.
const SLOWER: f64 = 1.1;

/// Periods of a wrench after which an interpolation has next to no noise in common with one before.
const SHARED_PERIODS: f64 = 1.5;

/// Number of periods that the weights reach to either side.
pub(super) const REACH: f64 = 1.5;

impl Averaging {
    /// Compares the periods of streams with that of the joints in the beginning of a recording.
    pub(crate) fn of(streams: &Streams, events: &[Event]) -> Self {
        let of_joints = |measured: &Measured| matches!(measured, Measured::Joints(_));
        let Some(period_s) = median_period_s(events, of_joints) else {
            return Self::default();
        };
        let faster = |is_of: &dyn Fn(&Measured) -> bool| {
            let own_s = median_period_s(events, is_of)?;
            (period_s >= FASTER * own_s).then_some(own_s)
        };
        let averaged = |is_of: &dyn Fn(&Measured) -> bool| faster(is_of).map(|_| period_s);
        let of_wrench = |k: usize| move |measured: &Measured| matches!(measured, Measured::Wrench(of, _) if *of == k);
        let wrenches: Vec<Option<f64>> = (0..streams.wrenches)
            .map(|k| faster(&of_wrench(k)))
            .collect();
        let slower_wrench_s = (0..streams.wrenches)
            .filter_map(|k| median_period_s(events, of_wrench(k)))
            .filter(|own_s| *own_s >= SLOWER * period_s)
            .fold(0.0, f64::max);
        Self {
            more_joints: (0..streams.more_joints.len())
                .map(|k| {
                    averaged(
                        &|measured| matches!(measured, Measured::MoreJoints(of, _) if *of == k),
                    )
                })
                .collect(),
            base: averaged(&|measured| matches!(measured, Measured::Base(_))),
            acceleration: averaged(&|measured| matches!(measured, Measured::Acceleration(_))),
            base_imu: averaged(&|measured| matches!(measured, Measured::BaseImu(_))),
            noise_ratios: wrenches
                .iter()
                .map(|own_s| own_s.map_or(1.0, |own_s| noise_ratio(period_s / own_s)))
                .collect(),
            wrenches: wrenches
                .iter()
                .map(|own_s| own_s.map(|_| period_s))
                .collect(),
            slower_wrench_s,
        }
    }

    /// Returns the longest time by which an average reaches beyond its middle, s.
    pub(super) fn reach_s(&self) -> f64 {
        let single = [self.base, self.acceleration, self.base_imu];
        let several = self.more_joints.iter().chain(&self.wrenches);
        let periods = single.iter().chain(several).flatten();
        REACH * periods.fold(0.0, |a: f64, &b| a.max(b))
    }

    /// Returns the time during which the wrenches of samples have noise in common, s.
    pub(crate) fn shared_noise_s(&self) -> f64 {
        SHARED_PERIODS * self.slower_wrench_s
    }

    /// Returns the standard deviations of the noise of aligned wrenches, given those of samples:
    /// once for all sensors, once for each, or none.
    pub(crate) fn of_averages(&self, noise: &[[f64; 6]]) -> Vec<[f64; 6]> {
        if noise.is_empty() || self.noise_ratios.iter().all(|ratio| *ratio == 1.0) {
            return noise.to_vec();
        }
        let of_sensors = noise.iter().cycle().zip(&self.noise_ratios);
        of_sensors
            .map(|(std_devs, ratio)| std_devs.map(|std_dev| std_dev * ratio))
            .collect()
    }
}

/// Returns the median time between two events of a stream, s; `None` where it has fewer than two.
fn median_period_s(events: &[Event], is_of: impl Fn(&Measured) -> bool) -> Option<f64> {
    let times_s = events
        .iter()
        .filter(|event| is_of(&event.measured))
        .map(|event| event.time_s);
    let later = times_s.clone().skip(1);
    let mut periods_s: Vec<f64> = times_s.zip(later).map(|(a, b)| b - a).collect();
    let middle = periods_s.len() / 2;
    if periods_s.is_empty() {
        return None;
    }
    let (_, median_s, _) = periods_s.select_nth_unstable_by(middle, f64::total_cmp);
    (*median_s > 0.0).then_some(*median_s)
}

/// Returns the standard deviation of white noise in an average over so many samples a period,
/// relative to that of a sample.
fn noise_ratio(samples: f64) -> f64 {
    let count = (REACH * samples).ceil() + 1.0;
    let times: Vec<f64> = (0..=2 * count as usize)
        .map(|k| (k as f64 - count) / samples)
        .collect();
    let weights = weights(&times, 0.0, 1.0);
    weights
        .iter()
        .map(|weight| weight * weight)
        .sum::<f64>()
        .sqrt()
}

/// Returns the weights of samples at `times_s` in their average about a time, s. The times reach
/// beyond [`REACH`] periods to either side.
///
/// It is a mean over the period about the time, which has nothing of what repeats with the joints'
/// period and would otherwise appear as a slow motion. A mean also flattens a curved course; the
/// means over the periods before and after show by how much, and a small multiple of them is
/// subtracted, so that the average is exact for a quadratic course and, where the times are
/// symmetric, for a cubic one. Means are those of the lines between samples.
pub(super) fn weights(times_s: &[f64], time_s: f64, period_s: f64) -> Vec<f64> {
    let means = [-1.0, 0.0, 1.0].map(|k| weights_of_mean(times_s, time_s + k * period_s, period_s));
    let squares = |weights: &Vec<f64>| -> f64 {
        let terms = weights.iter().zip(times_s);
        terms
            .map(|(weight, at_s)| weight * (at_s - time_s).powi(2))
            .sum()
    };
    let [before, about, after] = &means;
    let curved = squares(before) + squares(after) - 2.0 * squares(about);
    let ratio = squares(about) / curved;
    let pairs = about.iter().zip(before.iter().zip(after));
    pairs
        .map(|(about, (before, after))| (1.0 + 2.0 * ratio) * about - ratio * (before + after))
        .collect()
}

/// Returns the weights of samples in the mean, over a period about a time, of the lines between the
/// samples.
fn weights_of_mean(times_s: &[f64], time_s: f64, period_s: f64) -> Vec<f64> {
    let (begin_s, end_s) = (time_s - 0.5 * period_s, time_s + 0.5 * period_s);
    let mut weights = vec![0.0; times_s.len()];
    for (k, pair) in times_s.windows(2).enumerate() {
        let (from_s, to_s) = (pair[0].max(begin_s), pair[1].min(end_s));
        if from_s < to_s {
            let weight = (to_s - from_s) / period_s;
            let fraction = (0.5 * (from_s + to_s) - pair[0]) / (pair[1] - pair[0]);
            weights[k] += weight * (1.0 - fraction);
            weights[k + 1] += weight * fraction;
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    fn average(times_s: &[f64], time_s: f64, of: impl Fn(f64) -> f64) -> f64 {
        let weights = weights(times_s, time_s, 1.0);
        let terms = weights.iter().zip(times_s);
        terms.map(|(weight, &at_s)| weight * of(at_s)).sum()
    }

    /// On random times an average is exact for a quadratic course.
    #[test]
    fn averages_are_exact_for_a_quadratic_course() {
        let mut random = SmallRng::seed_from_u64(4);
        let quadratic = |t: f64| 3.0 - 2.0 * t + 5.0 * t * t;
        for samples in [2.0, 2.5, 7.0, 56.0] {
            let steps = (4.0 * samples) as i32;
            let times_s: Vec<f64> = (-steps / 2..=steps / 2)
                .map(|k| (f64::from(k) + random.random_range(-0.3..0.3)) / samples)
                .collect();
            let time_s = random.random_range(-0.1..0.1);
            let error = average(&times_s, time_s, quadratic) - quadratic(time_s);
            assert!(error.abs() < 1e-12, "{samples} {error}");
        }
    }

    /// What repeats with the period of the joints is not in an average, whose noise is that of a
    /// mean.
    #[test]
    fn averages_have_nothing_of_what_repeats() {
        let times_s: Vec<f64> = (-120..=120).map(|k| (f64::from(k) + 0.3) / 56.0).collect();
        for harmonic in [1.0, 2.0, 3.0] {
            let vibration = |t: f64| (TAU * harmonic * t + 1.0).sin();
            let found = average(&times_s, 0.0, vibration);
            assert!(found.abs() < 1e-3, "{harmonic} {found}");
        }
        let ratio = noise_ratio(56.0) * 56f64.sqrt();
        assert!((1.0..1.1).contains(&ratio), "{ratio}");
    }
}
