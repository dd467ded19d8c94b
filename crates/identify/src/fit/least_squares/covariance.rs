//! The covariance of the unknowns after the last pass.

use nalgebra::{DMatrix, DVector};

use super::ReweightedLeastSquares;
use super::whitened::WhitenedWindow;
use crate::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};
use crate::fit::rows::TARGET;
use crate::fit::sandwich::{MeatEstimator, NoiseMeat, ScoredRow};

impl ReweightedLeastSquares<'_> {
    /// Returns two sandwich covariances of the unknowns from so many windows (see [`sandwich`](crate::fit::sandwich)), given the inverse
    /// of their information: for the noise as it is, and for noise that is the same in all windows.
    pub(super) fn covariances(&self, count: usize, bread: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        let channels = self.noise.channels();
        let independent = (count * channels) as f64 / NOISE_CORRELATION;
        let unknowns = self.columns + self.means.len();
        let freedom = (independent - unknowns as f64).max(1.0);
        let rows = self.scored_rows();
        let sums = MeatEstimator::new(&rows, channels, bread);
        let scores = sums.newey_west_meat() * independent / freedom;
        let [of_noise, stationary] = sums.noise_meats();
        [of_noise, stationary].map(|meat| self.covariance(bread, &scores, meat, count))
    }

    /// Returns the covariance with the larger one of two meats: that of the `scores`, and one of the noise.
    fn covariance(
        &self,
        bread: &DMatrix<f64>,
        scores: &DMatrix<f64>,
        of_noise: NoiseMeat,
        count: usize,
    ) -> DMatrix<f64> {
        // Errors that last longer than the filter show in the scores, if there are enough of them.
        let size = |meat: &DMatrix<f64>| (bread * meat).trace();
        let NoiseMeat {
            meat,
            t_factors,
            from_residuals,
        } = if size(scores) > size(&of_noise.meat) {
            NoiseMeat {
                meat: scores.clone(),
                t_factors: DVector::repeat(self.columns, 1.0),
                from_residuals: 1.0,
            }
        } else {
            of_noise
        };
        let independent = count as f64 / PRODUCT_CORRELATION;
        let mut meat = meat * self.noise.inflation(independent, from_residuals);
        // Variance of the weighing: its information is enlarged for the correlation of neighbouring windows.
        meat[(0, 0)] += self.mass_information() * NOISE_CORRELATION;
        let scaled = self.spectrum.across_unobservable(bread * meat * bread);
        let mut scales = DVector::from_fn(self.columns, |k, _| self.scales[k] * t_factors[k]);
        if self.mass_information() > 0.0 {
            // The variance of a known mass is not estimated from the residuals.
            scales[0] = self.scales[0];
        }
        DMatrix::from_fn(self.columns, self.columns, |i, j| {
            scaled[(i, j)] * scales[i] * scales[j]
        })
    }

    /// Returns the whitened rows of the windows that are used with their scores, each times the root of its
    /// weight.
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
