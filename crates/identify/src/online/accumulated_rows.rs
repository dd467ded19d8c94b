//! The rows of all windows since the estimate began, accumulated in a fixed amount of memory.

use tactid_nlms::{Estimator, Rls};

use super::innovation::{Innovation, Prediction, WhitenedRow, WhitenedWindow};
use super::noise_tracker::NoiseTracker;
use crate::checks::MODEL_ERROR;
use crate::equations::window::NOISE_CORRELATION;
use crate::solve::information::{Information, inverse_of_upper};
use crate::solve::offsets::OffsetRows;
use crate::solve::subspace::{Matrix, Vector, bounded_lengths};

/// Least length of a column relative to what is usual for its kind. A parameter without any row
/// then has so large a unit that it dominates every gradient which contains it.
const LEAST_LENGTH: f64 = 1e-6;

/// Terms of the score covariance from the last window of one channel.
#[derive(Clone, Copy, Debug)]
struct ChannelTerms {
    /// Weighted regressors of the last window and of the one before it.
    last: [Vector; 2],
    /// Half the weighted regressor, plus those of the two windows before, each times the
    /// correlation of its noise with that of the last window.
    correlated: Vector,
    /// Weighted half-difference of the regressor.
    difference: Vector,
}

impl ChannelTerms {
    fn zero() -> Self {
        Self {
            last: [Vector::zeros(); 2],
            correlated: Vector::zeros(),
            difference: Vector::zeros(),
        }
    }
}

/// Sums of products of the whitened rows up to a window, in the terms of [`AccumulatedRows`]. The
/// difference of two is the sum over the windows between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowSums {
    /// Information of the rows, `A = RᵀR`.
    rows: Matrix,
    /// Information of their noise, `N`.
    noise: Matrix,
    /// Targets without those of the noise, `b - n`.
    targets: Vector,
    /// Products with the correlated terms, `P + Pᵀ`.
    correlated: Matrix,
}

impl RowSums {
    /// Returns the sums over no rows.
    pub(crate) fn none() -> Self {
        Self {
            rows: Matrix::zeros(),
            noise: Matrix::zeros(),
            targets: Vector::zeros(),
            correlated: Matrix::zeros(),
        }
    }

    /// Returns the squared Mahalanobis distance of what parameters leave of the rows since others,
    /// `b - n - (A - N) π`, whose ten entries have the covariance of scores with the variance
    /// `factor` of the residuals, and that of the [model error](MODEL_ERROR) in any direction.
    /// `None` where that covariance is singular.
    pub(crate) fn distance_since(
        &self,
        others: &Self,
        parameters: &Vector,
        factor: f64,
    ) -> Option<f64> {
        let rows = self.rows - others.rows;
        let noise = self.noise - others.noise;
        let scores = (noise + self.correlated - others.correlated) * factor;
        let left = self.targets - others.targets - (rows - noise) * parameters;
        let load = (rows * parameters).dot(parameters);
        let of_model = rows * (MODEL_ERROR * MODEL_ERROR * load);
        let covariance = (scores + of_model).cholesky()?;
        Some(covariance.solve(&left).dot(&left))
    }
}

/// Whitened rows `A π = b` of all windows, accumulated: their square-root information, the
/// information of their noise for the errors-in-variables bias correction, and the covariance of
/// their scores.
#[derive(Clone, Debug)]
pub(crate) struct AccumulatedRows {
    rls: Rls<10>,
    /// The same rows with those that known offsets add, as they were when the parameters were last
    /// solved for.
    solved: Rls<10>,
    /// Covariance of the scores of the rows that known offsets add.
    offset_scores: Matrix,
    /// Number of windows.
    windows: usize,
    /// Parameters before the first row. Unobservable directions keep them.
    start: Vector,
    /// `N = Σ D Dᵀ`: information of the half-differences `D` of the regressors, which is noise of
    /// the motion.
    noise: Matrix,
    /// `n = Σ D d`: products of the half-differences of regressors and targets.
    noise_targets: Vector,
    /// `P = Σ A Cᵀ` of regressors and their [correlated terms](ChannelTerms::correlated).
    correlated: Matrix,
    channels: Vec<ChannelTerms>,
    /// `R⁻ᵀ` of the regularised triangular factor `R` of all rows, as it was when it was last
    /// solved.
    inverse_root: Matrix,
    /// Weighted rows of the last window until the triangular factor is updated, which overwrites
    /// them.
    pending: Vec<WhitenedRow>,
}

impl AccumulatedRows {
    /// Creates the accumulation of no rows of so many channels.
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            start: Vector::zeros(),
            rls: Rls::starting_at(Vector::zeros()),
            solved: Rls::starting_at(Vector::zeros()),
            offset_scores: Matrix::zeros(),
            windows: 0,
            noise: Matrix::zeros(),
            noise_targets: Vector::zeros(),
            correlated: Matrix::zeros(),
            channels: vec![ChannelTerms::zero(); channels],
            inverse_root: Matrix::zeros(),
            pending: vec![(Vector::zeros(), 0.0); channels],
        }
    }

    /// Discards all rows and starts from other parameters. They are the estimate in every direction
    /// that later rows leave unobservable.
    pub(crate) fn restart_at(&mut self, start: &Vector) {
        self.start = *start;
        self.restart();
    }

    /// Discards all rows and starts from the same parameters as before.
    pub(crate) fn restart(&mut self) {
        self.rls = Rls::starting_at(self.start);
        self.solved = Rls::starting_at(self.start);
        self.offset_scores = Matrix::zeros();
        self.windows = 0;
        self.noise = Matrix::zeros();
        self.noise_targets = Vector::zeros();
        self.correlated = Matrix::zeros();
        self.channels.fill(ChannelTerms::zero());
    }

    /// Makes the rows that known offsets add to those of all windows, so that what follows can
    /// begin with other offsets. `factor` is that of [`score_covariance`](Self::score_covariance).
    pub(crate) fn keep_offset_rows(&mut self, factor: f64) {
        self.rls = self.solved.clone();
        self.correlated += self.offset_scores * (0.5 / factor);
    }

    /// Copies other rows of as many channels, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        (self.rls, self.solved) = (other.rls.clone(), other.solved.clone());
        (self.offset_scores, self.inverse_root) = (other.offset_scores, other.inverse_root);
        (self.windows, self.start) = (other.windows, other.start);
        (self.noise, self.noise_targets) = (other.noise, other.noise_targets);
        self.correlated = other.correlated;
        self.channels.copy_from_slice(&other.channels);
        self.pending.copy_from_slice(&other.pending);
    }

    /// Adds a whitened window with its robust weight to the sums.
    /// [`update_square_root`](Self::update_square_root) completes the addition.
    pub(crate) fn add(&mut self, window: &WhitenedWindow, weight: f64, noise: &NoiseTracker) {
        let root = weight.sqrt();
        let rows = window.rows.iter().zip(&window.differences);
        let places = self.channels.iter_mut().zip(&mut self.pending);
        for (channel, ((terms, pending), (row, difference))) in places.zip(rows).enumerate() {
            let regressor = row.0 * root;
            *pending = (regressor, row.1 * root);
            terms.difference = difference.0 * root;
            let target = difference.1 * root;
            self.noise_targets.axpy(target, &terms.difference, 1.0);
            let [next, second] = noise.correlation(channel);
            terms.correlated = regressor * 0.5 + terms.last[0] * next + terms.last[1] * second;
            terms.last = [regressor, terms.last[0]];
        }
        let channels = self.channels.iter();
        add_products(
            &mut self.noise,
            channels.clone().map(|c| (&c.difference, &c.difference)),
        );
        add_products(
            &mut self.correlated,
            channels.map(|c| (&c.last[0], &c.correlated)),
        );
    }

    /// Completes [`add`](Self::add): updates the triangular factor with the rows of the window.
    pub(crate) fn update_square_root(&mut self) {
        self.rls.update_all(&mut self.pending);
        self.windows += 1;
    }

    /// Returns the sums over all rows.
    pub(crate) fn sums(&self) -> RowSums {
        let root = self.rls.information_root();
        RowSums {
            rows: root.tr_mul(&root),
            noise: self.noise,
            targets: root.tr_mul(&self.rls.transformed_target()) - self.noise_targets,
            correlated: self.correlated + self.correlated.transpose(),
        }
    }

    /// Returns the sum of the squared residuals of all rows at the parameters that fit them best.
    pub(crate) fn residual_squares(&self) -> f64 {
        self.rls.residual_squares()
    }

    /// Returns the sum of the squared residuals of all rows at some parameters.
    pub(crate) fn squares_at(&self, parameters: &Vector) -> f64 {
        let distance = self.rls.information_root() * parameters - self.rls.transformed_target();
        self.rls.residual_squares() + distance.norm_squared()
    }

    /// Returns the parameters that fit all rows best, however uncertain they are. Their residuals
    /// are noise.
    pub(crate) fn best_fit(&self) -> Vector {
        let biased = self.rls.parameters();
        let root = self.rls.information_root();
        let information = Information::new(&root, &self.noise, self.windows, f64::INFINITY);
        biased + information.solve(&(self.noise * biased - self.noise_targets))
    }

    /// Solves `(A - N) π = b - n`, where `A π = b` are the normal equations of all rows, and
    /// returns the parameters and the information `A - N`.
    ///
    /// Least squares moves along a nearly singular direction by as much as noise over its singular
    /// value: by up to 1e6 units after few windows. Such a direction counts as unobservable, and
    /// keeps its [start](Self::restart_at). `offsets` are the rows that known offsets add.
    pub(crate) fn solve(&mut self, offsets: Option<OffsetRows>) -> (Vector, Information) {
        self.solved = self.rls.clone();
        self.offset_scores = Matrix::zeros();
        if let Some(OffsetRows { mut rows, scores }) = offsets {
            self.solved.update_all(&mut rows);
            self.offset_scores = scores;
        }
        let root = self.solved.information_root();
        let (regular_root, biased) = self.solved.regularised();
        self.inverse_root = inverse_of_upper(&regular_root).transpose();
        let plausible = self.plausible_size(&self.scales());
        let information = Information::new(&root, &self.noise, self.windows, plausible);
        let parameters = if information.is_complete() {
            biased + information.solve(&(self.noise * biased - self.noise_targets))
        } else {
            // Both sides are reduced by what the start contributes.
            let target = root.tr_mul(&(self.solved.transformed_target() - root * self.start));
            self.start + information.solve(&(target + self.noise * self.start - self.noise_targets))
        };
        (parameters, information)
    }

    /// Returns the covariance of the sum of the scores `A r - D d`, where a score is a regressor
    /// times its residual: the middle of the sandwich covariance. Residual `r` and half-difference
    /// `d` both have the variance `factor`. The rows that known offsets add have scores of their
    /// own.
    pub(crate) fn score_covariance(&self, factor: f64) -> Matrix {
        (self.noise + self.correlated + self.correlated.transpose()) * factor + self.offset_scores
    }

    /// Returns units of the parameters in which each column of all rows has length one. Before any
    /// row, they are as large as the parameters that the estimate starts from.
    pub(crate) fn scales(&self) -> Vector {
        let root = self.solved.information_root();
        let lengths = Vector::from_fn(|k, _| root.column(k).norm());
        if lengths == Vector::zeros() {
            return bounded_lengths(&self.start.abs(), 1.0);
        }
        bounded_lengths(&lengths, LEAST_LENGTH).map(f64::recip)
    }

    /// Returns the plausible size of each parameter, in its [unit](Self::scales).
    ///
    /// One parameter of a payload alone hardly causes a larger load than all that is measured; and
    /// none is larger than it was before the first row, as far as that is known.
    fn plausible_size(&self, scales: &Vector) -> f64 {
        let load = self.solved.transformed_target().norm();
        let scaled = self.start.component_div(scales).norm();
        load.hypot(scaled)
    }

    /// Returns the plausible size of each parameter in its own unit: the standard deviation of one
    /// that the rows leave unobservable.
    pub(crate) fn plausible_std_devs(&self) -> Vector {
        let scales = self.scales();
        scales * self.plausible_size(&scales)
    }

    /// Returns the innovation of whitened rows with their prediction. `covariance` is that of the
    /// parameters in observable directions.
    pub(crate) fn innovation(
        &self,
        rows: &[WhitenedRow],
        prediction: &Prediction,
        covariance: &Matrix,
    ) -> Innovation {
        let model = MODEL_ERROR * MODEL_ERROR * prediction.load;
        let mut innovation = Innovation {
            distance: 0.0,
            distance_beyond_model: 0.0,
            leverage: 0.0,
        };
        for ((regressor, _), residual) in rows.iter().zip(&prediction.residuals) {
            let square = residual * residual;
            // Only the triangular factor shows a direction that no row has excited yet.
            let observable = (covariance * regressor).dot(regressor);
            let all = (self.inverse_root * regressor).norm_squared();
            let leverage = observable.max(NOISE_CORRELATION * all);
            innovation.distance += square / (1.0 + leverage);
            innovation.distance_beyond_model += square / (1.0 + leverage + model);
            innovation.leverage += leverage / rows.len() as f64;
        }
        innovation
    }
}

/// Adds `Σ left rightᵀ` over pairs to a matrix, column by column, so that each column stays in
/// registers.
fn add_products<'a>(
    sum: &mut Matrix,
    pairs: impl Iterator<Item = (&'a Vector, &'a Vector)> + Clone,
) {
    for (k, mut column) in sum.column_iter_mut().enumerate() {
        let mut products = Vector::zeros();
        for (left, right) in pairs.clone() {
            products.axpy(right[k], left, 1.0);
        }
        column += products;
    }
}
