//! Gauss-Newton for the motion and the parameters at once.

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, SMatrix, SVector};

use super::bins::{Bin, Layout};
use super::bordered::Bordered;
use super::dynamics::Dynamics;
use super::marginal_prior::MarginalPrior;
use super::noise::Noise;
use super::rows::{BinRows, Rest, Weights};
use super::scatter::Scatter;
use super::segment::Segment;
use super::spline::order;
use super::{MotionEstimate, SETTINGS};
use crate::diagnosis::SIGNIFICANT;
use crate::fit::CONVERGED_ENOUGH;
use crate::fit::least_squares::MAX_PASSES;

type Parameters = SVector<f64, 10>;
type Matrix = SMatrix<f64, 10, 10>;

/// Parameters that explain the measurements of a recording best, together with its motion.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    pub(crate) parameters: Parameters,
    /// Covariance of the parameters for white noise.
    pub(crate) of_white_noise: Matrix,
    /// The larger of that and of the covariance from the scatter of scores, in every direction,
    /// times the square of Student's factor: 1.96 standard deviations are half of a 95 % interval.
    pub(crate) covariance: Matrix,
    /// Covariance for white noise that is as large as the mean scatter of the scores.
    pub(crate) metric: Matrix,
    /// Degrees of freedom of the residuals of a channel.
    pub(crate) freedom: f64,
    /// Largest mean square of the residuals of a quantity of the motion or of a channel of the load,
    /// relative to the variance of its noise, less what is chance: of all bins, and of those of any
    /// short time, which the others could hide.
    residual_ratio: f64,
}

impl Estimate {
    /// Returns whether the residuals are those of the noise throughout.
    pub(super) fn is_explained(&self) -> bool {
        self.residual_ratio <= SETTINGS.explained
    }
}

/// The problem of some stretches of a recording, or of what of the last one has not been
/// marginalised out.
pub(super) struct Problem<'a> {
    layout: Layout,
    dynamics: &'a mut Dynamics,
    segments: Vec<Segment>,
    weights: Weights,
    parameters: Parameters,
    /// What was marginalised out before the first segment.
    prior: MarginalPrior,
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

impl<'a> Problem<'a> {
    /// Smooths the motion of some stretches alone, and finds the noise of all channels.
    ///
    /// # Errors
    /// Returns why the motion cannot be estimated with splines.
    pub(super) fn new(
        stretches: &[Vec<Bin>],
        dynamics: &'a mut Dynamics,
        start: &Parameters,
    ) -> Result<Self, MotionEstimate> {
        let coordinates = dynamics.layout().coordinates();
        let new = |stretch: &Vec<Bin>| Segment::new(stretch, coordinates);
        let long = stretches.iter().filter(|bins| is_long(bins.len()));
        let mut segments: Vec<Segment> = long.map(new).collect();
        let noise = Noise::smoothed(&mut segments, dynamics, start)?;
        let bins = segments.iter().map(|segment| segment.bins.len()).sum();
        let weights = noise.weights(dynamics.layout(), bins)?;
        let prior = MarginalPrior::new(coordinates);
        Self::linearised(segments, dynamics, weights, prior, start)
    }

    /// Creates the problem of segments whose motion was smoothed alone.
    ///
    /// # Errors
    /// Returns [`MotionEstimate::Unexplained`] where the model cannot be computed at that motion.
    pub(super) fn linearised(
        segments: Vec<Segment>,
        dynamics: &'a mut Dynamics,
        weights: Weights,
        prior: MarginalPrior,
        start: &Parameters,
    ) -> Result<Self, MotionEstimate> {
        let mut by_motion = Vec::new();
        for segment in &segments {
            let bins = segment.bins.iter().enumerate();
            let slopes = bins.map(|(k, bin)| {
                let slopes = dynamics.by_motion(&segment.at(k), bin, start);
                slopes.map(|slopes| -(&weights.of_dynamics * slopes))
            });
            let slopes = slopes.collect::<Result<_, _>>();
            by_motion.push(slopes.map_err(|_| MotionEstimate::Unexplained)?);
        }
        Ok(Self {
            layout: dynamics.layout(),
            dynamics,
            segments,
            weights,
            parameters: *start,
            prior,
            by_motion,
            factors: Vec::new(),
        })
    }

    /// Continues with passes until the motion and the parameters no longer change. Returns the last
    /// pass; `None` where the measurements do not determine them, or the passes do not converge.
    pub(super) fn converge(&mut self, mut pass: Pass) -> Option<Pass> {
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
                return Some(pass);
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
        let linearised = self.dynamics.linearised(&at, measured, &self.parameters);
        Some(BinRows::new(
            &measured.values,
            &at,
            (&linearised.ok()?, by_motion),
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
            if index == 0 {
                let coefficients = &self.segments[0].coefficients;
                self.prior.move_to(coefficients, &self.parameters);
                self.prior
                    .add_to(&mut self.factors[0], &mut normal, is_first);
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

    /// Returns the estimate, given what a pass leaves of the rows, and what was left before.
    pub(super) fn estimate(&mut self, pass: &Pass, mut left: Residuals) -> Option<Estimate> {
        for (index, changes) in pass.changes.iter().enumerate() {
            for bin in 0..self.segments[index].bins.len() {
                self.leave(index, bin, changes, &mut left)?;
            }
            left.end_stretch(self.segments[index].coefficients.len());
        }
        let coordinates = self.layout.coordinates() as f64;
        let scatter = &left.scatter;
        let bins = scatter.bins();
        let (covariance, mean) = scatter.covariance(&pass.inverse, &self.parameters);
        Some(Estimate {
            parameters: self.parameters,
            of_white_noise: pass.inverse,
            covariance,
            metric: pass.inverse * mean,
            freedom: bins - scatter.unknowns() / coordinates,
            residual_ratio: mean_ratio(&left.squares, bins).max(left.worst_ratio),
        })
    }

    /// Adds to what is left what a pass leaves of the rows of a bin.
    fn leave(
        &mut self,
        segment: usize,
        bin: usize,
        changes: &DMatrix<f64>,
        left: &mut Residuals,
    ) -> Option<()> {
        let rows = self.rows(segment, bin)?;
        let rest = rows.rest(changes, &self.segments[segment], bin);
        left.add(
            &rest,
            &self.parameters,
            self.layout,
            &self.dynamics.are_measured(),
        );
        Some(())
    }

    /// Marginalises out the splines of some intervals of the first segment, and adds what their rows
    /// leave to what was left before. Returns all that was marginalised out.
    pub(super) fn marginalise(
        mut self,
        intervals: usize,
        pass: &Pass,
        left: &mut Residuals,
    ) -> Option<MarginalPrior> {
        let mut bin = 0;
        let coefficients = &self.segments[0].coefficients;
        self.prior.move_to(coefficients, &self.parameters);
        for interval in 0..intervals {
            let mut rows = Vec::new();
            while self.segments[0].spans.get(bin) == Some(&interval) {
                self.leave(0, bin, &pass.changes[0], left)?;
                rows.push(self.rows(0, bin)?.by_unknowns(&self.segments[0], bin));
                bin += 1;
            }
            let segment = &self.segments[0];
            let first = (interval + order() - 1) * segment.coordinates;
            let next = &segment.coefficients[first..first + segment.coordinates];
            self.prior.advance(&rows, next)?;
            left.scatter.add_unknowns(segment.coordinates);
        }
        Some(self.prior)
    }
}

/// What solutions leave of the rows of bins.
#[derive(Clone, Debug, Default)]
pub(super) struct Residuals {
    /// Sums of squares of the residuals: means over the channels of each quantity of the motion,
    /// then those of the channels of the load.
    squares: Vec<f64>,
    /// Squares of the last bins, and the largest ratio of so many bins anywhere.
    last: VecDeque<Vec<f64>>,
    worst_ratio: f64,
    scatter: Scatter,
}

impl Residuals {
    /// Adds what is left of the rows of a bin.
    fn add(&mut self, rest: &Rest, parameters: &Parameters, layout: Layout, measured: &[bool]) {
        let mean = |channels: Range<usize>| {
            let count = channels.len() as f64;
            let rest = &rest.of_motion[channels];
            rest.iter().map(|rest| rest * rest).sum::<f64>() / count
        };
        let loads = rest.of_dynamics.iter().zip(measured);
        let loads = loads.map(|(rest, is_measured)| match is_measured {
            true => rest * rest,
            false => 0.0,
        });
        let of_bin = quantities(layout).into_iter().map(mean).chain(loads);
        let of_bin: Vec<f64> = of_bin.collect();
        self.squares.resize(of_bin.len(), 0.0);
        add(&mut self.squares, &of_bin);
        self.last.truncate(SETTINGS.window - 1);
        self.last.push_front(of_bin);
        if self.last.len() == SETTINGS.window {
            self.worst_ratio = self.worst_ratio.max(self.last_ratio());
        }
        let rows = rest.of_motion.len() + rest.of_dynamics.len();
        self.scatter.add(&rest.scores, parameters, rows);
    }

    /// Returns the largest mean square of the residuals of the last bins.
    fn last_ratio(&self) -> f64 {
        let mut squares = vec![0.0; self.squares.len()];
        self.last
            .iter()
            .for_each(|of_bin| add(&mut squares, of_bin));
        mean_ratio(&squares, self.last.len() as f64)
    }

    /// Ends a stretch whose splines have so many coefficients that have not been marginalised out.
    pub(super) fn end_stretch(&mut self, coefficients: usize) {
        self.scatter.add_unknowns(coefficients);
        self.scatter.end_stretch();
    }
}

/// Adds entry by entry.
fn add(sums: &mut [f64], entries: &[f64]) {
    sums.iter_mut()
        .zip(entries)
        .for_each(|(sum, entry)| *sum += entry);
}

/// Returns the largest of the means of sums of squares over so many bins, less what is chance.
fn mean_ratio(squares: &[f64], bins: f64) -> f64 {
    // By so much the mean square of so many normal variables is larger by chance.
    let chance = 1.0 + SIGNIFICANT * (2.0 / bins).sqrt();
    squares.iter().fold(0.0, |a, &b| f64::max(a, b)) / (bins * chance)
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
