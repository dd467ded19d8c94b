//! The grasp: both fingers close slowly until they press with the requested force and are then
//! locked. Until then the payload is supported: gravity acts on nothing. Then it grows to its value
//! within half of the settling time.

use nalgebra::Vector3;

use crate::contact::ContactPoint;
use crate::scene::{Scene, State};
use crate::{Experiment, SimError, error::ADVICE_GRASP};

/// Time constant of the grip force's low-pass filter, s. It removes the spike of the first contact.
const FORCE_FILTER_S: f64 = 0.05;
/// Relative error of the grip force below which the fingers may be locked.
const FORCE_TOLERANCE: f64 = 0.02;
/// Time for which the grip force must stay within its tolerance before the fingers are locked, s.
const FORCE_HOLDS_S: f64 = 0.2;
/// Time for which the locked grasp settles before the excitation starts, s.
const SETTLING_S: f64 = 0.5;
/// Distance that the fingers may travel at closing speed before the grasp counts as failed, m. It
/// limits the time.
const SEARCH_M: f64 = 1e-2;

/// Closes the gripper, lets gravity act, and returns the force of each finger on the payload, N.
///
/// # Errors
/// Returns [`SimError::Grasp`] if the force is not reached, or is lost when the fingers are locked.
pub(crate) fn grasp(scene: &mut Scene, experiment: &Experiment) -> Result<f64, SimError> {
    let (closing_speed, dt) = (experiment.gripper.closing_speed_m_s, experiment.step_s);
    let mut grasp = Grasp {
        state: State::new(scene.robot().bodies.len()),
        contacts: [Vec::new(), Vec::new()],
        still: vec![0.0; scene.roles().arm.len()],
        filtered: 0.0,
        dt,
    };
    // Anchored before the first contact, the payload stays in place while the pads close.
    scene.anchor_grasp();
    let requested_n = experiment.grip_force_n();
    let search_s = SEARCH_M / closing_speed;
    let mut holds_s = 0.0;
    for _ in 0..steps(search_s, dt) {
        let missing = 1.0 - grasp.filtered / requested_n;
        holds_s = if missing.abs() < FORCE_TOLERANCE {
            holds_s + dt
        } else {
            0.0
        };
        if holds_s > FORCE_HOLDS_S {
            return grasp.settle(scene, requested_n, &experiment.gravity());
        }
        // The fingers slow down near the requested force, because filter and contacts lag.
        scene.move_fingers(closing_speed * (4.0 * missing).clamp(-1.0, 1.0));
        grasp.step(scene);
    }
    let advice = if grasp.filtered > 0.0 {
        "lower gripper.grip_force_n, because the contacts of a light payload are soft"
    } else {
        "check that payload.handle is between the pads"
    };
    Err(SimError::Grasp(format!(
        "after {search_s:.1} s each finger presses with {:.1} N in place of {requested_n} N; {advice}",
        grasp.filtered
    )))
}

/// Returns the number of steps of a duration.
fn steps(duration_s: f64, dt: f64) -> usize {
    (duration_s / dt).ceil() as usize
}

/// State of the closing gripper.
struct Grasp {
    state: State,
    contacts: [Vec<ContactPoint>; 2],
    /// Commanded velocities of the arm: zero.
    still: Vec<f64>,
    /// Filtered mean of both fingers' normal forces, N.
    filtered: f64,
    dt: f64,
}

impl Grasp {
    /// Simulates one step and updates the filtered force.
    fn step(&mut self, scene: &mut Scene) {
        scene.read(&mut self.state);
        scene.drive(&self.still);
        scene.step();
        scene.contacts(&self.state.payload, &mut self.contacts);
        let pressure: f64 = self.contacts.iter().flatten().map(|c| c.normal_force).sum();
        self.filtered += (0.5 * pressure - self.filtered) * (self.dt / FORCE_FILTER_S).min(1.0);
    }

    /// Locks the fingers, lets gravity act, waits, and returns the force left of each finger, N.
    fn settle(
        mut self,
        scene: &mut Scene,
        requested_n: f64,
        gravity: &Vector3<f64>,
    ) -> Result<f64, SimError> {
        scene.move_fingers(0.0);
        let steps = steps(SETTLING_S, self.dt);
        for step in 1..=steps {
            let fraction = (2.0 * step as f64 / steps as f64).min(1.0);
            scene.set_gravity(&(gravity * fraction));
            self.step(scene);
        }
        // Less than half of the requested force is no grasp. The comparison also fails for NaN.
        if self.filtered > 0.5 * requested_n {
            return Ok(self.filtered);
        }
        Err(SimError::Grasp(format!(
            "locked, each finger presses with {:.1} N in place of {requested_n} N; {ADVICE_GRASP}",
            self.filtered
        )))
    }
}
