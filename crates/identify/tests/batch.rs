//! What the batch identifier reports where the data contradict what is known, on samples of the project's robot.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::{Experiment, Instant, Noise, SENSORS, TOOL};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_dynamics::Wrench;
use tactid_identify::{
    BatchIdentifier, BatchResult, BatchSettings, EquationSettings, Finding, IdentifyError,
    KnownMass,
};

fn identify(
    instants: &[Instant],
    equations: EquationSettings,
    settings: BatchSettings,
) -> Result<BatchResult, IdentifyError> {
    let robot = Experiment::default().robot();
    let mut batch = BatchIdentifier::new(&robot, TOOL, &SENSORS, equations, settings).unwrap();
    for instant in instants {
        batch.push(&instant.sample()).unwrap();
    }
    batch.solve()
}

fn instants(duration_s: f64) -> Vec<Instant> {
    Experiment {
        duration_s,
        ..Experiment::default()
    }
    .run()
}

fn with_mass(mass_kg: f64, std_dev_kg: f64) -> BatchSettings {
    BatchSettings {
        known_mass: Some(KnownMass {
            mass_kg,
            std_dev_kg,
        }),
        ..BatchSettings::default()
    }
}

/// Sensors that measure nothing contradict any known mass. The result then is not the known mass and does not have
/// its standard deviation.
#[test]
fn wrenches_of_zero_contradict_a_known_mass() {
    let mut instants = instants(1.0);
    for instant in &mut instants {
        instant.wrenches.fill(Wrench::zero());
    }
    for std_dev_kg in [0.0, 0.01] {
        let settings = with_mass(1.0, std_dev_kg);
        let result = identify(&instants, EquationSettings::default(), settings).unwrap();
        let found = result.findings.iter().find_map(|finding| match finding {
            Finding::MassContradicted {
                found_kg, distance, ..
            } => Some((*found_kg, *distance)),
            _ => None,
        });
        let (found_kg, distance) = found.unwrap();
        assert!(found_kg.abs() < 1e-9, "{found_kg}");
        assert!(distance > 5.0 && distance.is_finite(), "{distance}");
        let has_known_mass = (result.estimate.body.mass_kg - 1.0).abs() < 1e-6;
        let std_dev = result.estimate.std_devs.unwrap()[0];
        assert!(has_known_mass || std_dev > 0.0, "{std_dev}");
        assert!(has_known_mass || !result.estimate.identifiable[0]);
    }
}

/// A known mass that the data confirm is the result, with the standard deviation of an exact mass, and no finding.
#[test]
fn a_known_mass_that_the_data_confirm_is_exact() {
    let mut random = SmallRng::seed_from_u64(1);
    let noisy: Vec<Instant> = instants(5.0)
        .iter()
        .map(|instant| Noise::fraction(1e-3).on(instant, &mut random))
        .collect();
    let settings = with_mass(100.0, 0.0);
    let result = identify(&noisy, EquationSettings::default(), settings).unwrap();
    assert!((result.estimate.body.mass_kg - 100.0).abs() < 1e-6);
    assert_eq!(result.estimate.std_devs.unwrap()[0], 0.0);
    assert_eq!(result.findings, []);
}
