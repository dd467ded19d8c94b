//! The zero of a sensor outlives a payload change: what an identifier has learnt of it in motion
//! holds for the next payload.

use crate::arm::{Run, TOOL, arm, body};
use crate::handling;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::{BaseKind, Wrench};
use tactid_identify::{ContactState, EquationSettings, Identifier, PushOutcome};

const OFFSET: Wrench = Wrench {
    force: Vector3::new(12.0, -7.0, 20.0),
    moment: Vector3::new(0.4, 0.3, -0.2),
};

fn noisy(wrench: Wrench, random: &mut SmallRng) -> Wrench {
    let mut draw =
        |std_dev: f64| Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal));
    Wrench {
        force: wrench.force + draw(0.3),
        moment: wrench.moment + draw(0.02),
    }
}

/// An arm that has moved with one payload and picks up another at rest knows the mass of the other
/// at once, because it knows the zero of the sensor. Whether it is no contact only the user knows.
#[test]
fn the_offset_of_a_sensor_outlives_a_payload_change() {
    let robot = arm(BaseKind::Fixed);
    let light = body(1.5, [-0.02, 0.04, 0.06], [0.1, 0.1, 0.12]);
    let heavy = body(3.2, [0.03, -0.02, 0.09], [0.2, 0.15, 0.25]);
    let settings = EquationSettings {
        wrench_offset: true,
        ..EquationSettings::default()
    };
    let (mut inside, mut known) = (0, 0);
    for seed in 0..10 {
        let run = Run {
            base: BaseKind::Fixed,
            rate_hz: 500.0,
            payloads: vec![(0.0, light), (8.0, heavy)],
            duration_s: 10.0,
            gap_s: None,
            motion_seed: seed,
        };
        let mut identifier = Identifier::new(&robot, TOOL, &[TOOL], &settings).unwrap();
        let mut random = SmallRng::seed_from_u64(seed);
        let mut alarms = Vec::new();
        for instant in handling::stopping(&run, 6.0, |_, _| OFFSET) {
            let wrenches = [noisy(instant.wrench, &mut random)];
            if identifier.push(&instant.sample(&wrenches)).unwrap() == PushOutcome::PayloadChanged {
                alarms.push(instant.time_s);
                let before = identifier.estimate_before_change().unwrap();
                assert!((before.body.mass_kg - 1.5).abs() < 6.0 * before.std_devs[0]);
                assert!(before.std_devs[0] < 0.02, "{}", before.std_devs[0]);
                assert!(!identifier.is_settled() && identifier.time_since_change_s() < 0.2);
            }
            if instant.time_s < 8.5 {
                continue;
            }
            let estimate = identifier.estimate();
            let ratio = (estimate.body.mass_kg - 3.2).abs() / estimate.std_devs[0];
            known += 1;
            inside += usize::from(ratio < 1.96);
            assert!(ratio < 6.0, "{ratio} at {}", instant.time_s);
            assert!(estimate.std_devs[0] < 0.05, "{}", estimate.std_devs[0]);
        }
        assert_eq!(alarms.len(), 1, "{alarms:?}");
        assert!((8.0..8.3).contains(&alarms[0]));
        // At rest, a contact would measure the same.
        assert!(!identifier.is_settled());
        let frame = identifier.wrench_frame(TOOL, None).unwrap();
        let contact = identifier.contact_wrench(&frame).unwrap();
        assert_eq!(contact.state, ContactState::Changing);
        assert!(identifier.hold_payload(true) && identifier.is_settled());
        let contact = identifier.contact_wrench(&frame).unwrap();
        assert!(contact.state == ContactState::Settled && contact.std_devs()[0] < 1.0);
        let offset = identifier.wrench_offset().unwrap();
        let errors = (offset.wrench.force - OFFSET.force).abs();
        for (error, std_dev) in errors.iter().zip(offset.std_devs.unwrap()) {
            assert!(*error < 6.0 * std_dev && std_dev < 0.3, "{offset:?}");
        }
    }
    assert!(inside * 10 > known * 8, "{inside} of {known}");
}

/// The joint covariance of payload and offset has that of each, and gives less uncertainty to what
/// both measure together than to either: a heavier payload makes up for the offset.
#[test]
fn payload_and_offset_have_a_joint_covariance() {
    let robot = arm(BaseKind::Fixed);
    let settings = EquationSettings {
        wrench_offset: true,
        ..EquationSettings::default()
    };
    let run = Run {
        base: BaseKind::Fixed,
        rate_hz: 500.0,
        payloads: vec![(0.0, body(1.5, [-0.02, 0.04, 0.06], [0.1, 0.1, 0.12]))],
        duration_s: 3.0,
        gap_s: None,
        motion_seed: 3,
    };
    let mut identifier = Identifier::new(&robot, TOOL, &[TOOL], &settings).unwrap();
    let mut random = SmallRng::seed_from_u64(3);
    assert!(identifier.joint_covariance().is_none());
    for instant in handling::stopping(&run, 10.0, |_, _| OFFSET) {
        let wrenches = [noisy(instant.wrench, &mut random)];
        identifier.push(&instant.sample(&wrenches)).unwrap();
    }
    identifier.finish();
    let joint = identifier.joint_covariance().unwrap();
    let covariance = identifier.covariance().unwrap();
    assert_eq!(joint.fixed_view::<10, 10>(0, 0), covariance);
    assert!((joint - joint.transpose()).amax() < 1e-12);
    assert!(joint.cholesky().is_some());
    let std_devs = identifier.wrench_offset().unwrap().std_devs.unwrap();
    for (k, std_dev) in std_devs.iter().enumerate() {
        assert!((joint[(10 + k, 10 + k)].sqrt() / std_dev - 1.0).abs() < 1e-9);
    }
    assert!((10..13).any(|k| joint[(0, k)].abs() > 0.3 * (joint[(0, 0)] * joint[(k, k)]).sqrt()));
}

/// A motion of 7 s with a payload of 1.5 kg.
fn light_payload(seed: u64) -> Run {
    Run {
        base: BaseKind::Fixed,
        rate_hz: 500.0,
        payloads: vec![(0.0, body(1.5, [-0.02, 0.04, 0.06], [0.1, 0.1, 0.12]))],
        duration_s: 7.0,
        gap_s: None,
        motion_seed: seed,
    }
}

/// A zero that moves is reported as a payload change. A tare then determines the zero anew within
/// 0.3 s, also at rest, and the payload is the one before. What an arm at rest measures from the
/// beginning on says neither zero nor weight.
#[test]
fn a_tare_sets_the_zero_and_holds_the_payload() {
    let robot = arm(BaseKind::Fixed);
    let settings = EquationSettings {
        wrench_offset: true,
        ..EquationSettings::default()
    };
    let moved = Wrench {
        force: OFFSET.force + Vector3::new(-6.0, 8.0, 10.0),
        moment: OFFSET.moment,
    };
    for (seed, moved_s, stop_s) in [(1, 5.0, 20.0), (2, 5.0, 4.5), (3, 0.0, -1.0)] {
        let run = light_payload(seed);
        let mut identifier = Identifier::new(&robot, TOOL, &[TOOL], &settings).unwrap();
        let mut random = SmallRng::seed_from_u64(seed);
        assert!(!identifier.tare(), "nothing is known yet");
        let frame = identifier.wrench_frame(TOOL, None).unwrap();
        let offset_at = |time_s: f64, _: &nalgebra::Isometry3<f64>| {
            if time_s < moved_s { OFFSET } else { moved }
        };
        let instants = handling::stopping(&run, stop_s, offset_at);
        let mut contacts = Vec::new();
        for (k, instant) in instants.iter().enumerate() {
            let wrenches = [noisy(instant.wrench, &mut random)];
            identifier.push(&instant.sample(&wrenches)).unwrap();
            if k == 2400 && moved_s > 0.0 {
                assert!(identifier.hold_payload(true));
                assert!(!identifier.tare(), "no window would determine the zero");
                assert!(identifier.hold_payload(false));
            }
            if k == 2700 && moved_s > 0.0 {
                assert_eq!(identifier.estimate().payload_changes, 1);
                assert!(!identifier.hold_payload(true), "it is not known yet");
                assert!(identifier.tare());
            }
            if k > 2850 && identifier.knows_weight() {
                let contact = identifier.contact_wrench(&frame).unwrap();
                let is_settled = contact.state == ContactState::Settled;
                contacts.push(is_settled);
                assert!(contact.wrench.force.norm() < 6.0 * contact.std_devs()[0]);
                assert!(contact.std_devs()[0] < 1.5, "{contact:?}");
            }
        }
        let settled = contacts.iter().filter(|is_settled| **is_settled).count();
        assert!(
            settled * 100 >= contacts.len() * 90,
            "{settled} of {}",
            contacts.len()
        );
        assert_eq!(identifier.knows_weight(), moved_s > 0.0);
        if moved_s > 0.0 {
            let estimate = identifier.estimate();
            assert!((estimate.body.mass_kg - 1.5).abs() < 4.0 * estimate.std_devs[0]);
            assert!(estimate.std_devs[0] < 0.02 && estimate.since_s < 0.0);
            let found = identifier.wrench_offset().unwrap();
            let error = found.wrench.force.x - moved.force.x;
            let std_dev = found.std_devs.unwrap()[0];
            assert!(error.abs() < 4.0 * std_dev && std_dev < 0.3, "{found:?}");
        }
    }
}
