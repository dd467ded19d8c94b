//! Changes of positions beside the integrals of their velocities, summed over short intervals.

use std::ops::Range;

/// Length of an interval, s: long enough for noise to average out, short enough for a motion not to turn back.
const INTERVAL_S: f64 = 0.1;
/// Fewest intervals from which velocities are judged.
const FEWEST_INTERVALS: usize = 10;
/// Slower motion is not judged, rad/s or m/s rms: it hardly enters the equations.
const SLOWEST: f64 = 0.01;
/// A difference is no noise where its rms is this many times that of the noise.
const BEYOND_NOISE: f64 = 3.0;
/// Number of neighbouring increments in a third difference.
const NEIGHBOURS: usize = 4;
/// Variance of third differences of the changes of a position, for white noise of variance one in the position: the
/// sum of the squares of the binomial coefficients 1, 4, 6, 4, 1.
const CHANGE_ROUGHNESS: f64 = 70.0;
/// Variance of third differences of the integrals of a velocity by the trapezoidal rule, relative to the variance
/// that one of them adds to a sum.
const INTEGRAL_ROUGHNESS: f64 = 2.5;

/// Increments of some quantities, the columns, over intervals of a series.
#[derive(Clone, Debug)]
pub(super) struct Increments {
    columns: usize,
    max_gap_s: f64,
    /// Increments of each interval, interval by interval: in a ring where their number is limited.
    intervals: Vec<f64>,
    /// Largest number of intervals that are kept.
    most: usize,
    /// Number of intervals so far.
    count: usize,
    /// Increments, and length, of the interval that has not ended yet.
    open: Vec<f64>,
    open_s: f64,
    total_s: f64,
    steps: u64,
    roughness: Roughness,
}

impl Increments {
    /// Creates increments of so many columns. Times between two samples that are longer than `max_gap_s` are not
    /// bridged. Only the last `most` intervals are kept, if given: then nothing is allocated later.
    pub(super) fn new(columns: usize, max_gap_s: f64, most: Option<usize>) -> Self {
        Self {
            columns,
            max_gap_s,
            intervals: Vec::with_capacity(most.unwrap_or(0) * columns),
            most: most.unwrap_or(usize::MAX),
            count: 0,
            open: vec![0.0; columns],
            open_s: 0.0,
            total_s: 0.0,
            steps: 0,
            roughness: Roughness::new(columns),
        }
    }

    /// Returns whether the time between two samples is short enough to be bridged.
    pub(super) fn is_bridged(&self, duration_s: f64) -> bool {
        duration_s > 0.0 && duration_s <= self.max_gap_s
    }

    /// Starts the sums again: the last sample and the next do not belong together.
    pub(super) fn interrupt(&mut self) {
        self.open.fill(0.0);
        self.open_s = 0.0;
        self.roughness.interrupt();
    }

    /// Adds the increments between two neighbouring samples.
    pub(super) fn push(&mut self, increment: &[f64], duration_s: f64) {
        for (sum, value) in self.open.iter_mut().zip(increment) {
            *sum += value;
        }
        self.roughness.push(increment);
        self.open_s += duration_s;
        self.total_s += duration_s;
        self.steps += 1;
        if self.open_s >= INTERVAL_S {
            self.close_interval();
        }
    }

    fn close_interval(&mut self) {
        if self.intervals.len() < self.most.saturating_mul(self.columns) {
            self.intervals.extend_from_slice(&self.open);
        } else {
            let first = self.count % self.most * self.columns;
            self.intervals[first..first + self.columns].copy_from_slice(&self.open);
        }
        self.count += 1;
        self.open.fill(0.0);
        self.open_s = 0.0;
    }

    /// Returns the rms difference between changes and integrals, relative to the larger rms of the two; 0 where it
    /// could be noise, `None` where the motion is too slow or too short. The integrals are multiplied by `scale`.
    pub(super) fn relative_difference(
        &self,
        changes: Range<usize>,
        integrals: Range<usize>,
        scale: f64,
    ) -> Option<f64> {
        if self.count < FEWEST_INTERVALS {
            return None;
        }
        let (mut differences, mut change_squares, mut integral_squares) = (0.0, 0.0, 0.0);
        for interval in self.intervals.chunks_exact(self.columns) {
            let pairs = interval[changes.clone()]
                .iter()
                .zip(&interval[integrals.clone()]);
            for (change, integral) in pairs {
                differences += (change - scale * integral).powi(2);
                change_squares += change.powi(2);
                integral_squares += (scale * integral).powi(2);
            }
        }
        let count = (self.intervals.len() / self.columns) as f64;
        let length_s = self.total_s / self.count as f64;
        let samples = self.steps as f64 / self.count as f64;
        let motion = f64::max(change_squares, integral_squares);
        let slowest = (SLOWEST * length_s).powi(2) * count;
        let rough = |columns: Range<usize>| self.roughness.mean_squares(columns);
        let noise = 2.0 * rough(changes) / CHANGE_ROUGHNESS
            + samples * scale.powi(2) * rough(integrals) / INTEGRAL_ROUGHNESS;
        let is_noise = differences <= BEYOND_NOISE.powi(2) * noise * count;
        let relative = if is_noise { 0.0 } else { differences / motion };
        (motion > slowest).then(|| relative.sqrt())
    }
}

/// Mean squares of third differences of neighbouring increments: of a smooth motion they are small.
#[derive(Clone, Debug)]
struct Roughness {
    /// The last increments, the newest last.
    last: [Vec<f64>; NEIGHBOURS],
    /// Number of valid ones among them.
    stored: usize,
    squares: Vec<f64>,
    count: u64,
}

impl Roughness {
    fn new(columns: usize) -> Self {
        Self {
            last: std::array::from_fn(|_| vec![0.0; columns]),
            stored: 0,
            squares: vec![0.0; columns],
            count: 0,
        }
    }

    fn push(&mut self, increment: &[f64]) {
        self.last.rotate_left(1);
        self.last[NEIGHBOURS - 1].copy_from_slice(increment);
        self.stored = NEIGHBOURS.min(self.stored + 1);
        if self.stored < NEIGHBOURS {
            return;
        }
        let [a, b, c, d] = &self.last;
        for (k, square) in self.squares.iter_mut().enumerate() {
            *square += (d[k] - a[k] + 3.0 * (b[k] - c[k])).powi(2);
        }
        self.count += 1;
    }

    fn interrupt(&mut self) {
        self.stored = 0;
    }

    /// Returns the sum of the mean squares of some columns.
    fn mean_squares(&self, columns: Range<usize>) -> f64 {
        self.squares[columns].iter().sum::<f64>() / self.count.max(1) as f64
    }
}
