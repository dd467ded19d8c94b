//! The wrench of a contact: the measured wrench less offset and load, with an uncertainty that
//! holds at rest, in motion and while a payload changes.

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{
    BatchIdentifier, BatchResult, BatchSettings, ContactSample, LoadEstimate, RecordedContact,
};
use tactid_dynamics::{BaseKind, MassProperties, Wrench};
use tactid_identify::{
    ActsOn, ContactState, EquationSettings, HALF_WIDTH_95, Identifier, PushOutcome, WORLD,
    WrenchFrame,
};

use crate::arm::{Instant, Run, TOOL, arm, body};
use crate::handling;

/// Standard deviations of the sensor's noise, N and N m.
pub(crate) const NOISE: [f64; 2] = [0.3, 0.02];

/// Standard deviation of white noise of 500 Hz behind four equal stages that lose 3 dB at 10 Hz
/// together.
const FILTERED: f64 = 0.213;

/// One run with a contact or with payload changes.
pub(crate) struct Trial {
    pub(crate) payloads: Vec<(f64, MassProperties)>,
    pub(crate) duration_s: f64,
    pub(crate) stop_s: f64,
    /// Time of the contact, s, and its force on the sensor's side, in world axes, N.
    pub(crate) contact: Option<([f64; 2], Vector3<f64>)>,
    /// Standard deviations of joint positions, rad, and velocities, rad/s.
    pub(crate) joints: [f64; 2],
    pub(crate) hold: bool,
    /// What the sensor measures when nothing acts on it.
    pub(crate) offset: Wrench,
    pub(crate) seed: u64,
}

/// What was seen of the contact in a run.
#[derive(Default, Debug)]
pub(crate) struct Seen {
    pub(crate) alarms: Vec<f64>,
    pub(crate) returns: Vec<f64>,
    /// Samples with a contact wrench, and those whose errors are within 1.96 standard deviations,
    /// for six entries.
    pub(crate) samples: u32,
    pub(crate) inside: u32,
    /// Largest error in standard deviations, but within 0.1 s of the ends of a contact, and when.
    pub(crate) worst: (f64, f64),
    /// Sums of squared errors of forces and of moments during the contact, but within 0.1 s of its
    /// ends, and their count.
    pub(crate) squares: [f64; 2],
    pub(crate) during: u32,
    /// Largest force while nothing touches the payload, N.
    pub(crate) largest: f64,
    /// Standard deviation of a force in the middle of the contact, N.
    pub(crate) std_dev: f64,
    /// Mass before the contact and at the end, with standard deviations, kg.
    pub(crate) masses: [[f64; 2]; 2],
    pub(crate) settled_samples: u32,
}

impl Trial {
    pub(crate) fn moving(seed: u64) -> Self {
        Self {
            payloads: vec![(0.0, body(3.2, [0.03, -0.02, 0.09], [0.2, 0.15, 0.25]))],
            duration_s: 14.0,
            stop_s: 100.0,
            contact: None,
            joints: [0.0; 2],
            hold: false,
            offset: Wrench::zero(),
            seed,
        }
    }

    fn force_at(&self, time_s: f64) -> Vector3<f64> {
        let active = self
            .contact
            .filter(|([from_s, to_s], _)| (*from_s..*to_s).contains(&time_s));
        active.map_or(Vector3::zeros(), |(_, force)| force)
    }

    /// Returns the samples with their noise.
    fn samples(&self) -> Vec<(Instant, [Wrench; 1])> {
        let run = Run {
            base: BaseKind::Fixed,
            rate_hz: 500.0,
            payloads: self.payloads.clone(),
            duration_s: self.duration_s,
            gap_s: None,
            motion_seed: self.seed,
        };
        let mut random = SmallRng::seed_from_u64(self.seed);
        let mut draw = |std_dev: f64| std_dev * random.sample::<f64, _>(StandardNormal);
        let pushed = |time_s: f64, tool_from_world: &Isometry3<f64>| Wrench {
            force: tool_from_world.rotation * self.force_at(time_s),
            moment: Vector3::zeros(),
        };
        let with_noise = |mut instant: Instant| {
            let wrenches = [Wrench {
                force: instant.wrench.force
                    + self.offset.force
                    + Vector3::from_fn(|_, _| draw(NOISE[0])),
                moment: instant.wrench.moment
                    + self.offset.moment
                    + Vector3::from_fn(|_, _| draw(NOISE[1])),
            }];
            for k in 0..2 {
                instant.joints[k]
                    .iter_mut()
                    .for_each(|value| *value += draw(self.joints[k]));
            }
            (instant, wrenches)
        };
        let instants = handling::stopping(&run, self.stop_s, pushed).into_iter();
        instants.map(with_noise).collect()
    }

    fn run(&self) -> Seen {
        let settings = EquationSettings::default();
        let mut identifier =
            Identifier::new(&arm(BaseKind::Fixed), TOOL, &[TOOL], &settings).unwrap();
        let world = identifier.wrench_frame(TOOL, Some(WORLD)).unwrap();
        let mut seen = Seen::default();
        for (instant, wrenches) in self.samples() {
            if self.hold {
                // Until the contact ends: later windows have none of its samples.
                assert!(identifier.hold_payload(instant.time_s > 5.0 && instant.time_s < 10.0));
            }
            match identifier.push(&instant.sample(&wrenches)).unwrap() {
                PushOutcome::PayloadChanged => seen.alarms.push(instant.time_s),
                PushOutcome::PayloadReturned => seen.returns.push(instant.time_s),
                _ => {}
            }
            let estimate = identifier.estimate();
            let mass = [estimate.body.mass_kg, estimate.std_devs[0]];
            seen.masses[usize::from(instant.time_s > 5.0)] = mass;
            if let Some(found) = identifier.contact_wrench(&world) {
                self.add(&mut seen, &found);
            }
        }
        seen
    }

    /// Identifies the load from the whole recording.
    pub(crate) fn load(&self) -> LoadEstimate {
        self.identified().load.unwrap()
    }

    /// Identifies the payload from the whole recording.
    pub(crate) fn identified(&self) -> BatchResult {
        let settings = BatchSettings {
            shown_offset: true,
            ..BatchSettings::default()
        };
        let (robot, equations) = (arm(BaseKind::Fixed), EquationSettings::default());
        let mut batch = BatchIdentifier::new(&robot, TOOL, &[TOOL], equations, settings).unwrap();
        for (instant, wrenches) in self.samples() {
            batch.push(&instant.sample(&wrenches)).unwrap();
        }
        batch.solve().unwrap()
    }

    /// Compensates the whole recording with a load.
    pub(crate) fn compensated(
        &self,
        load: &LoadEstimate,
        is_of_another: bool,
        cutoff_hz: f64,
    ) -> Seen {
        let robot = arm(BaseKind::Fixed);
        let equations = EquationSettings {
            cutoff_hz,
            ..EquationSettings::default()
        };
        let load = match is_of_another {
            true => load.of_another_recording(),
            false => load.clone(),
        };
        let frame = WrenchFrame::new(&robot, TOOL, TOOL, Some(WORLD)).unwrap();
        let acts_on = ActsOn::Payload;
        let contact =
            RecordedContact::new(&robot, TOOL, &[TOOL], &equations, &load, frame, acts_on);
        let mut contact = contact.unwrap();
        let (mut seen, mut rows) = (Seen::default(), 0);
        let mut take = |sample: ContactSample| {
            rows += 1;
            if let Some(found) = sample.wrenches {
                self.add(&mut seen, &found.parts.contact);
            }
        };
        let samples = self.samples();
        for (instant, wrenches) in &samples {
            contact.push(&instant.sample(wrenches), &mut take).unwrap();
        }
        contact.finish(&mut take);
        assert_eq!(rows, samples.len());
        seen
    }

    fn add(&self, seen: &mut Seen, found: &tactid_identify::WrenchEstimate) {
        let force = self.force_at(found.time_s);
        let error = found.wrench.force - force;
        let errors = error.iter().chain(&found.wrench.moment);
        let ratios = errors.zip(found.std_devs()).map(|(e, s)| e.abs() / s);
        let near = |[from_s, to_s]: [f64; 2]| {
            (found.time_s - from_s).abs() < 0.1 || (found.time_s - to_s).abs() < 0.1
        };
        let is_edge = self.contact.is_some_and(|(times, _)| near(times));
        // A step of a contact that is known to be one passes the low-pass, of which the uncertainty
        // says nothing.
        if is_edge && self.hold {
            return;
        }
        for ratio in ratios {
            seen.samples += 1;
            seen.inside += u32::from(ratio < HALF_WIDTH_95);
            if !is_edge && ratio > seen.worst.0 {
                seen.worst = (ratio, found.time_s);
            }
        }
        seen.settled_samples += u32::from(found.state == ContactState::Settled);
        if force == Vector3::zeros() {
            if !is_edge {
                seen.largest = seen.largest.max(found.wrench.force.norm());
            }
        } else if !is_edge {
            seen.squares[0] += error.norm_squared() / 3.0;
            seen.squares[1] += found.wrench.moment.norm_squared() / 3.0;
            seen.during += 1;
            seen.std_dev = found.std_devs()[0];
        }
    }
}

/// A contact of 15 N for 4 s on a moving arm is measured as well as the sensor measures, with exact
/// and with noisy joints, and the payload's estimate continues after it.
#[test]
fn a_contact_is_measured_as_well_as_the_sensor_measures() {
    for (seed, direction) in [
        (0, Vector3::new(1.0, 0.0, 0.0)),
        (1, Vector3::new(0.6, 0.8, 0.0)),
        (2, Vector3::new(0.5, -0.5, 0.7)),
        (3, Vector3::new(0.0, 0.7, -0.7)),
    ] {
        for (joints, hold) in [
            ([0.0; 2], false),
            ([5e-5, 5e-4], false),
            ([5e-5, 5e-4], true),
        ] {
            let trial = Trial {
                contact: Some(([6.0, 10.0], direction * 15.0)),
                joints,
                hold,
                ..Trial::moving(seed)
            };
            let seen = trial.run();
            let rms = seen
                .squares
                .map(|sum| (sum / f64::from(seen.during)).sqrt());
            assert!(rms[0] < 1.2 * FILTERED * NOISE[0], "{rms:?} {seen:?}");
            assert!(rms[1] < 1.2 * FILTERED * NOISE[1], "{rms:?} {seen:?}");
            assert!(seen.inside * 100 > seen.samples * 95, "{seen:?}");
            assert!(seen.worst.0 < 6.0, "{seen:?}");
            let [[before, _], [after, std_dev]] = seen.masses;
            assert!((after - 3.2).abs() < 6.0 * std_dev, "{seen:?}");
            assert!(std_dev < 0.01 && (after - before).abs() < 0.01, "{seen:?}");
            assert_eq!(seen.alarms.is_empty(), hold, "{seen:?}");
            assert!(!hold || seen.std_dev < 0.1, "{seen:?}");
        }
    }
}

/// A payload that changes in motion or at rest is never a contact within the stated interval, and
/// the contact is never larger than the change of the load.
#[test]
fn a_payload_change_is_within_the_uncertainty_of_the_contact() {
    let payloads = [
        body(1.7, [-0.02, 0.04, 0.06], [0.1, 0.1, 0.12]),
        body(3.2, [0.03, -0.02, 0.09], [0.2, 0.15, 0.25]),
    ];
    for seed in 0..6 {
        for stop_s in [5.0, 100.0] {
            for joints in [[0.0; 2], [5e-5, 5e-4]] {
                let trial = Trial {
                    payloads: vec![(0.0, payloads[0]), (6.5, payloads[1]), (10.5, payloads[0])],
                    stop_s,
                    joints,
                    ..Trial::moving(seed)
                };
                let seen = trial.run();
                assert!(seen.inside * 100 > seen.samples * 95, "{seen:?}");
                assert!(seen.worst.0 < 6.0, "{seen:?}");
                assert!(seen.largest < 1.2 * 1.5 * 11.5, "{seen:?}");
                // A payload at rest remains one that may be a contact.
                let is_certain = f64::from(seen.settled_samples * 6) / f64::from(seen.samples);
                assert!(
                    is_certain > if stop_s > 20.0 { 0.7 } else { 0.3 },
                    "{seen:?}"
                );
            }
        }
    }
}

/// A payload change leaves the noise of the contact as it was.
#[test]
fn a_payload_change_does_not_widen_later_contacts() {
    let payloads = [
        body(0.9, [0.0, 0.0, 0.05], [0.1, 0.1, 0.1]),
        body(3.4, [0.0, 0.0, 0.1], [0.2, 0.2, 0.2]),
    ];
    for seed in 0..4 {
        let trial = Trial {
            payloads: vec![(0.0, payloads[0]), (8.0, payloads[1])],
            duration_s: 14.0,
            ..Trial::moving(seed)
        };
        let settings = EquationSettings::default();
        let mut identifier =
            Identifier::new(&arm(BaseKind::Fixed), TOOL, &[TOOL], &settings).unwrap();
        let frame = identifier.wrench_frame(TOOL, None).unwrap();
        let mut before = None;
        for (instant, wrenches) in trial.samples() {
            identifier.push(&instant.sample(&wrenches)).unwrap();
            if instant.time_s < 7.5 {
                before = identifier.contact_wrench(&frame);
            }
        }
        let after = identifier.contact_wrench(&frame).unwrap();
        assert_eq!(identifier.estimate().payload_changes, 1);
        for (before, after) in before.unwrap().std_devs().iter().zip(after.std_devs()) {
            assert!(after < 1.5 * before, "{before} {after}");
        }
    }
}

/// Without contact and change, at rest and in motion, errors have the size of their standard
/// deviations.
#[test]
fn noise_alone_has_the_stated_uncertainty() {
    let (mut samples, mut inside) = (0, 0);
    for seed in 0..8 {
        let trial = Trial {
            stop_s: if seed % 2 == 0 { 7.0 } else { 100.0 },
            joints: if seed < 4 { [0.0; 2] } else { [5e-5, 5e-4] },
            duration_s: 12.0,
            ..Trial::moving(seed)
        };
        let seen = trial.run();
        assert!(seen.worst.0 < 6.0 && seen.alarms.is_empty(), "{seen:?}");
        assert!(seen.largest < 0.5, "{seen:?}");
        assert!(
            f64::from(seen.settled_samples * 6) > 0.98 * f64::from(seen.samples),
            "{seen:?}"
        );
        (samples, inside) = (samples + seen.samples, inside + seen.inside);
    }
    let fraction = f64::from(inside) / f64::from(samples);
    assert!((0.94..0.99).contains(&fraction), "{fraction}");
}
