//! Observable and unobservable directions of the ten parameters.
//!
//! A motion may leave directions of the parameters unobservable: the null space of the regressor.
//! Every least-squares solver describes it by one type, [`NullSpace`], and by the thresholds of
//! this file.
//!
//! # When a direction counts as unobservable
//!
//! | information | unobservable where it is | reason |
//! |---|---|---|
//! | eigenvalue, batch (`Spectrum` of `tactid-batch`) | at most [`EIGENVALUE_RATIO`] of the largest, in scaled parameters, before the bias correction | below, the entries of the Gram matrix are rounding |
//! | | at most [`LEAST_SIGNAL`] of the noise of the motion in it, or at most [`CHANCE`] times the scatter of that noise's power | noise alone excites it: its estimate would be biased, and noise of any size |
//! | column and pivot, online ([`Information`](super::information::Information)) | as little as that | the same |
//! | pivot, online | at most [`PIVOT_ROUNDING`] of the information of the rows on the parameter alone | below, the subtraction of the other parameters leaves rounding |
//! | | so little that the parameter would be larger than is plausible from noise alone | its estimate would be noise of any size |
//!
//! Both move the parameters only along observable directions, and for each unobservable one they
//! hold one parameter.
//!
//! A derived quantity is unobservable where more than [`QUANTITY_FRACTION`] of its squared gradient
//! lies in the null space. The fraction is not zero, because the directions are computed from noisy
//! rows and no quantity lies exactly across them. A covariance matrix has no variance in
//! unobservable directions; where only the covariance is at hand, directions with variances up to
//! [`VARIANCE_RATIO`] of the largest count as unobservable (see
//! [`consistency`](super::consistency)).
//!
//! The paper's filter has no information matrix. It compares the singular values of the rows with
//! thresholds of its own, which are documented there.

use nalgebra::{RowSVector, SMatrix, SVector};

use crate::equations::window::PRODUCT_CORRELATION;
use crate::result::KINDS;

/// A 10x10 matrix over the parameters.
pub type Matrix = SMatrix<f64, 10, 10>;
/// A vector of the ten parameters, in the order of
/// [`InertialParameters`](tactid_dynamics::InertialParameters).
pub type Vector = SVector<f64, 10>;

/// Ratio to the largest eigenvalue: the square of 1e-5, the ratio of singular values of the rows.
pub const EIGENVALUE_RATIO: f64 = 1e-5 * 1e-5;

/// Least information of a direction without the noise of the motion, relative to that of the noise.
/// What the half-differences show of noise that is not white is wrong by up to 7 %: that of derived
/// accelerations at 500 Hz.
pub(crate) const LEAST_SIGNAL: f64 = 0.1;

/// Fraction of the information on a parameter alone, the others known.
pub(crate) const PIVOT_ROUNDING: f64 = 1e-10;

/// Fraction of a quantity's squared gradient in scaled parameters.
pub const QUANTITY_FRACTION: f64 = 1e-3;

/// Ratio to the largest variance in scaled parameters.
pub const VARIANCE_RATIO: f64 = 1e-13;

/// Standard deviations of an information that noise alone may leave in a direction by chance.
const CHANCE: f64 = 4.0;

/// Returns the information without noise, relative to what the noise of the motion has added, up to
/// which noise alone may excite a direction over so many windows, where it already excites `others`
/// directions with less.
///
/// Noise in rows and in half-differences has the same power, and its difference over `n`
/// independent windows of one channel has the standard deviation `2 / √n` of it. The largest
/// difference of `k` directions is chosen from all combinations of them and exceeds zero by `√(2k)`
/// standard deviations (the edge of the spectrum of an F matrix to first order in `k / n`; Wachter
/// 1980, Annals of Statistics 8, 937).
pub fn least_signal(windows: usize, others: usize) -> f64 {
    let independent = windows.max(1) as f64 / PRODUCT_CORRELATION;
    let chance = (CHANCE + (2.0 * others as f64).sqrt()) * 2.0 / independent.sqrt();
    chance.max(LEAST_SIGNAL)
}

/// Returns the [`least_signal`] of a column, given the information of each column alone without
/// noise and that of its noise: the number of columns with less counts as that of directions.
///
/// A column with no more is noise alone. What it has in common with other columns is chance, too,
/// and its parameter may be of any size, so that it is held, and nothing of it moves the others.
pub fn least_signal_of_columns(signals: &[f64], noises: &[f64], windows: usize) -> f64 {
    let least = least_signal(windows, 0);
    let columns = signals.iter().zip(noises);
    let of_noise = columns.filter(|(signal, noise)| **signal <= least * **noise);
    least_signal(windows, of_noise.count())
}

/// Returns whether a direction with this pivot of the corrected information is observable.
/// `of_noise` is the information that noise alone may leave there, `alone` the information of the
/// rows on the parameter alone, and `plausible` the largest size of a parameter that can be
/// expected, in units in which `alone` is one.
pub(crate) fn is_observable_pivot(pivot: f64, of_noise: f64, alone: f64, plausible: f64) -> bool {
    pivot > of_noise.max(PIVOT_ROUNDING.max(plausible.powi(-2)) * alone)
}

/// Lever arm that decides between mass and inertia, m. The columns of rigid motion have lengths in
/// the ratio of a lever arm: mass to first moments, and first moments to inertia. Where both ratios
/// differ, rounding fills the mass or the inertia, and what the mass and the inertia show together
/// is far above this arm or far below it.
pub const LEVER_ARM_M: f64 = 1.0;

/// Returns the lengths of the columns of the parameters, at least `least` of what is usual for
/// their kind (mass, first moments, inertia). The result depends on units by [`LEVER_ARM_M`] alone.
/// Lengths may be infinite.
///
/// Usual is the largest length of the kind, or that which continues those of the other two kinds,
/// which differ by a lever arm each: a kind that only rounding excites has no column of usual
/// length. Where only one kind has rows, no row shows a lever arm, and any length will do for the
/// others.
pub fn bounded_lengths(lengths: &Vector, least: f64) -> Vector {
    let [mass, first, second] = KINDS.map(|kind| {
        let of_kind = lengths.as_slice()[kind].iter();
        of_kind.fold(0.0, |a, &b| f64::max(a, b))
    });
    let between = first.max(mass.sqrt() * second.sqrt());
    let over = |length: f64, by: f64| if by > 0.0 { length / by } else { 0.0 };
    let usual = if mass.sqrt() > LEVER_ARM_M * second.sqrt() {
        [mass, between, second.max(first * over(first, mass))]
    } else {
        [mass.max(first * over(first, second)), between, second]
    };
    let any = mass + first + second;
    let any = if any > 0.0 { any } else { 1.0 };
    let mut bounded = *lengths;
    for (kind, usual) in KINDS.into_iter().zip(usual) {
        let bound = least * if usual > 0.0 { usual } else { any };
        for length in &mut bounded.as_mut_slice()[kind] {
            *length = length.max(bound);
        }
    }
    bounded
}

/// The unobservable directions: the null space of the regressor, within the thresholds of this
/// module.
#[derive(Clone, Copy, Debug)]
pub struct NullSpace {
    /// Unit of each scaled parameter, in the parameter's unit: the parameters divided by their
    /// scales have standard deviations of similar size.
    scales: Vector,
    /// Unit vectors in scaled parameters, of which the first `dimension` are valid.
    directions: [Vector; 10],
    dimension: usize,
    /// Covariance of what the parameters may be in these directions, zero where nothing is known of
    /// it.
    hidden: Matrix,
}

impl NullSpace {
    /// Creates the null space that unit vectors in scaled parameters span, at most ten.
    pub fn new(scales: Vector, directions: impl Iterator<Item = Vector>) -> Self {
        let mut places = [Vector::zeros(); 10];
        let pairs = places.iter_mut().zip(directions);
        let dimension = pairs.map(|(place, direction)| *place = direction).count();
        Self {
            scales,
            directions: places,
            dimension,
            hidden: Matrix::zeros(),
        }
    }

    /// Returns the null space with what the parameters of a payload of this mass, kg, may be in its
    /// directions. `reach_m` is how far its parts may be from the origin of the tool frame, and
    /// `extents` are the largest steps along the directions that the rows admit, in scaled
    /// parameters.
    ///
    /// A quantity that is not quite across a direction is as uncertain as that: at rest in one
    /// attitude, a centre of mass somewhere on a vertical line is elsewhere across an axis of the
    /// tool that is not quite horizontal.
    pub fn with_extents(
        mut self,
        mass_kg: f64,
        reach_m: f64,
        extents: impl Iterator<Item = f64>,
    ) -> Self {
        if mass_kg == 0.0 {
            return self;
        }
        let mut units = Vector::repeat(mass_kg.abs());
        for (kind, size) in KINDS.into_iter().zip([1.0, reach_m, reach_m * reach_m]) {
            units.as_mut_slice()[kind]
                .iter_mut()
                .for_each(|unit| *unit *= size);
        }
        let mut steps = [Vector::zeros(); 10];
        for (place, extent) in (0..self.dimension).zip(extents) {
            let direction = self.directions[place].component_mul(&self.scales);
            // Of the largest steps to plausible parameters, those that are independent.
            let mut step = direction.component_div(&units);
            for before in &steps[..place] {
                step.axpy(-before.dot(&step), before, 1.0);
            }
            // A direction of further unknowns alone changes no parameter.
            steps[place] = step.try_normalize(0.0).unwrap_or_default();
            let step = steps[place].component_mul(&units);
            let length = step.component_div(&self.scales).norm();
            let step = step * (extent / length.max(f64::MIN_POSITIVE)).min(1.0);
            self.hidden.ger(1.0, &step, &step, 1.0);
        }
        self
    }

    /// Covariance of what the parameters may be in the unobservable directions, as far as something
    /// is known of it.
    pub(crate) fn hidden(&self) -> &Matrix {
        &self.hidden
    }

    /// Unit of each scaled parameter, in the parameter's unit.
    pub fn scales(&self) -> &Vector {
        &self.scales
    }

    /// Unit vectors in scaled parameters that span the null space.
    pub fn directions(&self) -> &[Vector] {
        &self.directions[..self.dimension]
    }

    /// Returns a covariance without its share in the unobservable directions, as that of known
    /// bodies has one: a projection onto consistent parameters moves freely in them.
    pub fn across(&self, covariance: &Matrix) -> Matrix {
        let units = self.scales * self.scales.transpose();
        let mut scaled = covariance.component_div(&units);
        for direction in self.directions() {
            scaled -= direction * (direction.transpose() * scaled);
            scaled -= (scaled * direction) * direction.transpose();
        }
        scaled.component_mul(&units)
    }

    /// Returns whether the observable directions determine a quantity with this gradient in the
    /// parameters.
    pub fn determines(&self, gradient: &RowSVector<f64, 10>) -> bool {
        let scaled = gradient.component_mul(&self.scales.transpose());
        let directions = self.directions().iter();
        let unobservable: f64 = directions
            .map(|direction| (scaled * direction)[0].powi(2))
            .sum();
        unobservable <= QUANTITY_FRACTION * scaled.norm_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quantity is determined where its gradient lies across the null space, in scaled
    /// parameters, and is not where a percent of its square lies in it.
    #[test]
    fn quantities_across_the_null_space_are_determined() {
        let scales = Vector::from_fn(|k, _| 10f64.powi(k as i32 % 3));
        let direction = (Vector::ith(0, 1.0) + Vector::ith(1, 1.0)).normalize();
        let null_space = NullSpace::new(scales, [direction].into_iter());
        assert_eq!(null_space.directions(), [direction]);
        let gradient = |first: f64| {
            let scaled = Vector::ith(0, 1.0) - Vector::ith(1, 1.0) + direction * first;
            scaled.component_div(&scales).transpose()
        };
        assert!(null_space.determines(&gradient(0.0)));
        assert!(null_space.determines(&gradient(0.01)));
        assert!(!null_space.determines(&gradient(0.15)));
    }

    /// The thresholds of pivots are the largest of the three.
    #[test]
    fn a_pivot_must_exceed_every_threshold() {
        assert!(is_observable_pivot(1e-30, 1e-31, 1e-30, f64::INFINITY));
        assert!(!is_observable_pivot(0.0, 0.0, 0.0, f64::INFINITY));
        assert!(is_observable_pivot(0.2, 0.1, 1.0, f64::INFINITY));
        assert!(!is_observable_pivot(0.05, 0.1, 1.0, f64::INFINITY));
        assert!(!is_observable_pivot(0.2, 0.1, 1e10, f64::INFINITY));
        // From noise alone the parameter would be up to four units large.
        assert!(is_observable_pivot(0.2, 0.1, 1.0, 4.0));
        assert!(!is_observable_pivot(0.2, 0.1, 1.0, 2.0));
    }

    /// A kind of parameters without rows has a length that scales with units like its own, and so
    /// do bounds within a kind.
    #[test]
    fn lengths_without_rows_have_the_unit_of_their_kind() {
        for without in [0..1, 1..4, 4..10, 3..9] {
            for scale in [1e-9, 1.0, 1e9] {
                let of_kinds = [1.0, 4.0 * scale, 16.0 * scale * scale];
                let mut lengths = Vector::zeros();
                for (kind, length) in KINDS.into_iter().zip(of_kinds) {
                    kind.for_each(|k| lengths[k] = length);
                }
                let mut missing = lengths;
                without.clone().for_each(|k| missing[k] = 0.0);
                let found = bounded_lengths(&missing, 1e-3);
                for k in 0..10 {
                    let factor = if without.contains(&k) { 1e-3 } else { 1.0 };
                    assert!(
                        (found[k] / (factor * lengths[k]) - 1.0).abs() < 1e-12,
                        "{k}"
                    );
                }
            }
        }
        assert_eq!(bounded_lengths(&Vector::zeros(), 0.5), Vector::repeat(0.5));
        let infinite = Vector::from_fn(|k, _| if k < 2 { f64::INFINITY } else { 0.0 });
        assert_eq!(
            bounded_lengths(&infinite, 0.5),
            Vector::repeat(f64::INFINITY)
        );
    }

    /// With many windows a tenth of the noise is more than its scatter, with few it is less; other
    /// directions that noise alone excites raise the limit.
    #[test]
    fn signal_exceeds_the_scatter_of_noise() {
        assert_eq!(least_signal(1_000_000, 0), LEAST_SIGNAL);
        let std_dev = 2.0 / (25.0 / PRODUCT_CORRELATION).sqrt();
        assert!((least_signal(25, 0) - 4.0 * std_dev).abs() < 1e-9);
        assert!((least_signal(25, 8) - 8.0 * std_dev).abs() < 1e-9);
    }
}
