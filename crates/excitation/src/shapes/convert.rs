//! Conversions between nalgebra, which the workspace uses, and glam, which parry uses.

use nalgebra::{Isometry3, Vector3};
use parry3d_f64::math::{Pose, Rotation, Vector};

pub(crate) fn glam_vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(crate) fn glam_pose(p: &Isometry3<f64>) -> Pose {
    let r = p.rotation.coords;
    Pose::from_parts(
        glam_vector(&p.translation.vector),
        Rotation::from_xyzw(r.x, r.y, r.z, r.w),
    )
}
