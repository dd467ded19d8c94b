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
    /// Sums over the bins of their information on each parameter, and of its squares.
    information: [Parameters; 2],
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
            information: [Parameters::zeros(); 2],
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
        // Less what the motion takes of it.
        let information = Parameters::from_fn(|k, _| scores[(k, k)]);
        self.information[0] += information;
        self.information[1] += information.component_mul(&information);
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

    /// Returns the covariance of the sum of scores at these parameters.
    fn meat(&self, parameters: &Parameters) -> Matrix {
        let factor = |column: usize| parameters.get(column).map_or(1.0, |value| -value);
        let mut half = Matrix::zeros();
        for (i, j) in (0..11).flat_map(|i| (0..11).map(move |j| (i, j))) {
            let block = self.products.fixed_view::<10, 10>(10 * i, 10 * j);
            half += block * (factor(i) * factor(j));
        }
        half + half.transpose()
    }

    /// Returns the covariance of these parameters that is at least as large as that of white noise in
    /// every direction, and the mean ratio of both, one or more.
    ///
    /// Residuals are smaller than the noise by what the unknowns explain, and the sum of scores is
    /// zero, which takes `b - b² / 3` of a meat with a bandwidth of the fraction `b` of the bins
    /// (Kiefer and Vogelsang 2005), as many as have the information (Kish 1965). Of the scatter in ten
    /// directions the mean is ten times as well known as each, so directions count as far as their
    /// degrees of freedom, `1.5 / b`, go. Where scatter is larger than white noise, the excess has
    /// the degrees of freedom of such an estimate (Satterthwaite 1946, doi 10.2307/3002019).
    pub(super) fn covariance(
        &self,
        of_white_noise: &Matrix,
        parameters: &Parameters,
    ) -> (Matrix, f64) {
        let [sum, squares] = &self.information;
        let effective = sum.component_mul(sum).component_div(squares).mean();
        let bandwidth = ((spanned() + 1) as f64 / effective).min(1.0);
        let left = 1.0 - bandwidth + bandwidth.powi(2) / 3.0;
        let fraction = (self.rows - self.unknowns) / self.rows;
        let meat = self.meat(parameters) / (left * fraction);
        let mean = (meat * of_white_noise).trace() / 10.0;
        let sandwich = of_white_noise * meat * of_white_noise;
        let freedom = 1.5 / bandwidth;
        let weight = freedom / (freedom + 10.0);
        let shrunk = sandwich * weight + of_white_noise * (mean * (1.0 - weight));
        let mean = mean.max(1.0);
        let of_scatter = freedom / (weight.powi(2) + (1.0 - weight.powi(2)) / 10.0);
        let factor = students_factor(of_scatter / (1.0 - mean.recip()).powi(2));
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

    /// Noise that is larger than white noise is seen in its scatter, also where few of the bins have
    /// information: intervals hold as often as they should.
    #[test]
    fn intervals_hold_where_few_bins_have_information() {
        const DRAWS: usize = 300;
        const BINS: usize = 60;
        let mut random = SmallRng::seed_from_u64(1);
        let information = |bin: usize| if bin < BINS / 2 { 1.0 } else { 0.01 };
        let whole: f64 = (0..BINS).map(information).sum();
        let of_white_noise = Matrix::identity() / whole;
        let (mut variance, mut inside) = (0.0, 0);
        for _ in 0..DRAWS {
            let mut noise_of = |bin: usize| {
                let size = 3.0 * information(bin).sqrt();
                Parameters::from_fn(|_, _| size * random.sample::<f64, _>(StandardNormal))
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
            variance += mean / DRAWS as f64;
            let is_inside = |k: usize| found[k].abs() < HALF_WIDTH_95 * covariance[(k, k)].sqrt();
            inside += (0..10).filter(|&k| is_inside(k)).count();
        }
        let inside = inside as f64 / (10 * DRAWS) as f64;
        assert!((variance / 9.0 - 1.0).abs() < 0.1, "{variance}");
        assert!((inside - 0.95).abs() < 0.01, "{inside}");
    }
}
