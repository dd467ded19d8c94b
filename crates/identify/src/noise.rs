//! The noise of the channels, learnt from residuals.

use nalgebra::{DMatrix, SVector};

use crate::equation::Equation;
use crate::window::{NOISE_BANDWIDTH, PRODUCT_CORRELATION};

/// Residuals of less than this part of what is measured are rounding.
pub(crate) const ROUNDING: f64 = 1e-14;

/// No channel has less noise than this part of the noisiest of its kind.
const ALIKE: f64 = 1e-2;

/// So many independent windows for each channel know all correlations well enough.
const PLENTY: f64 = 10.0;
/// Less than all of them, so that channels which are the same but for rounding leave a triangle, too.
const NEARLY: f64 = 1.0 - 1e-6;

/// Median of the absolute value of a standard normal variable.
const NORMAL_MEDIAN: f64 = 0.6745;

/// How channels belong together; each a part of all channels in order.
#[derive(Clone, Debug)]
pub(crate) struct Channels {
    /// How many there are of each kind, whose noise is of like size: the axes of a force, say.
    pub(crate) kinds: Vec<usize>,
    /// How many come from each source.
    pub(crate) sources: Vec<usize>,
    /// How many, the first ones, may be off by a constant.
    pub(crate) offsets: usize,
    /// What is known of the sensors of some sources.
    pub(crate) given: Vec<GivenNoise>,
}

/// White noise of a source's channels, from those who know the sensors.
#[derive(Clone, Debug)]
pub(crate) struct GivenNoise {
    /// The source's first channel.
    first: usize,
    /// Of one sample, in each channel's unit.
    deviations: Vec<f64>,
    /// Lower triangle, and what it is the product of.
    correlation: DMatrix<f64>,
    root: DMatrix<f64>,
}

impl GivenNoise {
    /// From the covariance of one sample's channels, which is positive definite.
    pub(crate) fn new(first: usize, mut covariance: DMatrix<f64>) -> Self {
        let deviations = covariance.diagonal().map(f64::sqrt);
        to_correlation(&mut covariance);
        let mut root = covariance.clone();
        if !factor(&mut root) {
            // Rounding has left one finger's lever no room beside the other's.
            root.fill_with_identity();
        }
        Self {
            first,
            deviations: deviations.as_slice().to_vec(),
            correlation: covariance,
            root,
        }
    }

    fn channels(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.deviations.len()
    }

    /// So many times the deviations of one sample.
    fn write(&self, size: f64, deviations: &mut [f64]) {
        for (deviation, of_a_sample) in deviations.iter_mut().zip(&self.deviations) {
            *deviation = size * of_a_sample;
        }
    }
}

impl Channels {
    /// Of one wrench.
    pub(crate) fn of_a_wrench() -> Self {
        Self {
            kinds: vec![3, 3],
            sources: vec![6],
            offsets: 0,
            given: Vec::new(),
        }
    }

    /// Where those of the wrench, which are the first, may be off by a constant, or none.
    pub(crate) fn with_offsets(self, unknown: bool) -> Self {
        let offsets = if unknown { 6 } else { 0 };
        Self { offsets, ..self }
    }

    /// All of them.
    pub(crate) fn count(&self) -> usize {
        self.sources.iter().sum()
    }

    /// Which source each channel comes from.
    fn source_of(&self) -> Vec<usize> {
        let counts = self.sources.iter().enumerate();
        let sources = counts.flat_map(|(source, &count)| std::iter::repeat_n(source, count));
        sources.collect()
    }
}

/// Deviations of the channels' noise, and how it is correlated between them: a finger's force pulls
/// at its lever arm, so its noise is in the moment, too.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    /// In each channel's unit.
    pub(crate) deviations: Vec<f64>,
    /// Smaller deviations are rounding.
    floors: Vec<f64>,
    /// Lower triangle whose product with its transpose is the correlation.
    root: DMatrix<f64>,
    /// How many correlations of each channel were in effect learnt from the residuals.
    learnt: f64,
    kinds: Vec<usize>,
    source_of: Vec<usize>,
    given: Vec<GivenNoise>,
    /// The variance of a window's mean of white noise, that of one sample being one.
    of_a_window: f64,
    exact: f64,
}

impl Noise {
    /// Before there are residuals: as large as what is measured, and uncorrelated. It will not be less
    /// than a part of that, `exact`.
    pub(crate) fn before_residuals(
        equations: &[Equation],
        channels: &Channels,
        exact: f64,
    ) -> Self {
        let source_of = channels.source_of();
        let count = source_of.len();
        let mut noise = Self {
            deviations: vec![1.0; count],
            floors: vec![0.0; count],
            root: DMatrix::identity(count, count),
            learnt: 0.0,
            kinds: channels.kinds.clone(),
            source_of,
            given: channels.given.clone(),
            of_a_window: 1.0,
            exact,
        };
        noise.begin(equations);
        noise
    }

    /// As before there were residuals. Allocates nothing.
    pub(crate) fn begin(&mut self, equations: &[Equation]) {
        sizes(equations, &self.kinds, &mut self.deviations);
        for (floor, size) in self.floors.iter_mut().zip(&self.deviations) {
            *floor = size * self.exact;
        }
        self.root.fill_with_identity();
        self.learnt = 0.0;
        let instants: u32 = equations.iter().map(|equation| equation.instants).sum();
        self.of_a_window = NOISE_BANDWIDTH * equations.len() as f64 / f64::from(instants.max(1));
        for given in &self.given {
            let part = (given.first, given.first);
            self.root
                .view_mut(part, given.root.shape())
                .copy_from(&given.root);
            let size = self.of_a_window.sqrt();
            given.write(size, &mut self.deviations[given.channels()]);
        }
    }

    /// By how much the covariance of parameters is larger than it seems, so many independent windows
    /// given: correlations that were learnt from the same residuals fit them too well, and the
    /// parameters suffer from their errors.
    pub(crate) fn inflation(&self, independent: f64) -> f64 {
        let part = (self.learnt / independent).min(0.9);
        (1.0 + part) / (1.0 - part)
    }

    pub(crate) fn channels(&self) -> usize {
        self.deviations.len()
    }

    /// Brings columns of values, a row each channel, to units of the noise, uncorrelated.
    pub(crate) fn whiten(&self, columns: &mut DMatrix<f64>) {
        for (mut row, deviation) in columns.row_iter_mut().zip(&self.deviations) {
            row /= *deviation;
        }
        self.root.solve_lower_triangular_mut(columns);
    }

    /// The same of rows with their wanted values, without allocation.
    pub(crate) fn whiten_rows(&self, rows: &mut [(SVector<f64, 10>, f64)]) {
        for i in 0..rows.len() {
            let (before, rest) = rows.split_at_mut(i);
            let (row, wanted) = &mut rest[0];
            let scale = self.deviations[i].recip();
            *row *= scale;
            *wanted *= scale;
            for (j, (other, other_wanted)) in before.iter().enumerate() {
                let part = self.root[(i, j)];
                row.axpy(-part, other, 1.0);
                *wanted -= part * other_wanted;
            }
            let scale = self.root[(i, i)].recip();
            *row *= scale;
            *wanted *= scale;
        }
    }

    /// Learns from the residuals of some windows and the windows' weights, once these tell outliers.
    ///
    /// Sizes and correlations are then of one sum: channels that follow each other closely tell most by
    /// their difference, which does not bear that one is a few percent off.
    pub(crate) fn measure<'a>(&mut self, windows: impl Iterator<Item = (&'a [f64], f64)> + Clone) {
        let (mut count, mut weights) = (0.0, f64::MIN_POSITIVE);
        for (_, weight) in windows.clone() {
            count += 1.0;
            weights += weight;
        }
        let mut covariance = self.products(windows) / weights;
        self.take(&mut covariance, count);
    }

    /// The same while outliers are still to be told: deviations from medians, which these do not move, and
    /// no correlations, which they would make.
    pub(crate) fn measure_medians<'a>(
        &mut self,
        windows: impl Iterator<Item = (&'a [f64], f64)> + Clone,
    ) {
        for channel in 0..self.channels() {
            let mut sizes: Vec<f64> = windows.clone().map(|(r, _)| r[channel].abs()).collect();
            if sizes.is_empty() {
                return;
            }
            let middle = sizes.len() / 2;
            let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
            self.deviations[channel] = *median / NORMAL_MEDIAN;
        }
        self.even_out();
    }

    /// Takes the covariance of the channels as so many windows told it, which is destroyed. Allocates
    /// nothing.
    pub(crate) fn take(&mut self, covariance: &mut DMatrix<f64>, windows: f64) {
        for (channel, deviation) in self.deviations.iter_mut().enumerate() {
            *deviation = covariance[(channel, channel)].max(0.0).sqrt();
        }
        self.even_out();
        self.believe(covariance, windows);
    }

    /// No deviation is less than rounding. A channel that happens to be met exactly, such as a moment
    /// about which nothing turns, must not count for all others of its kind.
    fn even_out(&mut self) {
        for (deviation, floor) in self.deviations.iter_mut().zip(&self.floors) {
            *deviation = deviation.max(*floor);
        }
        for kind in parts(&mut self.deviations, &self.kinds) {
            let largest = kind.iter().fold(0.0f64, |a, &b| a.max(b));
            for deviation in kind {
                *deviation = deviation.max(ALIKE * largest);
            }
        }
        self.stay_as_given();
    }

    /// What is given stays in proportion, and is larger as a whole where the residuals are: noise in the
    /// motion is in them, too.
    fn stay_as_given(&mut self) {
        for given in &self.given {
            let learnt = &mut self.deviations[given.channels()];
            let pairs = learnt.iter().zip(&given.deviations);
            let squares: f64 = pairs.map(|(learnt, given)| (learnt / given).powi(2)).sum();
            let square = (squares / learnt.len() as f64).max(self.of_a_window);
            given.write(square.sqrt(), learnt);
        }
    }

    /// The given noise that a channel belongs to.
    fn given_of(&self, channel: usize) -> Option<&GivenNoise> {
        self.given
            .iter()
            .find(|given| given.channels().contains(&channel))
    }

    /// Learns the correlations from the lower triangle of products, as far as so many windows are to be
    /// believed.
    fn believe(&mut self, products: &mut DMatrix<f64>, windows: f64) {
        to_correlation(products);
        let independent = windows / PRODUCT_CORRELATION;
        let share = |i: usize, j: usize| self.source_of[i] == self.source_of[j];
        let is_learnt = |i: usize, j: usize| self.given_of(i).or(self.given_of(j)).is_none();
        let within = kept(products, independent, |i, j| share(i, j) && is_learnt(i, j));
        // No more of what lies between sources than within them: the result stays positive.
        let between = kept(products, independent, |i, j| {
            !share(i, j) && is_learnt(i, j)
        })
        .min(within);
        let channels = self.channels();
        let mut squares = 0.0;
        for i in 0..channels {
            for j in 0..i {
                if is_learnt(i, j) {
                    let part = if share(i, j) { within } else { between };
                    products[(i, j)] *= part;
                    squares += part * part;
                } else {
                    let given = self.given_of(i).filter(|_| share(i, j));
                    products[(i, j)] = given.map_or(0.0, |given| {
                        given.correlation[(i - given.first, j - given.first)]
                    });
                }
            }
        }
        // A mean of a correlation and the identity, which a triangle takes without fail.
        if factor(products) {
            self.root.copy_from(products);
            self.learnt = 2.0 * squares / channels as f64;
        }
    }

    /// Of the channels' residuals: the lower triangle of their weighted sum.
    fn products<'a>(&self, windows: impl Iterator<Item = (&'a [f64], f64)>) -> DMatrix<f64> {
        let channels = self.channels();
        let mut products = DMatrix::<f64>::zeros(channels, channels);
        for (residuals, weight) in windows {
            for i in 0..channels {
                for j in 0..=i {
                    products[(i, j)] += weight * residuals[i] * residuals[j];
                }
            }
        }
        products
    }
}

/// Makes a lower triangle of products one of correlations.
fn to_correlation(products: &mut DMatrix<f64>) {
    for i in 0..products.nrows() {
        for j in 0..i {
            let size = (products[(i, i)] * products[(j, j)]).sqrt();
            products[(i, j)] /= size.max(f64::MIN_POSITIVE);
        }
    }
    products.fill_diagonal(1.0);
}

/// The Cholesky factor in place of a lower triangle; false, and something else, where it has none.
fn factor(matrix: &mut DMatrix<f64>) -> bool {
    for j in 0..matrix.nrows() {
        for k in 0..j {
            let part = matrix[(j, k)];
            for i in j..matrix.nrows() {
                matrix[(i, j)] -= part * matrix[(i, k)];
            }
        }
        let pivot = matrix[(j, j)];
        // Not a number is not positive either.
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        for i in j..matrix.nrows() {
            matrix[(i, j)] /= pivot.sqrt();
        }
    }
    matrix.fill_upper_triangle(0.0, 1);
    true
}

/// The part of estimated correlations that is to be believed, where few windows know little of many:
/// what leaves the least error on the average (Schäfer and Strimmer 2005, doi 10.2202/1544-6115.1175).
/// Of [many](PLENTY) nearly all: channels that follow each other closely tell most by their difference,
/// and would lose it by a percent less.
fn kept(raw: &DMatrix<f64>, independent: f64, among: impl Fn(usize, usize) -> bool) -> f64 {
    if independent >= PLENTY * raw.nrows() as f64 {
        return NEARLY;
    }
    let (mut errors, mut squares) = (0.0, 0.0);
    for i in 0..raw.nrows() {
        for j in (0..i).filter(|&j| among(i, j)) {
            let square = raw[(i, j)] * raw[(i, j)];
            errors += (1.0 - square).powi(2) / independent;
            squares += square;
        }
    }
    if squares > 0.0 {
        (1.0 - errors / squares).max(0.0)
    } else {
        0.0
    }
}

/// Root mean square of what each channel measures, together with those that are measured alike: how
/// large residuals may be before there are any.
pub(crate) fn sizes(equations: &[Equation], kinds: &[usize], sizes: &mut [f64]) {
    sizes.fill(0.0);
    for equation in equations {
        for (square, row) in sizes.iter_mut().zip(&equation.rows) {
            *square += row.wanted * row.wanted;
        }
    }
    for kind in parts(sizes, kinds) {
        let mean = kind.iter().sum::<f64>() / (equations.len() * kind.len()) as f64;
        kind.fill(mean.sqrt().max(f64::MIN_POSITIVE));
    }
}

/// The channels of each kind.
fn parts<'a>(
    mut channels: &'a mut [f64],
    kinds: &'a [usize],
) -> impl Iterator<Item = &'a mut [f64]> {
    kinds.iter().map_while(move |&count| {
        let (kind, rest) = std::mem::take(&mut channels).split_at_mut_checked(count)?;
        channels = rest;
        Some(kind)
    })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use rand_distr::StandardNormal;

    use super::*;

    /// Three channels are given, two are learnt: the first keep their proportions and correlations, and
    /// have none with the others, whatever the residuals say; all are as large as these.
    #[test]
    fn given_noise_stays_in_proportion() {
        let covariance = DMatrix::from_row_slice(
            3,
            3,
            &[4.0, 1.8, 0.0, 1.8, 1.0, 0.0, 0.0, 0.0, 9.0], // correlation 0.9
        );
        let channels = Channels {
            kinds: vec![3, 2],
            sources: vec![3, 2],
            offsets: 0,
            given: vec![GivenNoise::new(0, covariance)],
        };
        let mut equation = Equation::new(5);
        equation.instants = 70;
        equation.rows.iter_mut().for_each(|row| row.wanted = 100.0);
        let mut noise = Noise::before_residuals(&[equation], &channels, ROUNDING);
        let of_a_window = (35.0 / 18.0 / 70.0f64).sqrt();
        for (found, of_a_sample) in noise.deviations.iter().zip([2.0, 1.0, 3.0]) {
            assert!((found / of_a_sample / of_a_window - 1.0).abs() < 1e-12);
        }
        assert!((noise.deviations[3] - 100.0).abs() < 1e-9);

        let mut random = SmallRng::seed_from_u64(5);
        let mut draw = || -> f64 { random.sample(StandardNormal) };
        // Five times as large as given, and all five channels alike.
        let residuals: Vec<[f64; 5]> = (0..2000)
            .map(|_| {
                let common = draw();
                [10.0, 5.0, 15.0, 1.0, 2.0].map(|size| size * of_a_window * (common + 0.1 * draw()))
            })
            .collect();
        noise.measure(residuals.iter().map(|residual| (&residual[..], 1.0)));
        for (found, wanted) in noise.deviations.iter().zip([10.0, 5.0, 15.0, 1.0, 2.0]) {
            assert!((found / wanted / of_a_window - 1.0).abs() < 0.06, "{found}");
        }
        let correlation = &noise.root * noise.root.transpose();
        assert!((correlation[(1, 0)] - 0.9).abs() < 1e-12);
        assert!(correlation[(2, 0)].abs() < 1e-12 && correlation[(3, 1)].abs() < 1e-12);
        assert!((correlation[(4, 3)] - 1.0 / 1.01).abs() < 0.01);
    }
}
