//! Forecast of the uncertainty for a motion that continues.

use nalgebra::{SMatrix, SVector, SymmetricEigen};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_identify::equations::Equation;
use tactid_identify::solve::{HALF_WIDTH_95, largest_of_kind, value_jacobian};

use crate::fit::Fit;
use crate::fit::normal_equations::NormalEquations;
use crate::report::FitReport;
use crate::serial;

/// Beyond this many times the length of the recording the forecast is infinite: noise alone then
/// excites the direction.
const NEVER: f64 = 1e6;

/// Relative precision of a forecast time.
const PRECISION: f64 = 1e-6;

/// Forecast of the variances of the ten values for a motion that continues as in the second half of
/// the recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Forecast {
    /// Growth of the information in ten independent directions, relative to the present
    /// information, 1/s.
    #[serde(with = "serial::ten")]
    #[schemars(with = "[f64; 10]")]
    growth: SVector<f64, 10>,
    /// Fraction of each value's variance, a row, that is due to each direction, a column. It is
    /// serialised column by column.
    #[serde(with = "serial::square")]
    #[schemars(with = "[[f64; 10]; 10]")]
    fractions: SMatrix<f64, 10, 10>,
    /// Fraction of each value's present variance that is noise, which more motion reduces.
    noise_fraction: [f64; 10],
    /// Length of the recording, s.
    length_s: f64,
}

impl Forecast {
    /// Creates a forecast from the windows of a fit and its report. `parameters` are those of the
    /// payload alone. `None` for a mass of zero.
    pub(crate) fn new(
        equations: &[Equation],
        fit: &Fit,
        parameters: &SVector<f64, 10>,
        of_fit: &FitReport,
    ) -> Option<Self> {
        let middle = equations.len() / 2;
        let mut whole = NormalEquations::with_known_mass(fit);
        let mut of_first = SMatrix::<f64, 10, 10>::zeros();
        for (window, equation) in equations.iter().enumerate() {
            if window == middle {
                of_first = whole.information();
            }
            whole.add(equation, window);
        }
        let of_second = whole.information() - of_first;
        let second_s = (equations.len() - middle) as f64 * of_fit.stride_s;
        // W Wᵀ is the covariance in the observable directions.
        let mut root = SMatrix::<f64, 10, 10>::zeros();
        for (k, (information, direction)) in whole.spectrum().observable().enumerate() {
            root.set_column(k, &(direction / information.sqrt()));
        }
        let growth = SymmetricEigen::new(root.transpose() * of_second * root / second_s);
        let mut slopes = value_jacobian(parameters)?;
        for (mut column, scale) in slopes.column_iter_mut().zip(fit.scales()) {
            column *= *scale;
        }
        let mut fractions = (slopes * root * growth.eigenvectors).map(|entry| entry * entry);
        for mut row in fractions.row_iter_mut() {
            row /= row.sum().max(f64::MIN_POSITIVE);
        }
        Some(Self {
            // The bias correction may leave a direction a negative information.
            growth: growth.eigenvalues.map(|rate| rate.max(0.0)),
            fractions,
            noise_fraction: of_fit.noise_fraction,
            length_s: equations.len() as f64 * of_fit.stride_s,
        })
    }

    /// Returns for each value the time until half of its 95 % interval is `within` (0.01 for 1 %)
    /// times the largest value of its kind (mass, centre of mass, inertia), s, in the order of
    /// [`VALUE_NAMES`](tactid_identify::VALUE_NAMES). Zero where it is so already, infinite where the motion
    /// does not determine the value. `values` and `std_devs` are those of the estimate at the end
    /// of the recording.
    ///
    /// The information is extrapolated at the rate of the second half of the windows. An error of
    /// the model (a sign, a frame, friction) is a bias, which no time removes. The uncertainty of
    /// gains and of a known tool stays, too: where it alone is larger than the target, the time is
    /// infinite.
    #[must_use]
    pub fn remaining_s(&self, values: &[f64; 10], std_devs: &[f64; 10], within: f64) -> [f64; 10] {
        let largest = largest_of_kind(values);
        std::array::from_fn(|value| {
            let half_width = HALF_WIDTH_95 * std_devs[value];
            let target = within * largest[value];
            if half_width <= target {
                0.0
            } else if half_width.is_finite() {
                let of_noise = self.noise_fraction[value];
                let left = (target / half_width).powi(2) - (1.0 - of_noise);
                if left > 0.0 {
                    self.time_to_s(value, left / of_noise)
                } else {
                    f64::INFINITY
                }
            } else {
                f64::INFINITY
            }
        })
    }

    /// Returns the time until the variance of a value's noise has fallen to a fraction of its
    /// present value, s.
    fn time_to_s(&self, value: usize, fraction: f64) -> f64 {
        let variance = |after_s: f64| -> f64 {
            let fractions = self.fractions.row(value).transpose();
            let relative = self.growth.map(|rate| 1.0 / (1.0 + rate * after_s));
            fractions.dot(&relative)
        };
        let (mut low, mut high) = (0.0, self.length_s);
        while variance(high) > fraction {
            if high > NEVER * self.length_s {
                return f64::INFINITY;
            }
            (low, high) = (high, 2.0 * high);
        }
        while high - low > PRECISION * high {
            let middle = 0.5 * (low + high);
            if variance(middle) > fraction {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}
