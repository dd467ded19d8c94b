//! The wrench of a contact in a recording, with the uncertainty of its filter, and contacts that an
//! identification leaves out.

use nalgebra::Vector3;
use tactid_batch::Finding;
use tactid_dynamics::{Notice, Severity, Wrench};

use crate::contact::{NOISE, Trial};

/// Standard deviation of the mean of white noise of 500 Hz over a window of the equations at a
/// cutoff of 10 Hz.
const AVERAGED: f64 = 0.205;

/// A contact of 15 N for 4 s in a recording is measured without delay as well as the sensor
/// measures, with the load and the offset of this recording or of another. Joints whose noise
/// accelerates the load add a quarter to the moments' noise.
#[test]
fn a_recording_has_the_contact_as_the_sensor_measures_it() {
    let offset = Wrench {
        force: Vector3::new(4.0, -2.0, 3.0),
        moment: Vector3::new(0.2, 0.3, -0.1),
    };
    let (mut inside, mut samples) = (0, 0);
    for (seed, direction, joints, is_of_another) in [
        (0, Vector3::new(1.0, 0.0, 0.0), [1e-4, 1e-3], true),
        (1, Vector3::new(0.6, 0.8, 0.0), [0.0; 2], false),
        (2, Vector3::new(0.5, -0.5, 0.7), [0.0; 2], true),
        (3, Vector3::new(0.0, 0.7, -0.7), [1e-4, 1e-3], false),
    ] {
        let trial = Trial {
            contact: Some(([6.0, 10.0], direction * 15.0)),
            joints,
            offset,
            hold: true,
            ..Trial::moving(seed)
        };
        let without_contact = Trial {
            joints,
            offset,
            ..Trial::moving(seed + 10)
        };
        let load = if is_of_another {
            without_contact.load()
        } else {
            trial.load()
        };
        let seen = trial.compensated(&load, is_of_another, 10.0);
        let rms = seen
            .squares
            .map(|sum| (sum / f64::from(seen.during)).sqrt());
        let most_of_moments = if joints[1] > 0.0 { 1.3 } else { 1.2 };
        assert!(rms[0] < 1.2 * AVERAGED * NOISE[0], "{rms:?} {seen:?}");
        assert!(
            rms[1] < most_of_moments * AVERAGED * NOISE[1],
            "{rms:?} {seen:?}"
        );
        assert!(seen.worst.0 < 6.0 && seen.largest < 0.5, "{seen:?}");
        (inside, samples) = (inside + seen.inside, samples + seen.samples);
    }
    let fraction = f64::from(inside) / f64::from(samples);
    assert!((0.94..0.97).contains(&fraction), "{fraction}");
}

/// Above the cutoff of the identification, the noise of derived accelerations is part of the
/// uncertainty, and below it is not taken for that of the load's recording. Differences of even and
/// odd samples overstate it where a window has few samples.
#[test]
fn a_recorded_contact_has_the_noise_of_its_cutoff() {
    for (seed, cutoff_hz) in [(0, 2.0), (1, 10.0), (2, 25.0), (3, 40.0)] {
        let trial = Trial {
            joints: [1e-4, 1e-3],
            ..Trial::moving(seed)
        };
        let of_load = Trial {
            joints: [1e-4, 1e-3],
            ..Trial::moving(seed + 20)
        };
        let seen = trial.compensated(&of_load.load(), true, cutoff_hz);
        let fraction = f64::from(seen.inside) / f64::from(seen.samples);
        assert!(
            (0.92..0.998).contains(&fraction),
            "{cutoff_hz}: {fraction} {seen:?}"
        );
    }
}

/// A contact for a third of a recording is left out of the identification, which names its times,
/// whatever the offset. One for more than half is a contradiction: the rest may be the exception.
#[test]
fn a_long_contact_in_a_recording_is_left_out_and_named() {
    let offset = Wrench {
        force: Vector3::new(4.0, -2.0, 3.0),
        moment: Vector3::new(0.2, 0.3, -0.1),
    };
    let cases = [
        (0, offset, [5.0, 10.0], Vector3::new(0.0, 0.0, 15.0)),
        (1, Wrench::zero(), [4.0, 9.0], Vector3::new(4.0, 0.0, 3.0)),
        (2, offset, [3.0, 11.0], Vector3::new(0.0, 9.0, 12.0)),
    ];
    for (seed, offset, times_s, force) in cases {
        let trial = Trial {
            contact: Some((times_s, force)),
            offset,
            joints: [1e-4, 1e-3],
            ..Trial::moving(seed)
        };
        let found = trial.identified();
        let mass_kg = found.estimate.body.mass_kg;
        let std_dev_kg = found.estimate.std_devs[0];
        assert!(
            (mass_kg - 3.2).abs() < 3.0 * std_dev_kg,
            "{mass_kg} {std_dev_kg}"
        );
        assert!(std_dev_kg < 0.01, "{std_dev_kg}");
        let Finding::OtherLoad(other) = &found.findings[0] else {
            panic!("{:?}", found.findings);
        };
        let [[from_s, to_s]] = other.parts[..] else {
            panic!("{other:?}");
        };
        assert!((from_s - times_s[0]).abs() < 0.15 && (to_s - times_s[1]).abs() < 0.15);
        assert!(
            (other.force_rms - force.norm()).abs() < 0.05 * force.norm(),
            "{other:?}"
        );
        let is_most = times_s[1] - times_s[0] > 7.0;
        let severity = if is_most {
            Severity::Contradicts
        } else {
            Severity::Doubts
        };
        assert_eq!(found.findings[0].severity(), severity);
    }
    let without = Trial {
        offset,
        ..Trial::moving(3)
    }
    .identified();
    let is_other = |found: &Finding| matches!(found, Finding::OtherLoad(_));
    assert!(
        !without.findings.iter().any(is_other),
        "{:?}",
        without.findings
    );
}
