//! The arrays of a recording.

use nalgebra::Isometry3;
use tactid_dynamics::Manipulator;

/// A recording in arrays on one clock.
///
/// Matrices are flat, row by row; a row is one of N samples. An array that is empty was not
/// measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct Arrays<'a> {
    /// Robot with n joints. Where it is `None`, the robot is that of
    /// [`Request::urdf`](crate::Request::urdf); without either, the arrays are those of a sensor
    /// that is carried about, whose motion is that of the base.
    pub robot: Option<&'a Manipulator>,
    /// Links of the S wrench sensors. Default (`None`): one sensor in the end-effector frame where
    /// there are wrenches, else none.
    pub sensors: Option<&'a [&'a str]>,
    /// Time of each sample, s: N, increasing.
    pub time: &'a [f64],
    /// Joint positions, rad or m: N x n.
    pub q: &'a [f64],
    /// Joint velocities, rad/s or m/s: N x n, or empty to derive them from the positions.
    pub qd: &'a [f64],
    /// Joint efforts, N m or N, which include those for gravity and payload: N x n, or empty.
    pub effort: &'a [f64],
    /// Force, N, and moment, N m, of each sensor, in its own frame and about that frame's origin: N
    /// x S x 6, or empty.
    pub wrench: &'a [f64],
    /// `world_from_base`: N poses, or one for a floating base that does not move. A fixed base has
    /// none, and neither twists nor accelerations. Without a robot they are those of the sensor.
    pub pose: &'a [Isometry3<f64>],
    /// Velocity of the base frame's origin, m/s, and angular velocity, rad/s, along the axes of the
    /// world: N x 6, or empty to derive them from the poses.
    pub twist: &'a [f64],
    /// Classical acceleration of the base frame's origin without gravity, m/s², and angular
    /// acceleration, rad/s², along the axes of the world: N x 6, or empty to derive them from the
    /// velocities.
    pub acceleration: &'a [f64],
    /// Reference of the same motion without the payload, whose efforts are subtracted by the effort
    /// method.
    pub unloaded: Option<UnloadedArrays<'a>>,
}

/// Joints of the same motion without the payload, in arrays on a clock of their own.
///
/// Matrices are flat, row by row; a row is one of M samples. The time at which the motion is the
/// same is found by comparing the positions.
#[derive(Clone, Copy, Debug)]
pub struct UnloadedArrays<'a> {
    /// Time of each sample, s: M, increasing.
    pub time: &'a [f64],
    /// Joint positions in the order of the robot, rad or m: M x n.
    pub q: &'a [f64],
    /// Joint efforts, N m or N, to which the gains of the request apply, too: M x n.
    pub effort: &'a [f64],
}
