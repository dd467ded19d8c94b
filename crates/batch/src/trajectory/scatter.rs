//! The covariance of parameters whose noise need not be white, from the scatter of scores.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::SETTINGS;
use super::spline::order;
use crate::distributions::students_factor;
use crate::solve::with_variance_floor;

type Parameters = SVector<f64, 10>;
type Matrix = SMatrix<f64, 10, 10>;

/// Returns the number of bins over which splines correlate scores.
fn spanned() -> usize {
    order() * SETTINGS.bins_of_interval as usize
}

/// What the scores of the bins say of the noise of the parameters. Scores are linear in the
/// parameters, and their scatter is known for any.
#[derive(Clone, Debug)]
pub(super) struct Scatter {
    /// Products of the entries of the scores at a bin, a matrix each, with the sum of those at the
    /// bins before that splines correlate with them (Newey and West 1987): half of the covariance of
    /// the sum of scores, and half of it transposed.
    products: DMatrix<f64>,
    /// Entries of the scores at the bins of the stretch that splines span, the newest first.
    recent: VecDeque<DVector<f64>>,
    /// Numbers of bins, of rows, and of unknowns.
    bins: f64,
    rows: f64,
    unknowns: f64,
}

impl Default for Scatter {
    fn default() -> Self {
        // Ten by eleven entries.
        let entries = Matrix::zeros().len() + Parameters::zeros().len();
        Self {
            products: DMatrix::zeros(entries, entries),
            recent: VecDeque::new(),
            bins: 0.0,
            rows: 0.0,
            unknowns: 0.0,
        }
    }
}

impl Scatter {
    /// Adds the scores at a bin with so many rows: their derivatives by the parameters with the
    /// opposite sign, and last what they are at `parameters`.
    pub(super) fn add(&mut self, scores: &DMatrix<f64>, parameters: &Parameters, rows: usize) {
        let mut scores = scores.clone();
        let at_zero = scores.columns(0, 10) * parameters + scores.column(10);
        scores.set_column(10, &at_zero);
        let scores = DVector::from_column_slice(scores.as_slice());
        let mut others = &scores * 0.5;
        for (lag, other) in self.recent.iter().enumerate() {
            let weight = 1.0 - (lag + 1) as f64 / (spanned() + 1) as f64;
            others.axpy(weight, other, 1.0);
        }
        self.products.ger(1.0, &scores, &others, 1.0);
        self.recent.truncate(spanned() - 1);
        self.recent.push_front(scores);
        self.bins += 1.0;
        self.rows += rows as f64;
    }

    /// Adds so many unknowns that the bins have determined.
    pub(super) fn add_unknowns(&mut self, unknowns: usize) {
        self.unknowns += unknowns as f64;
    }

    /// Ends a stretch: the bins that follow have no scores in common with it.
    pub(super) fn end_stretch(&mut self) {
        self.recent.clear();
    }

    /// Number of bins.
    pub(super) fn bins(&self) -> f64 {
        self.bins
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> f64 {
        self.unknowns
    }

    /// Returns the sum of the products of neighbouring scores, entry `i` of one with entry `j` of the
    /// other by `weight(i, j)`: the covariance of the sum of scores for the weights of parameters.
    fn meat(&self, weight: impl Fn(usize, usize) -> f64) -> Matrix {
        let mut half = Matrix::zeros();
        for (i, j) in (0..11).flat_map(|i| (0..11).map(move |j| (i, j))) {
            half += self.products.fixed_view::<10, 10>(10 * i, 10 * j) * weight(i, j);
        }
        half + half.transpose()
    }

    /// Returns the covariance of these parameters that is at least as large as that of white noise in
    /// every direction, times the square of Student's factor, and the mean ratio of the scatter to
    /// that of white noise, one or more.
    ///
    /// Residuals are smaller than the noise by what the unknowns explain. The scores are those of
    /// parameters that were estimated from them: an error of the covariance `C` changes the scores
    /// of a bin with the information `J` by `J C J`, and the meat has so much less, taken in the
    /// mean over the ten directions. For one parameter and equal bins that is `b - b² / 3` with a
    /// bandwidth of the fraction `b` of the bins (Kiefer and Vogelsang 2005), and `b` is the
    /// fraction that loses as much. Of the scatter in ten directions the mean is ten times as well
    /// known as each, so directions count as far as their degrees of freedom, `1.5 / b`, go. The
    /// intervals are those of Student's t with the degrees of freedom of such a scatter where it is
    /// far larger than white noise, and of more where white noise explains it.
    pub(super) fn covariance(
        &self,
        of_white_noise: &Matrix,
        parameters: &Parameters,
    ) -> (Matrix, f64) {
        let of_errors = |i: usize, j: usize| match i.max(j) {
            10 => 0.0,
            _ => of_white_noise[(i, j)],
        };
        let taken = (self.meat(of_errors) * of_white_noise).trace() / 10.0;
        let taken = taken.min(2.0 / 3.0);
        let bandwidth = 1.5 - (2.25 - 3.0 * taken).sqrt();
        let fraction = (self.rows - self.unknowns) / self.rows;
        let factor = |column: usize| parameters.get(column).map_or(1.0, |value| -value);
        let meat = self.meat(|i, j| factor(i) * factor(j)) / ((1.0 - taken) * fraction);
        let mean = (meat * of_white_noise).trace() / 10.0;
        let sandwich = of_white_noise * meat * of_white_noise;
        let freedom = 1.5 / bandwidth;
        let weight = freedom / (freedom + 10.0);
        let shrunk = sandwich * weight + of_white_noise * (mean * (1.0 - weight));
        let mean = mean.max(1.0);
        let of_scatter = freedom / (weight.powi(2) + (1.0 - weight.powi(2)) / 10.0);
        let factor = students_factor(of_scatter / (1.0 - mean.recip()));
        (larger(of_white_noise, &shrunk) * factor.powi(2), mean)
    }
}

/// Returns the covariance that is at least as large as both of two in every direction.
fn larger(this: &Matrix, other: &Matrix) -> Matrix {
    let [this, other] = [this, other].map(|of| DMatrix::from_column_slice(10, 10, of.as_slice()));
    with_variance_floor(&this, other, 1.0)
        .fixed_view::<10, 10>(0, 0)
        .into()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use rand_distr::StandardNormal;
    use tactid_identify::solve::HALF_WIDTH_95;

    use super::*;

    /// The larger of two covariances has the larger variance direction by direction, also where the
    /// directions are not those of the parameters.
    #[test]
    fn the_larger_covariance_is_that_of_each_direction() {
        let turn = Matrix::from_fn(|i, j| {
            f64::from(u8::from(i == j)) + 0.3 * ((3 * i + 7 * j) as f64).sin()
        });
        let of = |variances: fn(usize) -> f64| {
            let diagonal = Parameters::from_fn(|k, _| variances(k));
            turn * SMatrix::from_diagonal(&diagonal) * turn.transpose()
        };
        let this = of(|k| 1e-3 * (k + 1) as f64);
        let other = of(|k| 1e-3 * (10 - k) as f64);
        let expected = of(|k| 1e-3 * f64::max((k + 1) as f64, (10 - k) as f64));
        for (this, other) in [(&this, &other), (&other, &this)] {
            let found = larger(this, other);
            assert!((found - expected).amax() < 1e-12 * expected.amax());
        }
    }

    /// Noise with more variance than the information says is seen in its scatter, also where few of
    /// the bins have information and where neighbouring bins share noise: intervals hold about as
    /// often as they should.
    #[test]
    fn intervals_hold_where_few_bins_have_information() {
        // Sums over neighbouring bins see less of noise that is correlated over as long.
        for (size, correlation, error, least) in [
            (3.0, 0.0, 0.1, 0.94),
            (1.5, 0.0, 0.1, 0.94),
            (1.5, 0.5, 0.25, 0.92),
        ] {
            let (ratio, inside) = ratio_and_coverage(size, correlation);
            let expected = size * size * (1.0 + correlation) / (1.0 - correlation);
            assert!((ratio / expected - 1.0).abs() < error, "{ratio} {expected}");
            assert!(
                (least..0.965).contains(&inside),
                "{size} {correlation}: {inside}"
            );
        }
    }

    /// Returns the mean ratio of the scatter to white noise, and how often intervals hold, over draws
    /// of noise of this size and of this correlation of neighbouring bins, half of them with a
    /// hundredth of the others' information.
    fn ratio_and_coverage(size: f64, correlation: f64) -> (f64, f64) {
        const DRAWS: usize = 300;
        const BINS: usize = 60;
        let mut random = SmallRng::seed_from_u64(1);
        let information = |bin: usize| if bin < BINS / 2 { 1.0 } else { 0.01 };
        let whole: f64 = (0..BINS).map(information).sum();
        let of_white_noise = Matrix::identity() / whole;
        let (mut ratio, mut inside) = (0.0, 0);
        for _ in 0..DRAWS {
            let mut drawn = || Parameters::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
            let mut last = drawn();
            let mut noise_of = |bin: usize| {
                last = last * correlation + drawn() * (1.0 - correlation * correlation).sqrt();
                last * (size * information(bin).sqrt())
            };
            let noise: Vec<Parameters> = (0..BINS).map(&mut noise_of).collect();
            let found = noise.iter().sum::<Parameters>() / whole;
            let mut scatter = Scatter::default();
            for (bin, noise) in noise.iter().enumerate() {
                let mut scores = DMatrix::identity(10, 11) * information(bin);
                scores.set_column(10, &(noise - found * information(bin)));
                scatter.add(&scores, &found, 30);
            }
            let (covariance, mean) = scatter.covariance(&of_white_noise, &found);
            ratio += mean / DRAWS as f64;
            let is_inside = |k: usize| found[k].abs() < HALF_WIDTH_95 * covariance[(k, k)].sqrt();
            inside += (0..10).filter(|&k| is_inside(k)).count();
        }
        (ratio, inside as f64 / (10 * DRAWS) as f64)
    }
}
