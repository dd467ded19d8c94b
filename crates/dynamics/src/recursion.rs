//! The recursion over the bodies that all computations share: motion outwards, (1)-(20), and forces
//! inwards, (21)-(41), of Hou et al. 2016.
//!
//! The vectors of a body are expressed in its joint frame: its origin is the origin of the body's
//! frame, and its z axis is the joint's axis. A joint then moves its body about or along z,
//! whatever its axis is in the description, and the inertia of a body is constant. The rates of a
//! vector fixed to the body come from one matrix, `Ω̇ = [ω̇]× + [ω]×²` of (31).

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::manipulator::{Body, JointKind, subtree_ends};
use crate::real::{Real, bounded_angle, sin_cos};
use crate::vector::{Mat3, Vec3};

/// The constants of one body in its joint frame.
#[derive(Clone, Debug)]
pub(crate) struct BodyModel {
    /// Index of the parent body; 0 for the base itself.
    pub(crate) parent: usize,
    /// Index after the last body that this one carries: in depth-first order these follow it.
    pub(crate) end: usize,
    /// Joint above the body; `None` for the base.
    pub(crate) joint: Option<JointModel>,
    /// Rotation of the joint frame in the frame of the parent's joint at joint position zero.
    rotation: Mat3<f64>,
    /// Position of the joint frame's origin in the parent's joint frame at joint position zero, m.
    translation: Vec3<f64>,
    /// Rotation of the joint frame in the body's frame; `None` where they are the same.
    pub(crate) body_from_joint: Option<Matrix3<f64>>,
    /// Mass, kg.
    pub(crate) mass_kg: f64,
    /// First moment of mass, kg m.
    pub(crate) first_moment: Vec3<f64>,
    /// Second moments of mass, the integral of `x xᵀ`, kg m².
    pub(crate) second_moments: Mat3<f64>,
}

/// The joint above a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointModel {
    pub(crate) kind: JointKind,
    /// Index of the coordinate that moves the joint.
    pub(crate) coordinate: usize,
    /// `position = ratio · q + offset`.
    pub(crate) ratio: f64,
    pub(crate) offset: f64,
}

impl JointModel {
    /// Returns the joint's position at a coordinate, as a [`bounded_angle`] for a revolute joint.
    #[inline(always)]
    pub(crate) fn position(&self, coordinate: f64) -> f64 {
        let position = self.ratio * coordinate + self.offset;
        match self.kind {
            JointKind::Revolute => bounded_angle(position),
            JointKind::Prismatic => position,
        }
    }
}

/// Position, velocity and acceleration of one joint, in rad or m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointState<T> {
    pub(crate) position: T,
    pub(crate) velocity: T,
    pub(crate) acceleration: T,
}

/// Motion of one body and the wrench on it, in its joint frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyState<T> {
    /// Rotation of this joint frame in the parent's joint frame (the base: in the inertial frame).
    pub(crate) rotation: Mat3<T>,
    /// Position of this frame's origin in the parent's joint frame, m; for the base, in the
    /// inertial frame.
    pub(crate) translation: Vec3<T>,
    /// Velocity along a prismatic joint, m/s; zero for a revolute one and the base.
    pub(crate) sliding_velocity: T,
    /// `ω`: angular velocity.
    pub(crate) angular_velocity: Vec3<T>,
    /// `ω̇`: angular acceleration.
    pub(crate) angular_acceleration: Vec3<T>,
    /// `Ω̇` of (31).
    pub(crate) omega_matrix: Mat3<T>,
    /// `p̈ - g`: classical acceleration of the origin less the gravitational acceleration.
    pub(crate) acceleration: Vec3<T>,
    /// `f`: force on the body from its parent, N.
    pub(crate) force: Vec3<T>,
    /// `n`: moment on the body from its parent about the origin, N m.
    pub(crate) moment: Vec3<T>,
}

/// Motion of the base frame, in the inertial frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BaseMotion<T> {
    pub(crate) rotation: Mat3<T>,
    pub(crate) position: Vec3<T>,
    pub(crate) angular_velocity: Vec3<T>,
    pub(crate) angular_acceleration: Vec3<T>,
    /// Classical acceleration less the gravitational acceleration.
    pub(crate) acceleration: Vec3<T>,
}

impl BodyModel {
    /// Returns the constants of all bodies of a robot.
    pub(crate) fn of_bodies(bodies: &[Body]) -> Vec<Self> {
        let frames: Vec<UnitQuaternion<f64>> = bodies.iter().map(joint_frame).collect();
        let ends = subtree_ends(bodies);
        let model = |((body, frame), end): ((&Body, &UnitQuaternion<f64>), usize)| {
            let above = frames[body.parent].inverse();
            let zero = match &body.joint {
                None => Isometry3::identity(),
                Some(joint) => above * joint.parent_from_zero * *frame,
            };
            let to_frame = Isometry3::from_parts(Default::default(), frame.inverse());
            let parameters = body.parameters.expressed_in(&to_frame);
            let second_moments = parameters
                .pseudo_inertia()
                .fixed_view::<3, 3>(0, 0)
                .into_owned();
            let is_aligned = *frame == UnitQuaternion::identity();
            Self {
                parent: body.parent,
                end,
                joint: body.joint.as_ref().map(|joint| JointModel {
                    kind: joint.kind,
                    coordinate: joint.coordinate,
                    ratio: joint.ratio,
                    offset: joint.offset,
                }),
                rotation: matrix(&zero.rotation),
                translation: Vec3::from(&zero.translation.vector),
                body_from_joint: (!is_aligned).then(|| *frame.to_rotation_matrix().matrix()),
                mass_kg: parameters.mass(),
                first_moment: Vec3::from(&parameters.first_moment()),
                second_moments: second_moments.into(),
            }
        };
        bodies.iter().zip(&frames).zip(ends).map(model).collect()
    }

    /// Returns the linear momentum of the body and the angular momentum about its origin, for the
    /// velocity of that origin and the angular velocity.
    pub(crate) fn momentum(&self, velocity: Vec3<f64>, w: Vec3<f64>) -> (Vec3<f64>, Vec3<f64>) {
        let (h, second) = (self.first_moment, &self.second_moments);
        let trace = second.0[0][0] + second.0[1][1] + second.0[2][2];
        let turning = w * trace - second * w; // the inertia is tr(Σ) 1 - Σ
        (
            velocity * self.mass_kg + w.cross(h),
            turning + h.cross(velocity),
        )
    }

    /// Returns the pose of a frame that is fixed to the body, in the joint frame.
    pub(crate) fn joint_from_fixed(&self, body_from_fixed: &Isometry3<f64>) -> Isometry3<f64> {
        match &self.body_from_joint {
            None => *body_from_fixed,
            Some(rotation) => {
                let rotation = Rotation3::from_matrix_unchecked(rotation.transpose());
                UnitQuaternion::from_rotation_matrix(&rotation) * body_from_fixed
            }
        }
    }
}

/// Returns the rotation of the joint frame in the body's frame: the smallest one that turns z into
/// the joint's axis.
fn joint_frame(body: &Body) -> UnitQuaternion<f64> {
    let Some(joint) = &body.joint else {
        return UnitQuaternion::identity();
    };
    let turn = UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), &joint.axis);
    // An axis opposite to z is reached by half a turn about any axis across.
    turn.unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    })
}

/// Returns the matrix of a rotation.
pub(crate) fn matrix(rotation: &UnitQuaternion<f64>) -> Mat3<f64> {
    rotation.to_rotation_matrix().into_inner().into()
}

impl<T: Real> BaseMotion<T> {
    /// Returns the motion of a base that is the same in all lanes of `like`.
    #[inline(always)]
    pub(crate) fn splat(like: T, base: &BaseMotion<f64>) -> Self {
        Self {
            rotation: Mat3::splat(like, &base.rotation),
            position: Vec3::splat(like, &base.position),
            angular_velocity: Vec3::splat(like, &base.angular_velocity),
            angular_acceleration: Vec3::splat(like, &base.angular_acceleration),
            acceleration: Vec3::splat(like, &base.acceleration),
        }
    }
}

impl<T: Real> BodyState<T> {
    /// Returns the state of a body at rest in a frame that is its parent's.
    pub(crate) fn at_rest(zero: T) -> Self {
        let (zeros, identity) = (Vec3([zero; 3]), Mat3::from(Matrix3::identity()));
        Self {
            rotation: Mat3::splat(zero, &identity),
            translation: zeros,
            sliding_velocity: zero,
            angular_velocity: zeros,
            angular_acceleration: zeros,
            omega_matrix: Mat3([zeros.0; 3]),
            acceleration: zeros,
            force: zeros,
            moment: zeros,
        }
    }

    /// Computes `Ω̇` from the angular velocity and acceleration.
    #[inline(always)]
    fn set_omega_matrix(&mut self) {
        let products = self.angular_velocity.products();
        self.omega_matrix = Mat3::omega_matrix(products, self.angular_acceleration);
    }

    /// Moves the base.
    #[inline(always)]
    fn move_base(&mut self, base: &BaseMotion<T>) {
        self.rotation = base.rotation;
        self.translation = base.position;
        self.angular_velocity = base.rotation.tr_mul(base.angular_velocity);
        self.angular_acceleration = base.rotation.tr_mul(base.angular_acceleration);
        self.set_omega_matrix();
        self.acceleration = base.rotation.tr_mul(base.acceleration);
    }

    /// Moves a body with its parent and its joint.
    #[inline(always)]
    fn move_body(
        &mut self,
        body: &BodyModel,
        kind: JointKind,
        joint: JointState<T>,
        parent: &Self,
    ) {
        let (rate, zero) = (joint.velocity, joint.velocity.splat(0.0));
        let at_zero = Mat3::splat(zero, &body.rotation);
        let origin = Vec3::splat(zero, &body.translation);
        match kind {
            JointKind::Revolute => {
                let (sin, cos) = sin_cos(joint.position);
                let [x, y, z] = at_zero.0;
                self.rotation = Mat3([
                    rotated_about_z(x, sin, cos),
                    rotated_about_z(y, sin, cos),
                    rotated_about_z(z, sin, cos),
                ]);
                self.translation = origin;
                self.sliding_velocity = zero;
            }
            JointKind::Prismatic => {
                self.rotation = at_zero;
                self.translation = origin + at_zero.column(2) * joint.position;
                self.sliding_velocity = rate;
            }
        }
        // (3), (6), (9), (13), (16), (19) and their centres of mass: a vector fixed to the parent.
        let at_joint = parent.acceleration + &parent.omega_matrix * self.translation;
        let acceleration = self.rotation.tr_mul(at_joint);
        let Vec3([x, y, z]) = self.rotation.tr_mul(parent.angular_velocity);
        let Vec3([dx, dy, dz]) = self.rotation.tr_mul(parent.angular_acceleration);
        match kind {
            JointKind::Revolute => {
                self.angular_velocity = Vec3([x, y, z + rate]); // (2), (5), (8)
                // (12), (15), (18); the printed equations omit the transport term ω × ω*.
                let (dx, dy) = (y.mul_add(rate, dx), (-x).mul_add(rate, dy));
                self.angular_acceleration = Vec3([dx, dy, dz + joint.acceleration]);
                self.acceleration = acceleration;
            }
            JointKind::Prismatic => {
                // The paper has revolute joints only. A prismatic joint moves the origin, with the
                // Coriolis term 2 ω × v.
                self.angular_velocity = Vec3([x, y, z]);
                self.angular_acceleration = Vec3([dx, dy, dz]);
                let twice = rate + rate;
                let coriolis = Vec3([y * twice, -(x * twice), joint.acceleration]);
                self.acceleration = acceleration + coriolis;
            }
        }
        self.set_omega_matrix();
    }

    /// Sets force and moment to those that accelerate this body alone, without its children.
    #[inline(always)]
    pub(crate) fn set_inertial_wrench(&mut self, body: &BodyModel) {
        let (a, o) = (self.acceleration, &self.omega_matrix);
        let zero = a.0[0].splat(0.0);
        let h = Vec3::splat(zero, &body.first_moment);
        self.force = a * zero.splat(body.mass_kg) + o * h; // (24)-(27)
        // (37)-(41): the integral of x × Ω̇ x, by the second moments about the origin.
        let second = Mat3::splat(zero, &body.second_moments);
        let [ox, oy, oz] = [Vec3(o.0[0]), Vec3(o.0[1]), Vec3(o.0[2])];
        let [sx, sy, sz] = [Vec3(second.0[0]), Vec3(second.0[1]), Vec3(second.0[2])];
        let turning = Vec3([
            oz.dot(sy) - oy.dot(sz),
            ox.dot(sz) - oz.dot(sx),
            oy.dot(sx) - ox.dot(sy),
        ]);
        self.moment = turning + h.cross(a);
    }
}

/// Returns a row of a matrix that a rotation about z follows.
#[inline(always)]
fn rotated_about_z<T: Real>([x, y, z]: [T; 3], sin: T, cos: T) -> [T; 3] {
    [x.mul_add(cos, y * sin), y.mul_add(cos, -(x * sin)), z]
}

/// Source of the joint states for the outward recursion.
pub(crate) trait JointStates<T> {
    /// Returns the state of a joint; the angle of a revolute one is a [`bounded_angle`].
    fn state(&self, joint: &JointModel) -> JointState<T>;
}

/// Receiver of the joint torques of the inward recursion.
pub(crate) trait JointTorques<T> {
    /// Adds the torque of a joint (the force of a prismatic one).
    fn add(&mut self, joint: &JointModel, torque: T);
}

/// Moves all bodies, parents first: (1)-(20).
#[inline(always)]
pub(crate) fn outward<T: Real>(
    bodies: &[BodyModel],
    states: &mut [BodyState<T>],
    base: &BaseMotion<T>,
    joints: &impl JointStates<T>,
) {
    for (index, body) in bodies.iter().enumerate() {
        let (before, after) = states.split_at_mut(index);
        let Some(state) = after.first_mut() else {
            return;
        };
        match &body.joint {
            None => state.move_base(base),
            Some(joint) => {
                let parent = &before[body.parent];
                state.move_body(body, joint.kind, joints.state(joint), parent);
            }
        }
    }
}

/// Computes the wrench on every body from its parent, (21)-(41), children first.
#[inline(always)]
pub(crate) fn inward<T: Real>(
    bodies: &[BodyModel],
    states: &mut [BodyState<T>],
    torques: &mut impl JointTorques<T>,
) {
    for (body, state) in bodies.iter().zip(states.iter_mut()) {
        state.set_inertial_wrench(body);
    }
    for (index, body) in bodies.iter().enumerate().rev() {
        let Some(joint) = &body.joint else { continue };
        let (before, after) = states.split_at_mut(index);
        let (parent, state) = (&mut before[body.parent], &after[0]);
        let force = &state.rotation * state.force;
        parent.force = parent.force + force; // (22), (23)
        // a × f_{i-1} + b × f_i of (34) is a × f̂_{i-1}, added above, and (a + b) × f_i.
        let moment = &state.rotation * state.moment + state.translation.cross(force);
        parent.moment = parent.moment + moment; // (33), (34)
        // τ_i = z_i · n_i
        torques.add(
            joint,
            match joint.kind {
                JointKind::Revolute => state.moment.0[2],
                JointKind::Prismatic => state.force.0[2],
            },
        );
    }
}
