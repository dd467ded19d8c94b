//! Least squares over poses at rest, with the noise between them.

use nalgebra::{Matrix2, Matrix3, RowSVector, SMatrix, Vector2, Vector3, Vector6};
use tactid_identify::KINDS;
use tactid_identify::equations::{Row, WRENCH};
use tactid_identify::solve::ZERO_SIZE;
use tactid_identify::solve::{EIGENVALUE_RATIO, LEVER_ARM_M, Matrix, NullSpace, Vector};
use tactid_identify::solve::{std_dev, value_jacobian};

use super::Rows;
use super::visits::{CHANNEL_KINDS, Visit, grams, less, means, means_of_attitudes};
use crate::distributions::{f_p, students_factor};
use crate::fit::CONVERGED_ENOUGH;
use crate::fit::least_squares::MAX_PASSES;
use crate::solve::{Excitation, Spectrum};
use crate::solve::{INVERSE_ROUNDING, PseudoInverse, normalized, pseudo_inverse};

/// The places of the two small angles of gravity, where its direction is unknown, among the columns
/// of a row. They are those of two entries of the inertia, which has no column at rest.
pub(super) const ANGLES: [usize; 2] = [KINDS[2].start, KINDS[2].start + 1];

/// The parameters that explain poses at rest best, with what the poses say about their noise.
#[derive(Clone, Debug)]
pub(super) struct RestFit {
    /// Parameters of the whole load.
    pub(super) parameters: Vector,
    /// Covariance of the parameters. What it contains in unobservable directions does not count.
    pub(super) covariance: Matrix,
    /// Information of the parameters, with the offsets and the angles of gravity eliminated.
    pub(super) information: Matrix,
    /// The unobservable directions.
    pub(super) null_space: NullSpace,
    /// Parameters and [angles](ANGLES) that explain the poses best, rad.
    unknowns: Vector,
    /// Covariance and unobservable directions of parameters and angles.
    inverse: PseudoInverse,
    /// Part of the information of parameters and angles that each kind of channels has.
    of_kinds: [Matrix; 2],
    /// Standard deviation of the noise between poses: force, N, and moment, N m.
    pub(super) noise: [f64; 2],
    /// Degrees of freedom from which each noise is estimated, infinite where no channel of the
    /// kind is measured.
    pub(super) freedom: [f64; 2],
    /// Offset of each channel, zero where it is known to be; in the channel's unit.
    pub(super) offsets: Vector6<f64>,
    /// Mean row of each channel, zero without offsets.
    means: [Row; WRENCH],
    has_offset: bool,
    /// One for each channel that is measured, zero for others.
    measured: Vector6<f64>,
    /// Number of poses.
    poses: usize,
    /// Largest measurement of each kind, N and N m.
    largest: [f64; 2],
}

impl RestFit {
    /// Fits the parameters, the angles of gravity where the rows have columns for them, and an
    /// offset of each channel if there is one. `measured` is one for each channel that is measured,
    /// and zero for others, whose rows are zero.
    ///
    /// Visits of one attitude enter with their mean: what differs between them is noise, and no
    /// information about the payload.
    pub(super) fn new(visits: &[Visit], has_offset: bool, measured: &Vector6<f64>) -> Self {
        let rows: Vec<Rows> = visits.iter().map(|visit| visit.rows).collect();
        let means = if has_offset {
            means(&rows)
        } else {
            [Row::zero(); WRENCH]
        };
        let centred: Vec<Rows> = rows.iter().map(|rows| less(rows, &means)).collect();
        let grams = grams(&means_of_attitudes(visits, &centred));
        let largest = CHANNEL_KINDS.map(|kind| {
            let targets = rows.iter().flat_map(|rows| &rows[kind.clone()]);
            let sizes = targets.map(|row| row.target.abs());
            sizes.fold(ZERO_SIZE, f64::max)
        });
        let nothing = pseudo_inverse(&Matrix::zeros());
        let mut fit = Self {
            parameters: Vector::zeros(),
            covariance: Matrix::zeros(),
            information: Matrix::zeros(),
            null_space: nothing.null_space,
            unknowns: Vector::zeros(),
            inverse: nothing,
            of_kinds: [Matrix::zeros(); 2],
            noise: [1.0; 2],
            freedom: [0.0; 2],
            offsets: Vector6::zeros(),
            means,
            has_offset,
            measured: *measured,
            poses: rows.len(),
            largest,
        };
        for _ in 0..MAX_PASSES {
            let before = fit.noise;
            fit.solve(&grams);
            fit.update_noise(&centred);
            let changed =
                |k: usize| (fit.noise[k] - before[k]).abs() > CONVERGED_ENOUGH * before[k];
            if !(changed(0) || changed(1)) {
                break;
            }
        }
        fit.solve(&grams);
        fit.eliminate_angles();
        fit.add_unobservable_shares();
        fit.offsets = Vector6::from_fn(|channel, _| {
            let mean = &fit.means[channel];
            mean.target - mean.regressor.dot(&fit.unknowns)
        });
        fit
    }

    /// Solves for the parameters and the angles with the present noise.
    fn solve(&mut self, grams: &[(Matrix, Vector); 2]) {
        let mut target = Vector::zeros();
        for (kind, (square, product)) in grams.iter().enumerate() {
            let weight = self.noise[kind].powi(-2);
            self.of_kinds[kind] = square * weight;
            target += product * weight;
        }
        self.inverse = pseudo_inverse(&(self.of_kinds[0] + self.of_kinds[1]));
        self.unknowns = self.inverse.covariance * target;
    }

    /// Sets what is known of the parameters alone.
    fn eliminate_angles(&mut self) {
        self.information = without_angles(&(self.of_kinds[0] + self.of_kinds[1]));
        let PseudoInverse {
            covariance,
            null_space,
        } = pseudo_inverse(&self.information);
        (self.covariance, self.null_space) = (covariance, null_space);
        self.parameters = self.unknowns;
        self.parameters.fixed_rows_mut::<2>(ANGLES[0]).fill(0.0);
    }

    /// Angles by which gravity turns from that of the rows, rad; zero where the rows have no
    /// columns for them.
    pub(super) fn angles(&self) -> Vector2<f64> {
        self.unknowns.fixed_rows::<2>(ANGLES[0]).into()
    }

    /// Size of the angles in standard deviations: by how much gravity moves in the next iteration.
    pub(super) fn angles_in_std_devs(&self) -> f64 {
        let in_std_devs = ANGLES.map(|k| {
            let variance = self.inverse.covariance[(k, k)];
            if variance > 0.0 {
                self.unknowns[k].abs() / variance.sqrt()
            } else {
                0.0
            }
        });
        in_std_devs.into_iter().fold(0.0, f64::max)
    }

    /// Whether the rows have columns for the angles.
    pub(super) fn has_angles(&self) -> bool {
        let first = (ANGLES[0], ANGLES[0]);
        self.of_kinds.iter().any(|kind| kind[first] > 0.0)
    }

    /// Adds what the centre of mass in an unobservable direction may change in values that count as
    /// determined across it: two attitudes determine an axis of the centre of mass but for a small
    /// share of another one, which may be as far away as [`LEVER_ARM_M`].
    fn add_unobservable_shares(&mut self) {
        let scales = *self.null_space.scales();
        for direction in self.null_space.directions() {
            let direction = direction.component_mul(&scales);
            let of_first_moments = direction.fixed_rows::<3>(1).norm();
            if of_first_moments > 0.0 {
                let change = direction * (self.parameters[0] * LEVER_ARM_M / of_first_moments);
                self.covariance += change * change.transpose();
            }
        }
    }

    /// Estimates the noise of each kind from its residuals, whose degrees of freedom are their
    /// number less the unknowns that they determine.
    fn update_noise(&mut self, centred: &[Rows]) {
        for (k, kind) in CHANNEL_KINDS.into_iter().enumerate() {
            let rows = centred.iter().flat_map(|rows| &rows[kind.clone()]);
            let squares = rows.map(|row| (row.target - row.regressor.dot(&self.unknowns)).powi(2));
            let channels: f64 = kind.clone().map(|channel| self.measured[channel]).sum();
            let count = (self.poses - usize::from(self.has_offset)) as f64 * channels;
            self.freedom[k] = if channels > 0.0 {
                count - (self.inverse.covariance * self.of_kinds[k]).trace()
            } else {
                f64::INFINITY
            };
            let variance = squares.sum::<f64>() / self.freedom[k].max(1.0);
            self.noise[k] = variance.sqrt().max(f64::EPSILON * self.largest[k]);
        }
    }

    /// Returns the noise of forces, N, and of moments, N m; zero where none is measured.
    pub(super) fn measured_noise(&self) -> [f64; 2] {
        std::array::from_fn(|k| {
            if self.freedom[k].is_finite() {
                self.noise[k]
            } else {
                0.0
            }
        })
    }

    /// Returns measured less predicted load of a channel, in its unit.
    pub(super) fn residual(&self, row: &Row, channel: usize) -> f64 {
        row.target - row.regressor.dot(&self.unknowns) - self.offsets[channel]
    }

    /// Returns the standard deviation of the [residual](Self::residual) of a pose that is among
    /// those of the fit, or is not.
    pub(super) fn residual_std_dev(&self, row: &Row, channel: usize, is_fitted: bool) -> f64 {
        let column = row.regressor - self.means[channel].regressor;
        let kind = channel / 3;
        let of_noise = self.resolved_noise(kind).powi(2);
        let of_fit =
            (self.inverse.covariance * column).dot(&column) + of_noise * self.fraction_of_mean();
        let variance = if is_fitted {
            of_noise - of_fit
        } else {
            of_noise + of_fit
        };
        variance.max(INVERSE_ROUNDING.sqrt() * of_noise).sqrt()
    }

    /// Variance of a mean that is subtracted, relative to that of one pose.
    fn fraction_of_mean(&self) -> f64 {
        f64::from(u8::from(self.has_offset)) / self.poses as f64
    }

    /// Returns the sum of the squares of the residuals in units of the noise of another fit.
    pub(super) fn squares(&self, other: &Self) -> f64 {
        let of_kind =
            |k: usize| self.freedom[k] * (self.noise[k] / other.resolved_noise(k)).powi(2);
        let is_measured = |k: &usize| self.freedom[*k].is_finite();
        (0..2).filter(is_measured).map(of_kind).sum()
    }

    /// Exchanges the noise of forces with that of moments, for a comparison with a fit of the same
    /// measurements in which these are exchanged.
    pub(super) fn exchange_kinds(&mut self) {
        self.noise.swap(0, 1);
        self.freedom.swap(0, 1);
        self.largest.swap(0, 1);
    }

    /// Returns the noise of a kind of channels, or the rounding of its residuals where that is
    /// larger, N or N m.
    fn resolved_noise(&self, kind: usize) -> f64 {
        self.noise[kind].max(INVERSE_ROUNDING.sqrt() * self.largest[kind])
    }

    /// Whether the poses are enough to contradict an assumption.
    pub(super) fn can_contradict(&self) -> bool {
        self.freedom.iter().all(|freedom| is_enough(*freedom))
    }

    /// Returns the probability that so many `further` unknowns of another fit explain as much, or
    /// more, by chance: that of an F test with the degrees of freedom of the kind of channels that
    /// has fewer, because the weights of both follow from them.
    pub(super) fn p_value_beside(&self, other: &Self, further: usize) -> f64 {
        let freedom = other.freedom[0].min(other.freedom[1]);
        let gain = self.squares(other) - other.squares(other);
        f_p(gain, further as f64, freedom)
    }

    /// Returns the probability that the forces or the moments of a pose of the fit differ from
    /// those of the others by as much, or more, by chance: the smaller one of the two. It is that
    /// of an F test of the residuals with and without the pose, and so holds for few poses; one
    /// where the others cannot contradict the pose.
    pub(super) fn p_value(&self, rows: &Rows) -> f64 {
        let of_kinds = [0, 1].map(|kind| self.p_value_of_kind(rows, kind));
        of_kinds[0].min(of_kinds[1])
    }

    fn p_value_of_kind(&self, rows: &Rows, kind: usize) -> f64 {
        let centred = less(rows, &self.means);
        let rows = &centred[CHANNEL_KINDS[kind].clone()];
        let variance = self.noise[kind].powi(2);
        let residuals =
            Vector3::from_fn(|k, _| rows[k].target - rows[k].regressor.dot(&self.unknowns));
        let columns = SMatrix::<f64, 3, 10>::from_fn(|k, column| rows[k].regressor[column]);
        let measured = self.measured.fixed_rows::<3>(3 * kind);
        let left = Matrix3::from_diagonal(&measured) * (1.0 - self.fraction_of_mean())
            - columns * self.inverse.covariance * columns.transpose() / variance;
        let eigen = left.symmetric_eigen();
        let (mut squares, mut count) = (0.0, 0.0);
        for (share, direction) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            // Below, the pose alone determines what it fits.
            if *share > INVERSE_ROUNDING.sqrt() {
                squares += direction.dot(&residuals).powi(2) / share;
                count += 1.0;
            }
        }
        let freedom = self.freedom[kind] - count;
        if !is_enough(freedom) {
            return 1.0;
        }
        let least = INVERSE_ROUNDING * self.largest[kind].powi(2);
        let of_others = ((self.freedom[kind] * variance - squares) / freedom).max(least);
        f_p(squares / of_others, count, freedom)
    }

    /// Returns the factor on the standard deviation of each of the [ten values](tactid_identify::VALUE_NAMES)
    /// that makes 1.96 of them an interval of Student's t, given the parameters of the payload.
    pub(super) fn t_factors(&self, parameters: &Vector) -> [f64; 10] {
        let Some(jacobian) = value_jacobian(parameters) else {
            return [1.0; 10];
        };
        std::array::from_fn(|k| self.t_factor(self.shares(&jacobian.row(k).into())))
    }

    /// Returns the parts of the variance of a quantity that each kind of channels has, given its
    /// derivatives.
    fn shares(&self, gradient: &RowSVector<f64, 10>) -> [f64; 2] {
        let along = self.inverse.covariance * gradient.transpose();
        self.of_kinds.map(|kind| (kind * along).dot(&along))
    }

    /// Returns the standard deviation of a quantity with these derivatives with respect to
    /// parameters and angles, widened as those of the values; infinite where the poses do not
    /// determine it.
    pub(super) fn std_dev(&self, gradient: &RowSVector<f64, 10>) -> f64 {
        let PseudoInverse {
            covariance,
            null_space,
        } = &self.inverse;
        std_dev(gradient, covariance, null_space) * self.t_factor(self.shares(gradient))
    }

    /// Returns the [standard deviation](Self::std_dev) of each of the ten values; infinite for a
    /// mass of zero.
    pub(super) fn value_std_devs(&self) -> [f64; 10] {
        value_jacobian(&self.parameters).map_or([f64::INFINITY; 10], |slopes| {
            std::array::from_fn(|k| self.std_dev(&slopes.row(k).into()))
        })
    }

    /// Returns the standard deviation of each offset, widened as those of the values; infinite
    /// where the poses do not distinguish the offset from the payload.
    pub(super) fn offset_std_devs(&self) -> [f64; WRENCH] {
        std::array::from_fn(|channel| {
            let gradient: RowSVector<f64, 10> = self.means[channel].regressor.transpose();
            let PseudoInverse {
                covariance,
                null_space,
            } = &self.inverse;
            let of_unknowns = std_dev(&gradient, covariance, null_space);
            if self.measured[channel] == 0.0 {
                return f64::INFINITY;
            }
            let kind = channel / 3;
            let of_mean = self.noise[kind].powi(2) / self.poses as f64;
            let mut shares = self.shares(&gradient);
            shares[kind] += of_mean;
            of_unknowns.hypot(of_mean.sqrt()) * self.t_factor(shares)
        })
    }

    /// Returns the factor for a quantity whose variance is the sum of `shares`, one of each kind of
    /// channels: the degrees of freedom of the sum are those of Satterthwaite (1946, doi
    /// 10.2307/3002019).
    fn t_factor(&self, shares: [f64; 2]) -> f64 {
        let whole: f64 = shares.iter().sum();
        let squares = shares.iter().zip(self.freedom);
        let squares: f64 = squares
            .map(|(share, freedom)| share * share / freedom.max(0.5))
            .sum();
        if squares <= 0.0 {
            return 1.0;
        }
        students_factor(whole * whole / squares)
    }

    /// Returns how strongly the poses excite each direction of the parameters.
    pub(super) fn excitation(&self) -> Excitation {
        Spectrum::new(normalized(&self.information)).excitation()
    }

    /// Returns the information of the parameters with the regressors of one more pose.
    pub(super) fn information_with(&self, rows: &[Vector; WRENCH]) -> Matrix {
        let poses = self.poses as f64;
        let share = if self.has_offset {
            poses / (poses + 1.0)
        } else {
            1.0
        };
        let parts = rows.iter().zip(&self.means).enumerate();
        let added: Matrix = parts
            .map(|(channel, (row, mean))| {
                let column = row - mean.regressor;
                let weight = self.measured[channel] * self.noise[channel / 3].powi(-2);
                column * column.transpose() * (share * weight)
            })
            .sum();
        without_angles(&(self.of_kinds[0] + self.of_kinds[1] + added))
    }
}

/// Returns the information of the parameters alone: that of parameters and angles, the angles
/// eliminated.
fn without_angles(information: &Matrix) -> Matrix {
    let (first, count) = (ANGLES[0], ANGLES.len());
    let of_angles: Matrix2<f64> = information.fixed_view::<2, 2>(first, first).into();
    let crossed = information.fixed_columns::<2>(first).into_owned();
    let size = of_angles.trace();
    let inverse = of_angles.pseudo_inverse(EIGENVALUE_RATIO * size);
    let mut alone = information - crossed * inverse.unwrap_or_default() * crossed.transpose();
    alone.rows_mut(first, count).fill(0.0);
    alone.columns_mut(first, count).fill(0.0);
    alone
}

/// Returns whether these degrees of freedom tell an error from noise: those of a pose, but for the
/// shares of the parameters that both kinds of channels determine.
fn is_enough(freedom: f64) -> bool {
    freedom > WRENCH as f64 - 0.5
}
