//! The row equations of motion: at one instant, and averaged over a window.

use educe::Educe;
use nalgebra::{SVector, Vector4};

/// One row equation `regressor · π = target`.
///
/// The parameters `π` are in the order and the units of
/// [`InertialParameters`](tactid_dynamics::InertialParameters): mass, first moments, and inertia
/// about the origin of the tool frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Derivative of the measured quantity with respect to each parameter: the channel's unit over
    /// the parameter's.
    pub regressor: SVector<f64, 10>,
    /// The measurement, in the channel's unit: the right-hand side of the row.
    pub target: f64,
    /// What an acceleration equal to the configured gravity would add to the entries of the mass
    /// and the first moments. The entries of the inertia do not depend on gravity. Scaled, it shows
    /// what another gravity would have explained.
    pub gravity: Vector4<f64>,
    /// What an error of the channel's gain of one standard deviation adds to the target, in the
    /// channel's unit. It is zero where the gain is exact. Gains of different channels have
    /// independent errors, and that of one channel is the same at all times.
    pub gain_error: f64,
}

impl Row {
    /// Returns the row whose entries are all zero.
    pub fn zero() -> Self {
        Self {
            regressor: SVector::zeros(),
            target: 0.0,
            gravity: Vector4::zeros(),
            gain_error: 0.0,
        }
    }

    /// Returns the regressor with gravity scaled by a factor.
    pub fn regressor_at(&self, gravity_scale: f64) -> SVector<f64, 10> {
        let mut regressor = self.regressor;
        let mut first = regressor.fixed_rows_mut::<4>(0);
        first += self.gravity * (1.0 - gravity_scale);
        regressor
    }

    /// Adds `weight` times another row.
    pub fn add(&mut self, row: &Self, weight: f64) {
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
/// The rows are averaged as a whole, after their products are formed, so that both sides pass the
/// same filter and the equation holds for the means as it does at every instant.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct Equation {
    /// Middle of the window, on the clock of the samples, s.
    pub time_s: f64,
    /// The mean rows, in the order of the [`Channels`](super::Channels).
    pub rows: Vec<Row>,
    /// Half the difference between the means over every second instant and over the others. It is
    /// noise alone, with the variance of the noise in `rows`: the motion is the same in both
    /// halves.
    pub differences: Vec<Row>,
    /// Time derivative of each target through the same filter, in the channel's unit per second: by
    /// so much a delay of the load changes the target.
    pub rates: Vec<f64>,
    /// Half the difference between these derivatives from every second instant and from the others:
    /// noise alone, as in `differences`.
    pub rate_differences: Vec<f64>,
    /// Number of instants in the window.
    pub instants: u32,
    /// Mean entries of the window's [`Geometry`](super::Geometry); empty where they are not kept.
    pub geometry: Vec<f64>,
}

impl Equation {
    /// Creates an equation of so many channels without any instant.
    #[must_use]
    pub fn new(channels: usize) -> Self {
        Self {
            time_s: 0.0,
            rows: vec![Row::zero(); channels],
            differences: vec![Row::zero(); channels],
            rates: vec![0.0; channels],
            rate_differences: vec![0.0; channels],
            instants: 0,
            geometry: Vec::new(),
        }
    }

    /// Adds another equation with its weight in the mean of several.
    pub fn add_mean(&mut self, other: &Self, weight: f64) {
        for (sum, row) in self.rows.iter_mut().zip(&other.rows) {
            sum.add(row, weight);
        }
        for (sum, row) in self.differences.iter_mut().zip(&other.differences) {
            sum.add(row, weight);
        }
        let (sums, rates) = (&mut self.rates, &other.rates);
        let (of_sums, of_rates) = (&mut self.rate_differences, &other.rate_differences);
        let pairs = sums.iter_mut().chain(of_sums);
        for (sum, rate) in pairs.zip(rates.iter().chain(of_rates)) {
            *sum += weight * rate;
        }
        self.geometry.resize(other.geometry.len(), 0.0);
        for (sum, entry) in self.geometry.iter_mut().zip(&other.geometry) {
            *sum += weight * entry;
        }
        self.instants += other.instants;
    }
}
