//! Normal equations that grow window by window, with the weights and the noise of a fit.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::Fit;
use crate::equations::{Equation, Row};
use crate::solve::offsets::Centering;

/// Normal equations in scaled parameters, with errors-in-variables bias correction.
pub(crate) struct NormalEquations<'a> {
    fit: &'a Fit,
    /// Information of the windows so far.
    pub(crate) information: SMatrix<f64, 10, 10>,
    /// Right-hand side.
    pub(crate) target: SVector<f64, 10>,
    centering: Centering,
    rows: Vec<Row>,
    /// Whitened rows with scaled columns, a row for each channel; the last column is the target.
    block: DMatrix<f64>,
}

impl<'a> NormalEquations<'a> {
    /// Creates the equations of no windows, with the known mass of the fit if it has one.
    pub(crate) fn with_known_mass(fit: &'a Fit) -> Self {
        let mut equations = Self::new(fit);
        if let Some(mass) = fit.known_mass {
            let scale = fit.scales()[0];
            equations.information[(0, 0)] = mass.information() * scale.powi(2);
            equations.target[0] = mass.information() * scale * mass.mass_kg;
        }
        equations
    }

    /// Creates the equations of no windows.
    pub(crate) fn new(fit: &'a Fit) -> Self {
        Self {
            fit,
            information: SMatrix::zeros(),
            target: SVector::zeros(),
            centering: Centering::new(if fit.offsets.is_some() { 6 } else { 0 }),
            rows: Vec::new(),
            block: DMatrix::zeros(fit.noise.channels(), 11),
        }
    }

    /// Adds the window of the fit with this index.
    pub(crate) fn add(&mut self, equation: &Equation, window: usize) {
        let weight = self.fit.weights[window];
        self.rows.clone_from(&equation.rows);
        if self.centering.is_needed() {
            let is_first = self.centering.is_empty();
            self.centering.centre(&mut self.rows, weight);
            self.centering.add(&equation.rows, weight);
            if is_first {
                return;
            }
        }
        for (rows, sign) in [(&self.rows, 1.0), (&equation.differences, -1.0)] {
            for (channel, row) in rows.iter().enumerate() {
                let scaled = row.regressor.component_mul(self.fit.scales());
                let mut entries = self.block.view_mut((channel, 0), (1, 10));
                entries.copy_from(&scaled.transpose());
                self.block[(channel, 10)] = row.target;
            }
            self.fit.noise.whiten(&mut self.block);
            let (rows, target) = (self.block.fixed_columns::<10>(0), self.block.column(10));
            self.information.gemm_tr(sign * weight, &rows, &rows, 1.0);
            self.target.gemv_tr(sign * weight, &rows, &target, 1.0);
        }
    }
}
