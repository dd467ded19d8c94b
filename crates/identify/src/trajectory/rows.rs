//! All rows of one bin in units of their noise: those of the measured motion, and those of the
//! dynamics.

use nalgebra::{DMatrix, DVector};

use super::bins::Layout;
use super::bordered::Bordered;
use super::dynamics::Linearised;
use super::segment::{Derivatives, Segment, imaginary, quaternions};
use super::smoothing::rotation_residuals;

/// Standard deviations of the channels of the motion, and the whitening of those of the dynamics.
pub(super) struct Weights {
    /// In the order of the [`Layout`]; see [`smooth`](super::smoothing::smooth).
    pub(super) of_motion: Vec<f64>,
    /// Inverse of a root of the covariance of the rows of the dynamics.
    pub(super) of_dynamics: DMatrix<f64>,
}

/// The row of one coordinate or of its rate.
struct CoordinateRow {
    coordinate: usize,
    /// Zero for the coordinate, one for its rate.
    order: usize,
    weight: f64,
    target: f64,
}

/// Rows of one bin: `target = by_splines * coefficients + by_parameters * parameters`, for changes
/// of both from the present ones.
pub(super) struct BinRows {
    /// Rows of single coordinates, on which no parameter acts.
    of_coordinates: Vec<CoordinateRow>,
    /// Derivatives of the other predictions by the coefficients of the splines at the bin.
    by_splines: DMatrix<f64>,
    /// Derivatives of the other predictions by the parameters, then what the present motion and
    /// parameters leave of the measurements.
    by_parameters: DMatrix<f64>,
    /// Number of other rows that are those of the rotation, which come first.
    of_rotation: usize,
}

/// What a solution leaves of the rows of a bin.
pub(super) struct Rest {
    /// What the rows say of the parameters beyond the solution.
    pub(super) score: DVector<f64>,
    /// Sum of the squared residuals of the motion, and their number.
    pub(super) of_motion: (f64, usize),
    /// Residuals of the rows of the dynamics.
    pub(super) of_dynamics: Vec<f64>,
}

impl BinRows {
    /// Computes the rows of a bin.
    pub(super) fn new(
        segment: &Segment,
        bin: usize,
        at: &Derivatives,
        dynamics: &Linearised<'_>,
        weights: &Weights,
        layout: Layout,
    ) -> Self {
        let values = &segment.bins[bin].values;
        let translational = layout.joints + 3;
        let rotation = rotation_rows(at, values, weights, layout);
        let (of_rotation, of_dynamics) = (rotation.len(), dynamics.residuals.len());
        let (coordinates, parameters) = (segment.coordinates, dynamics.by_parameters.ncols());
        let basis = &segment.bases[bin];
        let mut by_splines =
            DMatrix::zeros(of_rotation + of_dynamics, basis[0].len() * coordinates);
        let mut by_parameters = DMatrix::zeros(of_rotation + of_dynamics, parameters + 1);
        let whitening = &weights.of_dynamics;
        let by_motion = whitening * dynamics.by_motion;
        for spline in 0..basis[0].len() {
            let first = spline * coordinates;
            for (row, (by_value, by_rate, _)) in rotation.iter().enumerate() {
                for axis in 0..4 {
                    by_splines[(row, first + translational + axis)] =
                        basis[0][spline] * by_value[axis] + basis[1][spline] * by_rate[axis];
                }
            }
            let corner = (of_rotation, first);
            let mut place = by_splines.view_mut(corner, (of_dynamics, coordinates));
            for (order, weights) in basis.iter().enumerate() {
                place -= by_motion.columns(order * coordinates, coordinates) * weights[spline];
            }
        }
        for (row, (.., target)) in rotation.iter().enumerate() {
            by_parameters[(row, parameters)] = *target;
        }
        let corner = (of_rotation, 0);
        let mut place = by_parameters.view_mut(corner, (of_dynamics, parameters));
        place.gemm(1.0, whitening, &dynamics.by_parameters, 0.0);
        let residuals = whitening * &dynamics.residuals;
        for (row, residual) in residuals.iter().enumerate() {
            by_parameters[(of_rotation + row, parameters)] = *residual;
        }
        Self {
            of_coordinates: coordinate_rows(at, values, weights, layout),
            by_splines,
            by_parameters,
            of_rotation,
        }
    }

    /// Adds the rows to the normal equations of the coefficients, and what they say of the
    /// parameters and the targets alone to `direct`.
    pub(super) fn add_to(
        &self,
        system: &mut Bordered,
        direct: &mut DMatrix<f64>,
        segment: &Segment,
        bin: usize,
    ) {
        let coordinates = segment.coordinates;
        let (width, columns) = (self.by_splines.ncols(), self.by_parameters.ncols());
        let mut block = DMatrix::zeros(width, width);
        // The lower triangle is all that counts.
        for j in 0..width {
            let column = self.by_splines.column(j);
            for i in j..width {
                block[(i, j)] = self.by_splines.column(i).dot(&column);
            }
        }
        let mut border = self.by_splines.tr_mul(&self.by_parameters);
        for row in &self.of_coordinates {
            let basis = &segment.bases[bin][row.order];
            let place = |spline: usize| spline * coordinates + row.coordinate;
            for (i, of_row) in basis.iter().enumerate() {
                border[(place(i), columns - 1)] += row.weight * of_row * row.target;
                for (j, of_column) in basis.iter().enumerate().take(i + 1) {
                    block[(place(i), place(j))] += row.weight * row.weight * of_row * of_column;
                }
            }
        }
        system.add(segment.spans[bin] * coordinates, &block, &border);
        direct.gemm_tr(1.0, &self.by_parameters, &self.by_parameters, 1.0);
    }

    /// Returns what a solution leaves. `changes` are those of the coefficients by each parameter,
    /// and last those by the measurements; the parameters are those of the rows.
    pub(super) fn rest(&self, changes: &DMatrix<f64>, segment: &Segment, bin: usize) -> Rest {
        let parameters = self.by_parameters.ncols() - 1;
        let coordinates = segment.coordinates;
        let first = segment.spans[bin] * coordinates;
        let explained = &self.by_splines * changes.rows(first, self.by_splines.ncols());
        let rest = &self.by_parameters - explained;
        let residuals = rest.column(parameters);
        let mut score = rest.columns(0, parameters).tr_mul(&residuals);
        let (of_rotation, of_dynamics) = residuals.as_slice().split_at(self.of_rotation);
        let mut squares: f64 = of_rotation.iter().map(|residual| residual * residual).sum();
        for row in &self.of_coordinates {
            let basis = segment.bases[bin][row.order].iter().enumerate();
            let mut own = DVector::zeros(parameters + 1);
            for (spline, value) in basis {
                let place = first + spline * coordinates + row.coordinate;
                own.axpy(-row.weight * value, &changes.row(place).transpose(), 1.0);
            }
            let residual = row.target + own[parameters];
            squares += residual * residual;
            score.axpy(residual, &own.rows(0, parameters), 1.0);
        }
        Rest {
            score,
            of_motion: (squares, of_rotation.len() + self.of_coordinates.len()),
            of_dynamics: of_dynamics.to_vec(),
        }
    }
}

/// Returns the rows of the joints and of the position of the base, and those of their rates.
fn coordinate_rows(
    at: &Derivatives,
    values: &[f64],
    weights: &Weights,
    layout: Layout,
) -> Vec<CoordinateRow> {
    let mut rows = Vec::new();
    let present = at[0].iter().zip(&at[1]).take(layout.joints + 3);
    for (coordinate, (value, rate)) in present.enumerate() {
        let channels = layout.channels_of(coordinate).into_iter();
        for (order, (channel, present)) in channels.zip([value, rate]).enumerate() {
            let weight = weights.of_motion[channel].recip();
            rows.push(CoordinateRow {
                coordinate,
                order,
                weight,
                target: weight * (values[channel] - present),
            });
        }
    }
    rows
}

/// Derivatives of a row of the rotation by the quaternion and by its rate, and its target.
type RotationRow = ([f64; 4], [f64; 4], f64);

/// Returns the rows of the rotation: those of a small rotation in the inertial frame, of the
/// angular velocity, and of the length of the quaternion, which they hold to first order.
fn rotation_rows(
    at: &Derivatives,
    values: &[f64],
    weights: &Weights,
    layout: Layout,
) -> Vec<RotationRow> {
    let [q, rate, _] = quaternions(at);
    let (turn, angular_velocity) = rotation_residuals(at, values, layout);
    let std_devs = &weights.of_motion[layout.quaternion()..];
    let (by_value, of_rate) = (imaginary(&q) * 2.0, imaginary(&rate) * -2.0);
    let mut rows = Vec::new();
    for axis in 0..3 {
        let weight = std_devs[axis].recip();
        let by_quaternion = std::array::from_fn(|k| weight * by_value[(axis, k)]);
        rows.push((by_quaternion, [0.0; 4], weight * turn[axis]));
    }
    for axis in 0..3 {
        let weight = std_devs[4 + axis].recip();
        let by_quaternion = std::array::from_fn(|k| weight * of_rate[(axis, k)]);
        let by_rate = std::array::from_fn(|k| weight * by_value[(axis, k)]);
        rows.push((by_quaternion, by_rate, weight * angular_velocity[axis]));
    }
    let weight = std_devs[3].recip();
    let by_quaternion = std::array::from_fn(|k| weight * q[k]);
    let target = 0.5 * weight * (1.0 - q.norm_squared());
    rows.push((by_quaternion, [0.0; 4], target));
    rows
}
