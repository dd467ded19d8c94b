//! The covariance of the unknowns after the last pass.

use nalgebra::{DMatrix, DVector, SVector};
use tactid_identify::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};

use super::ReweightedLeastSquares;
use super::whitened::WhitenedWindow;
use crate::fit::rows::{TARGET, UNKNOWNS};
use crate::fit::sandwich::{MeatEstimator, NoiseMeat, ScoredRow};

impl ReweightedLeastSquares<'_> {
    /// Returns two covariances of the unknowns from so many windows (see
    /// [`sandwich`](crate::fit::sandwich)), given the inverse of their information: for the noise
    /// as it is, and for noise that is the same in all windows.
    ///
    /// Where the sections of the recording scatter significantly more than the noise explains, the
    /// model has errors that are correlated over seconds. The cluster-robust covariance is then
    /// added to the first covariance, which counts the noise twice: eight sections miss errors that
    /// last longer. The second one, in whose metric parameters are projected, grows by the same
    /// factor.
    pub(super) fn covariances(&self, count: usize, bread: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        let channels = self.noise.channels();
        let independent = (count * channels) as f64 / NOISE_CORRELATION;
        let unknowns = self.columns + self.means.len() + self.options.eliminated;
        let freedom = (independent - unknowns as f64).max(1.0);
        let rows = self.scored_rows();
        let sums = MeatEstimator::new(&rows, channels, bread);
        let scores = sums.newey_west_meat() * independent / freedom;
        let meats = sums.noise_meats();
        let [of_noise, mut stationary] = meats.map(|meat| larger_meat(bread, &scores, meat));
        let clusters = sums.cluster_robust(&of_noise.meat, freedom);
        let mut covariance = self.covariance(bread, of_noise, count);
        if let Some(found) = clusters.filter(|found| found.ratio > found.bound) {
            covariance += self.in_units(found.covariance, &self.scales);
            stationary.meat *= 1.0 + found.t_variance * found.ratio;
        }
        [covariance, self.covariance(bread, stationary, count)]
    }

    /// Returns the covariance with a meat of the noise from so many windows.
    fn covariance(&self, bread: &DMatrix<f64>, of_noise: NoiseMeat, count: usize) -> DMatrix<f64> {
        let NoiseMeat {
            meat,
            t_factors,
            from_residuals,
        } = of_noise;
        let independent = count as f64 / PRODUCT_CORRELATION;
        let mut meat = meat * self.noise.inflation(independent, from_residuals);
        // Variance of the weighing: its information is enlarged for the correlation of neighbouring
        // windows.
        meat[(0, 0)] += self.mass_information() * NOISE_CORRELATION;
        let mut scales = self.scales;
        for (scale, t_factor) in scales.iter_mut().zip(&t_factors) {
            *scale *= t_factor;
        }
        if self.mass_information() > 0.0 {
            // The variance of a known mass is not estimated from the residuals.
            scales[0] = self.scales[0];
        }
        self.in_units(bread * meat * bread, &scales)
    }

    /// Returns a covariance of scaled unknowns in the units of the unknowns, zero in unobservable
    /// directions.
    fn in_units(&self, scaled: DMatrix<f64>, scales: &SVector<f64, UNKNOWNS>) -> DMatrix<f64> {
        let scaled = self.spectrum.across_unobservable(scaled);
        DMatrix::from_fn(self.columns, self.columns, |i, j| {
            scaled[(i, j)] * scales[i] * scales[j]
        })
    }

    /// Returns the whitened rows of the windows that are used with their scores, each times the
    /// root of its weight.
    fn scored_rows(&self) -> Vec<ScoredRow> {
        let mut scored = Vec::new();
        let mut whitened = WhitenedWindow::new(self);
        for window in self.windows() {
            whitened.move_to(window);
            let weight = self.weights[window];
            let root = weight.sqrt();
            for (row, noise) in whitened.rows.iter().zip(&whitened.differences) {
                let (residual, difference) = (root * row[TARGET], root * noise[TARGET]);
                let mut scored_row = ScoredRow {
                    residual,
                    difference,
                    weight,
                    ..ScoredRow::default()
                };
                for k in 0..self.columns {
                    scored_row.entries[k] = root * row[k];
                    scored_row.score[k] = root * (row[k] * residual - noise[k] * difference);
                }
                scored.push(scored_row);
            }
        }
        scored
    }
}

/// Returns the larger one of two meats, that of the `scores` and one of the noise: errors that last
/// longer than the filter show in the scores, if there are enough of them.
fn larger_meat(bread: &DMatrix<f64>, scores: &DMatrix<f64>, of_noise: NoiseMeat) -> NoiseMeat {
    let size = |meat: &DMatrix<f64>| (bread * meat).trace();
    if size(scores) > size(&of_noise.meat) {
        NoiseMeat {
            meat: scores.clone(),
            t_factors: DVector::repeat(bread.nrows(), 1.0),
            from_residuals: 1.0,
        }
    } else {
        of_noise
    }
}
