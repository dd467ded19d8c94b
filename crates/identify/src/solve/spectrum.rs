//! Eigenvalues of an information matrix: the observable directions of a batch fit.

use nalgebra::allocator::Allocator;
use nalgebra::{
    DMatrix, DefaultAllocator, DimDiff, DimSub, Dyn, OMatrix, OVector, SymmetricEigen, U1,
};

use super::subspace::{EIGENVALUE_RATIO, NullSpace, Vector, least_excitation};

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
            pairs.filter(move |(information, _)| *information > EIGENVALUE_RATIO * largest);
        observable.map(|(information, vector)| (information, vector.into_owned()))
    }

    /// The unobservable directions of the ten parameters, whose units are `scales`.
    pub(crate) fn null_space(&self, scales: Vector) -> NullSpace {
        let least = self.eigen.eigenvalues.max() * EIGENVALUE_RATIO;
        self.weaker_than(scales, |_| least)
    }

    /// The directions of the ten parameters that the motion does not excite more than its noise does. `noise` is what the
    /// noise has added to the information of so many windows, and is already subtracted from it.
    pub(crate) fn not_excited(
        &self,
        scales: Vector,
        noise: &OMatrix<f64, D, D>,
        windows: usize,
    ) -> NullSpace {
        let largest = self.eigen.eigenvalues.max();
        self.weaker_than(scales, |k| {
            let vector = self.eigen.eigenvectors.column(k);
            least_excitation(largest, (noise * vector).dot(&vector), windows)
        })
    }

    /// The directions whose information is not more than a threshold.
    fn weaker_than(&self, scales: Vector, least: impl Fn(usize) -> f64) -> NullSpace {
        let order = self.descending().into_iter();
        let weak = order.filter(|&k| self.eigen.eigenvalues[k] <= least(k));
        NullSpace::new(scales, weak.map(|k| self.direction(k)))
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

impl Spectrum<Dyn> {
    /// Returns the inverse of the information, zero in unobservable directions.
    pub(crate) fn inverse(&self) -> DMatrix<f64> {
        let size = self.eigen.eigenvalues.len();
        let mut inverse = DMatrix::<f64>::zeros(size, size);
        for (information, direction) in self.observable() {
            inverse.ger(1.0 / information, &direction, &direction, 1.0);
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::U10;

    use super::*;
    use crate::solve::subspace::Matrix;

    /// A faint direction is observable, but not excited where noise of the motion is the larger part of it, or may be by
    /// chance.
    #[test]
    fn noise_does_not_excite_a_direction() {
        let faint = Vector::ith(3, 1e-4);
        let information = Matrix::identity() - Matrix::from_diagonal(&Vector::ith(3, 1.0 - 1e-4));
        let spectrum = Spectrum::<U10>::new(information);
        let scales = Vector::repeat(1.0);
        assert!(spectrum.null_space(scales).directions().is_empty());
        let not_excited = |noise: f64, windows: usize| -> Vec<Vector> {
            let noise = Matrix::from_diagonal(&(faint * noise));
            let found = spectrum.not_excited(scales, &noise, windows);
            found.directions().to_vec()
        };
        assert!(not_excited(0.0, 20).is_empty());
        assert!(not_excited(0.3, 20).is_empty());
        assert_eq!(not_excited(1.0, 20).len(), 1);
        assert!(not_excited(1.0, 2000).is_empty());
        let [direction] = not_excited(20.0, 2000)[..] else {
            panic!("one direction is noise");
        };
        assert!((direction[3].abs() - 1.0).abs() < 1e-9, "{direction}");
        // An unobservable direction is not excited either.
        let without = Spectrum::<U10>::new(information - Matrix::from_diagonal(&faint));
        let found = without.not_excited(scales, &Matrix::zeros(), 20);
        assert_eq!(found.directions().len(), 1);
    }
}
