//! Contact forces of the pads, and friction without drift.

use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;
use rapier3d_f64::dynamics::{RigidBodyHandle, RigidBodySet};
use rapier3d_f64::geometry::{ColliderHandle, ContactPair, NEW_CONTACT_BIT};
use rapier3d_f64::math::Pose;
use rapier3d_f64::pipeline::{ContactModificationContext, PhysicsHooks};
use rapier3d_f64::utils::OrthonormalBasis;

use crate::convert;

/// Contact between a finger and the payload, expressed in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactPoint {
    /// Position, m.
    pub position: Vector3<f64>,
    /// Force on the payload, N.
    pub force: Vector3<f64>,
    /// Component of the force along the contact normal, N.
    pub normal_force: f64,
}

/// Appends the contacts of one pair to `points`. `center` is the position of the payload's centre
/// of mass at the start of the step, m.
///
/// Rapier keeps one impulse for each contact and step, because there is a single substep, so that
/// each counts once.
pub(crate) fn read_contacts(
    pair: &ContactPair,
    handle: ColliderHandle,
    center: &Vector3<f64>,
    dt: f64,
    points: &mut Vec<ContactPoint>,
) {
    let payload_is_first = pair.collider1 == handle;
    let sign = if payload_is_first { 1.0 } else { -1.0 };
    for manifold in pair.solver_manifolds() {
        // The solver's axes: the normal towards the first body, and two tangents.
        let normal = -manifold.data.normal;
        let tangent1 = normal.orthonormal_vector();
        let tangent2 = normal.cross(tangent1);
        for contact in &manifold.data.solver_contacts {
            let id = (contact.contact_id[0] & !NEW_CONTACT_BIT) as usize;
            let Some(data) = manifold.points.get(id).map(|point| &point.data) else {
                continue;
            };
            let impulse = normal * data.impulse
                + tangent1 * data.tangent_impulse.x
                + tangent2 * data.tangent_impulse.y;
            let arm = if payload_is_first {
                data.solver_dp1
            } else {
                data.solver_dp2
            };
            points.push(ContactPoint {
                position: center + convert::vector(arm),
                force: convert::vector(impulse) * (sign / dt),
                normal_force: data.impulse / dt,
            });
        }
    }
}

/// Hook that prevents creep of the grasp. Rapier's friction acts on velocities only, so that
/// positions creep by centimetres over the experiment. The hook requests for each contact the
/// tangential velocity that reverses its slip.
pub(crate) struct SlipAnchors {
    fingers: [RigidBodyHandle; 2],
    payload: RigidBodyHandle,
    /// Fraction of the slip that is reversed in a step, divided by the step, 1/s.
    rate: f64,
    /// Anchor of each finger, in a mutex because Rapier requires the hook to be `Sync`.
    holds: Mutex<[Option<Hold>; 2]>,
}

/// Pose of the payload relative to a finger that friction maintains.
#[derive(Clone, Copy)]
struct Hold {
    finger_from_payload: Pose,
    /// Whether the payload slid away from this pose in the last step.
    slides: bool,
}

/// Fraction of the slip that is reversed in each step. At 0.5 the grasp is unstable.
const REVERSED_PER_STEP: f64 = 0.1;

/// Slip above which the contact counts as sliding, m. A payload that is held slips less.
const SLIDES_AT_M: f64 = 50e-6;

impl SlipAnchors {
    pub(crate) fn new(fingers: [RigidBodyHandle; 2], payload: RigidBodyHandle, dt: f64) -> Self {
        Self {
            fingers,
            payload,
            rate: REVERSED_PER_STEP / dt,
            holds: Mutex::new([None; 2]),
        }
    }

    fn holds(&self) -> MutexGuard<'_, [Option<Hold>; 2]> {
        self.holds.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Anchors the payload at its present pose relative to each finger.
    pub(crate) fn hold(&self, bodies: &RigidBodySet) {
        for (finger, hold) in self.holds().iter_mut().enumerate() {
            *hold = self.present_hold(finger, bodies);
        }
    }

    /// Anchors the payload anew at each finger on which it slid in the last step.
    pub(crate) fn follow_slides(&self, bodies: &RigidBodySet) {
        for (finger, hold) in self.holds().iter_mut().enumerate() {
            if hold.is_some_and(|hold| hold.slides) {
                *hold = self.present_hold(finger, bodies);
            }
        }
    }

    /// Returns the present pose of the payload relative to a finger.
    fn present_hold(&self, finger: usize, bodies: &RigidBodySet) -> Option<Hold> {
        let world_from_finger = bodies.get(self.fingers[finger])?.position();
        let world_from_payload = bodies.get(self.payload)?.position();
        Some(Hold {
            finger_from_payload: world_from_finger.inverse() * *world_from_payload,
            slides: false,
        })
    }
}

impl PhysicsHooks for SlipAnchors {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        let payload_is_first = context.rigid_body1 == Some(self.payload);
        let other = if payload_is_first {
            context.rigid_body2
        } else {
            context.rigid_body1
        };
        let Some(finger) = self.fingers.iter().position(|f| Some(*f) == other) else {
            return;
        };
        let mut holds = self.holds();
        let (Some(hold), Some(present)) = (
            &mut holds[finger],
            self.present_hold(finger, context.bodies),
        ) else {
            return;
        };
        let world_from_finger = *context.bodies[self.fingers[finger]].position();
        let Some(manifold) = context.rigid_mut() else {
            return;
        };
        let normal = *manifold.normal;
        // The solver enforces: velocity of the first body minus velocity of the
        // second = -tangent_velocity.
        let rate = if payload_is_first {
            self.rate
        } else {
            -self.rate
        };
        for contact in manifold.solver_contacts.iter_mut() {
            let point = (contact.anchor1 + contact.anchor2) * 0.5;
            let in_finger = world_from_finger.inverse_transform_point(point);
            let in_payload = present
                .finger_from_payload
                .inverse_transform_point(in_finger);
            let moved = in_finger - hold.finger_from_payload.transform_point(in_payload);
            let moved = world_from_finger.rotation * moved;
            let slip = moved - normal * moved.dot(normal);
            hold.slides |= slip.length() > SLIDES_AT_M;
            contact.tangent_velocity = slip * rate;
        }
    }
}
