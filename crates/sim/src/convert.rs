//! Conversions between nalgebra, which the workspace uses, and glam, which Rapier uses.

use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::math::{Matrix, Pose, Rotation, Vector};

pub(crate) fn vector(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub(crate) fn glam_vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(crate) fn rotation(r: Rotation) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(r.w, r.x, r.y, r.z))
}

pub(crate) fn pose(p: &Pose) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(vector(p.translation)),
        rotation(p.rotation),
    )
}

pub(crate) fn glam_pose(p: &Isometry3<f64>) -> Pose {
    let r = p.rotation.coords;
    Pose::from_parts(
        glam_vector(&p.translation.vector),
        Rotation::from_xyzw(r.x, r.y, r.z, r.w),
    )
}

pub(crate) fn glam_matrix(m: &Matrix3<f64>) -> Matrix {
    Matrix::from_cols(
        Vector::new(m[(0, 0)], m[(1, 0)], m[(2, 0)]),
        Vector::new(m[(0, 1)], m[(1, 1)], m[(2, 1)]),
        Vector::new(m[(0, 2)], m[(1, 2)], m[(2, 2)]),
    )
}
