//! The parameters and the differences from some assumptions that explain the windows best.

use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector6};
use tactid_identify::solve::EIGENVALUE_RATIO;

use super::model::{Model, Sums, first_column_of};
use super::windows::{SLIGHT, Windows};
use crate::finding::Hypothesis;
use crate::fit::CONVERGED_ENOUGH;
use crate::fit::least_squares::MAX_PASSES;

/// A model that explains the windows best, given which assumptions may be wrong.
#[derive(Clone)]
pub(super) struct Fitted {
    pub(super) model: Model,
    /// The assumptions that may be wrong, in the order of the columns.
    pub(super) active: Vec<Hypothesis>,
    /// Sum of the squares of the whitened residuals.
    pub(super) squares: f64,
    /// Inverse of the information of the unknowns.
    covariance: DMatrix<f64>,
    /// Sum over all lags of the correlation of the residuals, in kept windows.
    pub(super) correlation: f64,
}

impl Fitted {
    /// Fits from a start. `None` where the numbers are not finite.
    pub(super) fn new(windows: &Windows, start: &Model, active: &[Hypothesis]) -> Option<Self> {
        let joints = start.zeros.len();
        let mut model = start.clone();
        let mut sums = model.sums(windows, active);
        let mut factor = 1.0;
        for _ in 0..MAX_PASSES {
            let found = information(&sums, active, joints)?;
            let (step, decrease) = found.step(&sums)?;
            if decrease * factor < CONVERGED_ENOUGH * sums.squares() {
                break;
            }
            let moved = model.moved(&(step * factor), active);
            let less = moved.sums(windows, active);
            if less.squares() < sums.squares() {
                (model, sums, factor) = (moved, less, 1.0);
            } else {
                factor *= 0.5;
            }
        }
        if active.contains(&Hypothesis::AxisGains) {
            model.normalize_gains();
        }
        let found = information(&sums, active, joints)?;
        sums.squares().is_finite().then(|| Self {
            covariance: found.covariance(),
            correlation: correlation(&sums.residuals),
            squares: sums.squares(),
            active: active.to_vec(),
            model,
        })
    }

    /// Fits some of the `further` hypotheses beside those of this fit to first order: by one step,
    /// given the sums of this model for its own hypotheses and then all further ones.
    pub(super) fn to_first_order(
        &self,
        sums: &Sums,
        further: &[Hypothesis],
        some: &[Hypothesis],
    ) -> Option<Self> {
        let joints = self.model.zeros.len();
        let own = self.covariance.nrows();
        let mut columns: Vec<usize> = (0..own).collect();
        for each in some {
            let first = own - 10 + first_column_of(*each, further, joints)?;
            columns.extend(first..first + each.columns(joints));
        }
        let sums = sums.of(columns);
        let active = [&self.active[..], some].concat();
        let found = information(&sums, &active, joints)?;
        let (step, decrease) = found.step(&sums)?;
        let mut model = self.model.moved(&step, &active);
        if some.contains(&Hypothesis::AxisGains) {
            model.normalize_gains();
        }
        Some(Self {
            model,
            active,
            squares: self.squares - decrease,
            covariance: found.covariance(),
            correlation: self.correlation,
        })
    }

    /// Variance of a whitened residual whose neighbours are independent, given the number of
    /// measurements.
    pub(super) fn variance(&self, measurements: f64) -> f64 {
        let freedom = (measurements - self.covariance.nrows() as f64).max(1.0);
        self.squares / freedom * self.correlation
    }

    /// Returns the standard deviations of the unknowns from one on.
    fn std_devs(&self, first: usize, count: usize, measurements: f64) -> Vec<f64> {
        let variance = self.variance(measurements);
        let own = |k| (self.covariance[(k, k)] * variance).max(0.0).sqrt();
        (first..first + count).map(own).collect()
    }

    /// Returns the standard deviations of the unknowns of an active hypothesis.
    pub(super) fn std_devs_of(&self, hypothesis: Hypothesis, measurements: f64) -> Vec<f64> {
        let joints = self.model.zeros.len();
        let first = first_column_of(hypothesis, &self.active, joints);
        first.map_or(Vec::new(), |first| {
            self.std_devs(first, hypothesis.columns(joints), measurements)
        })
    }

    /// Returns the covariance of the inertial parameters.
    pub(super) fn parameter_covariance(&self, measurements: f64) -> nalgebra::SMatrix<f64, 10, 10> {
        self.covariance.fixed_view::<10, 10>(0, 0) * self.variance(measurements)
    }
}

/// Information of the unknowns in units in which each column has the length one.
struct Information {
    lengths: DVector<f64>,
    factor: nalgebra::Cholesky<f64, nalgebra::Dyn>,
    /// Unknowns that keep their values, one for each direction that noise alone excites.
    held: Vec<usize>,
}

/// Returns the information of sums for the parameters and some hypotheses.
fn information(sums: &Sums, active: &[Hypothesis], joints: usize) -> Option<Information> {
    let zeros = first_column_of(Hypothesis::JointZeros, active, joints);
    let zeros = zeros.map_or(0..0, |first| first..first + joints);
    let count = sums.products.nrows() - 1;
    let length = |k: usize| sums.products[(k, k)].sqrt();
    let lengths = DVector::from_fn(count, |k, _| {
        let length = length(k);
        if length.is_normal() { length } else { 1.0 }
    });
    let mut scaled = DMatrix::from_fn(count, count, |i, j| {
        // A ridge, below which directions are not determined.
        let ridge = match i == j {
            // The zero of the last joint is not determined but for the errors of the mean geometry
            // of a window.
            true if zeros.contains(&i) => EIGENVALUE_RATIO.sqrt(),
            true => EIGENVALUE_RATIO,
            false => 0.0,
        };
        sums.products[(i, j)] / (lengths[i] * lengths[j]) + ridge
    });
    let mut held = Vec::new();
    while held.len() < count {
        if let Some(factor) = scaled.clone().cholesky() {
            return Some(Information {
                lengths,
                factor,
                held,
            });
        }
        // A direction of noise alone is less than nothing without it, by chance.
        let eigen = SymmetricEigen::try_new(scaled.clone(), f64::EPSILON, MAX_PASSES * count)?;
        let unknown = eigen.eigenvectors.column(eigen.eigenvalues.imin()).iamax();
        scaled.row_mut(unknown).fill(0.0);
        scaled.column_mut(unknown).fill(0.0);
        scaled[(unknown, unknown)] = 1.0;
        held.push(unknown);
    }
    None
}

impl Information {
    /// Returns the step to the least squares, with the decrease of the squares if the model is
    /// linear.
    fn step(&self, sums: &Sums) -> Option<(DVector<f64>, f64)> {
        let count = self.lengths.len();
        let mut target =
            DVector::from_fn(count, |k, _| sums.products[(k, count)] / self.lengths[k]);
        for &held in &self.held {
            target[held] = 0.0;
        }
        let scaled = self.factor.solve(&target);
        let decrease = scaled.dot(&target);
        let step = scaled.component_div(&self.lengths);
        let is_finite = step.iter().all(|entry| entry.is_finite());
        is_finite.then_some((step, decrease))
    }

    /// Returns the inverse, infinite on the diagonal of what is not determined.
    fn covariance(&self) -> DMatrix<f64> {
        let mut inverse = self.factor.inverse();
        let undetermined: Vec<bool> = inverse
            .diagonal()
            .iter()
            .map(|variance| *variance > SLIGHT / EIGENVALUE_RATIO)
            .collect();
        for (k, length) in self.lengths.iter().enumerate() {
            inverse.row_mut(k).scale_mut(length.recip());
            inverse.column_mut(k).scale_mut(length.recip());
        }
        for (k, is_unknown) in undetermined.iter().enumerate() {
            if *is_unknown || self.held.contains(&k) {
                inverse[(k, k)] = f64::INFINITY;
            }
        }
        inverse
    }
}

/// Returns the sum over all lags of the correlation of residuals, one at least: how many windows
/// say what one of independent ones would.
///
/// It is the variance of means over sections, relative to that of as many independent residuals.
fn correlation(residuals: &[Vector6<f64>]) -> f64 {
    let length = residuals.len().isqrt().max(1);
    let sections = residuals.chunks_exact(length);
    let count = sections.len().max(1) as f64;
    let squares = |vectors: &mut dyn Iterator<Item = Vector6<f64>>| -> Vector6<f64> {
        vectors.map(|vector| vector.component_mul(&vector)).sum()
    };
    let of_sums = squares(&mut sections.map(|section| section.iter().sum())) / count;
    let of_all = squares(&mut residuals.iter().copied()) / residuals.len().max(1) as f64;
    let total = of_all.sum() * length as f64;
    if total > 0.0 {
        (of_sums.sum() / total).max(1.0)
    } else {
        1.0
    }
}
