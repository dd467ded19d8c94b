//! Changes of positions beside the integrals of their velocities, summed over short intervals.

use educe::Educe;
use std::ops::Range;

use nalgebra::Vector4;

use super::BEYOND_NOISE;
use crate::equations::LANES;

/// Length of an interval, s: long enough for noise to average out, short enough for a motion not to
/// turn back.
pub const INTERVAL_S: f64 = 0.1;
/// Fewest intervals from which velocities are judged.
const FEWEST_INTERVALS: usize = 10;
/// Slower motion is not judged, rad/s or m/s rms: it hardly enters the equations.
const SLOWEST: f64 = 0.01;
/// Number of neighbouring increments in a third difference. Each is over a quarter of an interval,
/// after which the noise of most filtered sensors is forgotten.
const NEIGHBOURS: usize = 4;
/// Variance of fourth differences of white noise of variance one, and so of third differences of its
/// changes: the sum of the squares of the binomial coefficients 1, 4, 6, 4, 1.
pub const FOURTH_ROUGHNESS: f64 = 70.0;
/// Variance of third differences of the integrals of a velocity, relative to that of the integrals:
/// the sum of the squares of the binomial coefficients 1, 3, 3, 1.
const INTEGRAL_ROUGHNESS: f64 = 20.0;

/// Increments of some quantities over intervals of a series. The quantities are the columns, in
/// vectors of [`LANES`] of them.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub(super) struct Increments {
    max_gap_s: f64,
    /// The intervals that have ended: in a ring where their number is limited.
    intervals: Vec<Interval>,
    /// Largest number of intervals that are kept.
    most: usize,
    /// Number of intervals so far.
    count: usize,
    /// The interval that has not ended yet: its increments and their roughness are those of
    /// `columns`.
    open: Interval,
    columns: Vec<Columns>,
    /// Length of the quarter that has not ended yet, s.
    quarter_s: f64,
    /// Number of neighbouring quarters so far, at most [`NEIGHBOURS`].
    neighbours: usize,
}

/// Sums over the open interval of some columns, and their last quarters.
#[derive(Clone, Copy, Debug)]
struct Columns {
    sum: Vector4<f64>,
    roughness: Vector4<f64>,
    /// Increment over the quarter that has not ended yet.
    quarter: Vector4<f64>,
    /// The increment over the last quarter, and its first and second difference from those before.
    last: [Vector4<f64>; NEIGHBOURS - 1],
}

impl Columns {
    /// Columns without increments.
    fn zeros() -> Self {
        Self {
            sum: Vector4::zeros(),
            roughness: Vector4::zeros(),
            quarter: Vector4::zeros(),
            last: [Vector4::zeros(); NEIGHBOURS - 1],
        }
    }
}

/// Sums over one interval.
#[derive(Debug, Educe)]
#[educe(Clone)]
struct Interval {
    /// Increment of each column.
    increments: Vec<f64>,
    /// Sum of the squares of the third differences of neighbouring quarters, for each column.
    roughness: Vec<f64>,
    /// Number of third differences.
    differences: u64,
    /// Number of quarters that ended within the interval.
    quarters: u64,
    /// Number of increments.
    steps: u64,
    length_s: f64,
}

impl Interval {
    fn new(columns: usize) -> Self {
        Self {
            increments: vec![0.0; columns],
            roughness: vec![0.0; columns],
            differences: 0,
            quarters: 0,
            steps: 0,
            length_s: 0.0,
        }
    }
}

impl Increments {
    /// Creates increments of so many vectors of columns. Times between two samples that are longer
    /// than `max_gap_s` are not bridged. Only the last `most` intervals are kept, if given: then
    /// nothing is allocated later.
    pub(super) fn new(vectors: usize, max_gap_s: f64, most: Option<usize>) -> Self {
        let interval = Interval::new(LANES * vectors);
        Self {
            max_gap_s,
            intervals: vec![interval.clone(); most.unwrap_or(0)],
            most: most.unwrap_or(usize::MAX),
            count: 0,
            open: interval,
            columns: vec![Columns::zeros(); vectors],
            quarter_s: 0.0,
            neighbours: 0,
        }
    }

    /// Returns whether the time between two samples is short enough to be bridged.
    pub(super) fn is_bridged(&self, duration_s: f64) -> bool {
        duration_s > 0.0 && duration_s <= self.max_gap_s
    }

    /// Starts the sums again: the last sample and the next do not belong together.
    pub(super) fn interrupt(&mut self) {
        self.clear_open();
        (self.quarter_s, self.neighbours) = (0.0, 0);
        for columns in &mut self.columns {
            columns.quarter = Vector4::zeros();
        }
    }

    /// Adds the increments between two neighbouring samples, a vector for each of
    /// [`new`](Self::new).
    pub(super) fn push(&mut self, increment: &[Vector4<f64>], duration_s: f64) {
        for (columns, increment) in self.columns.iter_mut().zip(increment) {
            columns.sum += increment;
            columns.quarter += increment;
        }
        self.open.steps += 1;
        self.open.length_s += duration_s;
        self.quarter_s += duration_s;
        // A tenth less than a quarter, so that neither rounding nor jitter of the times changes the
        // number of steps at usual rates: differences of unequal quarters would contain the motion.
        if self.quarter_s >= 0.9 * INTERVAL_S / NEIGHBOURS as f64 {
            self.close_quarter();
        }
        if self.open.length_s >= INTERVAL_S {
            self.close_interval();
        }
    }

    fn close_quarter(&mut self) {
        self.quarter_s = 0.0;
        self.neighbours = NEIGHBOURS.min(self.neighbours + 1);
        let is_rough = self.neighbours == NEIGHBOURS;
        for columns in &mut self.columns {
            let [last, first, second] = columns.last;
            let quarter = std::mem::replace(&mut columns.quarter, Vector4::zeros());
            let firsts = quarter - last;
            let seconds = firsts - first;
            let thirds = seconds - second;
            columns.last = [quarter, firsts, seconds];
            if is_rough {
                columns.roughness += thirds.component_mul(&thirds);
            }
        }
        self.open.differences += u64::from(is_rough);
        self.open.quarters += 1;
    }

    fn close_interval(&mut self) {
        let sums = self.open.increments.chunks_mut(LANES);
        let sums = sums.zip(self.open.roughness.chunks_mut(LANES));
        for ((increments, roughness), columns) in sums.zip(&self.columns) {
            increments.copy_from_slice(columns.sum.as_slice());
            roughness.copy_from_slice(columns.roughness.as_slice());
        }
        let place = self.count % self.most;
        match self.intervals.get_mut(place) {
            Some(oldest) => oldest.clone_from(&self.open),
            None => self.intervals.push(self.open.clone()),
        }
        self.count += 1;
        self.clear_open();
    }

    /// Returns to the sums of no increment.
    fn clear_open(&mut self) {
        (self.open.differences, self.open.quarters) = (0, 0);
        (self.open.steps, self.open.length_s) = (0, 0.0);
        for columns in &mut self.columns {
            (columns.sum, columns.roughness) = (Vector4::zeros(), Vector4::zeros());
        }
    }

    /// Returns the rms difference between changes and integrals, relative to the larger rms of the
    /// two; 0 where it could be noise, `None` where the motion is too slow or too short. The
    /// integrals are multiplied by `scale`.
    pub(super) fn relative_difference(
        &self,
        changes: Range<usize>,
        integrals: Range<usize>,
        scale: f64,
    ) -> Option<f64> {
        let intervals = &self.intervals[..self.count.min(self.intervals.len())];
        if intervals.len() < FEWEST_INTERVALS {
            return None;
        }
        let (mut differences, mut change_squares, mut integral_squares) = (0.0, 0.0, 0.0);
        for interval in intervals {
            let increments = &interval.increments;
            let pairs = increments[changes.clone()].iter();
            for (change, integral) in pairs.zip(&increments[integrals.clone()]) {
                differences += (change - scale * integral).powi(2);
                change_squares += change.powi(2);
                integral_squares += (scale * integral).powi(2);
            }
        }
        let count = intervals.len() as f64;
        let total_s: f64 = intervals.iter().map(|interval| interval.length_s).sum();
        let motion = f64::max(change_squares, integral_squares);
        let slowest = (SLOWEST * total_s / count).powi(2) * count;
        let noise = change_noise(intervals, changes)?
            + scale.powi(2) * integral_noise(intervals, integrals)?;
        let is_noise = differences <= BEYOND_NOISE.powi(2) * noise * count;
        let relative = if is_noise { 0.0 } else { differences / motion };
        (motion > slowest).then(|| relative.sqrt())
    }
}

/// Returns the variance of the changes of some columns over an interval that is due to noise of the
/// positions at its two ends, if the interval has third differences.
fn change_noise(intervals: &[Interval], columns: Range<usize>) -> Option<f64> {
    Some(2.0 * roughness(intervals, columns)? / FOURTH_ROUGHNESS)
}

/// Returns the variance of the integrals of some columns over an interval that is due to noise of
/// the velocities, if the interval has third differences.
fn integral_noise(intervals: &[Interval], columns: Range<usize>) -> Option<f64> {
    let steps = intervals.iter().map(|interval| interval.steps).sum::<u64>() as f64;
    let quarters = intervals
        .iter()
        .map(|interval| interval.quarters)
        .sum::<u64>() as f64;
    // Neighbouring integrals share a sample and weigh it by the mean of their coefficients. Its
    // variance is that of two halves less a quarter of the squared difference of the coefficients,
    // and those differences are the coefficients of a fourth difference.
    let of_step = INTEGRAL_ROUGHNESS * steps / quarters - FOURTH_ROUGHNESS / 4.0;
    // The samples at both ends of an interval have half the weight.
    let steps_of_interval = steps / intervals.len() as f64 - 0.5;
    Some(steps_of_interval * roughness(intervals, columns)? / of_step)
}

/// Returns the sum over some columns of the mean squares of third differences, which are small for
/// a smooth motion, or `None` if there are no third differences.
fn roughness(intervals: &[Interval], columns: Range<usize>) -> Option<f64> {
    let squares = intervals
        .iter()
        .map(|interval| interval.roughness[columns.clone()].iter().sum::<f64>());
    let differences: u64 = intervals.iter().map(|interval| interval.differences).sum();
    (differences > 0).then(|| squares.sum::<f64>() / differences as f64)
}

#[cfg(test)]
mod tests {
    use rand::rngs::SmallRng;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use super::*;

    /// Velocities that are half as large again contradict smooth positions at every rate, also where
    /// rounding makes a quarter of an interval now shorter and now longer than a number of periods.
    #[test]
    fn a_smooth_motion_is_no_noise() {
        for period_s in [
            0.04, 0.025, 0.02, 0.0125, 0.01, 0.008, 0.005, 0.004, 0.002, 1e-3,
        ] {
            let mut increments = Increments::new(2, 1.0, None);
            let at = |k: u32| {
                (
                    f64::from(k) * period_s,
                    (3.0 * f64::from(k) * period_s).sin_cos(),
                )
            };
            let steps = (10.0 / period_s) as u32;
            for (last, next) in (0..steps).map(|k| (at(k), at(k + 1))) {
                let duration_s = next.0 - last.0;
                let change = Vector4::repeat(next.1.0 - last.1.0);
                let rate = 1.5 * 3.0 * (last.1.1 + next.1.1) / 2.0;
                increments.push(&[change, Vector4::repeat(rate * duration_s)], duration_s);
            }
            let found = increments.relative_difference(0..LANES, LANES..2 * LANES, 1.0);
            let error = found.unwrap() - 1.0 / 3.0;
            assert!(error.abs() < 0.01, "{period_s} s: {found:?}");
        }
    }

    /// The noise of increments over intervals is that of white noise of positions and velocities,
    /// whether a quarter of an interval has one step or 25.
    #[test]
    fn white_noise_has_its_variance() {
        for period_s in [0.03, 0.012, 1e-3] {
            let mut random = SmallRng::seed_from_u64(7);
            let mut noise = || Vector4::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
            let mut increments = Increments::new(2, 1.0, None);
            let mut last = [noise(), noise()];
            for _ in 0..40_000 {
                let next = [noise(), noise()];
                let integral = (last[1] + next[1]) * (0.5 * period_s);
                increments.push(&[next[0] - last[0], integral], period_s);
                last = next;
            }
            let intervals = &increments.intervals;
            let mean_square = |columns: Range<usize>| {
                let squares = intervals
                    .iter()
                    .flat_map(|interval| &interval.increments[columns.clone()])
                    .map(|increment| increment.powi(2));
                squares.sum::<f64>() / intervals.len() as f64
            };
            let of_changes = change_noise(intervals, 0..LANES).unwrap() / mean_square(0..LANES);
            let integrals = LANES..2 * LANES;
            let of_integrals =
                integral_noise(intervals, integrals.clone()).unwrap() / mean_square(integrals);
            assert!((of_changes - 1.0).abs() < 0.1, "{period_s} s: {of_changes}");
            assert!(
                (of_integrals - 1.0).abs() < 0.1,
                "{period_s} s: {of_integrals}"
            );
        }
    }
}
