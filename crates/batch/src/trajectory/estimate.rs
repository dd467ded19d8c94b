//! Gauss-Newton for the motion and the parameters at once.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, SMatrix, SVector};
use tactid_identify::equations::{KnownNoise, Model};

use super::bins::{Bin, Layout};
use super::bordered::Bordered;
use super::dynamics::Dynamics;
use super::rows::{BinRows, Weights};
use super::scatter::Scatter;
use super::segment::Segment;
use super::smoothing::{residuals, smooth, unfollowed};
use super::spline::order;
use super::{MotionEstimate, SETTINGS};
use crate::diagnosis::SIGNIFICANT;
use crate::fit::CONVERGED_ENOUGH;
use crate::fit::least_squares::MAX_PASSES;

type Parameters = SVector<f64, 10>;
type Matrix = SMatrix<f64, 10, 10>;

/// Parameters that explain the measurements of a recording best, together with its motion.
pub(crate) struct Estimate {
    pub(crate) parameters: Parameters,
    /// Covariance of the parameters for white noise.
    pub(crate) of_white_noise: Matrix,
    /// The larger of that and of the covariance from the scatter of scores, in every direction.
    pub(crate) covariance: Matrix,
    /// Covariance for white noise that is as large as the mean scatter of the scores.
    pub(crate) metric: Matrix,
    /// Degrees of freedom of the noise.
    pub(crate) freedom: f64,
    /// Largest mean square of the residuals of a quantity of the motion or of a channel of the load,
    /// relative to the variance of its noise, less what is chance.
    pub(crate) residual_ratio: f64,
}

impl Estimate {
    /// Returns the estimate from several sections of a recording, each with the weight of its
    /// information for white noise. `None` where there are none.
    pub(super) fn of_all(mut sections: Vec<Self>) -> Option<Self> {
        if sections.len() < 2 {
            return sections.pop();
        }
        let informations = sections
            .iter()
            .map(|section| inverse(&section.of_white_noise));
        let informations: Vec<Matrix> = informations.collect::<Option<_>>()?;
        let of_white_noise = inverse(&informations.iter().sum())?;
        let pairs = || sections.iter().zip(informations.iter());
        let parameters: Parameters = pairs()
            .map(|(section, info)| info * section.parameters)
            .sum();
        let mean = |of: fn(&Self) -> &Matrix| {
            let terms = pairs().map(|(section, info)| info * of(section) * info);
            of_white_noise * terms.sum::<Matrix>() * of_white_noise
        };
        Some(Self {
            parameters: of_white_noise * parameters,
            covariance: mean(|section| &section.covariance),
            metric: mean(|section| &section.metric),
            freedom: sections.iter().map(|section| section.freedom).sum(),
            residual_ratio: sections
                .iter()
                .fold(0.0, |a, section| a.max(section.residual_ratio)),
            of_white_noise,
        })
    }
}

/// The problem of some stretches of a recording.
pub(super) struct Problem {
    layout: Layout,
    dynamics: Dynamics,
    segments: Vec<Segment>,
    weights: Weights,
    parameters: Parameters,
    /// Derivatives of the predictions of the dynamics, in units of their noise, by the motion that
    /// was smoothed alone, for each bin of each segment.
    by_motion: Vec<Vec<DMatrix<f64>>>,
    /// Factors of the normal equations of the coefficients of each segment, once there was a pass:
    /// the motion that was smoothed alone is near enough for all passes.
    factors: Vec<Bordered>,
}

/// What one pass knows of the parameters.
pub(super) struct Pass {
    /// Covariance of the parameters for white noise.
    pub(super) inverse: Matrix,
    /// Change of the parameters.
    step: Parameters,
    /// For each segment: what each parameter changes in the coefficients, and last what the
    /// measurements change in them.
    changes: Vec<DMatrix<f64>>,
}

impl Problem {
    /// Smooths the motion of some stretches alone, and finds the noise of all channels.
    ///
    /// # Errors
    /// Returns why the motion cannot be estimated with splines.
    pub(super) fn new(
        stretches: &[&[Bin]],
        layout: Layout,
        model: &Model,
        start: &Parameters,
    ) -> Result<Self, MotionEstimate> {
        let mut dynamics = Dynamics::new(model.clone(), layout);
        let coordinates = layout.coordinates();
        let new = |stretch: &&[Bin]| Segment::new(stretch, coordinates, SETTINGS.knots_hz);
        let long = stretches.iter().filter(|bins| is_long(bins.len()));
        let mut segments: Vec<Segment> = long.map(new).collect();
        segments.retain(|segment| segment.freedom() >= SETTINGS.least_freedom);
        if segments.is_empty() {
            return Err(MotionEstimate::TooFew);
        }
        let of_motion = smooth(&mut segments, layout).ok_or(MotionEstimate::TooFew)?;
        if let Some(reason) = unfollowed(&segments, layout, &of_motion) {
            return Err(reason);
        }
        let of_dynamics = whitening(&segments, &mut dynamics, start);
        let of_dynamics = of_dynamics.ok_or(MotionEstimate::TooFew)?;
        let mut by_motion = Vec::new();
        for segment in &segments {
            let bins = segment.bins.iter().enumerate();
            let slopes = bins.map(|(k, bin)| {
                let slopes = dynamics.by_motion(&segment.at(k), bin, start);
                slopes.map(|slopes| -(&of_dynamics * slopes))
            });
            let slopes = slopes.collect::<Result<_, _>>();
            by_motion.push(slopes.map_err(|_| MotionEstimate::Unexplained)?);
        }
        Ok(Self {
            layout,
            dynamics,
            segments,
            weights: Weights {
                of_motion,
                of_dynamics,
            },
            parameters: *start,
            by_motion,
            factors: Vec::new(),
        })
    }

    /// Returns motion and parameters from a first pass; `None` where the measurements do not
    /// determine them, or the passes do not converge.
    pub(super) fn solve(mut self, mut pass: Pass) -> Option<Estimate> {
        for _ in 0..MAX_PASSES {
            self.parameters += pass.step;
            for (segment, changes) in self.segments.iter_mut().zip(&pass.changes) {
                let coefficients = segment.coefficients.iter_mut();
                for (coefficient, row) in coefficients.zip(changes.row_iter()) {
                    let of_parameters = row.fixed_columns::<10>(0).tr_dot(&pass.step);
                    *coefficient += row[10] - of_parameters;
                }
            }
            let moved = pass.step.dot(&(inverse(&pass.inverse)? * pass.step)).sqrt();
            pass = self.pass()?;
            // The next step is smaller by more than this factor.
            if moved < CONVERGED_ENOUGH.sqrt() {
                return self.finish(&pass);
            }
        }
        None
    }

    /// Returns the rows of a bin at the present motion and parameters.
    fn rows(&mut self, segment: usize, bin: usize) -> Option<BinRows> {
        let by_motion = &self.by_motion[segment][bin];
        let segment = &self.segments[segment];
        let at = segment.at(bin);
        let measured = &segment.bins[bin];
        let linearised = self
            .dynamics
            .linearised(&at, measured, &self.parameters, by_motion);
        let (values, linearised) = (&measured.values, linearised.ok()?);
        Some(BinRows::new(
            values,
            &at,
            &linearised,
            &self.weights,
            self.layout,
        ))
    }

    /// Computes one pass from the present motion and parameters; `None` where the measurements do
    /// not determine them.
    pub(super) fn pass(&mut self) -> Option<Pass> {
        let mut normal = DMatrix::zeros(11, 11);
        let mut changes = Vec::new();
        for index in 0..self.segments.len() {
            let unknowns = self.segments[index].coefficients.len();
            let width = self.segments[index].coordinates * order();
            let is_first = self.factors.len() == index;
            if is_first {
                self.factors.push(Bordered::zeros(unknowns, width, 11));
            }
            for bin in 0..self.segments[index].bins.len() {
                let rows = self.rows(index, bin)?;
                let (segment, system) = (&self.segments[index], &mut self.factors[index]);
                if is_first {
                    rows.add_to(system, segment, bin);
                }
                rows.add_to_border(system, &mut normal, segment, bin);
            }
            if is_first {
                self.factors[index].factor()?;
            }
            let (explained, solution) = self.factors[index].solve();
            normal -= explained;
            changes.push(DMatrix::from_row_slice(unknowns, 11, &solution));
        }
        let inverse = inverse(&normal.fixed_view::<10, 10>(0, 0).into_owned())?;
        Some(Pass {
            step: inverse * normal.fixed_view::<10, 1>(0, 10),
            inverse,
            changes,
        })
    }

    /// Returns the estimate with what a pass leaves of the rows.
    fn finish(&mut self, pass: &Pass) -> Option<Estimate> {
        let of_dynamics = self.dynamics.are_measured();
        let of_motion = quantities(self.layout);
        let mut squares = vec![0.0; of_motion.len() + of_dynamics.len()];
        let mut scatter = Scatter::default();
        for (index, changes) in pass.changes.iter().enumerate() {
            let mut scores = Vec::new();
            for bin in 0..self.segments[index].bins.len() {
                let rows = self.rows(index, bin)?;
                let rest = rows.rest(changes, &self.segments[index], bin);
                scores.push(Parameters::from_column_slice(rest.score.as_slice()));
                let mean = |channels: &Range<usize>| {
                    let rest = &rest.of_motion[channels.clone()];
                    rest.iter().map(|rest| rest * rest).sum::<f64>() / rest.len() as f64
                };
                let loads = rest.of_dynamics.iter().zip(&of_dynamics);
                let loads = loads.map(|(rest, is_measured)| match is_measured {
                    true => rest * rest,
                    false => 0.0,
                });
                let of_bin = of_motion.iter().map(mean).chain(loads);
                squares
                    .iter_mut()
                    .zip(of_bin)
                    .for_each(|(sum, of_bin)| *sum += of_bin);
            }
            let segment = &self.segments[index];
            let rows = self.layout.effort() + of_dynamics.len();
            scatter.add(&scores, rows, segment.coefficients.len());
        }
        let bins = scatter.bins();
        let freedom = self
            .segments
            .iter()
            .map(|s| (s.bins.len() - s.splines) as f64);
        // By so much the mean square of so many normal variables is larger by chance.
        let chance = 1.0 + SIGNIFICANT * (2.0 / bins).sqrt();
        let (covariance, mean) = scatter.covariance(&pass.inverse)?;
        Some(Estimate {
            parameters: self.parameters,
            of_white_noise: pass.inverse,
            covariance,
            metric: pass.inverse * mean,
            freedom: freedom.sum(),
            residual_ratio: squares.into_iter().fold(0.0, f64::max) / (bins * chance),
        })
    }
}

/// Channels of the motion by quantity: positions and velocities of the joints, position, velocity,
/// rotation and angular velocity of the base, and its accelerations as far as they are measured.
fn quantities(layout: Layout) -> Vec<Range<usize>> {
    let (joints, position) = (layout.joints, layout.position());
    let (quaternion, angular_velocity) = (layout.quaternion(), layout.angular_velocity());
    let [linear, angular] = layout.accelerations();
    let mut quantities = vec![
        0..joints,
        joints..position,
        position..position + 3,
        position + 3..quaternion,
        quaternion..angular_velocity,
        angular_velocity..linear.start,
        linear,
        angular,
    ];
    quantities.retain(|channels| !channels.is_empty());
    quantities
}

/// Returns whether so many bins determine splines: one interval has six of them.
fn is_long(bins: usize) -> bool {
    bins as f64 > 6.0 * SETTINGS.bins_of_interval
}

/// Returns the inverse of a root of the covariance of the rows of the dynamics. The noise of a
/// measured load is what splines through its own values leave: it depends on no model. Known noise
/// keeps its proportions. What no sensor measures is next to exact, in proportion to what the noise
/// of the motion leaves of it.
fn whitening(
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
    let covariance = DMatrix::from_fn(channels, channels, |i, j| {
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
    let mut covariance = covariance;
    for known in dynamics.known_noise() {
        keep_proportions(&mut covariance, &(&noise / freedom), &known);
    }
    let root = Cholesky::new(covariance)?.unpack();
    let mut inverse = DMatrix::identity(channels, channels);
    root.solve_lower_triangular_mut(&mut inverse)
        .then_some(inverse)
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

/// Returns the inverse of a matrix, in units in which its diagonal is one; `None` where it is not
/// positive definite.
fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let units = matrix.diagonal().map(|entry| entry.sqrt().recip());
    if !units.iter().all(|unit| unit.is_finite()) {
        return None;
    }
    let scaled =
        Matrix::from_fn(|i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)]) * units[i] * units[j]);
    let inverse = Cholesky::new(scaled)?.inverse();
    Some(Matrix::from_fn(|i, j| {
        inverse[(i, j)] * units[i] * units[j]
    }))
}
