//! How much longer a motion must go on.

use nalgebra::{SMatrix, SVector, SymmetricEigen};

use super::accumulation::Gram;
use super::fit::Fit;
use crate::equations::Equation;
use crate::solve::subspace::known;
use crate::solve::uncertainty::{HALF_WIDTH_95, jacobian, largest_of_kind};

/// What would take more than so many times the recording's length is never reached: the motion does
/// not excite it any more, but for noise.
const NEVER: f64 = 1e6;

/// How the ten values become known when a motion goes on as in the recording's second half.
#[derive(Clone, Debug)]
pub struct Forecast {
    /// By how much the information of each independent direction grows in a second, in units of what
    /// there is, 1/s.
    growth: SVector<f64, 10>,
    /// The part of each value's variance, a row, that is due to each direction.
    shares: SMatrix<f64, 10, 10>,
    /// Of the windows, s.
    length_s: f64,
}

impl Forecast {
    /// From the windows of a fit, one every `stride_s`; `parameters` are those of the payload alone.
    pub(crate) fn new(
        equations: &[Equation],
        fit: &Fit,
        parameters: &SVector<f64, 10>,
        stride_s: f64,
    ) -> Option<Self> {
        let middle = equations.len() / 2;
        let (mut first, mut second) = (Gram::with_knowledge(fit), Gram::without_windows(fit));
        for (window, equation) in equations.iter().enumerate() {
            let half = if window < middle {
                &mut first
            } else {
                &mut second
            };
            half.add(equation, window);
        }
        let whole = first.information + second.information;
        let second_s = (equations.len() - middle) as f64 * stride_s;
        // W Wᵀ is the covariance, in directions that are known.
        let mut root = SMatrix::<f64, 10, 10>::zeros();
        for (k, (information, direction)) in known(&SymmetricEigen::new(whole)).enumerate() {
            root.set_column(k, &(direction / information.sqrt()));
        }
        let growth = SymmetricEigen::new(root.transpose() * second.information * root / second_s);
        let mut slopes = jacobian(parameters)?;
        for (mut column, scale) in slopes.column_iter_mut().zip(&fit.excitation.scales) {
            column *= *scale;
        }
        let mut shares = (slopes * root * growth.eigenvectors).map(|entry| entry * entry);
        for mut row in shares.row_iter_mut() {
            row /= row.sum().max(f64::MIN_POSITIVE);
        }
        Some(Self {
            // What the motion's noise adds is taken off the information, and may leave less than none.
            growth: growth.eigenvalues.map(|rate| rate.max(0.0)),
            shares,
            length_s: equations.len() as f64 * stride_s,
        })
    }

    /// For each value the time until half of its 95 % interval is `within` times the largest value of
    /// its kind, s.
    pub fn remaining_s(
        &self,
        values: &[f64; 10],
        std_devs: &[f64; 10],
        within: f64,
    ) -> [f64; 10] {
        let largest = largest_of_kind(values);
        std::array::from_fn(|value| {
            let half_width = HALF_WIDTH_95 * std_devs[value];
            let target = within * largest[value];
            if half_width <= target {
                0.0
            } else if half_width.is_finite() {
                self.time_to_s(value, (target / half_width).powi(2))
            } else {
                f64::INFINITY
            }
        })
    }

    /// When a value's variance has fallen to a part of what it is.
    fn time_to_s(&self, value: usize, part: f64) -> f64 {
        let variance = |after_s: f64| -> f64 {
            let directions = self.shares.row(value).transpose();
            let left = self.growth.map(|rate| 1.0 / (1.0 + rate * after_s));
            directions.dot(&left)
        };
        let (mut low, mut high) = (0.0, self.length_s);
        while variance(high) > part {
            if high > NEVER * self.length_s {
                return f64::INFINITY;
            }
            (low, high) = (high, 2.0 * high);
        }
        while high - low > 1e-6 * high {
            let middle = 0.5 * (low + high);
            if variance(middle) > part {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}
