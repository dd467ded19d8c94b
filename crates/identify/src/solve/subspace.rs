//! The information of the rows without the motion's noise, and the directions that it leaves unknown.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, DimDiff, DimSub, OVector, SMatrix, SVector, SymmetricEigen, U1};

pub(crate) type Matrix = SMatrix<f64, 10, 10>;
pub(crate) type Vector = SVector<f64, 10>;

/// A direction is unknown where all but this part of the rows' information is noise of the motion.
const SIGNAL: f64 = 0.1;

/// The same where it is this part of what the rows say of the parameter alone, the others known:
/// rounding.
const ROUNDING: f64 = 1e-10;

/// The same where rows of unit noise say no more than this: what an estimator starts with.
const NOTHING: f64 = 1e-10;

/// `A - N` as `Uᵀ D U`, `A` being the rows' information and `N` the part of it that is noise.
///
/// Directions are taken one after another, each what is left of a parameter once those before it
/// are known. Where the data say nothing of one, its parameter keeps its value in [`solve`](Self::solve), and
/// the others are solved for given this value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Information {
    /// `A - N`.
    difference: Matrix,
    /// `D⁻¹`; zero for a direction that is unknown.
    inverse: Vector,
    /// The directions, `U⁻¹`, `U` having a diagonal of ones.
    directions: Matrix,
}

impl Information {
    /// Factors `A - N` from the triangle of all rows, `A = RᵀR`, and `N`. Cost: some 1000 multiplications.
    ///
    /// `plausible` is the size of a parameter that can be expected, in units that make the columns of `R`
    /// of length one. A direction of which the rows know less than that counts as unobservable: its
    /// estimate would be noise of any size.
    pub(crate) fn new(root: &Matrix, noise: &Matrix, plausible: f64) -> Self {
        let rows = root.transpose() * root;
        let difference = rows - noise;
        let mut rest = difference;
        let mut upper = Matrix::identity();
        let mut inverse = Vector::zeros();
        for j in 0..10 {
            let mut column = Vector::zeros();
            column.copy_from(&rest.column(j));
            // What the elimination of A itself has left here is the square of R's diagonal.
            let all = root[(j, j)] * root[(j, j)];
            let vague = ROUNDING.max(plausible.powi(-2));
            let least = (SIGNAL * all).max(vague * rows[(j, j)]).max(NOTHING);
            if column[j] > least {
                inverse[j] = column[j].recip();
            }
            for i in j + 1..10 {
                let part = column[i] * inverse[j];
                upper[(j, i)] = part;
                // Above the pivots nothing is read again.
                rest.column_mut(i).axpy(-part, &column, 1.0);
            }
        }
        Self {
            difference,
            inverse,
            directions: inverse_of_upper(&upper),
        }
    }

    /// Nothing known.
    pub(crate) fn none() -> Self {
        Self {
            difference: Matrix::zeros(),
            inverse: Vector::zeros(),
            directions: Matrix::identity(),
        }
    }

    /// `(A - N)⁻¹ v` in the known directions.
    pub(crate) fn solve(&self, vector: &Vector) -> Vector {
        let along = self.directions.tr_mul(vector);
        self.directions * along.component_mul(&self.inverse)
    }

    /// Whether every direction is observable.
    pub(crate) fn is_complete(&self) -> bool {
        self.inverse.iter().all(|inverse| *inverse > 0.0)
    }

    /// `(A - N)⁻¹ S (A - N)⁻¹` of a symmetric `S`, in the known directions.
    pub(crate) fn sandwich(&self, middle: &Matrix) -> Matrix {
        let mut scaled = self.directions;
        for (mut column, inverse) in scaled.column_iter_mut().zip(&self.inverse) {
            column *= *inverse;
        }
        let inverse = scaled * self.directions.transpose();
        inverse * middle * inverse
    }

    /// Returns `A - N`, in which each unobservable direction has the information that `prior` has of the
    /// parameter that keeps its value: positive definite.
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

    /// Unobservable directions: the index of a parameter that keeps its value in [`solve`](Self::solve), and
    /// by how much all parameters change with a unit of it, the others being solved for anew.
    pub(crate) fn unobservable(&self) -> impl Iterator<Item = (usize, Vector)> + Clone + '_ {
        let indices = (0..10).filter(|&k| self.inverse[k] == 0.0);
        indices.map(|k| {
            let coupling = self.difference.column(k).into_owned();
            (k, Vector::ith(k, 1.0) - self.solve(&coupling))
        })
    }

    /// The directions that are unknown, of any length.
    pub(crate) fn unknown(&self) -> impl Iterator<Item = Vector> + Clone + '_ {
        self.unobservable().map(|(_, direction)| direction)
    }
}

/// `U⁻¹` of an upper triangle without zeros on its diagonal.
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

/// A direction of the scaled parameters that the rows excite by less than this part of the strongest
/// is unknown: what the numbers say of it is rounding.
const UNKNOWN: f64 = 1e-5;

/// How strongly directions of the scaled parameters are excited.
#[derive(Clone, Debug)]
pub(crate) struct Directions {
    /// Descending, 1 for what is as strong as the strongest column.
    pub(crate) strengths: Vec<f64>,
    /// Unit vectors, a row each, in parameters each divided by its scale.
    pub(crate) vectors: Vec<SVector<f64, 10>>,
    /// What a unit of each scaled parameter is.
    pub(crate) scales: SVector<f64, 10>,
}

impl Directions {
    /// Of a Gram matrix in scaled parameters; columns beyond the ten parameters are left out.
    pub(crate) fn new<D>(eigen: &SymmetricEigen<f64, D>, scales: SVector<f64, 10>) -> Self
    where
        D: DimSub<U1>,
        DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
    {
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let strength = |&k: &usize| eigen.eigenvalues[k].max(0.0).sqrt();
        let strongest = strength(&order[0]).max(f64::MIN_POSITIVE);
        let vector = |&k: &usize| SVector::from_fn(|i, _| eigen.eigenvectors[(i, k)]);
        Self {
            strengths: order.iter().map(|k| strength(k) / strongest).collect(),
            vectors: order.iter().map(vector).collect(),
            scales,
        }
    }

    pub(crate) fn unknown(&self) -> impl Iterator<Item = SVector<f64, 10>> + Clone {
        let pairs = self.strengths.iter().zip(&self.vectors);
        let strongest = self.strengths.first().copied().unwrap_or(0.0);
        pairs
            .filter(move |(strength, _)| **strength <= UNKNOWN * strongest)
            .map(|(_, vector)| *vector)
    }
}

/// The directions of a Gram matrix that are excited enough to be known: information, and unit vector.
pub(crate) fn known<D>(
    eigen: &SymmetricEigen<f64, D>,
) -> impl Iterator<Item = (f64, OVector<f64, D>)>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    let threshold = UNKNOWN * UNKNOWN * eigen.eigenvalues.max();
    let columns = eigen.eigenvectors.column_iter();
    let pairs = eigen.eigenvalues.iter().copied().zip(columns);
    let excited = pairs.filter(move |(information, _)| *information > threshold);
    excited.map(|(information, vector)| (information, vector.into_owned()))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    /// Products of forty random rows.
    fn random(random: &mut SmallRng) -> Matrix {
        let rows = SMatrix::<f64, 40, 10>::from_fn(|_, _| random.random_range(-1.0..1.0));
        rows.tr_mul(&rows)
    }

    /// The triangle of random rows with columns of very different size, and the noise's part of them.
    fn rows_and_noise(seed: u64, part: f64) -> (Matrix, Matrix) {
        let mut generator = SmallRng::seed_from_u64(seed);
        let scales = Vector::from_fn(|k, _| 10f64.powi(k as i32 % 4 * 2));
        let scales = Matrix::from_diagonal(&scales);
        let noise = scales * random(&mut generator) * scales * part;
        let all = scales * random(&mut generator) * scales + noise;
        (all.cholesky().unwrap().l().transpose(), noise)
    }

    /// Where everything is known, it is the plain inverse, whatever the columns' sizes.
    #[test]
    fn solves_without_the_noise() {
        for seed in 0..50 {
            let (root, noise) = rows_and_noise(seed, 0.1);
            let information = Information::new(&root, &noise, f64::INFINITY);
            assert_eq!(information.unknown().count(), 0);
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

    /// A direction without rows is found, as it is, and what does not lie in it is known nevertheless; of
    /// one that is all noise, a direction that is nearly so.
    #[test]
    fn finds_what_is_unknown() {
        for seed in 0..50 {
            let mut generator = SmallRng::seed_from_u64(seed);
            let direction = Vector::from_fn(|_, _| generator.random_range(-1.0..1.0)).normalize();
            let without = Matrix::identity() - direction * direction.transpose();
            let rows = without * random(&mut generator) * without;
            for noise in [0.0, 1.0] {
                let noise = direction * direction.transpose() * noise;
                let all = rows + noise + Matrix::identity() * 1e-12;
                let root = all.cholesky().unwrap().l().transpose();
                let information = Information::new(&root, &noise, f64::INFINITY);
                let unknown: Vec<Vector> = information.unknown().collect();
                assert_eq!(unknown.len(), 1);
                let found = unknown[0].normalize();
                let signal = (rows * found).dot(&found);
                let whole = (all * found).dot(&found);
                assert!(signal <= SIGNAL * whole, "{signal} of {whole}");
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

    #[test]
    fn nothing_known_moves_nothing() {
        let none = Information::none();
        assert_eq!(none.solve(&Vector::repeat(3.0)), Vector::zeros());
        assert_eq!(none.sandwich(&Matrix::identity()), Matrix::zeros());
        assert_eq!(none.unknown().count(), 10);
    }
}
