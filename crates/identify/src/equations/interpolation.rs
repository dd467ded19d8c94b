//! Interpolation between the samples of one measured quantity.

/// How the value at a time follows from samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InterpolationAt {
    /// It is that of one sample.
    Sample(usize),
    /// It is the weighted sum of some samples.
    Between {
        /// Index of the first of these samples.
        first: usize,
        /// Number of samples.
        count: usize,
        /// Weights of the samples in order, which sum to one.
        weights: [f64; 4],
    },
    /// Later samples are needed.
    NotYet,
    /// The samples begin later, or have a gap there.
    Never,
}

/// Returns how the value at `time_s` follows from `count` samples at increasing times: that of a
/// sample; of the cubic through two samples before and two after; or of the line between the two
/// neighbours where an end is beside them, or two of the four are further apart than `longest_s`. A
/// longer time than `max_gap_s` between two samples is a gap.
#[must_use]
pub fn interpolation(
    count: usize,
    time_of: impl Fn(usize) -> f64,
    time_s: f64,
    max_gap_s: f64,
    longest_s: f64,
) -> InterpolationAt {
    let (mut left, mut right) = (0, count);
    while left < right {
        let middle = usize::midpoint(left, right);
        if time_of(middle) <= time_s {
            left = middle + 1;
        } else {
            right = middle;
        }
    }
    let Some(left) = right.checked_sub(1) else {
        return if count == 0 {
            InterpolationAt::NotYet
        } else {
            InterpolationAt::Never
        };
    };
    if time_of(left) == time_s {
        return InterpolationAt::Sample(left);
    }
    if right == count {
        return InterpolationAt::NotYet;
    }
    if time_of(right) - time_of(left) > max_gap_s {
        return InterpolationAt::Never;
    }
    if left > 0 && right + 1 == count {
        return InterpolationAt::NotYet;
    }
    let is_dense = |k: usize| time_of(k + 1) - time_of(k) <= longest_s;
    if left > 0 && (left - 1..=right).all(is_dense) {
        let times_s = std::array::from_fn(|k| time_of(left - 1 + k));
        return InterpolationAt::Between {
            first: left - 1,
            count: 4,
            weights: cubic_weights(&times_s, time_s),
        };
    }
    let fraction = (time_s - time_of(left)) / (time_of(right) - time_of(left));
    InterpolationAt::Between {
        first: left,
        count: 2,
        weights: [1.0 - fraction, fraction, 0.0, 0.0],
    }
}

/// Weights of the values at four different times for the value of the cubic through them
/// (Lagrange).
fn cubic_weights(times_s: &[f64; 4], time_s: f64) -> [f64; 4] {
    std::array::from_fn(|k| {
        let others = times_s.iter().enumerate().filter(|(other, _)| *other != k);
        let factors = others.map(|(_, other_s)| (time_s - other_s) / (times_s[k] - other_s));
        factors.product()
    })
}
