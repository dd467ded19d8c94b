//! Cross-product matrices, wrenches and the motion of a frame.

use std::ops::{Add, Neg, Sub};

use nalgebra::{Isometry3, Matrix3, Vector3};

/// Returns the matrix `[v]×` with `[v]× w = v × w`.
#[must_use]
pub fn cross(v: &Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

/// Returns the 3x6 matrix `L(v)` for which `L(v) I_vec = I v`, with
/// `I_vec = [Ixx, Ixy, Ixz, Iyy, Iyz, Izz]`.
#[must_use]
#[rustfmt::skip]
pub fn inertia_product(v: &Vector3<f64>) -> nalgebra::Matrix3x6<f64> {
    nalgebra::Matrix3x6::new(
        v.x, v.y, v.z, 0.0, 0.0, 0.0,
        0.0, v.x, 0.0, v.y, v.z, 0.0,
        0.0, 0.0, v.x, 0.0, v.y, v.z,
    )
}

/// A force and a moment on a body, expressed in one frame and about that frame's origin. The name
/// of the value states the frame and the body: the value does not carry them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench {
    /// Force, N.
    pub force: Vector3<f64>,
    /// Moment about the frame's origin, N m.
    pub moment: Vector3<f64>,
}

impl Wrench {
    /// Returns the wrench without force and moment.
    #[must_use]
    #[inline]
    pub fn zero() -> Self {
        Self {
            force: Vector3::zeros(),
            moment: Vector3::zeros(),
        }
    }

    /// Returns force, N, then moment, N m.
    #[must_use]
    #[inline]
    pub fn entries(&self) -> [f64; 6] {
        let Self { force, moment } = self;
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }

    /// Returns the same wrench in frame `a` and about its origin, where `self` is in frame `b`.
    #[must_use]
    pub fn expressed_in(&self, a_from_b: &Isometry3<f64>) -> Self {
        let force = a_from_b * self.force;
        Self {
            force,
            moment: a_from_b * self.moment + a_from_b.translation.vector.cross(&force),
        }
    }

    /// Returns whether all six numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.force
            .iter()
            .chain(self.moment.iter())
            .all(|x| x.is_finite())
    }
}

impl Add for Wrench {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            force: self.force + other.force,
            moment: self.moment + other.moment,
        }
    }
}

impl Sub for Wrench {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Wrench {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            force: -self.force,
            moment: -self.moment,
        }
    }
}

/// Pose, velocity and acceleration of a frame, expressed in the inertial frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMotion {
    /// Pose `world_from_frame`. Its translation is the position `p` of the frame's origin, m.
    pub pose: Isometry3<f64>,
    /// Velocity `ṗ` of the frame's origin, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity `ω`, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Classical acceleration `p̈` of the frame's origin, m/s²: the derivative of `velocity`, not
    /// the linear part of a spatial acceleration.
    pub acceleration: Vector3<f64>,
    /// Angular acceleration `ω̇`, rad/s².
    pub angular_acceleration: Vector3<f64>,
}

impl FrameMotion {
    /// Returns the motion of a frame at rest at `pose`.
    #[must_use]
    pub fn at_rest(pose: Isometry3<f64>) -> Self {
        Self {
            pose,
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
            acceleration: Vector3::zeros(),
            angular_acceleration: Vector3::zeros(),
        }
    }

    /// Returns the motion of another frame that is fixed to the same body at `frame_from_fixed`.
    #[must_use]
    pub fn of_fixed(&self, frame_from_fixed: &Isometry3<f64>) -> Self {
        let (w, dw) = (&self.angular_velocity, &self.angular_acceleration);
        let arm = self.pose * frame_from_fixed.translation.vector;
        Self {
            pose: self.pose * frame_from_fixed,
            velocity: self.velocity + w.cross(&arm),
            angular_velocity: *w,
            acceleration: self.acceleration + dw.cross(&arm) + w.cross(&w.cross(&arm)),
            angular_acceleration: *dw,
        }
    }

    /// Returns the accelerations and the angular velocity that the regressors need, expressed in
    /// the frame itself. `gravity` is the gravitational acceleration in the inertial frame, m/s²,
    /// pointing down; it is zero in orbit.
    #[must_use]
    pub fn in_frame(&self, gravity: &Vector3<f64>) -> ToolMotion {
        let frame_from_world = self.pose.rotation.inverse();
        ToolMotion {
            acceleration: frame_from_world * (self.acceleration - gravity),
            angular_velocity: frame_from_world * self.angular_velocity,
            angular_acceleration: frame_from_world * self.angular_acceleration,
        }
    }
}

/// Motion of the end-effector frame `Σ_U`, expressed in `Σ_U`, where the unknowns are constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolMotion {
    /// `p̈_U - g`: classical acceleration of the origin minus the gravitational acceleration, m/s².
    pub acceleration: Vector3<f64>,
    /// `ω_U`: angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// `ω̇_U`: angular acceleration, rad/s².
    pub angular_acceleration: Vector3<f64>,
}
