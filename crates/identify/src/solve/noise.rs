//! The noise of the channels, learnt from residuals.

use nalgebra::{DMatrix, SVector};

use crate::equations::window::{NOISE_BANDWIDTH, PRODUCT_CORRELATION};
use crate::equations::{Channels, Equation, GivenNoise, cholesky_in_place, to_correlation};

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

/// Deviations of the channels' noise, and how it is correlated between them: a finger's force pulls
/// at its lever arm, so its noise is in the moment, too.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    /// In each channel's unit.
    pub(crate) std_devs: Vec<f64>,
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
            std_devs: vec![1.0; count],
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
        sizes(equations, &self.kinds, &mut self.std_devs);
        for (floor, size) in self.floors.iter_mut().zip(&self.std_devs) {
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
            given.write_scaled(size, &mut self.std_devs[given.channels()]);
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
        self.std_devs.len()
    }

    /// Brings columns of values, a row each channel, to units of the noise, uncorrelated.
    pub(crate) fn whiten(&self, columns: &mut DMatrix<f64>) {
        for (mut row, std_dev) in columns.row_iter_mut().zip(&self.std_devs) {
            row /= *std_dev;
        }
        self.root.solve_lower_triangular_mut(columns);
    }

    /// The same of rows with their wanted values, without allocation.
    pub(crate) fn whiten_rows(&self, rows: &mut [(SVector<f64, 10>, f64)]) {
        for i in 0..rows.len() {
            let (before, rest) = rows.split_at_mut(i);
            let (row, target) = &mut rest[0];
            let scale = self.std_devs[i].recip();
            *row *= scale;
            *target *= scale;
            for (j, (other, other_target)) in before.iter().enumerate() {
                let part = self.root[(i, j)];
                row.axpy(-part, other, 1.0);
                *target -= part * other_target;
            }
            let scale = self.root[(i, i)].recip();
            *row *= scale;
            *target *= scale;
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
            self.std_devs[channel] = *median / NORMAL_MEDIAN;
        }
        self.even_out();
    }

    /// Takes the covariance of the channels as so many windows told it, which is destroyed. Allocates
    /// nothing.
    pub(crate) fn take(&mut self, covariance: &mut DMatrix<f64>, windows: f64) {
        for (channel, std_dev) in self.std_devs.iter_mut().enumerate() {
            *std_dev = covariance[(channel, channel)].max(0.0).sqrt();
        }
        self.even_out();
        self.believe(covariance, windows);
    }

    /// No deviation is less than rounding. A channel that happens to be met exactly, such as a moment
    /// about which nothing turns, must not count for all others of its kind.
    fn even_out(&mut self) {
        for (std_dev, floor) in self.std_devs.iter_mut().zip(&self.floors) {
            *std_dev = std_dev.max(*floor);
        }
        for kind in parts(&mut self.std_devs, &self.kinds) {
            let largest = kind.iter().fold(0.0f64, |a, &b| a.max(b));
            for std_dev in kind {
                *std_dev = std_dev.max(ALIKE * largest);
            }
        }
        self.stay_as_given();
    }

    /// What is given stays in proportion, and is larger as a whole where the residuals are: noise in the
    /// motion is in them, too.
    fn stay_as_given(&mut self) {
        for given in &self.given {
            let learnt = &mut self.std_devs[given.channels()];
            let pairs = learnt.iter().zip(&given.std_devs);
            let squares: f64 = pairs.map(|(learnt, given)| (learnt / given).powi(2)).sum();
            let square = (squares / learnt.len() as f64).max(self.of_a_window);
            given.write_scaled(square.sqrt(), learnt);
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
        if cholesky_in_place(products) {
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
            *square += row.target * row.target;
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
            given: vec![GivenNoise::new(0, covariance)],
            ..Channels::of_wrench()
        };
        let mut equation = Equation::new(5);
        equation.instants = 70;
        equation.rows.iter_mut().for_each(|row| row.target = 100.0);
        let mut noise = Noise::before_residuals(&[equation], &channels, ROUNDING);
        let of_a_window = (35.0 / 18.0 / 70.0f64).sqrt();
        for (found, of_a_sample) in noise.std_devs.iter().zip([2.0, 1.0, 3.0]) {
            assert!((found / of_a_sample / of_a_window - 1.0).abs() < 1e-12);
        }
        assert!((noise.std_devs[3] - 100.0).abs() < 1e-9);

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
        for (found, target) in noise.std_devs.iter().zip([10.0, 5.0, 15.0, 1.0, 2.0]) {
            assert!((found / target / of_a_window - 1.0).abs() < 0.06, "{found}");
        }
        let correlation = &noise.root * noise.root.transpose();
        assert!((correlation[(1, 0)] - 0.9).abs() < 1e-12);
        assert!(correlation[(2, 0)].abs() < 1e-12 && correlation[(3, 1)].abs() < 1e-12);
        assert!((correlation[(4, 3)] - 1.0 / 1.01).abs() < 0.01);
    }
}
