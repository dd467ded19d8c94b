//! Least squares over poses at rest, with the noise between them.

use nalgebra::{RowSVector, Vector6};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::Rows;
use crate::equations::{Row, WRENCH};
use crate::fit::CONVERGED_ENOUGH;
use crate::fit::least_squares::MAX_PASSES;
use crate::solve::noise::ZERO_SIZE;
use crate::solve::pseudo_inverse::{PseudoInverse, normalized, pseudo_inverse};
use crate::solve::spectrum::{Excitation, Spectrum};
use crate::solve::subspace::{LEVER_ARM_M, Matrix, NullSpace, Vector};
use crate::solve::uncertainty::{HALF_WIDTH_95, std_dev, value_jacobian};

/// The two kinds of channels: forces, then moments.
const CHANNEL_KINDS: [std::ops::Range<usize>; 2] = [0..3, 3..WRENCH];

/// The parameters that explain poses at rest best, with what the poses say about their noise.
#[derive(Clone, Debug)]
pub(super) struct RestFit {
    /// Parameters of the whole load.
    pub(super) parameters: Vector,
    /// Covariance of the parameters. What it contains in unobservable directions does not count.
    pub(super) covariance: Matrix,
    /// Information of the parameters, the offsets eliminated.
    pub(super) information: Matrix,
    /// Part of the information that each kind of channels has.
    of_kinds: [Matrix; 2],
    /// The unobservable directions.
    pub(super) null_space: NullSpace,
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
}

impl RestFit {
    /// Fits the parameters, and an offset of each channel if there is one. `measured` is one for
    /// each channel that is measured, and zero for others, whose rows are zero.
    pub(super) fn new(rows: &[Rows], has_offset: bool, measured: &Vector6<f64>) -> Self {
        let means = if has_offset {
            means(rows)
        } else {
            [Row::zero(); WRENCH]
        };
        let centred: Vec<Rows> = rows.iter().map(|rows| less(rows, &means)).collect();
        let grams = CHANNEL_KINDS.map(|kind| {
            let rows = centred.iter().flat_map(|rows| &rows[kind.clone()]);
            rows.fold(
                (Matrix::zeros(), Vector::zeros()),
                |(square, target), row| {
                    let column = row.regressor;
                    (
                        square + column * column.transpose(),
                        target + column * row.target,
                    )
                },
            )
        });
        let floors = CHANNEL_KINDS.map(|kind| {
            let targets = rows.iter().flat_map(|rows| &rows[kind.clone()]);
            let sizes = targets.map(|row| row.target.abs());
            f64::EPSILON * sizes.fold(ZERO_SIZE, f64::max)
        });
        let mut fit = Self {
            parameters: Vector::zeros(),
            covariance: Matrix::zeros(),
            information: Matrix::zeros(),
            of_kinds: [Matrix::zeros(); 2],
            null_space: NullSpace::new(Vector::repeat(1.0), std::iter::empty()),
            noise: [1.0; 2],
            freedom: [0.0; 2],
            offsets: Vector6::zeros(),
            means,
            has_offset,
            measured: *measured,
            poses: rows.len(),
        };
        for _ in 0..MAX_PASSES {
            let before = fit.noise;
            fit.solve(&grams);
            fit.update_noise(&centred, &floors);
            let changed =
                |k: usize| (fit.noise[k] - before[k]).abs() > CONVERGED_ENOUGH * before[k];
            if !(changed(0) || changed(1)) {
                break;
            }
        }
        fit.solve(&grams);
        fit.add_unobservable_shares();
        fit.offsets = Vector6::from_fn(|channel, _| {
            let mean = &fit.means[channel];
            mean.target - mean.regressor.dot(&fit.parameters)
        });
        fit
    }

    /// Solves for the parameters with the present noise.
    fn solve(&mut self, grams: &[(Matrix, Vector); 2]) {
        let mut target = Vector::zeros();
        for (kind, (square, product)) in grams.iter().enumerate() {
            let weight = self.noise[kind].powi(-2);
            self.of_kinds[kind] = square * weight;
            target += product * weight;
        }
        self.information = self.of_kinds[0] + self.of_kinds[1];
        let PseudoInverse {
            covariance,
            null_space,
        } = pseudo_inverse(&self.information);
        self.parameters = covariance * target;
        self.covariance = covariance;
        self.null_space = null_space;
    }

    /// Adds what the centre of mass in an unobservable direction may change in values that count as determined across it: two
    /// attitudes determine an axis of the centre of mass but for a small share of another one, which may be as far away as
    /// [`LEVER_ARM_M`].
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

    /// Estimates the noise of each kind from its residuals, whose degrees of freedom are their number less the unknowns that
    /// they determine.
    fn update_noise(&mut self, centred: &[Rows], floors: &[f64; 2]) {
        for (k, kind) in CHANNEL_KINDS.into_iter().enumerate() {
            let rows = centred.iter().flat_map(|rows| &rows[kind.clone()]);
            let squares =
                rows.map(|row| (row.target - row.regressor.dot(&self.parameters)).powi(2));
            let channels: f64 = kind.clone().map(|channel| self.measured[channel]).sum();
            let count = (self.poses - usize::from(self.has_offset)) as f64 * channels;
            self.freedom[k] = if channels > 0.0 {
                count - (self.covariance * self.of_kinds[k]).trace()
            } else {
                f64::INFINITY
            };
            let variance = squares.sum::<f64>() / self.freedom[k].max(1.0);
            self.noise[k] = variance.sqrt().max(floors[k]);
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
        row.target - row.regressor.dot(&self.parameters) - self.offsets[channel]
    }

    /// Returns the factor on the standard deviation of each of the [ten values](crate::VALUE_NAMES) that makes 1.96 of them an
    /// interval of Student's t, given the parameters of the payload.
    pub(super) fn t_factors(&self, parameters: &Vector) -> [f64; 10] {
        let Some(jacobian) = value_jacobian(parameters) else {
            return [1.0; 10];
        };
        std::array::from_fn(|k| {
            let along = self.covariance * jacobian.row(k).transpose();
            self.t_factor(self.of_kinds.map(|kind| (kind * along).dot(&along)))
        })
    }

    /// Returns the standard deviation of each offset, widened as those of the values; infinite where the poses do not
    /// distinguish the offset from the payload.
    pub(super) fn offset_std_devs(&self) -> [f64; WRENCH] {
        std::array::from_fn(|channel| {
            let gradient: RowSVector<f64, 10> = self.means[channel].regressor.transpose();
            let of_parameters = std_dev(&gradient, &self.covariance, &self.null_space);
            let kind = channel / 3;
            let of_mean = self.noise[kind].powi(2) / self.poses as f64;
            let along = self.covariance * gradient.transpose();
            let mut shares = self.of_kinds.map(|kind| (kind * along).dot(&along));
            shares[kind] += of_mean;
            of_parameters.hypot(of_mean.sqrt()) * self.t_factor(shares)
        })
    }

    /// Returns the factor for a quantity whose variance is the sum of `shares`, one of each kind of channels: the degrees of freedom of the sum
    /// are those of Satterthwaite (1946, doi 10.2307/3002019).
    fn t_factor(&self, shares: [f64; 2]) -> f64 {
        let whole: f64 = shares.iter().sum();
        let squares = shares.iter().zip(self.freedom);
        let squares: f64 = squares
            .map(|(share, freedom)| share * share / freedom.max(0.5))
            .sum();
        if squares <= 0.0 {
            return 1.0;
        }
        let freedom = whole * whole / squares;
        let below = Normal::standard().cdf(HALF_WIDTH_95);
        let student = StudentsT::new(0.0, 1.0, freedom);
        student.map_or(f64::INFINITY, |student| {
            student.inverse_cdf(below) / HALF_WIDTH_95
        })
    }

    /// Returns how strongly the poses excite each direction of the parameters.
    pub(super) fn excitation(&self) -> Excitation {
        Spectrum::new(normalized(&self.information)).excitation()
    }

    /// Returns the information that rows of one more pose add, in which the offsets are eliminated again.
    pub(super) fn information_of(&self, rows: &[Vector; WRENCH]) -> Matrix {
        let poses = self.poses as f64;
        let share = if self.has_offset {
            poses / (poses + 1.0)
        } else {
            1.0
        };
        let parts = rows.iter().zip(&self.means).enumerate();
        parts
            .map(|(channel, (row, mean))| {
                let column = row - mean.regressor;
                let weight = self.measured[channel] * self.noise[channel / 3].powi(-2);
                column * column.transpose() * (share * weight)
            })
            .sum()
    }
}

/// Returns the mean row of each channel.
fn means(rows: &[Rows]) -> [Row; WRENCH] {
    let mut means = [Row::zero(); WRENCH];
    for pose in rows {
        for (mean, row) in means.iter_mut().zip(pose) {
            mean.add(row, 1.0 / rows.len() as f64);
        }
    }
    means
}

/// Returns rows less the mean row of each channel.
fn less(rows: &Rows, means: &[Row; WRENCH]) -> Rows {
    let mut rows = *rows;
    for (row, mean) in rows.iter_mut().zip(means) {
        row.add(mean, -1.0);
    }
    rows
}
