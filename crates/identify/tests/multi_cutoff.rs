//! The equations of several cutoffs in one pass, on samples of the project's robot.

use crate::common::{Experiment, Instant, Noise, SENSORS, TOOL};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_identify::equations::{Equation, MultiCutoffStream};
use tactid_identify::{EquationSettings, EquationStream};

/// Cutoffs of which some share their polynomials' samples, and some do not.
const CUTOFFS_HZ: [f64; 4] = [58.0, 29.0, 7.0, 3.5];

/// Noisy samples with a gap, and with one that is repeated.
fn instants() -> Vec<Instant> {
    let mut random = SmallRng::seed_from_u64(1);
    let instants = Experiment {
        duration_s: 3.0,
        ..Experiment::default()
    }
    .run();
    let noisy = instants
        .iter()
        .map(|instant| Noise::fraction(1e-2).on(instant, &mut random));
    let mut noisy: Vec<Instant> = noisy.collect();
    let count = noisy.len();
    noisy.drain(count / 2..count / 2 + count / 10);
    let repeated = noisy[count / 4].clone();
    noisy.insert(count / 4, repeated);
    noisy
}

fn equations(cutoff_hz: f64) -> Vec<Equation> {
    let settings = EquationSettings {
        cutoff_hz,
        ..EquationSettings::default()
    };
    let robot = Experiment::default().robot();
    let mut stream = EquationStream::new(&robot, TOOL, &SENSORS, &settings).unwrap();
    let mut equations = Vec::new();
    for instant in instants() {
        equations.extend(stream.push(&instant.sample()).unwrap().1.cloned());
    }
    equations
}

/// Each cutoff has the equations of a stream of its own, bit by bit.
#[test]
fn equations_are_those_of_streams_of_their_own() {
    let robot = Experiment::default().robot();
    let settings = EquationSettings::default();
    let stream = MultiCutoffStream::new(&robot, TOOL, &SENSORS, &settings, &CUTOFFS_HZ);
    let mut stream = stream.unwrap();
    for instant in instants() {
        stream.push(&instant.sample()).unwrap();
    }
    let (found, channels) = stream.finish();
    assert_eq!((found.len(), channels.count()), (4, 6));
    for (found, cutoff_hz) in found.iter().zip(CUTOFFS_HZ) {
        let expected = equations(cutoff_hz);
        assert!(found.len() == expected.len() && found.len() > 10);
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found.time_s, expected.time_s);
            assert_eq!(found.rows, expected.rows);
            assert_eq!(found.differences, expected.differences);
            assert_eq!(found.rates, expected.rates);
        }
    }
}

/// A cutoff out of range is an error, whichever it is.
#[test]
fn a_cutoff_out_of_range_is_an_error() {
    let robot = Experiment::default().robot();
    let settings = EquationSettings::default();
    for cutoff_hz in [0.0, f64::NAN] {
        let cutoffs_hz = [10.0, cutoff_hz];
        let stream = MultiCutoffStream::new(&robot, TOOL, &SENSORS, &settings, &cutoffs_hz);
        let error = stream.unwrap_err();
        assert!(error.option() == Some("cutoff_hz"), "{error}");
    }
}
