//! Constant offsets of channels, such as a force sensor's zero: further unknowns, eliminated.
//!
//! With an unknown constant in each channel, least squares is that of rows less their mean. Taken one
//! by one, it is that of each row less the mean of those before it, times a factor (Welford 1962,
//! Technometrics 4, 419-420): the same information, and the same parameters.

use nalgebra::SVector;

use crate::equations::Row;

/// What a channel is off by, and how well that is known, in the channel's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset {
    /// What the sensor says when nothing acts.
    pub value: f64,
    /// Its standard deviation.
    pub std_dev: f64,
}

/// The means of the rows so far, of channels whose offset is unknown: the first ones.
#[derive(Clone, Debug)]
pub(crate) struct Centering {
    means: Vec<Row>,
    weight: f64,
}

impl Centering {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            means: vec![Row::zero(); channels],
            weight: 0.0,
        }
    }

    /// Forgets all windows.
    pub(crate) fn begin_anew(&mut self) {
        self.means.fill(Row::zero());
        self.weight = 0.0;
    }

    /// Whether any channel has an offset.
    pub(crate) fn is_needed(&self) -> bool {
        !self.means.is_empty()
    }

    /// Whether no window has been added yet: the first tells of the offsets alone.
    pub(crate) fn is_empty(&self) -> bool {
        self.weight == 0.0
    }

    /// Makes a window's rows say what they will add to the parameters, with the noise they had.
    pub(crate) fn centre(&self, rows: &mut [Row], weight: f64) {
        let factor = (self.weight / (self.weight + weight).max(f64::MIN_POSITIVE)).sqrt();
        for (row, mean) in rows.iter_mut().zip(&self.means) {
            row.add(mean, -1.0);
            row.scale(factor);
        }
    }

    /// Adds a window, as it was before it was [centred](Self::centre).
    pub(crate) fn add(&mut self, rows: &[Row], weight: f64) {
        self.weight += weight;
        let share = weight / self.weight.max(f64::MIN_POSITIVE);
        for (row, mean) in rows.iter().zip(&mut self.means) {
            let mut beyond = *row;
            beyond.add(mean, -1.0);
            mean.add(&beyond, share);
        }
    }

    /// What each of six channels is off by, the parameters given; `None` before any window.
    pub(crate) fn offsets(&self, parameters: &SVector<f64, 10>) -> Option<[f64; 6]> {
        let means: &[Row; 6] = self.means.as_slice().try_into().ok()?;
        (!self.is_empty()).then(|| means.map(|mean| mean.target - mean.regressor.dot(parameters)))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    /// The information of centred rows is that of all rows less their weighted mean.
    #[test]
    fn one_by_one_is_all_at_once() {
        let mut random = SmallRng::seed_from_u64(3);
        let windows: Vec<(Row, f64)> = (0..20)
            .map(|_| {
                let mut row = Row::zero();
                row.regressor
                    .apply(|entry| *entry = random.random_range(-1.0..2.0));
                row.target = random.random_range(-1.0..2.0);
                (row, random.random_range(0.1..1.0))
            })
            .collect();
        let all: f64 = windows.iter().map(|(_, weight)| weight).sum();
        let mut mean = Row::zero();
        for (row, weight) in &windows {
            mean.add(row, weight / all);
        }
        let mut centering = Centering::new(1);
        let (mut whole, mut summed) = (SMatrix::<f64, 10, 10>::zeros(), SMatrix::zeros());
        for (row, weight) in windows {
            let mut less = row;
            less.add(&mean, -1.0);
            whole += less.regressor * less.regressor.transpose() * weight;
            // A second channel has no offset and stays as it is.
            let mut rows = [row, row];
            centering.centre(&mut rows, weight);
            centering.add(&[row], weight);
            assert_eq!(rows[1], row);
            summed += rows[0].regressor * rows[0].regressor.transpose() * weight;
        }
        assert!((whole - summed).norm() < 1e-13 * whole.norm());
    }
}
