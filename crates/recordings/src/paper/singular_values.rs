//! Strength with which the motion excites mass and inertia: the singular values of the paper's
//! rows.

use nalgebra::{Matrix4, Matrix6, SMatrix, SVector, SymmetricEigen, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::rows::{inertia_rows, mass_rows};
use tactid_identify::Observability;
use tactid_identify::equations::Equation;

/// A direction whose singular value is less than this fraction of the largest counts as
/// unobservable.
///
/// At the posture of the paper's Table 1 the smallest is 0.6 % of the largest, and the paper's
/// filter does not converge in its direction. At a posture that excites all axes the smallest is 40
/// %.
const WEAK: f64 = 0.02;

/// A parameter is not identifiable where more than this fraction of its squared unit vector lies in
/// unobservable directions.
const UNOBSERVABLE_FRACTION: f64 = 0.01;

/// Singular values below this are rounding: rad/s² for the inertia, m/s² for the mass.
const ROUNDING: f64 = 1e-6;

/// Singular values of the rows, divided by the root of the number of windows: the rms strength with
/// which each direction of the parameters is excited, descending.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SingularValues {
    /// Singular values of `A_3`, (48), in m/s². Its force column is divided by the mass that the
    /// data imply, so that all four columns have this unit for a centre of mass 1 m away.
    pub mass: [f64; 4],
    /// Singular values of `A_4`, (46), in rad/s².
    pub inertia: [f64; 6],
}

/// Sums of products of the paper's rows.
#[derive(Clone, Debug)]
pub(crate) struct RowProducts {
    /// `Σ A_3ᵀ A_3`, (48).
    mass: Matrix4<f64>,
    /// `Σ b_3ᵀ b_3`, (32).
    target_squares: f64,
    /// `Σ A_4ᵀ A_4`, (46).
    inertia: Matrix6<f64>,
    windows: u64,
}

impl RowProducts {
    /// Creates the sums over no windows.
    pub(crate) fn new() -> Self {
        Self {
            mass: Matrix4::zeros(),
            target_squares: 0.0,
            inertia: Matrix6::zeros(),
            windows: 0,
        }
    }

    /// Adds a window.
    pub(crate) fn update(&mut self, equation: &Equation) {
        let rows = mass_rows(equation);
        self.mass += rows.matrix.tr_mul(&rows.matrix);
        self.target_squares += rows.target.norm_squared();
        let matrix = inertia_rows(equation, &Vector3::zeros()).matrix;
        self.inertia += matrix.tr_mul(&matrix);
        self.windows += 1;
    }

    /// Returns the singular values, and the observability of each of the ten values, in the order
    /// of [`VALUE_NAMES`](tactid_identify::VALUE_NAMES); none is uncertain. Cost: two eigenvalue
    /// problems.
    pub(crate) fn assess(&self) -> (SingularValues, [Observability; 10]) {
        let count = (self.windows as f64).max(1.0);
        let force_squares = self.mass[(0, 0)];
        // Without rotation b_3 / f_K is the inverse of the mass. It brings the force column to
        // m/s².
        let inverse_mass = if force_squares > 0.0 {
            (self.target_squares / force_squares).sqrt()
        } else {
            0.0
        };
        let mut mass = self.mass / count;
        mass.row_mut(0).scale_mut(inverse_mass);
        mass.column_mut(0).scale_mut(inverse_mass);
        let (mass_values, mass_identifiable) = spectrum(SymmetricEigen::new(mass));
        let inertia = self.inertia / count;
        let (inertia_values, inertia_identifiable) = spectrum(SymmetricEigen::new(inertia));
        let mut identifiable = [false; 10];
        identifiable[..4].copy_from_slice(&mass_identifiable);
        identifiable[4..].copy_from_slice(&inertia_identifiable);
        let values = SingularValues {
            mass: mass_values,
            inertia: inertia_values,
        };
        let observability = identifiable.map(|is_identifiable| match is_identifiable {
            true => Observability::Identifiable,
            false => Observability::Unobservable,
        });
        (values, observability)
    }
}

/// Returns the descending singular values of rows with this Gram matrix, and whether each parameter
/// lies in observable directions.
fn spectrum<const N: usize>(gram: SymmetricEigen<f64, nalgebra::Const<N>>) -> ([f64; N], [bool; N])
where
    nalgebra::Const<N>: nalgebra::DimSub<nalgebra::U1>,
    nalgebra::DefaultAllocator:
        nalgebra::allocator::Allocator<nalgebra::DimDiff<nalgebra::Const<N>, nalgebra::U1>>,
{
    let values: SVector<f64, N> = gram.eigenvalues.map(|square| square.max(0.0).sqrt());
    let vectors: SMatrix<f64, N, N> = gram.eigenvectors;
    let threshold = (WEAK * values.max()).max(ROUNDING);
    let mut identifiable = [false; N];
    for (entry, identifiable) in identifiable.iter_mut().enumerate() {
        let weak = (0..N).filter(|&k| values[k] < threshold);
        let fraction: f64 = weak.map(|k| vectors[(entry, k)].powi(2)).sum();
        *identifiable = fraction < UNOBSERVABLE_FRACTION;
    }
    let mut sorted: [f64; N] = values.into();
    sorted.sort_by(|a, b| b.total_cmp(a));
    (sorted, identifiable)
}
