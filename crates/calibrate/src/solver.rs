//! Gauss-Newton over the unknowns of an arm and payloads, with whitened rows and a Gaussian prior.

use nalgebra::{DMatrix, DVector};

use super::noise::{EffortNoise, Whitening};
use super::payload::PayloadRow;
use super::recording::EffortRecording;
use super::rows::{EffortModel, Unknowns};
use super::scale::{HELD_SCALE_STD_DEV, KnownScale};

/// Windows of one recording that a solution uses.
#[derive(Clone, Debug)]
pub(crate) struct Block<'a> {
    pub(crate) recording: &'a EffortRecording,
    /// Index of the payload that the arm holds.
    pub(crate) payload: Option<usize>,
    pub(crate) windows: Vec<usize>,
}

/// What is known of the arm before: mean and precision, in units of `scales`.
#[derive(Clone, Debug)]
pub(crate) struct Prior {
    pub(crate) mean: Vec<f64>,
    /// Unit of each unknown; 0 for one that is known.
    pub(crate) scales: Vec<f64>,
    /// Precision of the unknowns divided by their units.
    pub(crate) precision: DMatrix<f64>,
}

/// Recordings, their model and what is known before.
#[derive(Clone, Debug)]
pub(crate) struct Problem<'a> {
    pub(crate) model: &'a EffortModel,
    pub(crate) blocks: Vec<Block<'a>>,
    pub(crate) prior: Prior,
    /// Units of the ten parameters of each payload.
    pub(crate) payload_scales: Vec<[f64; 10]>,
    /// What is known of each payload.
    pub(crate) payload_rows: Vec<Vec<PayloadRow>>,
    /// Scale of all torques, where it is held.
    pub(crate) scale: Option<KnownScale>,
}

/// Normal equations for a step of the unknowns in their units: of the arm, then of each payload.
#[derive(Clone, Debug)]
pub(crate) struct NormalEquations {
    pub(crate) matrix: DMatrix<f64>,
    pub(crate) rhs: DVector<f64>,
    /// Sum of the logarithms of the determinants of the noise.
    pub(crate) log_det: f64,
    /// Sum of the squares of all whitened residuals and of the distances from what is known before.
    pub(crate) squares: f64,
}

impl NormalEquations {
    /// Returns the normal equations of two independent sets of rows together.
    pub(crate) fn plus(mut self, other: Self) -> Self {
        self.matrix += other.matrix;
        self.rhs += other.rhs;
        self.log_det += other.log_det;
        self.squares += other.squares;
        self
    }
}

impl Problem<'_> {
    /// Number of unknowns of the arm.
    pub(crate) fn arm_len(&self) -> usize {
        self.prior.mean.len()
    }

    /// Number of all unknowns.
    pub(crate) fn len(&self) -> usize {
        self.arm_len() + 10 * self.payload_scales.len()
    }

    /// Returns the mean of what is known before, with payloads without mass.
    pub(crate) fn start(&self) -> Unknowns {
        Unknowns {
            arm: self.prior.mean.clone(),
            payloads: vec![Default::default(); self.payload_scales.len()],
        }
    }

    /// Returns the normal equations at these unknowns, with the noise of each joint.
    pub(crate) fn normal_equations(&self, at: &Unknowns, noise: &[EffortNoise]) -> NormalEquations {
        self.data_equations(at, noise)
            .plus(self.prior_equations(at))
    }

    /// Returns normal equations of the recordings alone at these unknowns, with each joint's noise.
    pub(crate) fn data_equations(&self, at: &Unknowns, noise: &[EffortNoise]) -> NormalEquations {
        let mut normal = NormalEquations {
            matrix: DMatrix::zeros(self.len(), self.len()),
            rhs: DVector::zeros(self.len()),
            log_det: 0.0,
            squares: 0.0,
        };
        for block in &self.blocks {
            for (joint, noise) in noise.iter().enumerate() {
                let mut rows = self.rows(block, joint, at);
                let whitening = block.whitening(joint, noise);
                whitening.apply(&mut rows);
                normal.log_det += whitening.log_det;
                let products = rows.tr_mul(&rows);
                let indices = self.indices(block, joint);
                let last = indices.len();
                for (a, &i) in indices.iter().enumerate() {
                    for (b, &k) in indices.iter().enumerate() {
                        normal.matrix[(i, k)] += products[(a, b)];
                    }
                    normal.rhs[i] += products[(a, last)];
                }
                normal.squares += products[(last, last)];
            }
        }
        normal
    }

    /// Returns the normal equations of what is known before.
    pub(crate) fn prior_equations(&self, at: &Unknowns) -> NormalEquations {
        let (arm, all) = (self.arm_len(), self.len());
        let mut matrix = DMatrix::zeros(all, all);
        let mut rhs = DVector::zeros(all);
        let scaled = DVector::from_fn(arm, |k, _| {
            let scale = self.prior.scales[k];
            if scale > 0.0 {
                (at.arm[k] - self.prior.mean[k]) / scale
            } else {
                0.0
            }
        });
        let gradient = &self.prior.precision * &scaled;
        matrix
            .view_mut((0, 0), (arm, arm))
            .copy_from(&self.prior.precision);
        rhs.rows_mut(0, arm).copy_from(&-&gradient);
        let mut squares = scaled.dot(&gradient);
        for (payload, rows) in self.payload_rows.iter().enumerate() {
            let scales = &self.payload_scales[payload];
            for row in rows {
                let gradient: [f64; 10] =
                    std::array::from_fn(|k| row.gradient[k] * scales[k] / row.std_dev);
                let distance = (row.target - row.gradient.dot(&at.payloads[payload])) / row.std_dev;
                let first = arm + 10 * payload;
                for (i, a) in gradient.iter().enumerate() {
                    for (k, b) in gradient.iter().enumerate() {
                        matrix[(first + i, first + k)] += a * b;
                    }
                    rhs[first + i] += a * distance;
                }
                squares += distance * distance;
            }
        }
        if let Some(scale) = &self.scale {
            let gradient = DVector::from_fn(all, |k, _| scale.gradient[k] * self.scale(k));
            let precision = HELD_SCALE_STD_DEV.powi(-2);
            let distance = -scale.value(at);
            matrix += precision * &gradient * gradient.transpose();
            rhs += precision * distance * gradient;
            squares += precision * distance * distance;
        }
        NormalEquations {
            matrix,
            rhs,
            log_det: 0.0,
            squares,
        }
    }

    /// Returns the rows of one joint in one block, their columns multiplied by the units; the last
    /// column is measured less modelled effort.
    pub(crate) fn rows(&self, block: &Block<'_>, joint: usize, at: &Unknowns) -> DMatrix<f64> {
        let payload = block.payload.map(|payload| &at.payloads[payload]);
        let model = self.model;
        let mut rows = model.rows(block.recording, joint, &block.windows, &at.arm, payload);
        for (column, index) in self.indices(block, joint).into_iter().enumerate() {
            rows.column_mut(column).scale_mut(self.scale(index));
        }
        rows
    }

    /// Indices of the unknowns that the columns of [`Self::rows`] belong to.
    pub(crate) fn indices(&self, block: &Block<'_>, joint: usize) -> Vec<usize> {
        let mut indices = self.model.indices(block.recording, joint);
        if let Some(payload) = block.payload {
            let first = self.arm_len() + 10 * payload;
            indices.extend(first..first + 10);
        }
        indices
    }

    /// Unit of an unknown of the arm or of a payload.
    fn scale(&self, index: usize) -> f64 {
        match index.checked_sub(self.arm_len()) {
            Some(place) => self.payload_scales[place / 10][place % 10],
            None => self.prior.scales[index],
        }
    }

    /// Adds a step, in units of the unknowns.
    pub(crate) fn add(&self, at: &mut Unknowns, step: &DVector<f64>) {
        for (k, value) in at.arm.iter_mut().enumerate() {
            *value += self.prior.scales[k] * step[k];
        }
        for (payload, values) in at.payloads.iter_mut().enumerate() {
            for k in 0..10 {
                let index = self.arm_len() + 10 * payload + k;
                values[k] += self.payload_scales[payload][k] * step[index];
            }
        }
    }

    /// Returns the mean square of the whitened residuals of each joint after a step of linearised
    /// equations; 1 for a joint without windows.
    pub(crate) fn misfit(
        &self,
        at: &Unknowns,
        step: &DVector<f64>,
        noise: &[EffortNoise],
    ) -> Vec<f64> {
        let of_joint = |(joint, noise): (usize, &EffortNoise)| {
            let (mut squares, mut count) = (0.0, 0);
            for block in &self.blocks {
                let mut residual = self.residual(block, joint, at, step);
                block.whitening(joint, noise).apply(&mut residual);
                squares += residual.norm_squared();
                count += residual.len();
            }
            if count == 0 {
                1.0
            } else {
                squares / count as f64
            }
        };
        noise.iter().enumerate().map(of_joint).collect()
    }

    /// Returns measured less modelled effort of the linearised equations after a step, one column.
    pub(crate) fn residual(
        &self,
        block: &Block<'_>,
        joint: usize,
        at: &Unknowns,
        step: &DVector<f64>,
    ) -> DMatrix<f64> {
        let rows = self.rows(block, joint, at);
        let indices = self.indices(block, joint);
        let of_joint = DVector::from_fn(indices.len(), |k, _| step[indices[k]]);
        let last = indices.len();
        let residual = rows.column(last) - rows.columns(0, last) * of_joint;
        DMatrix::from_column_slice(residual.len(), 1, residual.as_slice())
    }
}

impl Block<'_> {
    /// Returns the filter that whitens the windows of a joint.
    pub(crate) fn whitening(&self, joint: usize, noise: &EffortNoise) -> Whitening {
        let windows = self.windows.iter().map(|&window| {
            let columns = self.recording.columns(window, joint);
            (self.recording.times_s()[window], columns.standstill())
        });
        Whitening::new(noise, windows)
    }
}
