//! Poses and numbers of urdf-rs.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use urdf_rs::Pose;

/// Returns a pose as a transform.
pub(super) fn isometry(pose: &Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = *pose.rpy;
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Isometry3::from_parts(Translation3::from(*pose.xyz), rotation)
}

/// Returns whether all numbers are finite.
pub(super) fn is_finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.is_finite())
}
