//! Integration of the motion of a floating base, for simulated samples.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tactid_dynamics::FrameMotion;

/// Returns the base one step later, by the classical Runge-Kutta method. `accelerate` sets the
/// accelerations of a base at a fraction of the step.
pub(crate) fn runge_kutta(
    start: &FrameMotion,
    step_s: f64,
    mut accelerate: impl FnMut(&mut FrameMotion, f64),
) -> FrameMotion {
    let mut slopes: Vec<FrameMotion> = Vec::with_capacity(4);
    for fraction in [0.0, 0.5, 0.5, 1.0] {
        let mut at = slopes
            .last()
            .map_or(*start, |slope| advance(start, slope, fraction * step_s));
        accelerate(&mut at, fraction);
        slopes.push(at);
    }
    let mean = |f: &dyn Fn(&FrameMotion) -> Vector3<f64>| {
        (f(&slopes[0]) + (f(&slopes[1]) + f(&slopes[2])) * 2.0 + f(&slopes[3])) / 6.0
    };
    let slope = FrameMotion {
        velocity: mean(&|s| s.velocity),
        angular_velocity: mean(&|s| s.angular_velocity),
        acceleration: mean(&|s| s.acceleration),
        angular_acceleration: mean(&|s| s.angular_acceleration),
        ..*start
    };
    advance(start, &slope, step_s)
}

/// Returns `start` after a time with the velocities and accelerations of `slope`.
fn advance(start: &FrameMotion, slope: &FrameMotion, duration_s: f64) -> FrameMotion {
    let turn = UnitQuaternion::from_scaled_axis(slope.angular_velocity * duration_s);
    let position = start.pose.translation.vector + slope.velocity * duration_s;
    FrameMotion {
        pose: Isometry3::from_parts(position.into(), turn * start.pose.rotation),
        velocity: start.velocity + slope.acceleration * duration_s,
        angular_velocity: start.angular_velocity + slope.angular_acceleration * duration_s,
        ..*start
    }
}
