//! A stream: one measured quantity over time, averaged over or interpolated between its samples.

use std::collections::VecDeque;

use tactid_identify::equations::{InterpolationAt, interpolation};

use super::averaging::{REACH, weights};
use super::interpolation::Interpolate;

/// Value of a stream at a time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ValueAt<T> {
    Known(T),
    /// Later samples are needed.
    NotYet,
    /// The stream begins later, or has a gap there.
    Never,
}

/// The latest samples of one measured quantity.
#[derive(Clone, Debug)]
pub(crate) struct Stream<T> {
    samples: VecDeque<(f64, T)>,
    max_gap_s: f64,
    /// Period over which samples are averaged, s; `None` where they are interpolated.
    averaged_s: Option<f64>,
}

impl<T: Interpolate> Stream<T> {
    /// Creates a stream in which `max_gap_s` is the longest time between two samples that is
    /// bridged. Values are averaged over `averaged_s` seconds, if given.
    pub(crate) fn new(max_gap_s: f64, averaged_s: Option<f64>) -> Self {
        Self {
            samples: VecDeque::new(),
            max_gap_s,
            averaged_s,
        }
    }

    /// Adds a sample. One that is not later than the last is ignored.
    pub(crate) fn push(&mut self, time_s: f64, value: T) {
        if self
            .samples
            .back()
            .is_none_or(|(last_s, _)| time_s > *last_s)
        {
            self.samples.push_back((time_s, value));
        }
    }

    /// Returns whether the stream has not reached a time: its value there is
    /// [not yet](ValueAt::NotYet) known.
    pub(super) fn lags(&self, time_s: f64) -> bool {
        let last = self.samples.back();
        last.is_none_or(|(last_s, _)| *last_s < time_s)
    }

    /// Returns the value at a time: an [average](weights) where the stream is averaged and has
    /// neither a gap nor its start within it, else an interpolated one.
    ///
    /// Times must not decrease from call to call, because the samples before them are discarded.
    pub(crate) fn at(&mut self, time_s: f64) -> ValueAt<T> {
        let Some(period_s) = self.averaged_s else {
            self.discard_before(time_s);
            return self.interpolated(time_s);
        };
        self.discard_before(time_s - REACH * period_s);
        let average = self.average(time_s, period_s);
        average.unwrap_or_else(|| self.interpolated(time_s))
    }

    /// Returns the average about a time; `None` where the stream begins within it, or has a gap
    /// there.
    fn average(&self, time_s: f64, period_s: f64) -> Option<ValueAt<T>> {
        let (begin_s, end_s) = (time_s - REACH * period_s, time_s + REACH * period_s);
        let first = self.samples.partition_point(|(time, _)| *time <= begin_s);
        let first = first.checked_sub(1)?;
        let last = self.samples.partition_point(|(time, _)| *time < end_s);
        if last == self.samples.len() {
            return Some(ValueAt::NotYet);
        }
        let samples = self.samples.range(first..=last);
        let times_s: Vec<f64> = samples.clone().map(|(time, _)| *time).collect();
        if times_s
            .windows(2)
            .any(|pair| self.is_wide(pair[0], pair[1]))
        {
            return None;
        }
        let weights = weights(&times_s, time_s, period_s).into_iter();
        let weighted: Vec<(f64, &T)> = weights.zip(samples.map(|(_, value)| value)).collect();
        Some(ValueAt::Known(T::weighted_sum(&weighted)))
    }

    /// Returns whether two successive samples are so far apart that neither an average nor a cubic
    /// reaches over both: beyond a period both amplify the noise of the samples beside the dropout.
    fn is_wide(&self, before_s: f64, after_s: f64) -> bool {
        let longest_s = self.averaged_s.unwrap_or(f64::INFINITY).min(self.max_gap_s);
        after_s - before_s > longest_s
    }

    /// Returns the value at a time: that of a sample; of the cubic through two samples before and
    /// two after; or of the line between the two neighbours where an end is beside them, or two of
    /// the four are far apart.
    fn interpolated(&self, time_s: f64) -> ValueAt<T> {
        let samples = &self.samples;
        match self.interpolation(time_s) {
            InterpolationAt::Sample(index) => ValueAt::Known(samples[index].1.clone()),
            InterpolationAt::Between {
                first,
                count,
                weights,
            } => {
                let values =
                    std::array::from_fn(|k| (weights[k], &samples[first + k.min(count - 1)].1));
                let values: [(f64, &T); 4] = values;
                ValueAt::Known(T::weighted_sum(&values[..count]))
            }
            InterpolationAt::NotYet => ValueAt::NotYet,
            InterpolationAt::Never => ValueAt::Never,
        }
    }

    fn interpolation(&self, time_s: f64) -> InterpolationAt {
        let samples = &self.samples;
        let longest_s = self.averaged_s.unwrap_or(f64::INFINITY).min(self.max_gap_s);
        let time_of = |k: usize| samples[k].0;
        interpolation(samples.len(), time_of, time_s, self.max_gap_s, longest_s)
    }

    /// Discards all samples but the last two that are not later than a time.
    fn discard_before(&mut self, time_s: f64) {
        while self
            .samples
            .get(2)
            .is_some_and(|(third_s, _)| *third_s <= time_s)
        {
            self.samples.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use tactid_dynamics::Wrench;
    use tactid_identify::BaseState;

    use super::*;

    fn wrench(x: f64) -> Wrench {
        Wrench {
            force: Vector3::new(x, 0.0, 0.0),
            moment: Vector3::new(0.0, -x, 0.0),
        }
    }

    /// A cubic is exact between its samples; on a sample the value is the sample, bit by bit.
    #[test]
    fn interpolates_and_is_exact_on_a_sample() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 30.0 * t * t - 100.0 * t * t * t;
        let mut stream = Stream::new(1.0, None);
        for time_s in [0.1, 0.19, 0.31, 0.4] {
            stream.push(time_s, wrench(cubic(time_s)));
        }
        stream.push(0.4, wrench(9.0));
        assert_eq!(stream.at(0.0), ValueAt::Never);
        assert_eq!(stream.at(0.1), ValueAt::Known(wrench(cubic(0.1))));
        let ValueAt::Known(middle) = stream.at(0.25) else {
            panic!("no value between two samples")
        };
        assert!((middle.force.x - cubic(0.25)).abs() < 1e-12);
        assert_eq!(stream.at(0.31), ValueAt::Known(wrench(cubic(0.31))));
        assert_eq!(
            stream.at(0.35),
            ValueAt::NotYet,
            "the next sample may still come"
        );
    }

    /// A rotation through half of the quaternions' sphere is interpolated along the shorter arc,
    /// whatever the signs of the quaternions.
    #[test]
    fn interpolates_rotations_of_either_sign() {
        let turned = |angle: f64, sign: f64| {
            let q = UnitQuaternion::from_euler_angles(0.0, 0.0, angle);
            let q = UnitQuaternion::new_unchecked(q.into_inner() * sign);
            let mut base = BaseState::fixed();
            base.pose.rotation = q;
            base
        };
        let mut stream = Stream::new(1.0, None);
        for (k, sign) in [1.0, -1.0, 1.0, -1.0].into_iter().enumerate() {
            stream.push(0.1 * k as f64, turned(0.1 * k as f64, sign));
        }
        let ValueAt::Known(middle) = stream.at(0.15) else {
            panic!("no value between two samples")
        };
        let target = turned(0.15, 1.0).pose.rotation;
        assert!(middle.pose.rotation.angle_to(&target) < 1e-5);
    }

    /// A stream that is averaged waits for samples beyond the time, and is interpolated beside its
    /// start and a gap.
    #[test]
    fn averages_where_samples_reach() {
        let quadratic = |t: f64| 1.0 - 2.0 * t + 30.0 * t * t;
        let mut stream = Stream::new(0.05, Some(0.1));
        let push = |stream: &mut Stream<Wrench>, steps: std::ops::Range<i32>| {
            for time_s in steps.map(|k| 0.01 * f64::from(k)) {
                let alternating = (time_s * 1e2 * std::f64::consts::PI).cos();
                stream.push(time_s, wrench(quadratic(time_s) + alternating));
            }
        };
        let error = |value: ValueAt<Wrench>, time_s: f64| match value {
            ValueAt::Known(wrench) => (wrench.force.x - quadratic(time_s)).abs(),
            other => panic!("{other:?}"),
        };
        push(&mut stream, 0..40);
        assert!(error(stream.at(0.1), 0.1) > 0.9, "only one period before");
        assert!(error(stream.at(0.23), 0.23) < 0.01);
        assert_eq!(stream.at(0.25), ValueAt::NotYet);
        push(&mut stream, 60..100);
        assert!(
            error(stream.at(0.3), 0.3) > 0.9,
            "less than two periods after"
        );
        assert_eq!(stream.at(0.5), ValueAt::Never);
        assert!(error(stream.at(0.8), 0.8) < 0.01);
    }

    /// Beside a dropout of more than a period a stream is interpolated: means over periods without
    /// a sample would amplify the noise of the samples at the ends of the dropout.
    #[test]
    fn does_not_average_over_a_dropout() {
        for dropout_s in [0.12, 0.2, 0.29, 0.3, 0.31] {
            let mut stream = Stream::new(1.0, Some(0.1));
            for k in 0..200 {
                let time_s = 0.01 * f64::from(k);
                let is_out = (time_s - 1.0).abs() < 0.5 * dropout_s - 1e-9;
                let noise = if k % 2 == 0 { 1.0 } else { -1.0 };
                if !is_out {
                    stream.push(time_s, wrench(noise));
                }
            }
            for k in 60..140 {
                match stream.at(0.01 * f64::from(k)) {
                    ValueAt::Known(wrench) => assert!(
                        wrench.force.x.abs() < 2.0,
                        "{dropout_s} {k} {}",
                        wrench.force.x
                    ),
                    other => panic!("{other:?}"),
                }
            }
        }
    }

    /// A gap is not bridged.
    #[test]
    fn does_not_bridge_a_gap() {
        let mut stream = Stream::new(0.05, None);
        stream.push(0.0, wrench(1.0));
        stream.push(0.2, wrench(2.0));
        assert_eq!(stream.at(0.1), ValueAt::Never);
        assert_eq!(stream.at(0.2), ValueAt::Known(wrench(2.0)));
    }

    /// On random times with random gaps: a value is exactly the sample on a sample, the cubic
    /// itself between samples without a gap beside them, within its neighbours' hull of a line
    /// beside a gap, and none in a gap.
    #[test]
    fn interpolation_holds_on_random_times() {
        let mut random = SmallRng::seed_from_u64(1);
        let cubic = |t: f64| 0.3 + t - 2.0 * t * t + 0.5 * t * t * t;
        for _ in 0..200 {
            let mut times_s = vec![0.0];
            for _ in 0..12 {
                let is_gap = random.random::<f64>() < 0.2;
                let step_s = if is_gap { 0.5 } else { 0.1 } * (0.5 + random.random::<f64>());
                times_s.push(times_s[times_s.len() - 1] + step_s);
            }
            let mut stream = Stream::new(0.2, None);
            for time_s in &times_s {
                stream.push(*time_s, wrench(cubic(*time_s)));
            }
            for k in 0..times_s.len() - 2 {
                assert_eq!(
                    stream.at(times_s[k]),
                    ValueAt::Known(wrench(cubic(times_s[k])))
                );
                let (before_s, after_s) = (times_s[k], times_s[k + 1]);
                let time_s = before_s + random.random::<f64>() * (after_s - before_s);
                let is_dense = |k: usize| times_s[k + 1] - times_s[k] <= 0.2;
                match stream.at(time_s) {
                    ValueAt::NotYet => panic!("all samples have come"),
                    ValueAt::Never => assert!(!is_dense(k)),
                    ValueAt::Known(value) if k > 0 && is_dense(k - 1) && is_dense(k + 1) => {
                        assert!(is_dense(k));
                        assert!((value.force.x - cubic(time_s)).abs() < 1e-9, "{time_s}");
                    }
                    ValueAt::Known(value) => {
                        assert!(is_dense(k) || time_s == before_s);
                        let ends = [cubic(before_s), cubic(after_s)];
                        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                        assert!((low - 1e-12..=high + 1e-12).contains(&value.force.x));
                    }
                }
            }
        }
    }
}
