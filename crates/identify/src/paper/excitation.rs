//! What the motion made identifiable.

use nalgebra::{Matrix4, Matrix6, SMatrix, SVector, SymmetricEigen, Vector3};

use crate::equations::Equation;

/// A direction whose rows are weaker than this part of the strongest counts as not excited.
///
/// At the paper's Table 1 posture the weakest direction has 0.6 % of the strongest and the paper's
/// filter does not converge in it; at a posture that excites all axes it has 40 %.
const WEAK: f64 = 0.02;

/// A parameter that lies by more than this part (of its square) in directions that were not excited
/// is not identifiable.
const SHARE: f64 = 0.01;

/// Below this no row says anything: rad/s² for the inertia, m/s² for the mass.
const STILL: f64 = 1e-6;

/// Singular values of the rows, divided by the root of the number of intervals: the rms strength with
/// which each direction of the parameters was excited. Descending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingularValues {
    /// Of `A_3`, (48), its force column divided by the mass that the data imply, so that all four
    /// are in m/s² (for a centre of mass 1 m away).
    pub mass: [f64; 4],
    /// Of `A_4`, (46), rad/s².
    pub inertia: [f64; 6],
}

/// Accumulates the rows' Gram matrices.
#[derive(Clone, Debug)]
pub(crate) struct Excitation {
    mass: Matrix4<f64>,
    target_squares: f64,
    inertia: Matrix6<f64>,
    intervals: u64,
}

impl Excitation {
    pub(crate) fn new() -> Self {
        Self {
            mass: Matrix4::zeros(),
            target_squares: 0.0,
            inertia: Matrix6::zeros(),
            intervals: 0,
        }
    }

    pub(crate) fn update(&mut self, equation: &Equation) {
        let rows = equation.mass_rows();
        self.mass += rows.matrix.tr_mul(&rows.matrix);
        self.target_squares += rows.wanted.norm_squared();
        let matrix = equation.inertia_rows(&Vector3::zeros()).matrix;
        self.inertia += matrix.tr_mul(&matrix);
        self.intervals += 1;
    }

    /// The singular values, and for each of mass, centre of mass (x, y, z) and inertia (xx, xy, xz,
    /// yy, yz, zz) whether the motion determined it.
    pub(crate) fn assess(&self) -> (SingularValues, [bool; 10]) {
        let count = (self.intervals as f64).max(1.0);
        let force_squares = self.mass[(0, 0)];
        // b/f is the inverse of the mass but for rotation: it brings the force column to m/s².
        let inverse_mass = if force_squares > 0.0 {
            (self.target_squares / force_squares).sqrt()
        } else {
            0.0
        };
        let mut mass = self.mass / count;
        mass.row_mut(0).scale_mut(inverse_mass);
        mass.column_mut(0).scale_mut(inverse_mass);
        let (mass_values, mass_known) = spectrum(SymmetricEigen::new(mass));
        let inertia = self.inertia / count;
        let (inertia_values, inertia_known) = spectrum(SymmetricEigen::new(inertia));
        let mut known = [false; 10];
        known[..4].copy_from_slice(&mass_known);
        known[4..].copy_from_slice(&inertia_known);
        let values = SingularValues {
            mass: mass_values,
            inertia: inertia_values,
        };
        (values, known)
    }
}

/// Descending singular values, and which entries lie in excited directions.
fn spectrum<const N: usize>(gram: SymmetricEigen<f64, nalgebra::Const<N>>) -> ([f64; N], [bool; N])
where
    nalgebra::Const<N>: nalgebra::DimSub<nalgebra::U1>,
    nalgebra::DefaultAllocator:
        nalgebra::allocator::Allocator<nalgebra::DimDiff<nalgebra::Const<N>, nalgebra::U1>>,
{
    let values: SVector<f64, N> = gram.eigenvalues.map(|square| square.max(0.0).sqrt());
    let vectors: SMatrix<f64, N, N> = gram.eigenvectors;
    let bound = (WEAK * values.max()).max(STILL);
    let mut known = [false; N];
    for (entry, known) in known.iter_mut().enumerate() {
        let weak = (0..N).filter(|&k| values[k] < bound);
        let share: f64 = weak.map(|k| vectors[(entry, k)].powi(2)).sum();
        *known = share < SHARE;
    }
    let mut sorted: [f64; N] = values.into();
    sorted.sort_by(|a, b| b.total_cmp(a));
    (sorted, known)
}
