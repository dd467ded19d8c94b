//! Orientations as users and messages give them: quaternions that are about normalised.

use nalgebra::{Quaternion, UnitQuaternion};

/// Largest difference of a quaternion's norm from one.
///
/// Rounding to two decimals changes the norm by less than 0.02, and single precision by far less. Numbers that are no
/// quaternion, such as zeros or Euler angles, seldom have a norm so close to one.
const NORM_TOLERANCE: f64 = 0.1;

/// Returns the rotation of a quaternion; `None` if its norm is not one to within 0.1, or is not finite.
#[must_use]
pub fn unit_quaternion(quaternion: Quaternion<f64>) -> Option<UnitQuaternion<f64>> {
    // The comparison with NaN is false.
    let is_unit = (quaternion.norm() - 1.0).abs() <= NORM_TOLERANCE;
    is_unit.then(|| UnitQuaternion::new_normalize(quaternion))
}
