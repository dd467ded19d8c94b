//! The noise of the channels, estimated from residuals. Batch and online least squares share this
//! model.

mod correlation;
mod known_sensor;
mod whitening;

use nalgebra::{DMatrix, Matrix6, SVector};

use self::correlation::{cholesky_in_place, shrinkage_factor, to_correlation};
use self::known_sensor::KnownSensor;
pub use self::whitening::Whitening;
use crate::equations::window::{NOISE_BANDWIDTH, PRODUCT_CORRELATION};
use crate::equations::{Channels, Equation};

/// Least variance of a direction or spectral density of residuals, relative to that of white noise,
/// and least fraction of the degrees of freedom that a fit leaves. It keeps the variance of an
/// estimate positive whatever the estimated correlation.
pub const VARIANCE_FLOOR: f64 = 0.05;

/// Residuals smaller than this fraction of the measurements are rounding.
pub const RESIDUAL_ROUNDING: f64 = 1e-14;

/// Size, in N, N m or the unit of another channel, below which all measurements of a kind are zero.
/// The squares of what is divided by a larger size stay finite.
pub const ZERO_SIZE: f64 = 1e-30;

/// Least standard deviation of a channel relative to the largest of its kind. A channel with next
/// to no residuals by chance, such as a moment about which nothing turns, must not outweigh all
/// others.
const MIN_RATIO: f64 = 1e-2;

/// Median of the absolute value of a standard normal variable.
const NORMAL_MEDIAN: f64 = 0.6745;

/// Standard deviations of the channels' noise and its correlation across channels: through its
/// lever arm the noise of a finger's force is in the moment, too.
///
/// The noise of sources whose sensors are known keeps their proportions and correlation, and only
/// its overall size follows the residuals.
#[derive(Clone, Debug)]
pub struct Noise {
    /// Standard deviation of each channel's mean over a window, in the channel's unit.
    pub std_devs: Vec<f64>,
    /// Least standard deviations: smaller ones are rounding or discretisation.
    floors: Vec<f64>,
    /// Fraction of the measurements' size that is the floor.
    relative_floor: f64,
    /// Cholesky factor of the correlation matrix.
    root: DMatrix<f64>,
    /// Effective number of correlations of each channel that were estimated from the residuals.
    estimated_correlations: f64,
    kinds: Vec<usize>,
    source_of: Vec<usize>,
    known: Vec<KnownSensor>,
    /// Variance of the mean of white noise over a window, relative to the variance of one sample.
    window_variance: f64,
}

impl Noise {
    /// Creates a model from the measurements alone, before there are residuals: noise as large as
    /// the measurements, uncorrelated unless the sensors are known. No standard deviation will be
    /// less than `relative_floor` times the size of the measurements.
    pub fn from_targets(equations: &[Equation], channels: &Channels, relative_floor: f64) -> Self {
        let source_of = channels.source_of();
        let count = source_of.len();
        let mut noise = Self {
            std_devs: vec![1.0; count],
            floors: vec![0.0; count],
            relative_floor,
            root: DMatrix::identity(count, count),
            estimated_correlations: 0.0,
            kinds: channels.kinds.clone(),
            source_of,
            known: channels.known_noise.iter().map(KnownSensor::new).collect(),
            window_variance: 1.0,
        };
        noise.reset(equations);
        noise
    }

    /// Discards what was estimated from residuals, and takes sizes and floors from the measurements
    /// of some windows. Allocates nothing.
    pub(crate) fn reset(&mut self, equations: &[Equation]) {
        target_sizes(equations, &self.kinds, &mut self.std_devs);
        for (floor, size) in self.floors.iter_mut().zip(&self.std_devs) {
            *floor = size * self.relative_floor;
        }
        self.root.fill_with_identity();
        self.estimated_correlations = 0.0;
        let instants: u32 = equations.iter().map(|equation| equation.instants).sum();
        self.window_variance =
            NOISE_BANDWIDTH * equations.len() as f64 / f64::from(instants.max(1));
        for known in &self.known {
            let corner = (known.first_channel, known.first_channel);
            let mut block = self.root.view_mut(corner, known.root.shape());
            block.copy_from(&known.root);
            let scale = self.window_variance.sqrt();
            known.write_scaled(scale, &mut self.std_devs[known.channels()]);
        }
    }

    /// Returns whether any measurement was different from zero.
    pub fn has_measurements(&self) -> bool {
        self.std_devs.iter().any(|&size| size > f64::MIN_POSITIVE)
    }

    /// Sets the size of channels whose measurements were all zero to one unit: the sensor has not
    /// started yet, has no such axis, or a point mass without noise has no moments. Otherwise
    /// whitening would divide other measurements by zero. Allocates nothing.
    pub fn set_zero_channels_to_unit(&mut self) {
        for (std_dev, floor) in self.std_devs.iter_mut().zip(&mut self.floors) {
            if *std_dev <= f64::MIN_POSITIVE {
                (*std_dev, *floor) = (1.0, self.relative_floor);
            }
        }
    }

    /// Returns the same standard deviations without correlation across channels.
    pub fn without_correlation(&self) -> Self {
        let mut noise = self.clone();
        noise.root.fill_with_identity();
        noise.estimated_correlations = 0.0;
        noise
    }

    /// Returns the least standard deviation of a channel, in its unit: smaller residuals are
    /// rounding.
    pub fn floor(&self, channel: usize) -> f64 {
        self.floors[channel]
    }

    /// Numbers of consecutive channels whose noise is of similar size.
    pub(crate) fn kinds(&self) -> &[usize] {
        &self.kinds
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.std_devs.len()
    }

    /// Returns a root `R` of the covariance `R Rᵀ` of the channels' means over a window, in their
    /// units.
    pub fn covariance_root(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.channels(), self.channels(), |i, j| {
            if j <= i {
                self.std_devs[i] * self.root[(i, j)]
            } else {
                0.0
            }
        })
    }

    /// Returns the covariance of the first six channels' means over a window, in their units,
    /// without allocation; `None` where there are fewer.
    pub fn wrench_covariance(&self) -> Option<Matrix6<f64>> {
        (self.channels() >= 6).then(|| {
            let root = Matrix6::from_fn(|i, j| match j <= i {
                true => self.std_devs[i] * self.root[(i, j)],
                false => 0.0,
            });
            root * root.transpose()
        })
    }

    /// Copies the noise of as many channels, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.std_devs.copy_from_slice(&other.std_devs);
        self.floors.copy_from_slice(&other.floors);
        self.root.copy_from(&other.root);
        self.estimated_correlations = other.estimated_correlations;
        self.window_variance = other.window_variance;
    }

    /// Returns the factor by which the covariance of the parameters is larger than an estimate of
    /// the noise shows, given the number of independent windows. Errors of the estimated
    /// correlations add to those of the parameters; and the correlations fit the residuals, from
    /// which a fraction `from_residuals` of the estimate comes, too well.
    pub fn inflation(&self, independent: f64, from_residuals: f64) -> f64 {
        let fraction = (self.estimated_correlations / independent).min(0.9);
        (1.0 + fraction) * (1.0 + from_residuals * fraction / (1.0 - fraction))
    }

    /// Whitens regressor rows with their targets, one for each channel: brings them to units of
    /// their noise and removes its correlation. Allocates nothing.
    pub(crate) fn whiten(&self, rows: &mut [(SVector<f64, 10>, f64)]) {
        for (i, std_dev) in self.std_devs.iter().enumerate() {
            let (before, rest) = rows.split_at_mut(i);
            let (regressor, target) = &mut rest[0];
            // Products with a reciprocal are several times faster than as many divisions.
            let factor = std_dev.recip();
            *regressor *= factor;
            *target *= factor;
            // Forward substitution with the Cholesky factor.
            for (j, (other_regressor, other_target)) in before.iter().enumerate() {
                let factor = self.root[(i, j)];
                regressor.axpy(-factor, other_regressor, 1.0);
                *target -= factor * other_target;
            }
            let factor = self.root[(i, i)].recip();
            *regressor *= factor;
            *target *= factor;
        }
    }

    /// Estimates standard deviations and correlations from the residuals of some windows and the
    /// windows' robust weights, once these identify outliers.
    ///
    /// Sizes and correlations come from one sum: channels whose noise is almost the same determine
    /// most by their difference, which a size that is a few percent off would spoil.
    pub fn estimate<'a>(&mut self, windows: impl Iterator<Item = (&'a [f64], f64)> + Clone) {
        let (mut count, mut weights) = (0.0, f64::MIN_POSITIVE);
        for (_, weight) in windows.clone() {
            count += 1.0;
            weights += weight;
        }
        let mut covariance = self.products(windows) / weights;
        self.set_covariance(&mut covariance, count);
    }

    /// Estimates standard deviations from medians of the residuals of some windows, while outliers
    /// are not identified yet: outliers do not move medians. Correlations stay as they are, because
    /// outliers would dominate them.
    pub fn estimate_from_medians<'a>(
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
        self.apply_floors();
    }

    /// Sets the noise from a covariance across the channels that so many windows have shown. Only
    /// its lower triangle is used, and is overwritten. Allocates nothing.
    pub(crate) fn set_covariance(&mut self, covariance: &mut DMatrix<f64>, windows: f64) {
        for (channel, std_dev) in self.std_devs.iter_mut().enumerate() {
            *std_dev = covariance[(channel, channel)].max(0.0).sqrt();
        }
        self.apply_floors();
        self.set_correlation(covariance, windows);
    }

    /// Raises standard deviations that are rounding, or small by chance.
    fn apply_floors(&mut self) {
        for (std_dev, floor) in self.std_devs.iter_mut().zip(&self.floors) {
            *std_dev = std_dev.max(*floor);
        }
        for kind in groups_mut(&mut self.std_devs, &self.kinds) {
            let largest = kind.iter().fold(0.0f64, |a, &b| a.max(b));
            for std_dev in kind {
                *std_dev = std_dev.max(MIN_RATIO * largest);
            }
        }
        self.scale_known();
    }

    /// Gives the channels of known sensors the proportions of their known noise. Its overall size
    /// follows the residuals, in which there is noise of the motion, too, but is not less than
    /// known.
    fn scale_known(&mut self) {
        for known in &self.known {
            let estimated = &mut self.std_devs[known.channels()];
            let pairs = estimated.iter().zip(&known.std_devs);
            let squares: f64 = pairs
                .map(|(estimated, known)| (estimated / known).powi(2))
                .sum();
            let square = (squares / estimated.len() as f64).max(self.window_variance);
            known.write_scaled(square.sqrt(), estimated);
        }
    }

    /// Returns the known sensor that a channel belongs to.
    fn known_of(&self, channel: usize) -> Option<&KnownSensor> {
        self.known
            .iter()
            .find(|known| known.channels().contains(&channel))
    }

    /// Sets the correlations from the lower triangle of mean products over so many windows, which
    /// is overwritten. Estimated correlations are shrunk, within sources and between them by
    /// factors of their own.
    fn set_correlation(&mut self, products: &mut DMatrix<f64>, windows: f64) {
        to_correlation(products);
        let independent = windows / PRODUCT_CORRELATION;
        let same_source = |i: usize, j: usize| self.source_of[i] == self.source_of[j];
        let is_estimated = |i: usize, j: usize| self.known_of(i).or(self.known_of(j)).is_none();
        let within = shrinkage_factor(products, independent, |i, j| {
            same_source(i, j) && is_estimated(i, j)
        });
        // The matrix stays positive definite where the factor between sources is not the larger
        // one.
        let between = shrinkage_factor(products, independent, |i, j| {
            !same_source(i, j) && is_estimated(i, j)
        })
        .min(within);
        let channels = self.channels();
        let mut squares = 0.0;
        for i in 0..channels {
            for j in 0..i {
                if is_estimated(i, j) {
                    let factor = if same_source(i, j) { within } else { between };
                    products[(i, j)] *= factor;
                    squares += factor * factor;
                } else {
                    let known = self.known_of(i).filter(|_| same_source(i, j));
                    products[(i, j)] = known.map_or(0.0, |known| {
                        known.correlation[(i - known.first_channel, j - known.first_channel)]
                    });
                }
            }
        }
        // A mean of a correlation matrix and the identity is positive definite but for rounding.
        if cholesky_in_place(products) {
            self.root.copy_from(products);
            self.estimated_correlations = 2.0 * squares / channels as f64;
        }
    }

    /// Returns the lower triangle of the weighted sum of the residuals' products.
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

/// Writes the root mean square of each channel's measurements, taken over all channels of its kind:
/// an upper bound of its noise before there are residuals.
pub fn target_sizes(equations: &[Equation], kinds: &[usize], sizes: &mut [f64]) {
    sizes.fill(0.0);
    for equation in equations {
        for (square, row) in sizes.iter_mut().zip(&equation.rows) {
            *square += row.target * row.target;
        }
    }
    for kind in groups_mut(sizes, kinds) {
        let mean = kind.iter().sum::<f64>() / (equations.len() * kind.len()) as f64;
        let size = mean.sqrt();
        kind.fill(if size < ZERO_SIZE {
            f64::MIN_POSITIVE
        } else {
            size
        });
    }
}

/// Splits channels into consecutive groups of so many.
fn groups_mut<'a>(
    mut channels: &'a mut [f64],
    counts: &'a [usize],
) -> impl Iterator<Item = &'a mut [f64]> {
    counts.iter().map_while(move |&count| {
        let (group, rest) = std::mem::take(&mut channels).split_at_mut_checked(count)?;
        channels = rest;
        Some(group)
    })
}

#[cfg(test)]
mod tests;
