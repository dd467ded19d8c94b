//! The noise of all channels, as the motion that is smoothed alone shows it.

use nalgebra::{Cholesky, DMatrix, SVector};
use tactid_identify::equations::KnownNoise;

use super::bins::Layout;
use super::dynamics::Dynamics;
use super::rows::Weights;
use super::segment::Segment;
use super::smoothing::{
    noise_of_values, residuals, sixth_differences, smooth, unfollowed, values_at_times,
};
use super::{MotionEstimate, SETTINGS};

type Parameters = SVector<f64, 10>;

/// Noise of all channels.
#[derive(Clone, Debug)]
pub(super) struct Noise {
    /// Variances of the channels of the motion; see [`smooth`].
    of_motion: Vec<f64>,
    /// Variances that white noise with their [`sixth_differences`] would have, with an allowance for
    /// the error of splines.
    of_differences: Vec<f64>,
    /// Variances that splines through their values alone leave, of those whose rates are zero.
    of_values: Vec<f64>,
    /// Covariance of the rows of the dynamics.
    of_dynamics: DMatrix<f64>,
}

impl Noise {
    /// Sets the splines of segments to the measured motion alone, and means to values at their times,
    /// and returns the noise that the splines leave. Segments of too few bins are left out.
    ///
    /// # Errors
    /// Returns why the motion cannot be estimated with splines.
    pub(super) fn smoothed(
        segments: &mut Vec<Segment>,
        dynamics: &mut Dynamics,
        parameters: &Parameters,
    ) -> Result<Self, MotionEstimate> {
        segments.retain(|segment| segment.freedom() >= SETTINGS.least_freedom);
        if segments.is_empty() {
            return Err(MotionEstimate::TooFew);
        }
        for segment in segments.iter_mut() {
            values_at_times(segment).ok_or(MotionEstimate::TooFew)?;
        }
        let layout = dynamics.layout();
        let std_devs = smooth(segments, layout).ok_or(MotionEstimate::TooFew)?;
        let of_dynamics = covariance_of_dynamics(segments, dynamics, parameters);
        let of_differences = sixth_differences(segments, layout);
        let of_values = variances_of_values(segments, layout, &of_differences);
        Ok(Self {
            of_motion: std_devs
                .into_iter()
                .map(|std_dev| std_dev.powi(2))
                .collect(),
            of_differences,
            of_values: of_values.ok_or(MotionEstimate::TooFew)?,
            of_dynamics: of_dynamics.ok_or(MotionEstimate::TooFew)?,
        })
    }

    /// Replaces a fraction of this noise by another one.
    pub(super) fn average(&mut self, other: &Self, fraction: f64) {
        for (mine, others) in [
            (&mut self.of_motion, &other.of_motion),
            (&mut self.of_differences, &other.of_differences),
            (&mut self.of_values, &other.of_values),
        ] {
            for (mine, other) in mine.iter_mut().zip(others) {
                *mine += (other - *mine) * fraction;
            }
        }
        self.of_dynamics *= 1.0 - fraction;
        self.of_dynamics += &other.of_dynamics * fraction;
    }

    /// Returns the weights of the rows, where the noise is that of so many bins.
    ///
    /// # Errors
    /// Returns why the noise is not that of splines that follow the motion.
    pub(super) fn weights(&self, layout: Layout, bins: usize) -> Result<Weights, MotionEstimate> {
        let (left, of_differences) = (&self.of_motion, &self.of_differences);
        let reason = unfollowed(layout, left, of_differences, &self.of_values, bins);
        if let Some(reason) = reason {
            return Err(reason);
        }
        let factor = Cholesky::new(self.of_dynamics.clone());
        let root = factor.ok_or(MotionEstimate::TooFew)?.unpack();
        let mut inverse = DMatrix::identity(root.nrows(), root.ncols());
        if !root.solve_lower_triangular_mut(&mut inverse) {
            return Err(MotionEstimate::TooFew);
        }
        Ok(Weights {
            of_motion: self
                .of_motion
                .iter()
                .map(|variance| variance.sqrt())
                .collect(),
            of_dynamics: inverse,
        })
    }
}

/// Returns for each channel of the motion the variance of what splines through its values alone
/// leave, where its rates are zero in all bins; zero for others.
fn variances_of_values(
    segments: &[Segment],
    layout: Layout,
    of_differences: &[f64],
) -> Option<Vec<f64>> {
    let mut variances = vec![0.0; layout.effort()];
    let (turns, rates) = (layout.quaternion(), layout.angular_velocity());
    let of_coordinate = |coordinate: usize| {
        let [channel, rate] = layout.channels_of(coordinate);
        (channel..channel + 1, rate..rate + 1)
    };
    let coordinates = (0..layout.joints + 3).map(of_coordinate);
    for (values, rates) in coordinates.chain([(turns..rates, rates..rates + 3)]) {
        if of_differences[rates].iter().all(|&noise| noise == 0.0) {
            for channel in values {
                variances[channel] = noise_of_values(segments, channel)?.powi(2);
            }
        }
    }
    Some(variances)
}

/// Returns the covariance of the rows of the dynamics. The noise of a measured load is what splines
/// through its own values leave: it depends on no model. Known noise keeps its proportions. What no
/// sensor measures is next to exact, in proportion to what the noise of the motion leaves of it.
fn covariance_of_dynamics(
    segments: &[Segment],
    dynamics: &mut Dynamics,
    parameters: &Parameters,
) -> Option<DMatrix<f64>> {
    let are_measured = dynamics.are_measured();
    let channels = are_measured.len();
    let [mut noise, mut unexplained] = [0, 1].map(|_| DMatrix::<f64>::zeros(channels, channels));
    let mut sizes = vec![0.0; channels];
    let (mut freedom, mut bins) = (0.0, 0.0);
    for segment in segments {
        let count = segment.bins.len();
        let [mut targets, mut left] = [0, 1].map(|_| DMatrix::zeros(count, channels));
        for (k, bin) in segment.bins.iter().enumerate() {
            let rows = dynamics.rows(&segment.at(k), bin).ok()?;
            for (channel, row) in rows.iter().enumerate() {
                sizes[channel] += row.target.powi(2);
                targets[(k, channel)] = row.target;
                left[(k, channel)] = row.target - row.regressor.dot(parameters);
            }
        }
        unexplained += left.tr_mul(&left);
        let rest = residuals(segment, targets)?;
        noise += rest.tr_mul(&rest);
        freedom += segment.freedom() * count as f64;
        bins += count as f64;
    }
    let sources = dynamics.source_of();
    // The inverse of a sample covariance is too large in the mean, by this number of channels of the
    // source and one. With few bins, correlations are not known.
    let taken = |i: usize| 1.0 + sources.iter().filter(|of| **of == sources[i]).count() as f64;
    let mut covariance = DMatrix::from_fn(channels, channels, |i, j| {
        let is_known = freedom > 2.0 * taken(i);
        if i != j && !(sources[i] == sources[j] && is_known) {
            return 0.0;
        }
        let of_pair = if are_measured[i] {
            noise[(i, j)] / (freedom - if is_known { taken(i) } else { 0.0 }).max(1.0)
        } else {
            SETTINGS.exact.powi(2) * unexplained[(i, j)] / bins
        };
        if i != j {
            return of_pair;
        }
        let least = SETTINGS.accuracy.powi(2) * sizes[i] / bins;
        of_pair + if are_measured[i] { least } else { 0.0 } + f64::MIN_POSITIVE.sqrt()
    });
    for known in dynamics.known_noise() {
        keep_proportions(&mut covariance, &(&noise / freedom), &known);
    }
    Some(covariance)
}

/// Replaces the block of a source by its known noise, whose size follows the covariance that the
/// residuals `show`. It stays where known noise is singular to rounding.
fn keep_proportions(covariance: &mut DMatrix<f64>, shown: &DMatrix<f64>, known: &KnownNoise) {
    let (corner, shape) = ([known.first_channel; 2], known.covariance.shape());
    let Some(factor) = Cholesky::new(known.covariance.clone()) else {
        return;
    };
    let shown = shown.view(corner.into(), shape).into_owned();
    let size = factor.solve(&shown).trace() / shape.0 as f64;
    let mut block = covariance.view_mut(corner.into(), shape);
    let least = block.diagonal() * f64::EPSILON;
    block.copy_from(&(&known.covariance * size));
    for (k, least) in least.iter().enumerate() {
        block[(k, k)] += least;
    }
}
