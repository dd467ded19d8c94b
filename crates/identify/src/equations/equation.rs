//! The row equations of motion: at one instant, and averaged over a window.

use nalgebra::{SVector, Vector4};

use super::window::{Place, WindowMean};

/// One row equation `regressor · π = target`.
///
/// The parameters `π` are in the order and the units of
/// [`InertialParameters`](tactid_dynamics::InertialParameters): mass, first moments, and inertia about the
/// origin of the tool frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Derivative of the measured quantity with respect to each parameter: the channel's unit over the
    /// parameter's.
    pub regressor: SVector<f64, 10>,
    /// The measurement, in the channel's unit: the right-hand side of the row.
    pub target: f64,
    /// What an acceleration equal to the configured gravity would add to the entries of the mass and the
    /// first moments. The entries of the inertia do not depend on gravity. Scaled, it shows what another
    /// gravity would have explained.
    pub gravity: Vector4<f64>,
    /// What an error of the channel's gain of one standard deviation adds to the target, in the channel's unit. It is
    /// zero where the gain is exact. Gains of different channels have independent errors, and that of one channel is the
    /// same at all times.
    pub gain_error: f64,
}

impl Row {
    /// Returns the row whose entries are all zero.
    pub(crate) fn zero() -> Self {
        Self {
            regressor: SVector::zeros(),
            target: 0.0,
            gravity: Vector4::zeros(),
            gain_error: 0.0,
        }
    }

    /// Adds `weight` times another row.
    pub(crate) fn add(&mut self, row: &Self, weight: f64) {
        self.regressor += row.regressor * weight;
        self.target += row.target * weight;
        self.gravity += row.gravity * weight;
        self.gain_error += row.gain_error * weight;
    }

    /// Multiplies both sides by a factor.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.regressor *= factor;
        self.target *= factor;
        self.gravity *= factor;
        self.gain_error *= factor;
    }
}

/// Row equations averaged over one window, a row for each channel.
///
/// The rows are averaged as a whole, after their products are formed, so that both sides pass the same
/// filter and the equation holds for the means as it does at every instant.
#[derive(Clone, Debug)]
pub struct Equation {
    /// Middle of the window, on the clock of the samples, s.
    pub time_s: f64,
    /// The mean rows, in the order of the [`Channels`](super::Channels).
    pub rows: Vec<Row>,
    /// Half the difference between the means over every second instant and over the others. It is noise
    /// alone, with the variance of the noise in `rows`: the motion is the same in both halves.
    pub differences: Vec<Row>,
    /// Time derivative of each target through the same filter, in the channel's unit per second: by so much
    /// a delay of the load changes the target.
    pub rates: Vec<f64>,
    /// Number of instants in the window.
    pub instants: u32,
    /// Sum of the instants' weights in the mean, in the derivative, and in the half-difference.
    weight: f64,
    slope_weight: f64,
    difference_weight: f64,
}

impl Equation {
    /// Creates an equation of so many channels without any instant.
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            time_s: 0.0,
            rows: vec![Row::zero(); channels],
            differences: vec![Row::zero(); channels],
            rates: vec![0.0; channels],
            weight: 0.0,
            slope_weight: 0.0,
            difference_weight: 0.0,
            instants: 0,
        }
    }

    /// Copies a finished equation of as many channels, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.rows.copy_from_slice(&other.rows);
        self.differences.copy_from_slice(&other.differences);
        self.rates.copy_from_slice(&other.rates);
        (self.time_s, self.instants) = (other.time_s, other.instants);
    }

    /// Removes all instants and sets the middle of the window.
    pub(crate) fn clear(&mut self, time_s: f64) {
        self.time_s = time_s;
        self.rows.fill(Row::zero());
        self.differences.fill(Row::zero());
        self.rates.fill(0.0);
        (self.weight, self.slope_weight, self.difference_weight) = (0.0, 0.0, 0.0);
        self.instants = 0;
    }

    /// Adds an instant with its weight in the mean, its weight in the derivative, and its half of the
    /// instants, 1 or -1. Until [`finish`](Self::finish), `rows` has the sums of one half and `differences`
    /// those of the other.
    pub(crate) fn add(&mut self, rows: &[Row], weight: f64, slope_weight: f64, half: f64) {
        let sums = if half > 0.0 {
            &mut self.rows
        } else {
            &mut self.differences
        };
        for ((sum, rate), row) in sums.iter_mut().zip(&mut self.rates).zip(rows) {
            sum.add(row, weight);
            *rate += row.target * slope_weight;
        }
        self.difference_weight += half * weight;
        self.weight += weight;
        self.slope_weight += slope_weight;
        self.instants += 1;
    }

    /// Adds a finished equation with its weight in the mean of several.
    pub(crate) fn add_mean(&mut self, other: &Self, weight: f64) {
        for (sum, row) in self.rows.iter_mut().zip(&other.rows) {
            sum.add(row, weight);
        }
        for (sum, row) in self.differences.iter_mut().zip(&other.differences) {
            sum.add(row, weight);
        }
        for (sum, rate) in self.rates.iter_mut().zip(&other.rates) {
            *sum += weight * rate;
        }
        self.instants += other.instants;
    }

    /// Turns the sums over instants into means.
    pub(crate) fn finish(&mut self) {
        let normalization = 1.0 / self.weight;
        let sums = self.rows.iter_mut().zip(&mut self.differences);
        for ((row, difference), rate) in sums.zip(&mut self.rates) {
            let other_half = *difference;
            difference.scale(-1.0);
            difference.add(row, 1.0);
            row.add(&other_half, 1.0);
            row.scale(normalization);
            // Both halves have the same weight but for the ends of the window and uneven times.
            difference.add(row, -self.difference_weight);
            difference.scale(normalization);
            // The weights of the derivative sum to zero but for rounding and uneven times.
            *rate = (*rate - self.slope_weight * row.target) * normalization;
        }
    }
}

impl WindowMean for Equation {
    type Entry = Row;

    fn empty(channels: usize) -> Self {
        Self::new(channels)
    }

    fn zero() -> Row {
        Row::zero()
    }

    fn clear(&mut self, time_s: f64) {
        self.clear(time_s);
    }

    fn add(&mut self, rows: &[Row], place: &Place) {
        self.add(rows, place.weight(), place.slope_weight(), place.half);
    }

    fn finish(&mut self) {
        self.finish();
    }

    fn instants(&self) -> u32 {
        self.instants
    }
}
