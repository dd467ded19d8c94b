//! Placement of the frames of bodies and links relative to others.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::manipulator::Link;
use crate::real::Real;
use crate::recursion::{BodyModel, BodyState, matrix};
use crate::vector::{Mat3, Vec3};
use crate::{InertialParameters, Wrench};

/// A link's frame in the joint frame of the body that the link is fixed to.
#[derive(Clone, Debug)]
pub(crate) struct FixedFrame {
    pub(crate) body: usize,
    pub(crate) rotation: Mat3<f64>,
    pub(crate) translation: Vec3<f64>,
}

/// Motion of a [`FixedFrame`], expressed in the frame itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedMotion<T> {
    /// Classical acceleration of the origin less the gravitational acceleration.
    pub(crate) acceleration: Vec3<T>,
    pub(crate) angular_velocity: Vec3<T>,
    pub(crate) angular_acceleration: Vec3<T>,
}

/// Position and rotation of a frame relative to another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) rotation: Mat3<f64>,
    pub(crate) position: Vec3<f64>,
}

/// Position and rotation of a frame relative to another, and the velocity of its origin there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingPlacement {
    pub(crate) placement: Placement,
    /// Velocity of the frame's origin relative to the other frame's origin, in its axes.
    pub(crate) velocity: Vec3<f64>,
}

impl FixedFrame {
    /// Returns the frames of links, in their order, on the bodies that carry them.
    pub(crate) fn of_links(links: &[Link], bodies: &[BodyModel]) -> Vec<Self> {
        let frames = links.iter();
        frames
            .map(|link| Self::new(link, &bodies[link.body]))
            .collect()
    }

    /// Returns the placement of the frame in the joint frame of its body.
    #[inline(always)]
    pub(crate) fn placement(&self) -> Placement {
        Placement {
            rotation: self.rotation,
            position: self.translation,
        }
    }

    /// Returns the motion of the frame in the frame itself, where `state` is the state of its body.
    #[inline(always)]
    pub(crate) fn motion<T: Real>(&self, state: &BodyState<T>) -> FixedMotion<T> {
        let zero = state.sliding_velocity.splat(0.0);
        let rotation = Mat3::splat(zero, &self.rotation);
        let translation = Vec3::splat(zero, &self.translation);
        let acceleration = state.acceleration + &state.omega_matrix * translation;
        FixedMotion {
            acceleration: rotation.tr_mul(acceleration),
            angular_velocity: rotation.tr_mul(state.angular_velocity),
            angular_acceleration: rotation.tr_mul(state.angular_acceleration),
        }
    }

    fn new(link: &Link, body: &BodyModel) -> Self {
        let joint_from_frame = body.joint_from_fixed(&link.body_from_link);
        Self {
            body: link.body,
            rotation: matrix(&joint_from_frame.rotation),
            translation: (&joint_from_frame.translation.vector).into(),
        }
    }
}

impl Placement {
    /// Returns the placement of a body in itself.
    pub(crate) fn identity() -> Self {
        Self {
            rotation: Matrix3::identity().into(),
            position: Vec3([0.0; 3]),
        }
    }

    /// Returns the placement of a body in the frame of its parent; the base is placed in the
    /// inertial frame.
    #[inline(always)]
    pub(crate) fn in_parent(body: &BodyState<f64>) -> Self {
        Self {
            rotation: body.rotation,
            position: body.translation,
        }
    }

    /// Returns the placement of a third frame, where `next` is its placement in this one.
    #[inline(always)]
    pub(crate) fn followed_by(&self, next: &Self) -> Self {
        Self {
            rotation: &self.rotation * &next.rotation,
            position: &self.rotation * next.position + self.position,
        }
    }

    /// Returns the placement of the other frame in this one.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> Self {
        let [x, y, z] = [0, 1, 2].map(|k| self.rotation.column(k).0);
        let position = self.rotation.tr_mul(self.position);
        Self {
            rotation: Mat3([x, y, z]),
            position: Vec3([0.0; 3]) - position,
        }
    }

    /// Returns a wrench in the frame in which this one is placed, about its origin, where `wrench`
    /// is in the placed frame.
    #[inline(always)]
    pub(crate) fn transform_wrench(&self, wrench: &Wrench) -> Wrench {
        let force = &self.rotation * Vec3::from(&wrench.force);
        let moment = &self.rotation * Vec3::from(&wrench.moment);
        Wrench {
            force: force.into(),
            moment: (moment + self.position.cross(force)).into(),
        }
    }

    /// Returns a wrench in the placed frame, about its origin, where `wrench` is in the frame in
    /// which it is placed.
    #[inline(always)]
    pub(crate) fn inverse_transform_wrench(&self, wrench: &Wrench) -> Wrench {
        let force = Vec3::from(&wrench.force);
        let moment = Vec3::from(&wrench.moment) - self.position.cross(force);
        Wrench {
            force: self.rotation.tr_mul(force).into(),
            moment: self.rotation.tr_mul(moment).into(),
        }
    }

    /// Returns the parameters of a body in the frame in which its joint frame is placed.
    pub(crate) fn parameters_of(&self, body: &BodyModel) -> InertialParameters {
        let rotation = Matrix3::from(&self.rotation);
        let arm = Vector3::from(self.position);
        let second = Matrix3::from(&body.second_moments);
        let turned = rotation * Vector3::from(body.first_moment);
        let mixed = arm * turned.transpose();
        let second = rotation * second * rotation.transpose()
            + mixed
            + mixed.transpose()
            + arm * arm.transpose() * body.mass_kg;
        let inertia = Matrix3::identity() * second.trace() - second;
        InertialParameters::from_moments(body.mass_kg, &(turned + arm * body.mass_kg), &inertia)
    }

    /// Returns the pose.
    pub(crate) fn pose(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(Vector3::from(self.position)),
            quaternion(&self.rotation),
        )
    }
}

/// Returns the quaternion of a rotation.
pub(crate) fn quaternion(rotation: &Mat3<f64>) -> UnitQuaternion<f64> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from(rotation));
    UnitQuaternion::from_rotation_matrix(&rotation)
}

impl MovingPlacement {
    /// Returns the placement of a body in itself.
    pub(crate) fn identity() -> Self {
        Self {
            placement: Placement::identity(),
            velocity: Vec3([0.0; 3]),
        }
    }

    /// Returns the placement of a body in the frame of its parent; `parent_velocity` is the
    /// parent's angular velocity in its own frame.
    #[inline(always)]
    pub(crate) fn in_parent(body: &BodyState<f64>, parent_velocity: Vec3<f64>) -> Self {
        let sliding = body.rotation.column(2) * body.sliding_velocity;
        Self {
            placement: Placement::in_parent(body),
            velocity: parent_velocity.cross(body.translation) + sliding,
        }
    }

    /// Returns the placement of a third frame, where `next` is its placement in this one.
    #[inline(always)]
    pub(crate) fn followed_by(&self, next: &Self) -> Self {
        Self {
            placement: self.placement.followed_by(&next.placement),
            velocity: &self.placement.rotation * next.velocity + self.velocity,
        }
    }
}
