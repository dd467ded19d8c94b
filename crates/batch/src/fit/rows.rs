//! The rows of all windows of a fit, one after the other: each pass reads all of them.

use tactid_identify::equations::{Equation, Row};

use super::FitOptions;
use super::products::{WIDTH, WideRow};

/// Place of the delay in a row, after the entries of the ten parameters.
pub(crate) const DELAY: usize = 10;

/// Most unknowns of a fit: the ten parameters, and the delay.
pub(crate) const UNKNOWNS: usize = DELAY + 1;

/// Place of the target in a row, after the entries of the unknowns.
pub(crate) const TARGET: usize = UNKNOWNS;

/// The rows and the half-differences of all windows, a row for each channel, with the scaled
/// gravity. Their entries for the delay are zero where it is not estimated.
pub(crate) struct FitRows {
    channels: usize,
    rows: Vec<WideRow>,
    /// Half-differences: noise alone, on both sides.
    differences: Vec<WideRow>,
}

impl FitRows {
    /// Copies the rows of equations of so many channels.
    pub(crate) fn new(equations: &[Equation], options: &FitOptions<'_>, channels: usize) -> Self {
        let wide = |row: &Row| {
            let mut wide = [0.0; WIDTH];
            let regressor = row.regressor_at(options.gravity_scale);
            wide[..DELAY].copy_from_slice(regressor.as_slice());
            wide[TARGET] = row.target;
            wide
        };
        let mut all = Self {
            channels,
            rows: Vec::with_capacity(equations.len() * channels),
            differences: Vec::with_capacity(equations.len() * channels),
        };
        for equation in equations {
            // target(t + delay) = target(t) + delay · rate belongs to the motion at t.
            let with_rate = |(row, rate): (&Row, &f64)| {
                let mut wide = wide(row);
                wide[DELAY] = if options.delay { -rate } else { 0.0 };
                wide
            };
            let rows = equation.rows.iter().zip(&equation.rates);
            all.rows.extend(rows.map(with_rate));
            let differences = equation.differences.iter();
            let differences = differences.zip(&equation.rate_differences);
            all.differences.extend(differences.map(with_rate));
        }
        all
    }

    /// Number of windows.
    pub(crate) fn windows(&self) -> usize {
        self.rows.len() / self.channels
    }

    /// Returns all rows, window by window.
    pub(crate) fn all(&self) -> &[WideRow] {
        &self.rows
    }

    /// Returns the rows of a window.
    pub(crate) fn of_window(&self, window: usize) -> &[WideRow] {
        &self.rows[window * self.channels..(window + 1) * self.channels]
    }

    /// Returns the half-differences of a window.
    pub(crate) fn differences(&self, window: usize) -> &[WideRow] {
        &self.differences[window * self.channels..(window + 1) * self.channels]
    }
}

/// Returns what a solution leaves of a row: the target less its prediction. The offset of the
/// channel is in it.
#[inline(always)]
pub(crate) fn remainder(row: &WideRow, solution: &[f64; UNKNOWNS]) -> f64 {
    // Sums that do not wait for each other.
    let mut sums = [0.0; 4];
    for (k, (entry, unknown)) in row.iter().zip(solution).enumerate() {
        sums[k % 4] += entry * unknown;
    }
    row[TARGET] - ((sums[0] + sums[1]) + (sums[2] + sums[3]))
}
