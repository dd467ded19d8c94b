//! What the batch identifier reports where the data contradict what is known, on samples of the project's robot.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::{Experiment, Instant, Noise, SENSORS, TOOL, payload};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_dynamics::{MassProperties, Wrench};
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

fn noisy_instants(duration_s: f64) -> Vec<Instant> {
    let mut random = SmallRng::seed_from_u64(1);
    let instants = instants(duration_s);
    let noisy = instants
        .iter()
        .map(|instant| Noise::fraction(1e-3).on(instant, &mut random));
    noisy.collect()
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
    let settings = with_mass(100.0, 0.0);
    let result = identify(&noisy_instants(5.0), EquationSettings::default(), settings).unwrap();
    assert!((result.estimate.body.mass_kg - 100.0).abs() < 1e-6);
    assert_eq!(result.estimate.std_devs.unwrap()[0], 0.0);
    assert_eq!(result.findings, []);
}

/// A known tool that is heavier than the load is reported. One that is the whole load leaves a payload of zero within
/// the noise, and is not.
#[test]
fn a_known_tool_heavier_than_the_load_is_reported() {
    let instants = noisy_instants(5.0);
    let with_tool = |mass_kg: f64| {
        let known_tool = Some(MassProperties {
            mass_kg,
            ..payload()
        });
        let settings = BatchSettings {
            known_tool,
            ..BatchSettings::default()
        };
        identify(&instants, EquationSettings::default(), settings).unwrap()
    };
    let result = with_tool(150.0);
    assert!((result.estimate.body.mass_kg + 50.0).abs() < 1.0);
    let [Finding::KnownBodiesTooHeavy { known_kg, load_kg }] = result.findings[..] else {
        panic!("{:?}", result.findings);
    };
    assert_eq!(known_kg, 150.0);
    assert!((load_kg - 100.0).abs() < 1.0, "{load_kg}");
    assert_eq!(with_tool(99.0).findings, []);
    assert_eq!(with_tool(100.0).findings, []);
}

/// A recording that is too short and a cutoff that is too high for the sample rate are different errors, with
/// opposite remedies.
#[test]
fn too_short_and_too_sparse_recordings_are_different_errors() {
    let message = |duration_s, cutoff_hz| {
        let equations = EquationSettings {
            cutoff_hz,
            ..EquationSettings::default()
        };
        let error = identify(&instants(duration_s), equations, BatchSettings::default());
        error.unwrap_err().to_string()
    };
    let too_short = "too few windows: 0 of 0.0926 s without a gap were found; record longer, or raise the cutoff";
    assert_eq!(message(0.08, 10.0), too_short);
    let too_sparse = |cutoff_hz| {
        let message = message(1.0, cutoff_hz);
        assert!(
            message.contains("have fewer than 6; lower the cutoff"),
            "{message}"
        );
        message
    };
    // Restarted at each sample, since a third of a window has none; and dropped, with three samples or four.
    assert!(too_sparse(1e6).contains("0.000000926 s"));
    too_sparse(250.0);
}
