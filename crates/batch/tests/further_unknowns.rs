//! A weight that was subtracted, and a direction of gravity, are identified together with the
//! payload, or added again where they are known.

use nalgebra::{Isometry3, Matrix3, Rotation3, Vector3};
use tactid_batch::{BatchIdentifier, BatchResult, BatchSettings};
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, MassProperties, Workspace, Wrench,
    motion,
};
use tactid_identify::{EquationSettings, Identifier, KnownMass, Method, SubtractedLoad, Unknowns};

use crate::arm::{JOINTS, TOOL, arm};
use crate::recorded::{Recorded, payload, recorded};

/// Gravity, m/s².
const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// The payload that a controller has configured.
fn configured() -> MassProperties {
    MassProperties {
        mass_kg: 0.7,
        center_of_mass: Vector3::new(0.01, -0.02, 0.05),
        inertia: Matrix3::zeros(),
    }
}

/// Adds the weight of a body, in a gravity in world axes, to the wrenches that the sensor measures.
fn with_weight(given: &mut Recorded, body: &MassProperties, gravity: Vector3<f64>) {
    let robot = arm(BaseKind::Fixed);
    let tool = robot.frame(TOOL).unwrap();
    let mut workspace = Workspace::new(&robot);
    let base = FrameMotion::at_rest(Isometry3::identity());
    for (joints, wrench) in given.joints.iter().zip(&mut given.wrenches) {
        let joints = JointMotion {
            position: &joints[0],
            velocity: &joints[1],
            acceleration: &[0.0; JOINTS],
        };
        motion(&mut workspace, &base, joints).unwrap();
        let force = workspace.vector_in_frame(tool, &(gravity * body.mass_kg));
        *wrench = *wrench
            + Wrench {
                force,
                moment: body.center_of_mass.cross(&force),
            };
    }
}

fn solved(given: &Recorded, settings: EquationSettings, batch: BatchSettings) -> BatchResult {
    given.identify_with(&arm(BaseKind::Fixed), TOOL, &settings, batch)
}

fn with(weight: bool, gravity: bool) -> EquationSettings {
    EquationSettings {
        unknowns: Unknowns { weight, gravity },
        ..EquationSettings::default()
    }
}

/// Checks values against the truth within some standard deviations.
fn agree(values: &[f64], std_devs: &[f64], truth: &[f64]) {
    for ((value, std_dev), truth) in values.iter().zip(std_devs).zip(truth) {
        let distance = (value - truth).abs() / std_dev;
        assert!(distance < 4.0, "{values:?} ± {std_devs:?}: {truth}");
    }
}

fn of_payload(result: &BatchResult) {
    let truth = tactid_identify::values_of_body(&payload());
    let estimate = &result.estimate;
    agree(&estimate.values(), &estimate.std_devs, &truth);
}

/// The weight of a configured payload is added again where it is known, with and without the forces
/// that accelerate it, and is among the unknowns where it is not.
#[test]
fn a_subtracted_weight_is_added_or_identified() {
    for seed in 0..8 {
        let mut given = recorded(seed);
        with_weight(&mut given, &configured(), DOWN);
        let subtracted = SubtractedLoad {
            body: InertialParameters::from(configured()),
            with_inertia: false,
        };
        let known = EquationSettings {
            subtracted: Some(subtracted),
            ..EquationSettings::default()
        };
        let known = solved(&given, known, BatchSettings::default());
        of_payload(&known);
        let unknown = solved(&given, with(true, false), BatchSettings::default());
        of_payload(&unknown);
        assert!(unknown.estimate.std_devs[0] > known.estimate.std_devs[0]);
        assert!(unknown.findings.is_empty(), "{:?}", unknown.findings);
        let weight = unknown.fit.subtracted_weight.unwrap();
        let truth = &tactid_identify::values_of_body(&configured())[..4];
        agree(&weight.values, &weight.std_devs, truth);
        assert!(known.fit.subtracted_weight.is_none());
    }
}

/// Where the payload that is configured is the one that is held, nothing is left of the wrenches,
/// and it is found.
#[test]
fn contacts_and_the_configured_payload_are_the_payload() {
    let mut given = recorded(3);
    let plain = solved(
        &given,
        EquationSettings::default(),
        BatchSettings::default(),
    );
    given.wrenches.fill(Wrench::zero());
    let subtracted = SubtractedLoad {
        body: plain.estimate.body.into(),
        with_inertia: true,
    };
    let settings = EquationSettings {
        subtracted: Some(subtracted),
        ..EquationSettings::default()
    };
    let found = solved(&given, settings, BatchSettings::default());
    let error_kg = found.estimate.body.mass_kg - plain.estimate.body.mass_kg;
    assert!(error_kg.abs() < 1e-6, "{error_kg}");
}

/// The direction of gravity is found from any start, together with an offset that the data show.
#[test]
fn a_direction_of_gravity_is_identified() {
    let auto = BatchSettings {
        shown_offset: true,
        ..BatchSettings::default()
    };
    for (seed, degrees) in [
        (0, 3.0),
        (1, 30.0),
        (2, 81.0),
        (3, 90.0),
        (4, 130.0),
        (5, 180.0),
    ] {
        let axis = Vector3::new(0.6, 0.8, 0.0);
        let gravity = Rotation3::new(axis * f64::to_radians(degrees)) * DOWN;
        let mut given = recorded(seed);
        with_weight(&mut given, &payload(), DOWN - gravity);
        let found = solved(&given, with(false, true), BatchSettings::default());
        of_payload(&found);
        let shown = found.fit.gravity.unwrap();
        agree(&shown.values, &shown.std_devs, gravity.as_slice());
        let size: f64 = shown.values.iter().map(|entry| entry * entry).sum();
        assert!((size.sqrt() - 9.81).abs() < 1e-9);
        for wrench in &mut given.wrenches {
            wrench.force += Vector3::new(1.0, -3.0, 5.0);
            wrench.moment.y += 0.2;
        }
        let found = solved(&given, with(false, true), auto.clone());
        of_payload(&found);
        let offset = found.fit.wrench_offset.unwrap();
        let std_devs = offset.std_devs.unwrap();
        agree(
            &offset.values(),
            &std_devs,
            &[1.0, -3.0, 5.0, 0.0, 0.2, 0.0],
        );
    }
}

/// A sensor without moments, or with one axis less, tells the direction of gravity, too.
#[test]
fn a_direction_of_gravity_is_identified_from_some_axes() {
    let gravity = Rotation3::new(Vector3::new(0.36, 0.48, 0.0)) * DOWN;
    for (seed, missing) in [(0, 3..6), (1, 5..6), (2, 0..1)] {
        let mut given = recorded(seed);
        with_weight(&mut given, &payload(), DOWN - gravity);
        let mut settings = with(false, true);
        settings.unmeasured[missing].fill(true);
        let found = solved(&given, settings, BatchSettings::default());
        of_payload(&found);
        let shown = found.fit.gravity.unwrap();
        agree(&shown.values, &shown.std_devs, gravity.as_slice());
    }
}

/// A control loop, and methods that use other measurements, have none of these unknowns.
#[test]
fn only_a_recording_of_wrenches_has_further_unknowns() {
    let robot = arm(BaseKind::Fixed);
    for settings in [with(true, false), with(false, true)] {
        assert!(Identifier::new(&robot, TOOL, &[TOOL], &settings).is_err());
        let effort = EquationSettings {
            method: Method::Effort,
            ..settings
        };
        let batch = BatchSettings::default();
        assert!(BatchIdentifier::new(&robot, TOOL, &[TOOL], effort, batch).is_err());
    }
}

/// With a known mass, the weight that is reported is that of the fit that is reported.
#[test]
fn a_subtracted_weight_agrees_with_a_known_mass() {
    for seed in 0..8 {
        let mut given = recorded(seed);
        with_weight(&mut given, &configured(), DOWN);
        let batch = BatchSettings {
            known_mass: Some(KnownMass {
                mass_kg: payload().mass_kg,
                std_dev_kg: 0.0,
            }),
            ..BatchSettings::default()
        };
        let free = solved(&given, with(true, false), BatchSettings::default());
        let known = solved(&given, with(true, false), batch);
        let [free, known] = [free, known].map(|result| result.fit.subtracted_weight.unwrap());
        assert!(known.std_devs[0] < 0.5 * free.std_devs[0]);
        let truth = &tactid_identify::values_of_body(&configured())[..4];
        agree(&known.values, &known.std_devs, truth);
    }
}
