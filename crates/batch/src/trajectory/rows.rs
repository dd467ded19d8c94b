//! All rows of one bin in units of their noise: those of the measured motion, and those of the
//! dynamics.

use nalgebra::{DMatrix, SMatrix};

use super::bins::Layout;
use super::bordered::Bordered;
use super::dynamics::Linearised;
use super::segment::{Derivatives, Segment, base_motion, imaginary, quaternions};
use super::smoothing::rotation_residuals;

/// Standard deviations of the channels of the motion, and the whitening of those of the dynamics.
pub(super) struct Weights {
    /// In the order of the [`Layout`]; see [`smooth`](super::smoothing::smooth).
    pub(super) of_motion: Vec<f64>,
    /// Inverse of a root of the covariance of the rows of the dynamics.
    pub(super) of_dynamics: DMatrix<f64>,
}

/// Rows of one bin, those of the measured motion first, in the order of the channels: `target =
/// by_state * state + by_parameters * parameters`, for changes of both from the present ones. The
/// state consists of the coordinates, their first, and their second derivatives.
pub(super) struct BinRows {
    by_state: DMatrix<f64>,
    /// Derivatives by the parameters, then what the present motion and parameters leave of the
    /// measurements.
    by_parameters: DMatrix<f64>,
    /// Number of rows of the measured motion.
    of_motion: usize,
}

/// Residuals of the rows of a bin.
pub(super) struct Rest {
    /// Scores of the parameters: their derivatives by each parameter with the opposite sign, and last
    /// their values.
    pub(super) scores: DMatrix<f64>,
    /// Residuals of the rows of the measured motion.
    pub(super) of_motion: Vec<f64>,
    /// Residuals of the rows of the dynamics.
    pub(super) of_dynamics: Vec<f64>,
}

impl BinRows {
    /// Computes the rows of a bin with these values of its channels. `by_motion` are the derivatives
    /// of the predictions of the dynamics, in units of their noise, by the state.
    pub(super) fn new(
        values: &[f64],
        at: &Derivatives,
        (dynamics, by_motion): (&Linearised, &DMatrix<f64>),
        weights: &Weights,
        layout: Layout,
    ) -> Self {
        let coordinates = layout.coordinates();
        let of_motion = layout.effort();
        let (count, parameters) = dynamics.by_parameters.shape();
        let mut rows = Self {
            by_state: DMatrix::zeros(of_motion + count, 3 * coordinates),
            by_parameters: DMatrix::zeros(of_motion + count, parameters + 1),
            of_motion,
        };
        for (order, present) in at.iter().take(2).enumerate() {
            let present = present.iter().take(layout.joints + 3);
            for (coordinate, present) in present.enumerate() {
                let channel = layout.channels_of(coordinate)[order];
                rows.by_state[(channel, order * coordinates + coordinate)] = 1.0;
                rows.by_parameters[(channel, parameters)] = values[channel] - present;
            }
        }
        rows.set_rotation(values, at, layout);
        rows.set_accelerations(values, at, layout);
        for (channel, std_dev) in weights.of_motion.iter().enumerate() {
            rows.by_state.row_mut(channel).unscale_mut(*std_dev);
            rows.by_parameters.row_mut(channel).unscale_mut(*std_dev);
        }
        let mut place = rows.by_state.rows_mut(of_motion, count);
        place.copy_from(by_motion);
        let mut place = rows.by_parameters.rows_mut(of_motion, count);
        let whitening = &weights.of_dynamics;
        place
            .columns_mut(0, parameters)
            .gemm(1.0, whitening, &dynamics.by_parameters, 0.0);
        place
            .column_mut(parameters)
            .gemv(1.0, whitening, &dynamics.residuals, 0.0);
        rows
    }

    /// Sets the rows of the rotation, in their units: those of a small rotation in the inertial
    /// frame, of the length of the quaternion, which they hold to first order, and of the angular
    /// velocity.
    fn set_rotation(&mut self, values: &[f64], at: &Derivatives, layout: Layout) {
        let [q, rate, _] = quaternions(at);
        let (turn, angular_velocity) = rotation_residuals(at, values, layout);
        let (by_value, of_rate) = (imaginary(&q) * 2.0, imaginary(&rate) * -2.0);
        let (of_turns, of_rates) = (layout.quaternion(), layout.angular_velocity());
        let coordinates = layout.coordinates();
        let (first, last) = (coordinates - 4, self.by_parameters.ncols() - 1);
        for (row, column, block) in [
            (of_turns, first, by_value),
            (of_rates, first, of_rate),
            (of_rates, coordinates + first, by_value),
        ] {
            let mut place = self.by_state.fixed_view_mut::<3, 4>(row, column);
            place.copy_from(&block);
        }
        for (row, rest) in [(of_turns, turn), (of_rates, angular_velocity)] {
            let mut place = self.by_parameters.fixed_view_mut::<3, 1>(row, last);
            place.copy_from(&rest);
        }
        let of_length = of_turns + 3;
        for k in 0..4 {
            self.by_state[(of_length, first + k)] = q[k];
        }
        self.by_parameters[(of_length, last)] = 0.5 * (1.0 - q.norm_squared());
    }

    /// Sets the rows of the measured accelerations of the base, in their units, and beside those of
    /// an angular acceleration that of the quaternion's length.
    fn set_accelerations(&mut self, values: &[f64], at: &Derivatives, layout: Layout) {
        let [q, rate, second] = quaternions(at);
        let present = base_motion(at);
        let present = [present.acceleration, present.angular_acceleration];
        let (coordinates, last) = (layout.coordinates(), self.by_parameters.ncols() - 1);
        let [linear, angular] = layout.accelerations();
        let turning = angular.start;
        for (axis, row) in linear.clone().enumerate() {
            self.by_state[(row, 2 * coordinates + layout.joints + axis)] = 1.0;
        }
        for (channels, present) in [linear, angular].into_iter().zip(present) {
            for (channel, present) in channels.zip(&present) {
                self.by_parameters[(channel, last)] = values[channel] - present;
            }
        }
        let Some(of_length) = layout.lengthening() else {
            return;
        };
        let by_turning = [
            imaginary(&second) * -2.0,
            SMatrix::zeros(),
            imaginary(&q) * 2.0,
        ];
        for (order, by_length) in [second, rate * 2.0, q].iter().enumerate() {
            let column = (order + 1) * coordinates - 4;
            let mut place = self.by_state.fixed_view_mut::<3, 4>(turning, column);
            place.copy_from(&by_turning[order]);
            let mut place = self.by_state.fixed_view_mut::<1, 4>(of_length, column);
            place.tr_copy_from(by_length);
        }
        self.by_parameters[(of_length, last)] = -q.dot(&second) - rate.norm_squared();
    }

    /// Adds what the rows say of the coefficients to the matrix of the normal equations.
    pub(super) fn add_to(&self, system: &mut Bordered, segment: &Segment, bin: usize) {
        let of_states = self.by_state.transpose() * &self.by_state;
        let by_state = segment.by_coefficients(bin, &of_states).transpose();
        let block = segment.by_coefficients(bin, &by_state);
        system.add(segment.spans[bin] * segment.coordinates, &block);
    }

    /// Adds what the rows say of the coefficients beside the parameters and the targets to the
    /// border of the normal equations, and what they say of these alone to `direct`.
    pub(super) fn add_to_border(
        &self,
        system: &mut Bordered,
        direct: &mut DMatrix<f64>,
        segment: &Segment,
        bin: usize,
    ) {
        let of_both = self.by_state.tr_mul(&self.by_parameters);
        let border = segment.by_coefficients(bin, &of_both);
        system.add_to_border(segment.spans[bin] * segment.coordinates, &border);
        direct.gemm_tr(1.0, &self.by_parameters, &self.by_parameters, 1.0);
    }

    /// Returns the rows by the coefficients of the splines that are not zero at the bin, by the
    /// parameters, and last the targets.
    pub(super) fn by_unknowns(&self, segment: &Segment, bin: usize) -> DMatrix<f64> {
        let by_state = self.by_state.transpose();
        let of_splines = segment.by_coefficients(bin, &by_state).transpose();
        let columns = of_splines.ncols();
        let mut both = of_splines.resize_horizontally(columns + self.by_parameters.ncols(), 0.0);
        let mut place = both.columns_mut(columns, self.by_parameters.ncols());
        place.copy_from(&self.by_parameters);
        both
    }

    /// Returns what a solution leaves. `changes` are those of the coefficients by each parameter,
    /// and last those by the measurements; the parameters are those of the rows.
    pub(super) fn rest(&self, changes: &DMatrix<f64>, segment: &Segment, bin: usize) -> Rest {
        let parameters = self.by_parameters.ncols() - 1;
        let explained = &self.by_state * segment.state_of(bin, changes);
        let rest = &self.by_parameters - explained;
        let residuals = rest.column(parameters);
        let (of_motion, of_dynamics) = residuals.as_slice().split_at(self.of_motion);
        Rest {
            scores: rest.columns(0, parameters).tr_mul(&rest),
            of_motion: of_motion.to_vec(),
            of_dynamics: of_dynamics.to_vec(),
        }
    }
}
