//! Changes of positions beside the integrals of their velocities, summed over short intervals.

use std::collections::VecDeque;
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
pub(super) struct Increments {
    /// Increments of each interval.
    intervals: Vec<Vec<f64>>,
    /// Mean length of an interval, s.
    length_s: f64,
    /// Mean number of samples in an interval.
    samples: f64,
    /// Mean square of the third differences of neighbouring increments in each column.
    roughness: Vec<f64>,
}

impl Increments {
    /// Sums what `step` returns for neighbouring samples, an entry for each column; where it returns `None`, and
    /// across times longer than `max_gap_s`, the sums start again. `None` for too short a series.
    pub(super) fn new<T>(
        series: &[(f64, T)],
        max_gap_s: f64,
        step: impl Fn(&T, &T, f64) -> Option<Vec<f64>>,
    ) -> Option<Self> {
        let (mut intervals, mut steps) = (Vec::new(), 0u32);
        let (mut total_s, mut open_s, mut open) = (0.0, 0.0, Vec::new());
        let mut roughness = Roughness::default();
        for pair in series.windows(2) {
            let duration_s = pair[1].0 - pair[0].0;
            let is_bridged = duration_s > 0.0 && duration_s <= max_gap_s;
            let increment = is_bridged.then(|| step(&pair[0].1, &pair[1].1, duration_s));
            let Some(increment) = increment.flatten() else {
                (open_s, open) = (0.0, Vec::new());
                roughness.interrupt();
                continue;
            };
            open.resize(increment.len(), 0.0);
            add(&mut open, &increment, 1.0);
            roughness.push(increment);
            open_s += duration_s;
            total_s += duration_s;
            steps += 1;
            if open_s >= INTERVAL_S {
                intervals.push(std::mem::take(&mut open));
                open_s = 0.0;
            }
        }
        let count = intervals.len();
        (count >= FEWEST_INTERVALS).then(|| Self {
            intervals,
            length_s: total_s / count as f64,
            samples: f64::from(steps) / count as f64,
            roughness: roughness.mean_squares(),
        })
    }

    /// Returns the rms difference between changes and integrals, relative to the larger rms of the two; 0 where it
    /// could be noise, `None` where the motion is too slow. The integrals are multiplied by `scale`.
    pub(super) fn relative_difference(
        &self,
        changes: Range<usize>,
        integrals: Range<usize>,
        scale: f64,
    ) -> Option<f64> {
        let (mut differences, mut change_squares, mut integral_squares) = (0.0, 0.0, 0.0);
        for interval in &self.intervals {
            let pairs = interval[changes.clone()]
                .iter()
                .zip(&interval[integrals.clone()]);
            for (change, integral) in pairs {
                differences += (change - scale * integral).powi(2);
                change_squares += change.powi(2);
                integral_squares += (scale * integral).powi(2);
            }
        }
        let count = self.intervals.len() as f64;
        let motion = f64::max(change_squares, integral_squares);
        let slowest = (SLOWEST * self.length_s).powi(2) * count;
        let rough = |columns: Range<usize>| self.roughness[columns].iter().sum::<f64>();
        let noise = 2.0 * rough(changes) / CHANGE_ROUGHNESS
            + self.samples * scale.powi(2) * rough(integrals) / INTEGRAL_ROUGHNESS;
        let is_noise = differences <= BEYOND_NOISE.powi(2) * noise * count;
        let relative = if is_noise { 0.0 } else { differences / motion };
        (motion > slowest).then(|| relative.sqrt())
    }
}

/// Mean squares of third differences of neighbouring increments: of a smooth motion they are small.
#[derive(Default)]
struct Roughness {
    last: VecDeque<Vec<f64>>,
    squares: Vec<f64>,
    count: u32,
}

impl Roughness {
    fn push(&mut self, increment: Vec<f64>) {
        self.squares.resize(increment.len(), 0.0);
        self.last.push_back(increment);
        if self.last.len() < NEIGHBOURS {
            return;
        }
        let mut difference = vec![0.0; self.squares.len()];
        for (increment, weight) in self.last.iter().zip([-1.0, 3.0, -3.0, 1.0]) {
            add(&mut difference, increment, weight);
        }
        for (square, entry) in self.squares.iter_mut().zip(difference) {
            *square += entry * entry;
        }
        self.count += 1;
        self.last.pop_front();
    }

    fn interrupt(&mut self) {
        self.last.clear();
    }

    fn mean_squares(&self) -> Vec<f64> {
        let count = f64::from(self.count.max(1));
        self.squares.iter().map(|square| square / count).collect()
    }
}

fn add(sums: &mut [f64], values: &[f64], weight: f64) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}
