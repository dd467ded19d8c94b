//! The uncertainty of the payload that a motion leaves, as functions of the outputs along it.

use std::f64::consts::PI;

use nalgebra::{DMatrix, SMatrix};
use tactid_identify::equations::window;
use tactid_identify::{HALF_WIDTH_95, value_jacobian};

use crate::ExcitationError;
use crate::problem::{Criterion, Problem};
use crate::samples::{Sampler, Samples};

type Matrix = SMatrix<f64, 10, 10>;

/// Weights of the samples in the mean over one averaging window.
#[derive(Clone, Debug)]
struct Window {
    first: usize,
    weights: Vec<f64>,
}

/// The functions that a design minimises the largest of.
///
/// Each function is the logarithm of the half width of one predicted interval over its target, or,
/// for [`Criterion::Volume`], the mean logarithm of the semi-axes of the confidence ellipsoid.
///
/// The averaging windows give the information: the regressors of the samples in a window are
/// averaged with the weight of the filter, and their noise is the noise of one second of samples
/// over the time that the window stands for. Where the samples of the grid are further apart than
/// half a window, each stands for itself.
#[derive(Clone, Debug)]
pub(crate) struct Objective {
    /// Derivatives of the ten values, in units of their targets, by the parameters; a row for each.
    values: Matrix,
    criterion: Criterion,
    windows: Vec<Window>,
    /// Time that each window stands for, s.
    share_s: f64,
    channels: usize,
    offsets: usize,
    /// Information on the ten parameters before the motion.
    pub(crate) known: Matrix,
}

/// Information along a motion, and what follows from it.
#[derive(Clone, Debug)]
pub(crate) struct Uncertainty {
    /// The functions of the objective.
    pub(crate) functions: Vec<f64>,
    /// Directions in the parameters, a column for each: their information gives the functions.
    directions: DMatrix<f64>,
    /// Mean rows of each window, channels by ten, without the mean over all windows
    /// where the channel has an offset.
    means: Vec<DMatrix<f64>>,
}

impl Objective {
    /// Creates the objective of a problem for samples so far apart, s.
    pub(crate) fn new(problem: &Problem, sampler: &Sampler) -> Result<Self, ExcitationError> {
        let parameters = problem.payloads[0].as_vector();
        let mut values = value_jacobian(parameters).ok_or(ExcitationError::NotObservable)?;
        for (mut row, target) in values.row_iter_mut().zip(problem.targets) {
            row *= HALF_WIDTH_95 / target;
        }
        let grid = &sampler.grid;
        let length_s = window::length_s(problem.sensing.equations.cutoff_hz);
        let windows = windows(grid.count(), grid.step_s, length_s);
        if windows.is_empty() {
            return Err(problem.sensing.no_window(problem.duration_s));
        }
        Ok(Self {
            values,
            criterion: problem.criterion,
            windows,
            share_s: grid.step_s,
            channels: sampler.plant.layout().channels,
            offsets: sampler.plant.offsets,
            known: Matrix::zeros(),
        })
    }

    /// Computes the functions at a motion's samples; `None` if these do not determine all values.
    pub(crate) fn uncertainty(&self, samples: &Samples) -> Option<Uncertainty> {
        let means = self.means(samples);
        let mut information = self.known;
        for mean in &means {
            information += mean.tr_mul(mean).fixed_view::<10, 10>(0, 0) * self.share_s;
        }
        // Parameters differ by orders of magnitude: the factorised matrix has a diagonal of ones.
        let units = information.diagonal().map(|x| x.sqrt().recip());
        let scaling = Matrix::from_diagonal(&units);
        let factor = (scaling * information * scaling).cholesky()?;
        let inverse_root = factor.l().try_inverse()?.transpose();
        let root = scaling * inverse_root;
        let (functions, directions) = match self.criterion {
            Criterion::LargestInterval => {
                // σ² = |J root|², and its derivative is -zᵀ dM z with z = M⁻¹ Jᵀ.
                let of_values = self.values * root;
                let variances = of_values.row_iter().map(|row| row.norm_squared());
                let functions = variances.clone().map(|v| 0.5 * v.ln());
                let mut directions = root * of_values.transpose();
                for (mut column, variance) in directions.column_iter_mut().zip(variances) {
                    column /= variance.sqrt();
                }
                (functions.collect::<Vec<f64>>(), directions)
            }
            Criterion::Volume => {
                // ln det M⁻¹ = 2 ln det root, and its derivative is -tr(rootᵀ dM root).
                let diagonal = factor.l_dirty().diagonal();
                let log = units.map(f64::ln).sum() - diagonal.map(f64::ln).sum();
                (vec![log / 10.0], root / 10f64.sqrt())
            }
        };
        functions
            .iter()
            .all(|f| f.is_finite())
            .then(|| Uncertainty {
                functions,
                directions: DMatrix::from_column_slice(10, 10, directions.as_slice()),
                means,
            })
    }

    /// Returns the gradient of each function with respect to the variables.
    pub(crate) fn gradients(
        &self,
        uncertainty: &Uncertainty,
        sampler: &Sampler,
        samples: &Samples,
    ) -> Vec<Vec<f64>> {
        let count = uncertainty.functions.len();
        let mut gradients = vec![vec![0.0; sampler.variables.count()]; count];
        let adjoints = self.adjoints(uncertainty, samples.count());
        let mut slopes = vec![0.0; count];
        for (sample, adjoint) in adjoints.iter().enumerate() {
            for (input, outputs) in sampler.slopes(samples, sample) {
                // dY Z, channels by directions, against the adjoint; each row of dY has ten
                // contiguous entries.
                slopes.fill(0.0);
                for channel in 0..self.channels {
                    let row = &outputs[channel * 10..channel * 10 + 10];
                    for direction in 0..10 {
                        let column = uncertainty.directions.column(direction);
                        let product: f64 = row.iter().zip(&column).map(|(a, b)| a * b).sum();
                        slopes[direction.min(count - 1)] -= product * adjoint[(channel, direction)];
                    }
                }
                for (gradient, slope) in gradients.iter_mut().zip(&slopes) {
                    sampler.add_input(sample, input, *slope, gradient);
                }
            }
        }
        gradients
    }

    /// Returns what each sample's rows, times the directions, add to the information along them.
    fn adjoints(&self, uncertainty: &Uncertainty, samples: usize) -> Vec<DMatrix<f64>> {
        let mut adjoints = vec![DMatrix::zeros(self.channels, 10); samples];
        for (window, mean) in self.windows.iter().zip(&uncertainty.means) {
            let along = mean * &uncertainty.directions * self.share_s;
            for (k, weight) in window.weights.iter().enumerate() {
                let adjoint = &mut adjoints[window.first + k];
                *adjoint += &along * *weight;
            }
        }
        adjoints
    }

    /// Returns the mean rows of all windows.
    fn means(&self, samples: &Samples) -> Vec<DMatrix<f64>> {
        let mut means: Vec<DMatrix<f64>> = Vec::with_capacity(self.windows.len());
        for window in &self.windows {
            let mut mean = DMatrix::zeros(self.channels, 10);
            for (k, weight) in window.weights.iter().enumerate() {
                let outputs = samples.at(window.first + k);
                for channel in 0..self.channels {
                    for parameter in 0..10 {
                        mean[(channel, parameter)] += weight * outputs[channel * 10 + parameter];
                    }
                }
            }
            means.push(mean);
        }
        remove_offsets(&mut means, self.offsets);
        means
    }
}

/// Subtracts the mean over all windows from the rows of the leading channels, which have an unknown
/// offset: least squares with a constant is least squares of what differs from its mean.
pub(crate) fn remove_offsets(means: &mut [DMatrix<f64>], offsets: usize) {
    let count = means.len() as f64;
    for channel in 0..offsets {
        for parameter in 0..10 {
            let sum: f64 = means.iter().map(|mean| mean[(channel, parameter)]).sum();
            for mean in means.iter_mut() {
                mean[(channel, parameter)] -= sum / count;
            }
        }
    }
}

/// Returns the windows around the samples that are at least half a window away from both ends.
fn windows(samples: usize, step_s: f64, length_s: f64) -> Vec<Window> {
    let reach = (0.5 * length_s / step_s) as usize;
    let margin = (0.5 * length_s / step_s).ceil() as usize;
    let around = |middle: usize| {
        let weight = |k: usize| {
            let offset_s = step_s * (k as f64 - reach as f64);
            (PI * offset_s / length_s).cos().powi(4)
        };
        let weights: Vec<f64> = (0..=2 * reach).map(weight).collect();
        let sum: f64 = weights.iter().sum();
        Window {
            first: middle - reach,
            weights: weights.iter().map(|weight| weight / sum).collect(),
        }
    };
    (margin..samples.saturating_sub(margin))
        .map(around)
        .collect()
}
