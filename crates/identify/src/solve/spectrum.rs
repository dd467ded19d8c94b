//! Eigenvalues of an information matrix: the observable directions of a batch fit.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, DimDiff, DimSub, OMatrix, OVector, SymmetricEigen, U1};

use super::subspace::{NullSpace, Vector, is_observable_eigenvalue};

/// Eigenvalues and eigenvectors of the information of scaled parameters.
#[derive(Clone, Debug)]
pub(crate) struct Spectrum<D>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    eigen: SymmetricEigen<f64, D>,
}

/// How strongly the rows excite each eigenvector of their information.
#[derive(Clone, Debug)]
pub(crate) struct Excitation {
    /// Square roots of the eigenvalues relative to the largest, descending.
    pub(crate) strengths: Vec<f64>,
    /// Unit vectors in scaled parameters, in the same order.
    pub(crate) directions: Vec<Vector>,
}

impl<D> Spectrum<D>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    /// Decomposes a symmetric matrix, the ten parameters first.
    pub(crate) fn new(information: OMatrix<f64, D, D>) -> Self {
        Self {
            eigen: SymmetricEigen::new(information),
        }
    }

    /// The observable directions: information, and unit vector in scaled parameters.
    pub(crate) fn observable(&self) -> impl Iterator<Item = (f64, OVector<f64, D>)> + '_ {
        let largest = self.eigen.eigenvalues.max();
        let columns = self.eigen.eigenvectors.column_iter();
        let pairs = self.eigen.eigenvalues.iter().copied().zip(columns);
        let observable =
            pairs.filter(move |(information, _)| is_observable_eigenvalue(*information, largest));
        observable.map(|(information, vector)| (information, vector.into_owned()))
    }

    /// The unobservable directions of the ten parameters, whose units are `scales`.
    pub(crate) fn null_space(&self, scales: Vector) -> NullSpace {
        let largest = self.eigen.eigenvalues.max();
        let unobservable = self
            .descending()
            .into_iter()
            .filter(|&k| !is_observable_eigenvalue(self.eigen.eigenvalues[k], largest));
        NullSpace::new(scales, unobservable.map(|k| self.direction(k)))
    }

    /// Strengths and directions, the strongest first.
    pub(crate) fn excitation(&self) -> Excitation {
        let order = self.descending();
        let strength = |&k: &usize| self.eigen.eigenvalues[k].max(0.0).sqrt();
        let strongest = strength(&order[0]).max(f64::MIN_POSITIVE);
        Excitation {
            strengths: order.iter().map(|k| strength(k) / strongest).collect(),
            directions: order.iter().map(|&k| self.direction(k)).collect(),
        }
    }

    /// Indices of the eigenvalues, the largest first.
    fn descending(&self) -> Vec<usize> {
        let values = &self.eigen.eigenvalues;
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        order
    }

    /// Entries of an eigenvector that belong to the ten parameters.
    fn direction(&self, k: usize) -> Vector {
        Vector::from_fn(|i, _| self.eigen.eigenvectors[(i, k)])
    }
}
