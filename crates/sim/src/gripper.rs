//! The grasp: both fingers close slowly until they press as hard as they should, then lock.

use crate::contact::ContactPoint;
use crate::experiment::Gripper;
use crate::scene::{Scene, State};
use crate::{SimError, error::ADVICE_GRASP};

/// Time constant of the filter on the grip force, s: the first touch is a spike that holds nothing.
const FORCE_FILTER_S: f64 = 0.05;
/// How near the force must be, as a fraction, and for how long, s, before the fingers lock.
const FORCE_TOLERANCE: f64 = 0.02;
const FORCE_HOLDS_S: f64 = 0.2;
/// How long the locked grasp may ring before the payload is taken as held, s.
const SETTLING_S: f64 = 0.5;
/// The time for all this, as a distance at closing speed, m.
const SEARCH_M: f64 = 2e-3;

/// Closes the gripper and returns the force with which each finger presses, N.
pub(crate) fn grasp(scene: &mut Scene, settings: &Gripper, dt: f64) -> Result<f64, SimError> {
    let mut grasp = Grasp {
        state: State::new(scene.robot().bodies.len()),
        contacts: [Vec::new(), Vec::new()],
        still: vec![0.0; scene.drives().len()],
        filtered: 0.0,
        dt,
    };
    // Held from the first touch on, the payload stays where it was put while the pads press on it.
    scene.anchor_grasp();
    let wanted = settings.grip_force_n;
    let search_s = SEARCH_M / settings.closing_speed_m_s;
    let mut holds_s = 0.0;
    for _ in 0..steps(search_s, dt) {
        let missing = 1.0 - grasp.filtered / wanted;
        holds_s = if missing.abs() < FORCE_TOLERANCE {
            holds_s + dt
        } else {
            0.0
        };
        if holds_s > FORCE_HOLDS_S {
            return grasp.settle(scene, wanted);
        }
        // Slower towards the end: filter and contacts lag behind.
        scene.move_fingers(settings.closing_speed_m_s * (4.0 * missing).clamp(-1.0, 1.0));
        grasp.step(scene);
    }
    Err(SimError::Grasp(format!(
        "after {search_s:.1} s each finger presses with {:.1} N in place of {wanted} N; check that payload.handle stands between the pads",
        grasp.filtered
    )))
}

fn steps(duration_s: f64, dt: f64) -> usize {
    (duration_s / dt).ceil() as usize
}

struct Grasp {
    state: State,
    contacts: [Vec<ContactPoint>; 2],
    still: Vec<f64>,
    /// Mean of both fingers, N.
    filtered: f64,
    dt: f64,
}

impl Grasp {
    fn step(&mut self, scene: &mut Scene) {
        scene.read(&mut self.state);
        scene.drive(&self.still);
        scene.step();
        scene.contacts(&self.state.payload, &mut self.contacts);
        let pressure: f64 = self.contacts.iter().flatten().map(|c| c.normal_force).sum();
        self.filtered += (0.5 * pressure - self.filtered) * (self.dt / FORCE_FILTER_S).min(1.0);
    }

    fn settle(mut self, scene: &mut Scene, wanted: f64) -> Result<f64, SimError> {
        scene.move_fingers(0.0);
        for _ in 0..steps(SETTLING_S, self.dt) {
            self.step(scene);
        }
        // Half the force may hold; less is no grasp. Written so that NaN is none either.
        if self.filtered > 0.5 * wanted {
            return Ok(self.filtered);
        }
        Err(SimError::Grasp(format!(
            "locked, each finger presses with {:.1} N in place of {wanted} N; {ADVICE_GRASP}",
            self.filtered
        )))
    }
}
