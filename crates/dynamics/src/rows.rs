//! Linear equations for the inertial parameters of an end-effector, (29)-(32) and (42)-(48). All
//! vectors are in the end-effector frame `Σ_U`, the only one in which the unknowns are constant.

use nalgebra::{Matrix3, Matrix3x4, Matrix3x6, SMatrix, Vector3};

use crate::real::Real;
use crate::vector::{Mat3, Vec3};
use crate::{ToolMotion, Wrench, cross, inertia_product};

/// A linear equation `A x = b` of three rows for `N` unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows<const N: usize> {
    /// `A`: the regressor, 3xN.
    pub matrix: SMatrix<f64, 3, N>,
    /// `b`: the target.
    pub target: Vector3<f64>,
}

impl<const N: usize> Rows<N> {
    /// Returns the three scalar equations `A(k) x = b(k)` of (50) as pairs `(A(k)ᵀ, b(k))`.
    pub fn iter(&self) -> impl Iterator<Item = (nalgebra::SVector<f64, N>, f64)> + '_ {
        (0..3).map(|k| (self.matrix.row(k).transpose(), self.target[k]))
    }
}

/// Returns `Ω̇_U = [ω̇_U]× + [ω_U]×²` of (31) in Hou et al. 2016, 1/s².
#[must_use]
pub fn omega_matrix(motion: &ToolMotion) -> Matrix3<f64> {
    let w = cross(&motion.angular_velocity);
    cross(&motion.angular_acceleration) + w * w // (31)
}

/// Returns `Q̇_U = L(ω̇_U) + [ω_U]× L(ω_U)` of (43) and (45) in Hou et al. 2016, 1/s²: the matrix
/// for which `Q̇_U I = I ω̇_U + ω_U × (I ω_U)`, with `I = [Ixx, Ixy, Ixz, Iyy, Iyz, Izz]`.
#[must_use]
pub fn inertia_regressor(motion: &ToolMotion) -> Matrix3x6<f64> {
    let w = &motion.angular_velocity;
    inertia_product(&motion.angular_acceleration) + cross(w) * inertia_product(w) // (45)
}

/// Returns the equation for mass and centre of mass from the motion of all other bodies, (30)-(32)
/// of Hou et al. 2016.
///
/// `f_k` is `Σ m r̈` over the base and all links except the end-effector, N. The unknowns are
/// `[1/m_U, a_Ux, a_Uy, a_Uz]` in 1/kg and m; the targets are in m/s².
#[must_use]
pub fn mass_rows(motion: &ToolMotion, f_k: &Vector3<f64>) -> Rows<4> {
    let mut matrix = Matrix3x4::zeros();
    matrix.set_column(0, f_k);
    matrix
        .fixed_view_mut::<3, 3>(0, 1)
        .copy_from(&omega_matrix(motion));
    Rows {
        matrix,                       // A_3 = [f_K | Ω̇_U], (32)
        target: -motion.acceleration, // b_3 = -p̈_U (p̈_U - g on the ground), (30)
    }
}

/// Returns the equation for mass and centre of mass from the contact forces of the fingers, (48) of
/// Hou et al. 2016.
///
/// `f_u` is the sum of the contact forces **on** the payload, N. The unknowns are
/// `[1/m_U, a_Ux, a_Uy, a_Uz]` of the payload alone, in 1/kg and m; the targets are in m/s².
#[must_use]
pub fn tactile_mass_rows(motion: &ToolMotion, f_u: &Vector3<f64>) -> Rows<4> {
    mass_rows(motion, &-f_u) // (47): f_K = -f_U
}

/// Returns the equation for the inertia about the centre of mass, (45)-(46) of Hou et al. 2016.
///
/// `wrench` acts **on** the body, about the origin of `Σ_U`; `center_of_mass` is `a_U` of the first
/// stage, m. The unknowns are `[Ixx, Ixy, Ixz, Iyy, Iyz, Izz]` in kg m²; the targets are in N m.
#[must_use]
pub fn inertia_rows(
    motion: &ToolMotion,
    wrench: &Wrench,
    center_of_mass: &Vector3<f64>,
) -> Rows<6> {
    Rows {
        matrix: inertia_regressor(motion), // A_4, (46)
        target: wrench.moment - center_of_mass.cross(&wrench.force), // b_4 = n_U - a_U × f_U, (45)
    }
}

/// Returns the 6x10 regressor `Y` of a rigid body, for which `[f_U; n_U] = Y π` with `π` the
/// [`InertialParameters`](crate::InertialParameters) in `Σ_U`.
///
/// The wrench acts **on** the body, is expressed in `Σ_U` and is taken about its origin. The upper
/// three rows are the force, (29) with (47) of Hou et al. 2016; the lower three are the moment,
/// (37) with (41) and the inertia about the origin of `Σ_U`.
#[must_use]
pub fn wrench_regressor(motion: &ToolMotion) -> SMatrix<f64, 6, 10> {
    let products = Vec3::from(&motion.angular_velocity).products();
    mean_wrench_regressor(
        &motion.acceleration,
        &motion.angular_acceleration,
        &products,
    )
}

/// Returns the mean of the [`wrench_regressor`] over several motions, which is linear in the means
/// of these quantities of the motion in `Σ_U`: `p̈_U - g`, `ω̇_U`, and the products
/// `ωxωx, ωxωy, ωxωz, ωyωy, ωyωz, ωzωz` of the angular velocity.
#[must_use]
pub fn mean_wrench_regressor(
    acceleration: &Vector3<f64>,
    angular_acceleration: &Vector3<f64>,
    products: &[f64; 6],
) -> SMatrix<f64, 6, 10> {
    let (a, dw) = (acceleration.into(), angular_acceleration.into());
    SMatrix::from_data(nalgebra::ArrayStorage(regressor_entries(a, dw, *products)))
}

/// Returns the columns of [`wrench_regressor`]: `p̈_U - g`, `Ω̇_U` of (31) above, and
/// `-[p̈_U - g]×` and `Q̇_U` of (45) below. Tests hold the products of `Q̇_U` against
/// [`inertia_regressor`].
#[inline(always)]
pub(crate) fn regressor_entries<T: Real>(
    a: Vec3<T>,
    dw: Vec3<T>,
    products: [T; 6],
) -> [[T; 6]; 10] {
    let ([ax, ay, az], [dx, dy, dz]) = (a.0, dw.0);
    let [xx, xy, xz, yy, yz, zz] = products;
    let o = Mat3::omega_matrix(products, dw);
    let zero = ax.splat(0.0);
    let [ox, oy, oz] = o.0;
    [
        [ax, ay, az, zero, zero, zero],
        [ox[0], oy[0], oz[0], zero, -az, ay],
        [ox[1], oy[1], oz[1], az, zero, -ax],
        [ox[2], oy[2], oz[2], -ay, ax, zero],
        [zero, zero, zero, dx, xz, -xy],
        [zero, zero, zero, dy - xz, dx + yz, xx - yy],
        [zero, zero, zero, dz + xy, zz - xx, dx - yz],
        [zero, zero, zero, -yz, dy, xy],
        [zero, zero, zero, yy - zz, dz - xy, dy + xz],
        [zero, zero, zero, yz, -xz, dz],
    ]
}
