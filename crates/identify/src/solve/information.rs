//! The information of the rows without the noise of the motion, factorised by pivots, without
//! allocation.

use super::subspace::{Matrix, NullSpace, Vector, is_observable_pivot, least_signal_of_columns};
use crate::result::KINDS;

/// The corrected information `A - N = Uᵀ D U`. `A` is the information of the rows, and `N` its part
/// that is noise of the motion: the errors-in-variables bias correction.
///
/// The parameters are eliminated one after another: a pivot is the information on a parameter that
/// the previous ones leave. Where a pivot is unobservable, its parameter keeps its value in
/// [`solve`](Self::solve), and the others are solved for given this value.
///
/// - A parameter whose column of the rows is noise alone keeps its value first of all, and its
///   products with other columns count as zero: they are chance, and the parameter may be of any
///   size. An arm that holds still would otherwise take inertias of 1000 kg m², which it does not
///   show, into its mass.
/// - The other parameters are eliminated kind by kind, each time the one with the largest pivot of
///   its kind. One that keeps its value is then the largest of its kind in its direction, so that
///   the others do not have to be larger to make up for it, and multiply the noise of the motion.
///   Of the first moments of an arm that holds still it is the one that is nearest to the vertical.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Information {
    /// `A - N`, in which columns and rows of noise alone are zero.
    difference: Matrix,
    /// `D⁻¹`; zero for an unobservable direction.
    inverse: Vector,
    /// The columns of `U⁻¹`. In the order of elimination `U` is triangular, with a diagonal of
    /// ones.
    directions: Matrix,
}

impl Information {
    /// Factorises from the triangular factor of the rows of so many windows, `A = RᵀR`, and `N`.
    /// Cost: some 1500 multiplications.
    ///
    /// `plausible` is the largest size of a parameter that can be expected, in units that make the
    /// columns of `R` of length one.
    pub(crate) fn new(root: &Matrix, noise: &Matrix, windows: usize, plausible: f64) -> Self {
        let rows = root.transpose() * root;
        let mut difference = rows - noise;
        let (signals, noises) = (difference.diagonal(), noise.diagonal());
        let least = least_signal_of_columns(signals.as_slice(), noises.as_slice(), windows);
        for k in (0..10).filter(|&k| signals[k] <= least * noises[k]) {
            difference.row_mut(k).fill(0.0);
            difference.column_mut(k).fill(0.0);
        }
        let noise_sizes = noises.map(|square| square.max(0.0).sqrt());
        let mut rest = difference;
        let mut inverse = Vector::zeros();
        let mut directions = Matrix::identity();
        let mut is_open = [true; 10];
        for kind in KINDS {
            for _ in kind.clone() {
                let open = kind.clone().filter(|&k| is_open[k]);
                let larger = |a: usize, b: usize| if rest[(b, b)] > rest[(a, a)] { b } else { a };
                let Some(j) = open.reduce(larger) else { break };
                is_open[j] = false;
                let column = rest.column(j).into_owned();
                let direction = directions.column(j).into_owned();
                // An upper limit of the noise in the direction, which is far below the pivot where
                // the motion excites it.
                let limit = direction.abs().dot(&noise_sizes).powi(2);
                let of_noise = if column[j] > least * limit {
                    0.0
                } else {
                    least * (noise * direction).dot(&direction)
                };
                if !is_observable_pivot(column[j], of_noise, rows[(j, j)], plausible) {
                    continue;
                }
                inverse[j] = column[j].recip();
                for i in (0..10).filter(|&i| is_open[i]) {
                    let factor = column[i] * inverse[j];
                    // Rows of parameters that are eliminated are not read again.
                    rest.column_mut(i).axpy(-factor, &column, 1.0);
                    directions.column_mut(i).axpy(-factor, &direction, 1.0);
                }
            }
        }
        Self {
            difference,
            inverse,
            directions,
        }
    }

    /// Returns the information of no rows: every direction is unobservable.
    pub(crate) fn none() -> Self {
        Self {
            difference: Matrix::zeros(),
            inverse: Vector::zeros(),
            directions: Matrix::identity(),
        }
    }

    /// Returns `(A - N)⁻¹ v` in the observable directions.
    pub(crate) fn solve(&self, vector: &Vector) -> Vector {
        let along = self.directions.tr_mul(vector);
        self.directions * along.component_mul(&self.inverse)
    }

    /// Whether every direction is observable.
    pub(crate) fn is_complete(&self) -> bool {
        self.inverse.iter().all(|inverse| *inverse > 0.0)
    }

    /// Returns the sandwich `(A - N)⁻¹ S (A - N)⁻¹` of a symmetric score covariance `S`, in the
    /// observable directions.
    pub(crate) fn sandwich(&self, scores: &Matrix) -> Matrix {
        let mut scaled = self.directions;
        for (mut column, inverse) in scaled.column_iter_mut().zip(&self.inverse) {
            column *= *inverse;
        }
        let inverse = scaled * self.directions.transpose();
        inverse * scores * inverse
    }

    /// Returns `A - N`, in which each unobservable direction has the information that `prior` has
    /// of the parameter that keeps its value: positive definite.
    ///
    /// Its inverse is that of `A - N` among the other parameters, plus `d dᵀ / prior` for each
    /// [direction](Self::unobservable) `d`.
    pub(crate) fn matrix(&self, prior: &Vector) -> Matrix {
        let mut matrix = self.difference;
        for (k, direction) in self.unobservable() {
            let explained = self.difference * (Vector::ith(k, 1.0) - direction);
            for i in (0..10).filter(|&i| self.inverse[i] == 0.0) {
                matrix[(i, k)] = explained[i];
            }
            matrix[(k, k)] += prior[k];
        }
        matrix
    }

    /// The unobservable directions of the parameters, whose units are `scales`.
    pub(crate) fn null_space(&self, scales: Vector) -> NullSpace {
        let directions = self.unobservable().map(|(_, direction)| direction);
        let scaled = directions.map(|direction| direction.component_div(&scales).normalize());
        NullSpace::new(scales, scaled)
    }

    /// The unobservable directions: the index of a parameter that keeps its value in
    /// [`solve`](Self::solve), and the change of all parameters for a unit of it, the others being
    /// solved for again.
    pub(crate) fn unobservable(&self) -> impl Iterator<Item = (usize, Vector)> + Clone + '_ {
        let indices = (0..10).filter(|&k| self.inverse[k] == 0.0);
        indices.map(|k| {
            let coupling = self.difference.column(k).into_owned();
            (k, Vector::ith(k, 1.0) - self.solve(&coupling))
        })
    }
}

/// Returns `U⁻¹` of an upper triangular matrix without zeros on its diagonal.
pub(crate) fn inverse_of_upper(upper: &Matrix) -> Matrix {
    let mut inverse = Matrix::identity();
    for j in 0..10 {
        let mut column = Vector::ith(j, 1.0);
        for i in 0..j {
            column.axpy(-upper[(i, j)], &inverse.column(i), 1.0);
        }
        inverse.set_column(j, &(column * upper[(j, j)].recip()));
    }
    inverse
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, Vector3};
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::solve::subspace::LEAST_SIGNAL;

    /// So many that chance is no more than a tenth of the noise.
    const WINDOWS: usize = 1_000_000;

    /// The Gram matrix of forty random rows.
    fn random(random: &mut SmallRng) -> Matrix {
        let rows = SMatrix::<f64, 40, 10>::from_fn(|_, _| random.random_range(-1.0..1.0));
        rows.tr_mul(&rows)
    }

    /// The triangular factor of random rows with columns of very different size, and the
    /// information of their noise, a `fraction` of that of the motion.
    fn rows_and_noise(seed: u64, fraction: f64) -> (Matrix, Matrix) {
        let mut generator = SmallRng::seed_from_u64(seed);
        let scales = Vector::from_fn(|k, _| 10f64.powi(k as i32 % 4 * 2));
        let scales = Matrix::from_diagonal(&scales);
        let noise = scales * random(&mut generator) * scales * fraction;
        let all = scales * random(&mut generator) * scales + noise;
        (all.cholesky().unwrap().l().transpose(), noise)
    }

    /// Where every direction is observable, the result is the plain inverse for columns of any
    /// size.
    #[test]
    fn solves_without_the_noise() {
        for seed in 0..50 {
            let (root, noise) = rows_and_noise(seed, 0.1);
            let information = Information::new(&root, &noise, WINDOWS, f64::INFINITY);
            assert_eq!(information.unobservable().count(), 0);
            let matrix = root.tr_mul(&root) - noise;
            let expected = Vector::from_fn(|k, _| (k as f64).sin());
            let found = information.solve(&(matrix * expected));
            assert!((found - expected).norm() < 1e-5, "{found}");
            assert!((information.matrix(&Vector::zeros()) - matrix).norm() < 1e-9 * matrix.norm());
            let covariance = information.sandwich(&matrix);
            let unit = covariance * matrix;
            assert!((unit - Matrix::identity()).norm() < 1e-3, "{unit}");
        }
    }

    /// A direction without rows is found exactly, and the parameters across it are determined.
    /// Where a direction is all noise, the direction found is nearly so.
    #[test]
    fn finds_the_unobservable_direction() {
        for seed in 0..50 {
            let mut generator = SmallRng::seed_from_u64(seed);
            let direction = Vector::from_fn(|_, _| generator.random_range(-1.0..1.0)).normalize();
            let without = Matrix::identity() - direction * direction.transpose();
            let rows = without * random(&mut generator) * without;
            for noise in [0.0, 1.0] {
                let noise = direction * direction.transpose() * noise;
                let all = rows + noise + Matrix::identity() * 1e-12;
                let root = all.cholesky().unwrap().l().transpose();
                let information = Information::new(&root, &noise, WINDOWS, f64::INFINITY);
                let unobservable: Vec<Vector> = information
                    .unobservable()
                    .map(|(_, direction)| direction)
                    .collect();
                assert_eq!(unobservable.len(), 1);
                let found = unobservable[0].normalize();
                let signal = (rows * found).dot(&found);
                let whole = (all * found).dot(&found);
                assert!(signal <= LEAST_SIGNAL * whole, "{signal} of {whole}");
                if noise == Matrix::zeros() {
                    assert!(found.dot(&direction).abs() > 1.0 - 1e-6, "{found}");
                    let truth = Vector::from_fn(|k, _| k as f64);
                    let error = information.solve(&(rows * truth)) - truth;
                    let across = error - direction * direction.dot(&error);
                    assert!(across.norm() < 1e-4, "{across}");
                }
            }
        }
    }

    /// A column of noise that has products with another one by chance leaves the latter's solution
    /// and direction as they are.
    #[test]
    fn noise_that_is_coupled_by_chance_moves_nothing() {
        let mut rows = Matrix::identity();
        (rows[(0, 9)], rows[(9, 0)]) = (0.1, 0.1);
        let noise = Matrix::from_diagonal(&Vector::ith(9, 0.95));
        let root = rows.cholesky().unwrap().l().transpose();
        let information = Information::new(&root, &noise, 50, f64::INFINITY);
        let found: Vec<_> = information.unobservable().collect();
        assert_eq!(found, [(9, Vector::ith(9, 1.0))]);
        let solution = information.solve(&(rows * Vector::ith(0, 1e4)));
        assert!((solution - Vector::ith(0, 1e4)).amax() < 1e-6, "{solution}");
        let prior = Vector::repeat(1e-6);
        assert_eq!(information.matrix(&prior)[(0, 9)], 0.0);
    }

    /// Along an unobservable direction the parameter that keeps its value is the largest of its
    /// kind.
    #[test]
    fn the_largest_entry_of_a_direction_keeps_its_value() {
        for (down, held) in [
            ([1.0, 0.8, 1e-3], 1),
            ([1e-3, 0.8, 1.0], 3),
            ([0.2, -0.9, 0.3], 2),
        ] {
            let down = Vector3::from(down);
            let moments = down.cross_matrix().tr_mul(&down.cross_matrix());
            let noise = Matrix::identity() * 1e-6;
            let mut rows = noise;
            let mut of_first_moments = rows.fixed_view_mut::<3, 3>(1, 1);
            of_first_moments += moments;
            let root = rows.cholesky().unwrap().l().transpose();
            let information = Information::new(&root, &noise, WINDOWS, f64::INFINITY);
            let found = information.unobservable().find(|(k, _)| (1..4).contains(k));
            let (index, direction) = found.unwrap();
            assert_eq!(index, held, "{down}");
            assert!(direction.amax() < 1.0 + 1e-3, "{direction}");
        }
    }

    /// Without rows, no parameter moves and every direction is unobservable.
    #[test]
    fn no_information_moves_nothing() {
        let none = Information::none();
        assert_eq!(none.solve(&Vector::repeat(3.0)), Vector::zeros());
        assert_eq!(none.sandwich(&Matrix::identity()), Matrix::zeros());
        assert_eq!(none.unobservable().count(), 10);
    }
}
