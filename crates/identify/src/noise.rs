//! The noise of the channels, learnt from residuals.

use nalgebra::DMatrix;

use crate::equation::Equation;
use crate::window::PRODUCT_CORRELATION;

/// Residuals of less than this part of what is measured are rounding.
const ROUNDING: f64 = 1e-14;

/// No channel has less noise than this part of the noisiest of its kind.
const ALIKE: f64 = 1e-2;

/// Median of the absolute value of a standard normal variable.
const NORMAL_MEDIAN: f64 = 0.6745;

/// How channels belong together; each a part of all channels in order.
#[derive(Clone, Debug)]
pub(crate) struct Channels {
    /// How many there are of each kind, whose noise is of like size: the axes of a force, say.
    pub(crate) kinds: Vec<usize>,
    /// How many come from each source.
    pub(crate) sources: Vec<usize>,
}

impl Channels {
    /// Of one wrench.
    pub(crate) fn of_a_wrench() -> Self {
        Self {
            kinds: vec![3, 3],
            sources: vec![6],
        }
    }

    /// Whether two come from the same source.
    fn share_source(&self, a: usize, b: usize) -> bool {
        let source = |channel: usize| {
            let ends = self.sources.iter().scan(0, |end, count| {
                *end += count;
                Some(*end)
            });
            ends.take_while(|&end| end <= channel).count()
        };
        source(a) == source(b)
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
}

impl Noise {
    /// Before there are residuals: as large as what is measured, and uncorrelated.
    pub(crate) fn before_residuals(equations: &[Equation], channels: &Channels) -> Self {
        let deviations = sizes(equations, &channels.kinds);
        Self {
            floors: deviations.iter().map(|size| size * ROUNDING).collect(),
            root: DMatrix::identity(deviations.len(), deviations.len()),
            learnt: 0.0,
            deviations,
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

    /// Learns from the residuals of some windows and the windows' weights: deviations from medians,
    /// which outliers do not move, and correlations from weighted products.
    pub(crate) fn measure<'a>(
        &mut self,
        windows: impl Iterator<Item = (&'a [f64], f64)> + Clone,
        grouping: &Channels,
    ) {
        let count = windows.clone().count();
        if count == 0 {
            return;
        }
        for channel in 0..self.channels() {
            let mut sizes: Vec<f64> = windows.clone().map(|(r, _)| r[channel].abs()).collect();
            let (_, median, _) = sizes.select_nth_unstable_by(count / 2, f64::total_cmp);
            self.deviations[channel] = (*median / NORMAL_MEDIAN).max(self.floors[channel]);
        }
        even_out(&mut self.deviations, &grouping.kinds);
        let raw = self.correlation(windows);
        let independent = count as f64 / PRODUCT_CORRELATION;
        let share = |i, j| grouping.share_source(i, j);
        let within = kept(&raw, independent, share);
        // No more of what lies between sources than within them: the result stays positive.
        let between = kept(&raw, independent, |i, j| !share(i, j)).min(within);
        let believed = DMatrix::from_fn(raw.nrows(), raw.ncols(), |i, j| {
            if i == j {
                0.0
            } else if share(i, j) {
                within
            } else {
                between
            }
        });
        let mut correlation = raw.component_mul(&believed);
        correlation.fill_diagonal(1.0);
        if let Some(cholesky) = correlation.cholesky() {
            self.root = cholesky.unpack();
            self.learnt = believed.norm_squared() / self.channels() as f64;
        }
    }

    /// Of the channels' residuals, as it comes out.
    fn correlation<'a>(&self, windows: impl Iterator<Item = (&'a [f64], f64)>) -> DMatrix<f64> {
        let channels = self.channels();
        let mut products = DMatrix::<f64>::zeros(channels, channels);
        for (residuals, weight) in windows {
            for i in 0..channels {
                for j in 0..=i {
                    let scale = self.deviations[i] * self.deviations[j];
                    products[(i, j)] += weight * residuals[i] * residuals[j] / scale;
                }
            }
        }
        DMatrix::from_fn(channels, channels, |i, j| {
            let size = (products[(i, i)] * products[(j, j)]).sqrt();
            products[(i.max(j), i.min(j))] / size.max(f64::MIN_POSITIVE)
        })
    }
}

/// The part of estimated correlations that is to be believed, where few windows know little of many:
/// what leaves the least error on the average (Schäfer and Strimmer 2005, doi 10.2202/1544-6115.1175).
fn kept(raw: &DMatrix<f64>, independent: f64, among: impl Fn(usize, usize) -> bool) -> f64 {
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
pub(crate) fn sizes(equations: &[Equation], kinds: &[usize]) -> Vec<f64> {
    let channels = equations.first().map_or(0, |equation| equation.rows.len());
    let mut squares = vec![0.0; channels];
    for equation in equations {
        for (square, row) in squares.iter_mut().zip(&equation.rows) {
            *square += row.wanted * row.wanted;
        }
    }
    for kind in parts(&mut squares, kinds) {
        let mean = kind.iter().sum::<f64>() / (equations.len() * kind.len()) as f64;
        kind.fill(mean.sqrt().max(f64::MIN_POSITIVE));
    }
    squares
}

/// A channel that happens to be met exactly, such as a moment about which nothing turns, must not
/// count for all others of its kind.
fn even_out(deviations: &mut [f64], kinds: &[usize]) {
    for kind in parts(deviations, kinds) {
        let largest = kind.iter().fold(0.0f64, |a, &b| a.max(b));
        for deviation in kind {
            *deviation = deviation.max(ALIKE * largest);
        }
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
