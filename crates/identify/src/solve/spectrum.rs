//! Eigenvalues of an information matrix: the observable directions of a batch fit.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, DimDiff, DimSub, OMatrix, OVector, SymmetricEigen, U1};

use super::subspace::{NullSpace, Vector, least_information};

/// Eigenvalues and eigenvectors of the information of scaled parameters.
#[derive(Clone, Debug)]
pub(crate) struct Spectrum<D>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    eigen: SymmetricEigen<f64, D>,
    /// Least information of an observable direction, for each eigenvector.
    least: OVector<f64, D>,
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
    /// Decomposes a symmetric matrix, the ten parameters first, of rows whose motion is without noise.
    pub(crate) fn new(information: OMatrix<f64, D, D>) -> Self {
        let noise = &information * 0.0;
        Self::with_noise(information, &noise, 1)
    }

    /// Decomposes a symmetric matrix, the ten parameters first. `noise` is what the noise of the motion has added to the
    /// information of so many windows, and is already subtracted from `information`.
    pub(crate) fn with_noise(
        information: OMatrix<f64, D, D>,
        noise: &OMatrix<f64, D, D>,
        windows: usize,
    ) -> Self {
        let eigen = SymmetricEigen::new(information);
        let largest = eigen.eigenvalues.max();
        let mut least = eigen.eigenvalues.clone();
        for (least, vector) in least.iter_mut().zip(eigen.eigenvectors.column_iter()) {
            let of_noise = (noise * vector).dot(&vector);
            *least = least_information(largest, of_noise, windows);
        }
        Self { eigen, least }
    }

    /// The observable directions: information, and unit vector in scaled parameters.
    pub(crate) fn observable(&self) -> impl Iterator<Item = (f64, OVector<f64, D>)> + '_ {
        let columns = self.eigen.eigenvectors.column_iter().enumerate();
        let observable = columns.filter(|(k, _)| self.is_observable(*k));
        observable.map(|(k, vector)| (self.eigen.eigenvalues[k], vector.into_owned()))
    }

    /// The unobservable directions of the ten parameters, whose units are `scales`.
    pub(crate) fn null_space(&self, scales: Vector) -> NullSpace {
        let order = self.descending().into_iter();
        let unobservable = order.filter(|&k| !self.is_observable(k));
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

    fn is_observable(&self, k: usize) -> bool {
        self.eigen.eigenvalues[k] > self.least[k]
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
