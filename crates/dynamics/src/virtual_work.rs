//! The power of the wrench that moves a body, as coefficients of its parameters.

use nalgebra::{SVector, Vector3};

use crate::ToolMotion;
use crate::vector::Vec3;

/// Motion of a body in its own frame, and the velocity of its origin for a unit velocity of one
/// joint above it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RegressorState {
    pub(crate) motion: ToolMotion,
    /// Velocity of the origin, then angular velocity, in the joint frame.
    pub(crate) column: [Vec3<f64>; 2],
}

impl Default for RegressorState {
    fn default() -> Self {
        Self {
            motion: ToolMotion {
                acceleration: Vector3::zeros(),
                angular_velocity: Vector3::zeros(),
                angular_acceleration: Vector3::zeros(),
            },
            column: [Vec3([0.0; 3]); 2],
        }
    }
}

/// Returns the power of the wrench that moves a body, as coefficients of its parameters, for a
/// velocity `v` of its origin and an angular velocity `u`: `[v; u]ᵀ Y` with `Y` the
/// [`wrench_regressor`](crate::wrench_regressor), of which half is zero.
pub(crate) fn power_regressor(
    motion: &ToolMotion,
    v: &Vector3<f64>,
    u: &Vector3<f64>,
) -> SVector<f64, 10> {
    let (a, w, dw) = (
        &motion.acceleration,
        &motion.angular_velocity,
        &motion.angular_acceleration,
    );
    let turned = u.cross(w);
    // (31) transposed: v · (ω̇ × h + ω × (ω × h)) = (v × ω̇ + (v × ω) × ω) · h
    let h = v.cross(dw) + v.cross(w).cross(w) + a.cross(u);
    // (45): u · (I ω̇ + ω × I ω) = u · I ω̇ + (u × ω) · I ω
    let both = |k: usize, l: usize| u[k] * dw[l] + turned[k] * w[l];
    SVector::from([
        v.dot(a),
        h.x,
        h.y,
        h.z,
        both(0, 0),
        both(0, 1) + both(1, 0),
        both(0, 2) + both(2, 0),
        both(1, 1),
        both(1, 2) + both(2, 1),
        both(2, 2),
    ])
}
