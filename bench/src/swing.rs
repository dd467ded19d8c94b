//! What the long runs of the online identifier share: a sensor that is swung by hand, and the memory
//! that the process takes.

use std::fs;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tactid_dynamics::FrameMotion;

/// Returns the motion of the flange, which turns about the vertical and about its own x axis and
/// sways, given the phase of the motion, s, and its first and second derivative.
pub(crate) fn motion([phase, rate, acceleration]: [f64; 3]) -> FrameMotion {
    let sine = |w: f64| {
        let (sin, cos) = (w * phase).sin_cos();
        [
            sin,
            w * rate * cos,
            w * acceleration * cos - (w * rate).powi(2) * sin,
        ]
    };
    let ([a, da, dda], [b, db, ddb], [c, dc, ddc]) = (sine(4.0), sine(5.0), sine(6.0));
    let (up, along) = (Vector3::z(), Vector3::new(0.1, 0.05, 0.02));
    let turn = UnitQuaternion::from_scaled_axis(up * a);
    let axis = turn * Vector3::x();
    let rotation = turn * UnitQuaternion::from_scaled_axis(Vector3::x() * b);
    FrameMotion {
        pose: Isometry3::from_parts((along * c).into(), rotation),
        velocity: along * dc,
        angular_velocity: up * da + axis * db,
        acceleration: along * ddc,
        angular_acceleration: up * dda + axis * ddb + up.cross(&axis) * (da * db),
    }
}

/// Returns the resident memory of this process, bytes.
pub(crate) fn resident_bytes() -> Result<u64, String> {
    let text = fs::read_to_string("/proc/self/status")
        .map_err(|error| format!("/proc/self/status: {error}"))?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok());
    Ok(kilobytes.ok_or("/proc/self/status has no VmRSS")? << 10)
}
