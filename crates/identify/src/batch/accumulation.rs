//! The information of windows, weighted as a fit has weighted them.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::fit::Fit;
use crate::equations::{Equation, Row};
use crate::solve::offsets::Centering;

/// Normal equations in scaled parameters, to which windows are added one by one.
pub(crate) struct Gram<'a> {
    fit: &'a Fit,
    pub(crate) information: SMatrix<f64, 10, 10>,
    pub(crate) target: SVector<f64, 10>,
    centering: Centering,
    rows: Vec<Row>,
    block: DMatrix<f64>,
}

impl<'a> Gram<'a> {
    /// With what is known besides all windows.
    pub(crate) fn with_knowledge(fit: &'a Fit) -> Self {
        let mut gram = Self::without_windows(fit);
        if let Some(mass) = fit.mass {
            let scale = fit.excitation.scales[0];
            gram.information[(0, 0)] = mass.information() * scale.powi(2);
            gram.target[0] = mass.information() * scale * mass.mass_kg;
        }
        gram
    }

    /// To tell what windows add.
    pub(crate) fn without_windows(fit: &'a Fit) -> Self {
        Self {
            fit,
            information: SMatrix::zeros(),
            target: SVector::zeros(),
            centering: Centering::new(fit.offsets.len()),
            rows: Vec::new(),
            block: DMatrix::zeros(fit.noise.channels(), 11),
        }
    }

    /// Adds the fit's `window`; what the motion's noise adds is taken off, as in the fit.
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
                let scaled = row.regressor.component_mul(&self.fit.excitation.scales);
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
