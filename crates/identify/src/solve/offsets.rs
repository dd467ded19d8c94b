//! Constant offsets of channels, such as a force sensor's zero: further unknowns, which are
//! eliminated.
//!
//! With an unknown constant in a channel, least squares is that of the channel's rows less their
//! weighted mean. [`MeanRow`] eliminates the constant from all rows at once, for the batch fit.
//! [`Centering`] eliminates it from one row after another, for what grows window by window: each
//! row less the mean of those before it, times a factor (Welford 1962, Technometrics 4, 419-420).
//! Both give the same information and the same parameters, and both then give the offset as what
//! the parameters leave of the mean.

use nalgebra::{Matrix6, SMatrix, Vector6};

use super::noise::Noise;
use super::subspace::{Matrix, NullSpace, PIVOT_ROUNDING, Vector};
use crate::equations::Row;
use crate::equations::window::NOISE_CORRELATION;

/// Constant offsets of the six channels of a wrench, with what their covariance follows from.
#[derive(Clone, Copy, Debug)]
pub struct Offsets {
    /// What each channel measures when nothing acts on the sensor, in the channel's unit.
    pub values: Vector6<f64>,
    /// Derivatives of the values with respect to the parameters, with the opposite sign.
    gradients: SMatrix<f64, 6, 10>,
    /// Covariance of the mean noise of the channels.
    of_means: Matrix6<f64>,
}

impl Offsets {
    /// Returns offsets that are known, whatever the parameters.
    pub(crate) fn known(known: &KnownOffsets) -> Self {
        Self {
            values: known.values,
            gradients: SMatrix::zeros(),
            of_means: known.covariance,
        }
    }

    /// Returns what a solution leaves of the mean rows of so many windows; `None` unless there are
    /// six.
    pub fn new(
        means: &[MeanRow<11>],
        solution: &[f64],
        noise: &Noise,
        windows: usize,
    ) -> Option<Self> {
        let means: &[MeanRow<11>; 6] = means.try_into().ok()?;
        let root = noise.covariance_root();
        let covariance = &root * root.transpose();
        let of_means = covariance.fixed_view::<6, 6>(0, 0) * (NOISE_CORRELATION / windows as f64);
        Some(Self {
            values: means.each_ref().map(|mean| mean.remainder(solution)).into(),
            gradients: SMatrix::from_fn(|channel, k| means[channel].entries[k]),
            of_means,
        })
    }

    /// Returns the offsets of the wrench in another frame, given the matrix that maps wrenches to
    /// it.
    pub fn mapped(&self, map: &Matrix6<f64>) -> Self {
        Self {
            values: map * self.values,
            gradients: map * self.gradients,
            of_means: map * self.of_means * map.transpose(),
        }
    }

    /// Adds what the uncertainty of further unknowns contributes at known parameters.
    pub fn add_covariance(&mut self, covariance: &Matrix6<f64>) {
        self.of_means += covariance;
    }

    /// Returns the standard deviation of each offset, in its unit, given the covariance of the
    /// parameters; infinite where the motion does not distinguish the offset from the payload.
    ///
    /// A channel whose mean is next to nothing for all parameters, those that the motion determines
    /// as well as the others, has its offset from the measurements alone.
    pub fn std_devs(&self, of_parameters: &Matrix, null_space: &NullSpace) -> [f64; 6] {
        let variances = self.covariance(of_parameters).diagonal();
        let hidden = self.gradients * null_space.hidden() * self.gradients.transpose();
        std::array::from_fn(|channel| {
            let (variance, hidden) = (variances[channel].max(0.0), hidden[(channel, channel)]);
            let is_slight = hidden > 0.0 && hidden < variance;
            if is_slight || self.is_determined(channel, null_space) {
                (variance + hidden).sqrt()
            } else {
                f64::INFINITY
            }
        })
    }

    /// Returns whether the motion distinguishes all offsets from the payload.
    pub(crate) fn are_determined(&self, null_space: &NullSpace) -> bool {
        (0..6).all(|channel| self.is_determined(channel, null_space))
    }

    fn is_determined(&self, channel: usize, null_space: &NullSpace) -> bool {
        null_space.determines(&self.gradients.row(channel).into())
    }

    /// Returns the covariance of the offsets, given that of the parameters.
    pub(crate) fn covariance(&self, of_parameters: &Matrix) -> Matrix6<f64> {
        self.gradients * of_parameters * self.gradients.transpose() + self.of_means
    }

    /// Returns the covariance of the offsets with the parameters, given that of the parameters.
    pub(crate) fn covariance_with(&self, of_parameters: &Matrix) -> SMatrix<f64, 6, 10> {
        -self.gradients * of_parameters
    }

    /// Returns the covariance of what a load with this regressor and the offsets measure together,
    /// given that of the parameters.
    pub(crate) fn covariance_of_load(
        &self,
        regressor: &SMatrix<f64, 6, 10>,
        of_parameters: &Matrix,
    ) -> Matrix6<f64> {
        let gradients = regressor - self.gradients;
        gradients * of_parameters * gradients.transpose() + self.of_means
    }
}

/// Returns the joint covariance of parameters and of offsets times a sign, which are zero where
/// there are none, given that of the parameters.
pub fn joint_covariance(
    of_parameters: &Matrix,
    offsets: Option<&Offsets>,
    sign: f64,
) -> SMatrix<f64, 16, 16> {
    let mut joint = SMatrix::<f64, 16, 16>::zeros();
    joint
        .fixed_view_mut::<10, 10>(0, 0)
        .copy_from(of_parameters);
    if let Some(offsets) = offsets {
        let crossed = offsets.covariance_with(of_parameters) * sign;
        let of_offsets = offsets.covariance(of_parameters);
        joint.fixed_view_mut::<6, 10>(10, 0).copy_from(&crossed);
        joint
            .fixed_view_mut::<10, 6>(0, 10)
            .copy_from(&crossed.transpose());
        joint.fixed_view_mut::<6, 6>(10, 10).copy_from(&of_offsets);
    }
    joint
}

/// Weighted mean of all rows of a channel, `N` entries each.
#[derive(Clone, Copy, Debug)]
pub struct MeanRow<const N: usize> {
    /// Mean of the entries.
    entries: [f64; N],
    /// Mean of the targets.
    target: f64,
}

impl<const N: usize> MeanRow<N> {
    /// Returns the mean of no rows.
    pub fn zero() -> Self {
        Self {
            entries: [0.0; N],
            target: 0.0,
        }
    }

    /// Returns the mean of rows, each with its weight, its entries and its target.
    pub fn new(rows: impl Iterator<Item = (f64, [f64; N], f64)>) -> Self {
        let (mut sum, mut sum_of_targets, mut weights) = ([0.0; N], 0.0, f64::MIN_POSITIVE);
        for (weight, entries, target) in rows {
            for (sum, entry) in sum.iter_mut().zip(entries) {
                *sum += weight * entry;
            }
            sum_of_targets += weight * target;
            weights += weight;
        }
        Self {
            entries: sum.map(|sum| sum / weights),
            target: sum_of_targets / weights,
        }
    }

    /// Returns the mean entries and the mean target.
    pub fn parts(&self) -> (&[f64; N], f64) {
        (&self.entries, self.target)
    }

    /// Returns the mean target less that predicted by a solution.
    pub fn remainder(&self, solution: &[f64]) -> f64 {
        let entries = self.entries.iter();
        self.target - entries.zip(solution).map(|(a, x)| a * x).sum::<f64>()
    }
}

/// Offsets of the six channels of a wrench as windows before a payload change have shown them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownOffsets {
    pub values: Vector6<f64>,
    pub(crate) covariance: Matrix6<f64>,
}

/// Noise of the six channels of a wrench in one window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WrenchNoise {
    /// Covariance across the channels, in their units.
    pub(crate) covariance: Matrix6<f64>,
    /// Factor on the covariance for errors that last longer than a window.
    pub(crate) factor: f64,
}

/// Rows that [known offsets](KnownOffsets) add to the information on the parameters: what they
/// leave of the mean rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OffsetRows {
    /// Regressors and targets in units in which the noise of a window has variance one.
    pub(crate) rows: [(Vector, f64); 6],
    /// Covariance of the scores of the rows: regressors times noise.
    pub(crate) scores: Matrix,
}

/// Running means of the rows of the leading channels, whose offsets are unknown, or known from
/// windows before a payload change.
#[derive(Clone, Debug)]
pub struct Centering {
    means: Vec<Row>,
    weight: f64,
    known: Option<KnownOffsets>,
}

impl Centering {
    /// Creates means without rows for so many channels.
    pub fn new(channels: usize) -> Self {
        Self {
            means: vec![Row::zero(); channels],
            weight: 0.0,
            known: None,
        }
    }

    /// Discards all windows, and begins again with what is known of the offsets.
    pub(crate) fn restart(&mut self, known: Option<KnownOffsets>) {
        self.means.fill(Row::zero());
        self.weight = 0.0;
        self.known = known;
    }

    /// Copies other means of as many channels, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.means.copy_from_slice(&other.means);
        (self.weight, self.known) = (other.weight, other.known);
    }

    /// Whether any channel has an offset.
    pub fn is_needed(&self) -> bool {
        !self.means.is_empty()
    }

    /// Whether no window has been added.
    pub fn is_empty(&self) -> bool {
        self.weight == 0.0
    }

    /// Whether the first window determines the offsets alone, because nothing is known of them.
    pub(crate) fn needs_first_window(&self) -> bool {
        self.is_empty() && self.known.is_none()
    }

    /// Replaces a window's rows by those that it adds to the information on the parameters. Their
    /// noise has the variance of the original rows.
    pub fn centre(&self, rows: &mut [Row], weight: f64) {
        let factor = (self.weight / (self.weight + weight).max(f64::MIN_POSITIVE)).sqrt();
        for (row, mean) in rows.iter_mut().zip(&self.means) {
            row.add(mean, -1.0);
            // An arm at rest whose encoders do not change would otherwise determine a mass from the
            // rounding of the mean.
            for (entry, mean) in row.regressor.iter_mut().zip(&mean.regressor) {
                if entry.abs() <= PIVOT_ROUNDING * mean.abs() {
                    *entry = 0.0;
                }
            }
            row.scale(factor);
        }
    }

    /// Adds a window, as it was before it was [centred](Self::centre).
    pub fn add(&mut self, rows: &[Row], weight: f64) {
        self.weight += weight;
        let fraction = weight / self.weight.max(f64::MIN_POSITIVE);
        for (row, mean) in rows.iter().zip(&mut self.means) {
            let mut difference = *row;
            difference.add(mean, -1.0);
            mean.add(&difference, fraction);
        }
    }

    /// Returns the rows that the known offsets add to those that are [centred](Self::centre): the
    /// covariance of their noise is that of the offsets and of the mean rows. `None` where nothing
    /// is known of the offsets.
    pub(crate) fn offset_rows(&self, noise: &WrenchNoise) -> Option<OffsetRows> {
        let known = self.known.as_ref()?;
        let (regressors, targets) = self.mean()?;
        let of_means = noise.covariance * (NOISE_CORRELATION / self.weight);
        let weights = ((known.covariance + of_means) / NOISE_CORRELATION).cholesky()?;
        let whitened = weights.l().solve_lower_triangular(&regressors)?;
        let differences = weights
            .l()
            .solve_lower_triangular(&(targets - known.values))?;
        let scores = weights.inverse() * regressors;
        Some(OffsetRows {
            rows: std::array::from_fn(|k| (whitened.row(k).transpose(), differences[k])),
            scores: scores.tr_mul(&((known.covariance + of_means * noise.factor) * scores)),
        })
    }

    /// Returns the offsets of the six channels of a wrench, given the parameters; `None` without
    /// offsets or before any window.
    pub(crate) fn offsets(&self, parameters: &Vector, noise: &WrenchNoise) -> Option<Offsets> {
        let (regressors, targets) = self.mean()?;
        let of_means = noise.covariance * (NOISE_CORRELATION / self.weight);
        let remainder = targets - regressors * parameters;
        let Some(known) = &self.known else {
            return Some(Offsets {
                values: remainder,
                gradients: regressors,
                of_means: of_means * noise.factor,
            });
        };
        let gain = known.covariance * (known.covariance + of_means).try_inverse()?;
        let rest = Matrix6::identity() - gain;
        Some(Offsets {
            values: known.values + gain * (remainder - known.values),
            gradients: gain * regressors,
            of_means: rest * known.covariance * rest.transpose()
                + gain * of_means * gain.transpose() * noise.factor,
        })
    }

    /// Returns the squared Mahalanobis distance of the offsets that parameters leave of the windows
    /// from the known ones. The variance of a model error adds to theirs, in units of the noise of
    /// a window. `None` where nothing is known of the offsets, or before any window.
    pub(crate) fn shift(
        &self,
        parameters: &Vector,
        noise: &WrenchNoise,
        model_error: f64,
    ) -> Option<f64> {
        let known = self.known.as_ref()?;
        let (regressors, targets) = self.mean()?;
        let of_means = NOISE_CORRELATION / self.weight * noise.factor + model_error;
        let covariance = known.covariance + noise.covariance * of_means;
        let shift = targets - regressors * parameters - known.values;
        Some(shift.dot(&covariance.cholesky()?.solve(&shift)))
    }

    /// Returns the mean regressors and targets of the six channels of a wrench; `None` without
    /// offsets or before any window.
    fn mean(&self) -> Option<(SMatrix<f64, 6, 10>, Vector6<f64>)> {
        let means: &[Row; 6] = self.means.as_slice().try_into().ok()?;
        let regressors = SMatrix::from_fn(|channel, k| means[channel].regressor[k]);
        let targets = Vector6::from_fn(|channel, _| means[channel].target);
        (!self.is_empty()).then_some((regressors, targets))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    /// The information of rows that are centred one by one is that of all rows less their weighted
    /// mean.
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
        let weights: f64 = windows.iter().map(|(_, weight)| weight).sum();
        let mut mean = Row::zero();
        for (row, weight) in &windows {
            mean.add(row, weight / weights);
        }
        let mut centering = Centering::new(1);
        let (mut whole, mut summed) = (SMatrix::<f64, 10, 10>::zeros(), SMatrix::zeros());
        for (row, weight) in windows {
            let mut centred = row;
            centred.add(&mean, -1.0);
            whole += centred.regressor * centred.regressor.transpose() * weight;
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
