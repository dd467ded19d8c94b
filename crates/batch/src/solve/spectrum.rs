//! Eigenvalues of an information matrix: the observable directions of a batch fit.

use nalgebra::allocator::Allocator;
use nalgebra::{
    DMatrix, DefaultAllocator, DimDiff, DimSub, Dyn, OMatrix, OVector, SymmetricEigen, U1,
};
use tactid_identify::solve::{
    EIGENVALUE_RATIO, NullSpace, QUANTITY_FRACTION, Vector, least_signal, least_signal_of_columns,
};

/// Fraction of noise of a direction that no row excites: more than all of it.
const WITHOUT_ROWS: f64 = 2.0;

/// Observable and unobservable directions of scaled parameters, the ten parameters first.
#[derive(Clone, Debug)]
pub struct Spectrum<D>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    /// Eigenvalues of the information without the noise of the motion, of the parameters that are
    /// not held.
    eigen: SymmetricEigen<f64, D>,
    /// Orthogonal unit vectors.
    unobservable: Vec<OVector<f64, D>>,
    /// Largest step along each of them, at which the rows alone would leave residuals as large as
    /// their noise.
    extents: Vec<f64>,
}

/// How strongly the rows excite each eigenvector of their information.
#[derive(Clone, Debug)]
pub struct Excitation {
    /// Square roots of the eigenvalues relative to the largest, descending.
    pub strengths: Vec<f64>,
    /// Unit vectors in scaled parameters, in the same order.
    pub directions: Vec<Vector>,
}

impl<D> Spectrum<D>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    /// Decomposes an information of exact rows.
    pub fn new(information: OMatrix<f64, D, D>) -> Self {
        let noise = &information * 0.0;
        Self::with_noise(&information, &noise, 1)
    }

    /// Decomposes the information of the `rows` of so many windows less what the `noise` of their
    /// motion has added to it.
    ///
    /// For each direction that noise alone excites, one parameter is held. To hold the coordinate
    /// along the direction instead would bias the other parameters: by chance the direction
    /// contains a small share of them, and their values are thousands of their standard deviations.
    /// A parameter that is held lacks its own value only. One whose column is noise alone is a
    /// direction of its own.
    pub fn with_noise(
        rows: &OMatrix<f64, D, D>,
        noise: &OMatrix<f64, D, D>,
        windows: usize,
    ) -> Self {
        let (mut rows, mut noise) = (rows.clone(), noise.clone());
        let [of_noise, mut unobservable] = if excites_all(&rows, &noise, windows) {
            Default::default()
        } else {
            remove_columns_of_noise(&mut rows, &mut noise, windows);
            not_excited(&rows, &noise, windows)
        };
        let mut information = &rows - noise;
        for parameter in largest_entries(&of_noise) {
            information.row_mut(parameter).fill(0.0);
            information.column_mut(parameter).fill(0.0);
        }
        unobservable.extend(of_noise);
        let unobservable = orthogonal(unobservable);
        let extent = |direction: &OVector<f64, D>| {
            let squares = (&rows * direction).dot(direction).max(f64::MIN_POSITIVE);
            (windows as f64 / squares).sqrt()
        };
        Self {
            eigen: SymmetricEigen::new(information),
            extents: unobservable.iter().map(extent).collect(),
            unobservable,
        }
    }

    /// The observable directions: information, and unit vector in scaled parameters.
    pub fn observable(&self) -> impl Iterator<Item = (f64, OVector<f64, D>)> + '_ {
        let largest = self.eigen.eigenvalues.max();
        let columns = self.eigen.eigenvectors.column_iter();
        let pairs = self.eigen.eigenvalues.iter().copied().zip(columns);
        let observable =
            pairs.filter(move |(information, _)| *information > EIGENVALUE_RATIO * largest);
        observable.map(|(information, vector)| (information, vector.into_owned()))
    }

    /// The unobservable directions of the ten parameters, whose units are `scales`: those that no
    /// row excites, or only the noise of the motion.
    pub fn null_space(&self, scales: Vector) -> NullSpace {
        let directions = self.unobservable.iter();
        NullSpace::new(
            scales,
            directions.map(|vector| Vector::from_fn(|k, _| vector[k])),
        )
    }

    /// The unobservable directions with what the parameters of a payload of a mass, kg, that
    /// reaches so far, m, may be there.
    pub fn null_space_of(&self, scales: Vector, mass_kg: f64, reach_m: f64) -> NullSpace {
        let extents = self.extents.iter().copied();
        self.null_space(scales)
            .with_extents(mass_kg, reach_m, extents)
    }

    /// Returns whether the observable directions determine an unknown.
    pub fn determines(&self, unknown: usize) -> bool {
        let directions = self.unobservable.iter();
        directions
            .map(|direction| direction[unknown].powi(2))
            .sum::<f64>()
            <= QUANTITY_FRACTION
    }

    /// Returns a covariance without its share in the unobservable directions. The covariance of a
    /// solution lacks a share in the parameters that are held, which is another one.
    pub fn across_unobservable(&self, mut covariance: OMatrix<f64, D, D>) -> OMatrix<f64, D, D> {
        for _ in 0..2 {
            for column in 0..covariance.ncols() {
                let across =
                    self.vector_across_unobservable(covariance.column(column).into_owned());
                covariance.set_column(column, &across);
            }
            covariance = covariance.transpose();
        }
        covariance
    }

    /// Returns a vector without its share in the unobservable directions.
    pub fn vector_across_unobservable(&self, mut vector: OVector<f64, D>) -> OVector<f64, D> {
        for direction in &self.unobservable {
            vector.axpy(-direction.dot(&vector), direction, 1.0);
        }
        vector
    }

    /// Strengths and directions, the strongest first.
    pub fn excitation(&self) -> Excitation {
        let values = &self.eigen.eigenvalues;
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        let strength = |&k: &usize| values[k].max(0.0).sqrt();
        let strongest = strength(&order[0]).max(f64::MIN_POSITIVE);
        let direction = |&k: &usize| Vector::from_fn(|i, _| self.eigen.eigenvectors[(i, k)]);
        Excitation {
            strengths: order.iter().map(|k| strength(k) / strongest).collect(),
            directions: order.iter().map(direction).collect(),
        }
    }
}

/// Returns whether the rows certainly excite every direction by more than noise. It costs one
/// Cholesky factorisation; [`not_excited`], with two eigenvalue decompositions, finds the
/// directions where the answer is no.
///
/// Every fraction of noise is below `1 / (1 + s)`, where `s` is the least signal, if the products
/// of rows less `1 + s` times those of noise are positive definite. The trace is an upper limit of
/// the largest eigenvalue.
fn excites_all<D>(rows: &OMatrix<f64, D, D>, noise: &OMatrix<f64, D, D>, windows: usize) -> bool
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    let mut excess = rows - noise * (1.0 + least_signal(windows, 0));
    let least = EIGENVALUE_RATIO * rows.trace();
    for k in 0..excess.ncols() {
        excess[(k, k)] -= least;
    }
    excess.cholesky().is_some()
}

/// Sets the products of each column that is noise alone to zero, so that no row excites it.
fn remove_columns_of_noise<D>(
    rows: &mut OMatrix<f64, D, D>,
    noise: &mut OMatrix<f64, D, D>,
    windows: usize,
) where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    let noises = noise.diagonal();
    let signals = rows.diagonal() - &noises;
    let least = least_signal_of_columns(signals.as_slice(), noises.as_slice(), windows);
    for k in (0..signals.len()).filter(|&k| signals[k] <= least * noises[k]) {
        for products in [&mut *rows, &mut *noise] {
            products.row_mut(k).fill(0.0);
            products.column_mut(k).fill(0.0);
        }
    }
}

/// Returns unit vectors of the directions that only noise excites, and of those that no row
/// excites.
///
/// The directions are those in which the products of rows and those of noise are independent of
/// each other.
fn not_excited<D>(
    rows: &OMatrix<f64, D, D>,
    noise: &OMatrix<f64, D, D>,
    windows: usize,
) -> [Vec<OVector<f64, D>>; 2]
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    let eigen = SymmetricEigen::new(rows.clone());
    let least = EIGENVALUE_RATIO * eigen.eigenvalues.max();
    let has_rows = |k: usize| eigen.eigenvalues[k] > least;
    // Products of rows are the identity in these vectors.
    let mut roots = eigen.eigenvectors.clone();
    for k in (0..roots.ncols()).filter(|&k| has_rows(k)) {
        let mut root = roots.column_mut(k);
        root /= eigen.eigenvalues[k].sqrt();
    }
    let mut fractions = roots.tr_mul(&(noise * &roots));
    for k in (0..roots.ncols()).filter(|&k| !has_rows(k)) {
        fractions.row_mut(k).fill(0.0);
        fractions.column_mut(k).fill(0.0);
        fractions[(k, k)] = WITHOUT_ROWS;
    }
    let fractions = SymmetricEigen::new(fractions);
    let directions = roots * fractions.eigenvectors;
    let mut order: Vec<usize> = (0..directions.ncols()).collect();
    order.sort_by(|&a, &b| fractions.eigenvalues[b].total_cmp(&fractions.eigenvalues[a]));
    let [mut of_noise, mut without_rows] = [Vec::new(), Vec::new()];
    for k in order {
        let (direction, fraction) = (directions.column(k), fractions.eigenvalues[k]);
        let unit = direction / direction.norm();
        if fraction == WITHOUT_ROWS {
            without_rows.push(unit);
        } else if 1.0 - fraction <= least_signal(windows, of_noise.len()) * fraction {
            of_noise.push(unit);
        }
    }
    [of_noise, without_rows]
}

/// Returns an entry for each of some vectors so that no combination of them is zero in all of these
/// entries: the largest of the last vector, then of each other one after the elimination of those
/// that follow it.
fn largest_entries<D>(vectors: &[OVector<f64, D>]) -> Vec<usize>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D>,
{
    let mut rest = vectors.to_vec();
    let mut entries = Vec::new();
    while let Some(vector) = rest.pop() {
        let entry = vector.iamax();
        for other in &mut rest {
            let factor = other[entry] / vector[entry];
            other.axpy(-factor, &vector, 1.0);
        }
        entries.push(entry);
    }
    entries
}

/// Returns orthogonal unit vectors that span the same directions.
fn orthogonal<D>(vectors: Vec<OVector<f64, D>>) -> Vec<OVector<f64, D>>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D>,
{
    let mut units: Vec<OVector<f64, D>> = Vec::new();
    for mut vector in vectors {
        for unit in &units {
            vector.axpy(-unit.dot(&vector), unit, 1.0);
        }
        units.push(vector.normalize());
    }
    units
}

impl Spectrum<Dyn> {
    /// Returns the inverse of the information, zero in unobservable directions.
    pub fn inverse(&self) -> DMatrix<f64> {
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
    use tactid_identify::solve::Matrix;

    /// A faint direction is observable, but not where noise of the motion is the larger part of it,
    /// or may be by chance.
    #[test]
    fn noise_does_not_excite_a_direction() {
        let faint = Vector::ith(3, 1e-4);
        let signal = Matrix::identity() - Matrix::from_diagonal(&Vector::ith(3, 1.0 - 1e-4));
        let unobservable = |noise: f64, windows: usize| -> Vec<Vector> {
            let noise = Matrix::from_diagonal(&(faint * noise));
            let spectrum = Spectrum::<U10>::with_noise(&(signal + noise), &noise, windows);
            let found = spectrum.null_space(Vector::repeat(1.0));
            found.directions().to_vec()
        };
        assert!(unobservable(0.0, 20).is_empty());
        assert!(unobservable(0.3, 2000).is_empty());
        assert_eq!(unobservable(1.0, 20).len(), 1);
        assert!(unobservable(1.0, 2000).is_empty());
        let [direction] = unobservable(20.0, 2000)[..] else {
            panic!("one direction is noise");
        };
        assert!((direction[3].abs() - 1.0).abs() < 1e-9, "{direction}");
        // A direction without rows is not observable, either.
        let without = signal - Matrix::from_diagonal(&faint);
        let found = Spectrum::<U10>::new(without).null_space(Vector::repeat(1.0));
        assert_eq!(found.directions().len(), 1);
    }

    /// The quick check never takes a direction for excited that noise alone excites, and finds that
    /// most are excited by far more.
    #[test]
    fn the_quick_check_misses_no_direction() {
        let mut excited = 0;
        for draw in 0..200 {
            let entry = |k: usize| (f64::from(draw) * 0.7 + 1.3 * (k * k) as f64).sin();
            let root = Matrix::from_fn(|i, j| entry(13 * i + j) + 2.0 * f64::from(i == j));
            let rows = root * root.transpose();
            let root = Matrix::from_fn(|i, j| entry(7 * i + 3 * j + 5));
            let noise = root * root.transpose() * 1e-4 * f64::from(draw);
            let [of_noise, without_rows] = not_excited::<U10>(&rows, &noise, 1000);
            let all = of_noise.is_empty() && without_rows.is_empty();
            let found = excites_all::<U10>(&rows, &noise, 1000);
            assert!(all || !found, "{draw}");
            excited += usize::from(found);
        }
        assert!((20..180).contains(&excited), "{excited}");
    }

    /// The inverse of an information with noise of any direction is that of the difference.
    #[test]
    fn the_inverse_is_that_of_the_information_without_noise() {
        let root = Matrix::from_fn(|i, j| ((3 * i + 7 * j) as f64).sin() + f64::from(i == j));
        let signal = root * root.transpose();
        let root = Matrix::from_fn(|i, j| 0.1 * ((5 * i + j * j) as f64).cos());
        let noise = root * root.transpose();
        let spectrum = Spectrum::<U10>::with_noise(&(signal + noise), &noise, 1_000_000);
        let inverse: Matrix = spectrum
            .observable()
            .map(|(information, direction)| direction * direction.transpose() / information)
            .sum();
        let error = (inverse * signal - Matrix::identity()).amax();
        assert!(error < 1e-9, "{error}");
    }

    /// A direction that noise alone excites, and that the rows couple by chance with one that is
    /// known well, leaves the solution of the latter as it is.
    #[test]
    fn noise_that_is_coupled_by_chance_does_not_move_the_solution() {
        let mut rows = Matrix::identity();
        (rows[(0, 1)], rows[(1, 0)]) = (0.1, 0.1);
        let noise = Matrix::from_diagonal(&Vector::ith(1, 1.01));
        let truth = Vector::ith(0, 1e4);
        let target = (rows - noise) * truth;
        let spectrum = Spectrum::<U10>::with_noise(&rows, &noise, 50);
        let solution: Vector = spectrum
            .observable()
            .map(|(information, direction)| direction * (direction.dot(&target) / information))
            .sum();
        assert!((solution - truth).amax() < 1e-6, "{solution}");
    }
}
