//! What the pads feel, and friction that holds.

use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;
use rapier3d_f64::dynamics::{RigidBodyHandle, RigidBodySet};
use rapier3d_f64::geometry::{ColliderHandle, ContactPair, NEW_CONTACT_BIT};
use rapier3d_f64::math::Pose;
use rapier3d_f64::pipeline::{ContactModificationContext, PhysicsHooks};
use rapier3d_f64::utils::OrthonormalBasis;

use crate::convert;

/// Where and how a finger pushes the payload, in world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactPoint {
    pub position: Vector3<f64>,
    /// On the payload, N.
    pub force: Vector3<f64>,
    /// The part of the force that is pressure, N.
    pub normal_force: f64,
}

/// Adds the contacts of one pair to `points`. `center` is where the payload's centre of mass was when the step began.
///
/// Rapier keeps one impulse for each contact and step (there is a single substep), so each is counted once.
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
        // As the solver has them: force on the first body's side, and its two tangents.
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

/// Friction in Rapier stops velocities and lets positions creep, by centimetres over the experiment. Here each
/// contact is asked for the tangential velocity that takes its slip back.
pub(crate) struct SlipAnchors {
    fingers: [RigidBodyHandle; 2],
    payload: RigidBodyHandle,
    /// Fraction of the slip that a step takes back, over the step, 1/s.
    rate: f64,
    /// By finger. Rapier wants the hook to be `Sync`.
    holds: Mutex<[Option<Hold>; 2]>,
}

/// How a finger holds the payload.
#[derive(Clone, Copy)]
struct Hold {
    finger_from_payload: Pose,
    /// Whether the last step saw the payload slide away from there.
    slides: bool,
}

/// Half of the slip taken back each step is unstable.
const TAKEN_BACK_PER_STEP: f64 = 0.1;

/// More slip than a payload that is held ever shows, m: friction has given way.
const SLIDES_AT_M: f64 = 50e-6;

impl SlipAnchors {
    pub(crate) fn new(fingers: [RigidBodyHandle; 2], payload: RigidBodyHandle, dt: f64) -> Self {
        Self {
            fingers,
            payload,
            rate: TAKEN_BACK_PER_STEP / dt,
            holds: Mutex::new([None; 2]),
        }
    }

    fn holds(&self) -> MutexGuard<'_, [Option<Hold>; 2]> {
        self.holds.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Holds the payload where it is.
    pub(crate) fn hold(&self, bodies: &RigidBodySet) {
        for (finger, hold) in self.holds().iter_mut().enumerate() {
            *hold = self.present_hold(finger, bodies);
        }
    }

    /// Takes a new hold with each finger on which the payload slid in the last step.
    pub(crate) fn follow_slides(&self, bodies: &RigidBodySet) {
        for (finger, hold) in self.holds().iter_mut().enumerate() {
            if hold.is_some_and(|hold| hold.slides) {
                *hold = self.present_hold(finger, bodies);
            }
        }
    }

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
        // The solver seeks: first minus second body's velocity = -tangent_velocity.
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
