//! The identification rows: what is measured, linear in what is sought. Every vector that enters is
//! expressed in the end-effector frame `Σ_U`; there alone are the unknowns constant.

use nalgebra::{Matrix3, Matrix3x4, Matrix3x6, SMatrix, Vector3};

use crate::{ToolMotion, Wrench, cross, inertia_product};

/// A matrix equation `A x = b` of three rows and `N` unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows<const N: usize> {
    /// `A`, 3xN.
    pub matrix: SMatrix<f64, 3, N>,
    /// `b`, 3.
    pub wanted: Vector3<f64>,
}

impl<const N: usize> Rows<N> {
    /// The row equations `A(k) x = b(k)`, (50), each `(A(k)ᵀ, b(k))`.
    pub fn iter(&self) -> impl Iterator<Item = (nalgebra::SVector<f64, N>, f64)> + '_ {
        (0..3).map(|k| (self.matrix.row(k).transpose(), self.wanted[k]))
    }
}

/// `Ω̇_U = [ω̇_U]× + [ω_U]×²`, 1/s²: (31).
#[must_use]
pub fn omega_matrix(motion: &ToolMotion) -> Matrix3<f64> {
    let w = cross(&motion.angular_velocity);
    cross(&motion.angular_acceleration) + w * w // (31)
}

/// `Q̇_U = L(ω̇_U) + [ω_U]× L(ω_U)`, so that `Q̇_U I = I ω̇_U + ω_U × (I ω_U)`: (45).
#[must_use]
pub fn inertia_regressor(motion: &ToolMotion) -> Matrix3x6<f64> {
    let w = &motion.angular_velocity;
    inertia_product(&motion.angular_acceleration) + cross(w) * inertia_product(w) // (45)
}

/// Mass and centre of mass from the motion of all other bodies: (30)-(32).
///
/// `f_k` is `Σ m r̈` over the base and every link but the end-effector, N. The unknowns are
/// `[1/m_U, a_Ux, a_Uy, a_Uz]`.
#[must_use]
pub fn mass_rows(motion: &ToolMotion, f_k: &Vector3<f64>) -> Rows<4> {
    let mut matrix = Matrix3x4::zeros();
    matrix.set_column(0, f_k);
    matrix
        .fixed_view_mut::<3, 3>(0, 1)
        .copy_from(&omega_matrix(motion));
    Rows {
        matrix,                       // A_3 = [f_K | Ω̇_U], (32)
        wanted: -motion.acceleration, // b_3 = -p̈_U (p̈_U - g on the ground), (30)
    }
}

/// Mass and centre of mass from the force that the fingers feel: (48).
///
/// `f_u` is the sum of the contact forces **on** the payload, N. The unknowns are
/// `[1/m_U, a_Ux, a_Uy, a_Uz]` of the payload alone.
#[must_use]
pub fn tactile_mass_rows(motion: &ToolMotion, f_u: &Vector3<f64>) -> Rows<4> {
    mass_rows(motion, &-f_u) // (47): f_K = -f_U
}

/// Inertia about the centre of mass: (45)-(46).
///
/// `wrench` acts on the body, about the origin of `Σ_U`; `center_of_mass` is `a_U` of the first
/// stage. The unknowns are `[Ixx, Ixy, Ixz, Iyy, Iyz, Izz]`.
#[must_use]
pub fn inertia_rows(
    motion: &ToolMotion,
    wrench: &Wrench,
    center_of_mass: &Vector3<f64>,
) -> Rows<6> {
    Rows {
        matrix: inertia_regressor(motion), // A_4, (46)
        wanted: wrench.moment - center_of_mass.cross(&wrench.force), // b_4 = n_U - a_U × f_U, (45)
    }
}

/// The one-stage form: `[f_U; n_U] = Y π` with `π` in the order of
/// [`InertialParameters`](crate::InertialParameters), 6x10.
///
/// The upper three rows are the force, (29) with (47); the lower three the moment about the origin
/// of `Σ_U`, (37) with (41) and the inertia moved to that origin.
#[must_use]
pub fn wrench_regressor(motion: &ToolMotion) -> SMatrix<f64, 6, 10> {
    let mut regressor = SMatrix::<f64, 6, 10>::zeros();
    regressor
        .fixed_view_mut::<3, 1>(0, 0)
        .copy_from(&motion.acceleration);
    regressor
        .fixed_view_mut::<3, 3>(0, 1)
        .copy_from(&omega_matrix(motion));
    regressor
        .fixed_view_mut::<3, 3>(3, 1)
        .copy_from(&-cross(&motion.acceleration));
    regressor
        .fixed_view_mut::<3, 6>(3, 4)
        .copy_from(&inertia_regressor(motion));
    regressor
}
