//! What the batch identifier reports where the data contradict what is known, on samples of the
//! project's robot.

use nalgebra::{UnitQuaternion, Vector3};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_batch::{BatchIdentifier, BatchResult, BatchSettings, Finding, Hypothesis};
use tactid_dynamics::{MassProperties, Wrench};
use tactid_identify::{BoundingBox, EquationSettings, IdentifyError, KnownMass, KnownTool};

use crate::common::{Experiment, Instant, Noise, SENSORS, TOOL, payload};
use crate::turning::{BESIDE, PointMass, TETRAHEDRON, about_all_axes, about_y, samples};

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

/// Samples of sensors that measure nothing.
fn instants_of_zeros() -> Vec<Instant> {
    let mut instants = instants(1.0);
    for instant in &mut instants {
        instant.wrenches.fill(Wrench::zero());
    }
    instants
}

/// Asserts that sensors which measure nothing contradict a known mass, and that nothing is known of
/// the payload.
#[track_caller]
fn assert_zeros_contradict(std_dev_kg: f64) {
    let settings = with_mass(1.0, std_dev_kg);
    let result = identify(&instants_of_zeros(), EquationSettings::default(), settings).unwrap();
    let [
        Finding::MassContradicted {
            found_kg, distance, ..
        },
    ] = result.findings[..]
    else {
        panic!("{:?}", result.findings);
    };
    assert!(found_kg.abs() < 1e-9, "{found_kg}");
    assert!(distance > 5.0 && distance.is_finite(), "{distance}");
    assert_eq!(result.estimate.not_identifiable().count(), 10);
    assert_eq!(result.estimate.std_devs, [f64::INFINITY; 10]);
}

/// Wrenches of zero contradict an exact mass.
#[test]
fn wrenches_of_zero_contradict_an_exact_mass() {
    assert_zeros_contradict(0.0);
}

/// Wrenches of zero contradict a mass with a standard deviation.
#[test]
fn wrenches_of_zero_contradict_an_uncertain_mass() {
    assert_zeros_contradict(0.01);
}

/// A known mass of the wrong tool or of the wrong sign is one cause with one finding: that which
/// says why.
#[test]
fn a_known_mass_adds_no_finding_to_its_cause() {
    let mut instants = noisy_instants(5.0);
    let with_tool = BatchSettings {
        known_tool: Some(KnownTool::from(MassProperties {
            mass_kg: 150.0,
            ..payload()
        })),
        ..with_mass(100.0, 0.1)
    };
    let result = identify(&instants, EquationSettings::default(), with_tool).unwrap();
    let is_mass = |finding: &Finding| matches!(finding, Finding::MassContradicted { .. });
    let is_tool = |finding: &Finding| matches!(finding, Finding::KnownBodiesTooHeavy { .. });
    assert!(result.findings.iter().any(is_tool), "{:?}", result.findings);
    assert!(
        !result.findings.iter().any(is_mass),
        "{:?}",
        result.findings
    );
    for wrench in instants
        .iter_mut()
        .flat_map(|instant| &mut instant.wrenches)
    {
        *wrench = Wrench {
            force: -wrench.force,
            moment: -wrench.moment,
        };
    }
    let result = identify(
        &instants,
        EquationSettings::default(),
        with_mass(100.0, 0.1),
    )
    .unwrap();
    let is_sign = |finding: &Finding| matches!(finding, Finding::NegativeMass { .. });
    assert!(result.findings.iter().any(is_sign), "{:?}", result.findings);
    assert!(
        !result.findings.iter().any(is_mass),
        "{:?}",
        result.findings
    );
}

/// A known mass that the data do not determine, but that no consistent body has which explains
/// them, is not the result. That is reported once, with and without a box.
#[test]
fn a_known_mass_that_is_not_kept_is_reported() {
    let (robot, instants) = samples(about_all_axes, 1.0, &BESIDE, Vector3::zeros());
    let bounding_box = Some(BoundingBox {
        min: Vector3::repeat(-0.15),
        max: Vector3::repeat(0.15),
    });
    for bounding_box in [None, bounding_box] {
        let (equations, settings) = (
            EquationSettings::default(),
            BatchSettings {
                bounding_box,
                ..with_mass(2.0, 0.0)
            },
        );
        let mut batch =
            BatchIdentifier::new(&robot, "sensor", &["sensor"], equations, settings).unwrap();
        for instant in &instants {
            batch.push(&instant.sample()).unwrap();
        }
        let result = batch.solve().unwrap();
        let [
            Finding::KnownMassNotKept {
                known_mass_kg,
                estimated_kg,
                within_box,
                ..
            },
        ] = result.findings[..]
        else {
            panic!("{:?}", result.findings);
        };
        assert_eq!((known_mass_kg, within_box), (2.0, bounding_box.is_some()));
        assert_eq!(estimated_kg, result.estimate.body.mass_kg);
        assert!(estimated_kg > 3.9, "{estimated_kg}");
    }
}

/// A known mass that the data confirm is the result, with the standard deviation of an exact mass,
/// and no finding.
#[test]
fn a_known_mass_that_the_data_confirm_is_exact() {
    let settings = with_mass(100.0, 0.0);
    let result = identify(&noisy_instants(5.0), EquationSettings::default(), settings).unwrap();
    assert!((result.estimate.body.mass_kg - 100.0).abs() < 1e-6);
    assert_eq!(result.estimate.std_devs[0], 0.0);
    assert_eq!(result.findings, []);
}

/// A known tool that is heavier than the load is reported. One that is the whole load leaves a
/// payload of zero within the noise, and is not.
#[test]
fn a_known_tool_heavier_than_the_load_is_reported() {
    let instants = noisy_instants(5.0);
    let with_tool = |mass_kg: f64| {
        let known_tool = Some(KnownTool::from(MassProperties {
            mass_kg,
            ..payload()
        }));
        let settings = BatchSettings {
            known_tool,
            ..BatchSettings::default()
        };
        identify(&instants, EquationSettings::default(), settings).unwrap()
    };
    let result = with_tool(150.0);
    assert!((result.estimate.body.mass_kg + 50.0).abs() < 1.0);
    let [
        Finding::KnownBodiesTooHeavy {
            known_bodies_kg,
            load_kg,
        },
    ] = result.findings[..]
    else {
        panic!("{:?}", result.findings);
    };
    assert_eq!(known_bodies_kg, 150.0);
    assert!((load_kg - 100.0).abs() < 1.0, "{load_kg}");
    assert_eq!(with_tool(99.0).findings, []);
    let nothing = with_tool(100.0).findings;
    assert!(
        matches!(nothing[..], [Finding::NothingHeld { .. }]),
        "{nothing:?}"
    );
}

/// A recording that is too short and a cutoff that is too high for the sample rate are different
/// errors, with opposite remedies.
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
    assert!(message(0.08, 10.0).starts_with(too_short));
    let too_sparse = |cutoff_hz| {
        let message = message(1.0, cutoff_hz);
        assert!(
            message.contains("have fewer than 6; lower the cutoff"),
            "{message}"
        );
        message
    };
    // Restarted at each sample, since a third of a window has none; and dropped, with three samples
    // or four.
    assert!(too_sparse(1e6).contains("0.000000926 s"));
    too_sparse(250.0);
}

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// Solves for the masses on a sensor that rotates in [`GRAVITY`]; `given` is the gravity of the
/// settings, m/s².
fn identify_turning(
    turn: fn(f64) -> UnitQuaternion<f64>,
    speed: f64,
    masses: &[PointMass],
    given: Vector3<f64>,
) -> BatchResult {
    let (robot, instants) = samples(turn, speed, masses, GRAVITY);
    let (equations, settings) = (
        EquationSettings {
            gravity: Some(given),
            ..EquationSettings::default()
        },
        BatchSettings::default(),
    );
    let mut batch =
        BatchIdentifier::new(&robot, "sensor", &["sensor"], equations, settings).unwrap();
    for instant in &instants {
        batch.push(&instant.sample()).unwrap();
    }
    batch.solve().unwrap()
}

/// A point mass at the sensor's origin has no moments: its mass and its centre are known all the
/// same.
#[test]
fn a_point_mass_without_moments_is_identified() {
    let at_the_origin = [(4.0, Vector3::zeros())];
    let result = identify_turning(about_all_axes, 1.0, &at_the_origin, GRAVITY);
    assert!((result.estimate.body.mass_kg - 4.0).abs() < 1e-6);
    assert!(result.estimate.body.center_of_mass.norm() < 1e-6);
    assert_eq!(result.findings, []);
}

/// A rotation about one axis determines the mass, the centre of mass and the moments about that
/// axis, and leaves the other moments to what a consistent body may have.
#[test]
fn a_rotation_about_one_axis_identifies_what_it_excites() {
    let result = identify_turning(about_y, 2.0, &TETRAHEDRON, GRAVITY);
    assert_eq!(result.findings, []);
    let body = &result.estimate.body;
    assert!((body.mass_kg - 2.0).abs() < 1e-6, "{body:?}");
    let moments = TETRAHEDRON.map(|(mass_kg, position)| mass_kg * position);
    let center = moments.iter().sum::<Vector3<f64>>() / 2.0;
    assert!((body.center_of_mass - center).norm() < 1e-6, "{body:?}");
    let unknown: Vec<&str> = result.estimate.unobservable().collect();
    assert_eq!(unknown, ["Ixx", "Ixz", "Izz"]);
    assert_eq!(result.estimate.uncertain().count(), 0);
}

/// Gravity of the wrong sign is reported as such, and not as an offset, at every speed of the
/// motion.
#[test]
fn gravity_of_the_wrong_sign_is_no_offset() {
    for speed in [2.0, 1.0, 0.5, 0.2] {
        let result = identify_turning(about_all_axes, speed, &BESIDE, -GRAVITY);
        let [Finding::WrongAssumption(found)] = &result.findings[..] else {
            panic!("{speed}: {:?}", result.findings);
        };
        assert_eq!(found.cause, Hypothesis::Gravity);
        let error = Vector3::from_column_slice(&found.values) - GRAVITY;
        assert!(error.norm() < 1e-3, "{speed}: {found:?}");
    }
}
