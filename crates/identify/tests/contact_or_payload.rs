//! A contact never becomes a payload, and a payload never a contact: neither estimate is settled on
//! a wrong value, also after the contact has ended and after a payload change.

use crate::arm::{Run, TOOL, arm, body};
use crate::handling;
use nalgebra::{Isometry3, Vector2, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::{BaseKind, Wrench};
use tactid_identify::{EquationSettings, Identifier, WORLD, WrenchFrame};

/// Standard deviations of the sensor's noise, N and N m.
const NOISE: [f64; 2] = [0.3, 0.02];

/// What the sensor measures when nothing acts on it.
const OFFSET: Wrench = Wrench {
    force: Vector3::new(3.0, -4.0, 8.0),
    moment: Vector3::new(0.2, -0.1, 0.3),
};

/// A contact, then a payload change.
#[derive(Clone, Copy, Debug)]
struct Case {
    cutoff_hz: f64,
    /// Whether the zero of the sensor is an unknown.
    wrench_offset: bool,
    /// Times at which the arm begins to stop, and to move again, s.
    rest_s: [f64; 2],
    /// Begin and end of the contact, s, and its force in world axes, N.
    contact_s: [f64; 2],
    force: Vector3<f64>,
    /// Time of the payload change, s.
    change_s: f64,
    /// Standard deviations of the noise of joint positions, rad, and velocities, rad/s.
    joints: [f64; 2],
    /// Masses before and after the payload change, kg.
    masses_kg: [f64; 2],
    seed: u64,
}

/// What was wrong in a run: how long errors were beyond four standard deviations, s.
#[derive(Debug, Default)]
struct Wrong {
    /// Of the contact.
    contact_s: f64,
    /// Of the mass while the estimate is settled, and at any time.
    settled_s: f64,
    reported_s: f64,
    /// Of the zero of the sensor.
    zero_s: f64,
    /// Masses before the payload change and at the end, with standard deviations, kg.
    masses: [[f64; 2]; 2],
}

impl Wrong {
    fn check(&self, case: &Case) {
        // A few samples in a row are beyond four standard deviations by chance.
        let is_rare = self.contact_s < 0.02 && self.settled_s < 0.02;
        let is_right = is_rare && self.zero_s < 0.1;
        assert!(is_right, "{case:?} {self:?}");
        for ([mass_kg, std_dev], expected) in self.masses.iter().zip(case.masses_kg) {
            let is_right = (mass_kg - expected).abs() < 4.0 * std_dev && *std_dev < 0.02;
            assert!(is_right, "{case:?} {self:?}");
        }
    }
}

const MASSES_KG: [f64; 2] = [2.0, 3.5];
/// Time from the payload change to the end, s.
const END_S: f64 = 3.0;

/// Time from one sample to the next, s.
const STEP_S: f64 = 0.004;

impl Case {
    fn force_at(&self, time_s: f64) -> Vector3<f64> {
        let [from_s, to_s] = self.contact_s;
        if (from_s..to_s).contains(&time_s) {
            self.force
        } else {
            Vector3::zeros()
        }
    }

    fn run(&self) -> Wrong {
        let [light_kg, heavy_kg] = self.masses_kg;
        let light = body(light_kg, [0.02, -0.01, 0.1], [0.1, 0.1, 0.12]);
        let heavy = body(heavy_kg, [-0.01, 0.03, 0.14], [0.2, 0.15, 0.25]);
        let run = Run {
            base: BaseKind::Fixed,
            rate_hz: STEP_S.recip(),
            payloads: vec![(0.0, light), (self.change_s, heavy)],
            duration_s: self.change_s + END_S,
            gap_s: None,
            motion_seed: self.seed,
        };
        let settings = EquationSettings {
            cutoff_hz: self.cutoff_hz,
            wrench_offset: self.wrench_offset,
            ..EquationSettings::default()
        };
        let offset = if self.wrench_offset {
            OFFSET
        } else {
            Wrench::zero()
        };
        let robot = arm(BaseKind::Fixed);
        let mut identifier = Identifier::new(&robot, TOOL, &[TOOL], &settings).unwrap();
        let world = identifier.wrench_frame(TOOL, Some(WORLD)).unwrap();
        let mut random = SmallRng::seed_from_u64(self.seed);
        let mut wrong = Wrong::default();
        let pushed = |time_s: f64, tool_from_world: &Isometry3<f64>| Wrench {
            force: offset.force + tool_from_world.rotation * self.force_at(time_s),
            moment: offset.moment,
        };
        for mut instant in handling::pausing(&run, self.rest_s, pushed) {
            for (values, std_dev) in instant.joints.iter_mut().zip(self.joints) {
                for value in values {
                    *value += std_dev * random.sample::<f64, _>(StandardNormal);
                }
            }
            let mut noisy = |vector: Vector3<f64>, std_dev: f64| {
                vector.map(|x| x + std_dev * random.sample::<f64, _>(StandardNormal))
            };
            let wrench = Wrench {
                force: noisy(instant.wrench.force, NOISE[0]),
                moment: noisy(instant.wrench.moment, NOISE[1]),
            };
            identifier.push(&instant.sample(&[wrench])).unwrap();
            if instant.time_s > 2.0 {
                self.compare(&identifier, &world, instant.time_s, &mut wrong);
            }
        }
        wrong
    }

    fn compare(
        &self,
        identifier: &Identifier,
        world: &WrenchFrame,
        time_s: f64,
        wrong: &mut Wrong,
    ) {
        // Evidence of a change needs some windows.
        let edges = [self.contact_s[0], self.contact_s[1], self.change_s];
        let is_near = |time_s: f64| {
            edges
                .iter()
                .any(|edge| (-0.05..0.2).contains(&(time_s - edge)))
        };
        if let Some(found) = identifier.contact_wrench(world) {
            let error = found.wrench.force - self.force_at(found.time_s);
            let ratios = error.iter().zip(found.std_devs()).map(|(e, s)| e.abs() / s);
            let is_off = ratios.fold(0.0, f64::max) > 4.0;
            wrong.contact_s += STEP_S * f64::from(u8::from(is_off && !is_near(found.time_s)));
        }
        if is_near(time_s) {
            return;
        }
        let estimate = identifier.estimate();
        let has_changed = time_s > self.change_s;
        let truth_kg = self.masses_kg[usize::from(has_changed)];
        let [mass_kg, std_dev] = [estimate.body.mass_kg, estimate.std_devs[0]];
        let is_off = f64::from(u8::from((mass_kg - truth_kg).abs() > 4.0 * std_dev));
        wrong.reported_s += STEP_S * is_off;
        wrong.settled_s += STEP_S * is_off * f64::from(u8::from(identifier.is_settled()));
        wrong.masses[usize::from(has_changed)] = [mass_kg, std_dev];
        let Some(zero) = identifier.wrench_offset() else {
            return;
        };
        let errors = (zero.wrench.force - OFFSET.force).abs();
        let mut errors = errors.iter().zip(zero.std_devs.unwrap());
        let is_off = errors.any(|(error, std_dev)| *error > 5.0 * std_dev);
        wrong.zero_s += STEP_S * f64::from(u8::from(is_off));
    }
}

/// Of 24 runs with a contact of 15 N for 2 to 4 s and a payload change 3 to 5 s after it, at rest, in
/// motion and across the start of a motion, no estimate is settled on a wrong value.
#[test]
fn a_contact_is_no_payload_and_a_payload_no_contact() {
    let forces = [
        Vector3::new(15.0, 0.0, 0.0),
        Vector3::new(0.0, 0.0, 15.0),
        Vector3::new(0.0, 0.0, -15.0),
        Vector3::new(-6.0, 12.0, -7.0),
    ];
    let never = [100.0, 200.0];
    let mut runs = 0;
    for (rest_s, contact_s, change_s) in [
        ([6.0, 12.0], [8.0, 10.0], 15.0),
        (never, [6.0, 10.0], 13.0),
        ([6.0, 9.0], [8.0, 11.0], 14.0),
    ] {
        for force in forces {
            for cutoff_hz in [10.0, 28.9] {
                let case = Case {
                    cutoff_hz,
                    wrench_offset: runs % 3 != 1,
                    rest_s,
                    contact_s,
                    force,
                    change_s,
                    joints: [0.0; 2],
                    masses_kg: MASSES_KG,
                    seed: runs / 8,
                };
                runs += 1;
                let wrong = case.run();
                wrong.check(&case);
                let is_weight = force.xy() == Vector2::zeros();
                let least_s = if is_weight && rest_s != never {
                    2.0
                } else {
                    0.1
                };
                assert!(wrong.reported_s < least_s, "{case:?} {wrong:?}");
            }
        }
    }
}

/// A contact of the first seconds, in which the noise is not known well, is no payload, either.
#[test]
fn a_contact_of_the_first_seconds_is_no_payload() {
    for (seed, force) in [
        (3, Vector3::new(15.0, 0.0, 0.0)),
        (4, Vector3::new(0.0, 9.0, -12.0)),
    ] {
        let case = Case {
            cutoff_hz: 10.0,
            wrench_offset: false,
            rest_s: [100.0, 200.0],
            contact_s: [2.2, 6.0],
            force,
            change_s: 9.0,
            joints: [0.0; 2],
            masses_kg: MASSES_KG,
            seed,
        };
        let wrong = case.run();
        wrong.check(&case);
        assert!(wrong.reported_s < 0.1, "{case:?} {wrong:?}");
    }
}

/// An oblique push of an arm at rest is no payload beside another zero of the sensor, with noise of
/// the joints that the inertia of a body would explain.
#[test]
fn an_oblique_push_at_rest_is_no_payload() {
    for seed in 0..12 {
        let mut random = SmallRng::seed_from_u64(seed);
        let mut draw = |[from, to]: [f64; 2]| random.random_range(from..to);
        let (tilt, turn, size) = (draw([0.3, 1.0]), draw([0.0, 6.3]), draw([5.0, 15.0]));
        let side = Vector3::new(f64::cos(turn), f64::sin(turn), 0.0) * f64::sin(tilt);
        let up = if seed % 2 == 0 { 1.0 } else { -1.0 };
        let case = Case {
            cutoff_hz: 10.0,
            wrench_offset: true,
            rest_s: [6.0, 14.0],
            contact_s: [8.0, 8.0 + draw([1.0, 5.0])],
            force: (side + Vector3::z() * (up * f64::cos(tilt))) * size,
            change_s: 18.0,
            joints: [2e-5, 1e-3],
            masses_kg: [6.0, 4.0],
            seed,
        };
        case.run().check(&case);
    }
}
