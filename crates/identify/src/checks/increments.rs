//! Changes of positions beside the integrals of their velocities, summed over short intervals.

use educe::Educe;
use std::ops::Range;

use nalgebra::Vector4;

use super::BEYOND_NOISE;
use crate::equations::LANES;

/// Length of an interval, s: long enough for noise to average out, short enough for a motion not to
/// turn back.
pub(crate) const INTERVAL_S: f64 = 0.1;
/// Fewest intervals from which velocities are judged.
const FEWEST_INTERVALS: usize = 10;
/// Slower motion is not judged, rad/s or m/s rms: it hardly enters the equations.
const SLOWEST: f64 = 0.01;
/// Number of neighbouring increments in a third difference.
const NEIGHBOURS: usize = 4;
/// Variance of third differences of the changes of a position, for white noise of variance one in
/// the position: the sum of the squares of the binomial coefficients 1, 4, 6, 4, 1.
const CHANGE_ROUGHNESS: f64 = 70.0;
/// Variance of third differences of the integrals of a velocity by the trapezoidal rule, relative
/// to the variance that one of them adds to a sum.
const INTEGRAL_ROUGHNESS: f64 = 2.5;

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
    /// Number of neighbouring increments so far, at most [`NEIGHBOURS`].
    neighbours: usize,
}

/// Sums over the open interval of some columns, and their last increments.
#[derive(Clone, Copy, Debug)]
struct Columns {
    sum: Vector4<f64>,
    roughness: Vector4<f64>,
    /// The last increment, and its first and second difference from those before.
    last: [Vector4<f64>; NEIGHBOURS - 1],
}

impl Columns {
    /// Columns without increments.
    fn zeros() -> Self {
        Self {
            sum: Vector4::zeros(),
            roughness: Vector4::zeros(),
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
    /// Sum of the squares of the third differences of neighbouring increments, for each column.
    roughness: Vec<f64>,
    /// Number of third differences.
    differences: u64,
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
        self.neighbours = 0;
    }

    /// Adds the increments between two neighbouring samples, a vector for each of
    /// [`new`](Self::new).
    pub(super) fn push(&mut self, increment: &[Vector4<f64>], duration_s: f64) {
        self.neighbours = NEIGHBOURS.min(self.neighbours + 1);
        let is_rough = self.neighbours == NEIGHBOURS;
        for (columns, increment) in self.columns.iter_mut().zip(increment) {
            let [last, first, second] = columns.last;
            let firsts = increment - last;
            let seconds = firsts - first;
            let thirds = seconds - second;
            columns.last = [*increment, firsts, seconds];
            columns.sum += increment;
            if is_rough {
                columns.roughness += thirds.component_mul(&thirds);
            }
        }
        self.open.differences += u64::from(is_rough);
        self.open.steps += 1;
        self.open.length_s += duration_s;
        if self.open.length_s >= INTERVAL_S {
            self.close_interval();
        }
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
        (self.open.differences, self.open.steps, self.open.length_s) = (0, 0, 0.0);
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
        let steps: u64 = intervals.iter().map(|interval| interval.steps).sum();
        let motion = f64::max(change_squares, integral_squares);
        let slowest = (SLOWEST * total_s / count).powi(2) * count;
        let noise = 2.0 * roughness(intervals, changes) / CHANGE_ROUGHNESS
            + steps as f64 / count * scale.powi(2) * roughness(intervals, integrals)
                / INTEGRAL_ROUGHNESS;
        let is_noise = differences <= BEYOND_NOISE.powi(2) * noise * count;
        let relative = if is_noise { 0.0 } else { differences / motion };
        (motion > slowest).then(|| relative.sqrt())
    }
}

/// Returns the sum over some columns of the mean squares of third differences, which are small for
/// a smooth motion.
fn roughness(intervals: &[Interval], columns: Range<usize>) -> f64 {
    let squares = intervals
        .iter()
        .map(|interval| interval.roughness[columns.clone()].iter().sum::<f64>());
    let differences: u64 = intervals.iter().map(|interval| interval.differences).sum();
    squares.sum::<f64>() / differences.max(1) as f64
}
