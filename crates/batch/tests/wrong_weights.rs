//! Gravity of a wrong length and another configured payload, which look like a weight that was
//! subtracted.

use nalgebra::{Matrix3, Vector3};
use tactid_batch::{BatchSettings, Finding, Hypothesis, WrongAssumption};
use tactid_dynamics::{InertialParameters, MassProperties, Notice, Severity};
use tactid_identify::{EquationSettings, SubtractedLoad, Unknowns};

use crate::faults::{Draws, of_a_real_sensor};
use crate::setups::{DOWN, Recording};
use crate::wrong_assumptions::{causes, others};

/// Gravity of another length than that on Earth is named, beside the weight that explains the same.
/// A weight elsewhere than at the centre of the load is no gravity.
#[test]
fn a_gravity_of_another_length_is_named() {
    for (setup, seed) in others(5) {
        let (mut given, mut draws) = (setup.recorded(seed), Draws::new(seed));
        of_a_real_sensor(&mut given, &mut draws);
        for length in [1.0, 98.1] {
            let equations = EquationSettings {
                gravity: Some(DOWN.normalize() * length),
                ..EquationSettings::default()
            };
            let result = given.identify_with(equations, BatchSettings::default());
            let found = causes(&result);
            let first = found.first().unwrap();
            let both = (first.cause, first.runner_up);
            let expected = (Hypothesis::Gravity, Some(Hypothesis::Weight));
            assert_eq!(both, expected, "{seed} {length}: {:?}", result.findings);
            let error = (first.values[2] - DOWN.z).abs();
            assert!(
                error < 0.03 * DOWN.norm() + 3.0 * first.std_devs[2],
                "{error}"
            );
            let words = Finding::WrongAssumption((*first).clone()).to_string();
            assert!(words.contains("9.81 m/s² on Earth"), "{words}");
        }
    }
}

/// Gravity of the opposite sign is named where a weight of twice the load explains the same, be this
/// weight among the unknowns or not. A weight that was subtracted is no gravity.
#[test]
fn a_gravity_of_the_opposite_sign_is_named() {
    for (setup, seed) in others(5) {
        let (mut given, mut draws) = (setup.recorded(seed), Draws::new(seed));
        of_a_real_sensor(&mut given, &mut draws);
        let solved = |given: &Recording, gravity, weight| {
            let equations = EquationSettings {
                gravity: Some(gravity),
                unknowns: Unknowns {
                    weight,
                    gravity: false,
                },
                ..EquationSettings::default()
            };
            given.identify_with(equations, BatchSettings::default())
        };
        for weight in [false, true] {
            let result = solved(&given, -DOWN, weight);
            let found = causes(&result);
            let first = found.first().map(|found| found.cause);
            let findings = &result.findings;
            assert_eq!(
                first,
                Some(Hypothesis::Gravity),
                "{seed} {weight}: {findings:?}"
            );
            assert_eq!(findings[0].severity(), Severity::Contradicts);
            let words = findings[0].to_string();
            assert!(
                words.starts_with("Gravity of the opposite sign, ("),
                "{words}"
            );
        }
        let sound = solved(&given, DOWN, true).findings;
        assert_eq!(sound, [], "{seed}");
        let at = given.setup.payload().center_of_mass;
        let weights = given.in_tool(DOWN * (0.5 * given.setup.mass_kg));
        for (wrench, weight) in given.wrenches.iter_mut().zip(weights) {
            wrench.force += weight;
            wrench.moment += at.cross(&weight);
        }
        let subtracted = solved(&given, DOWN, true);
        let is_gravity = |found: &&WrongAssumption| found.cause == Hypothesis::Gravity;
        assert!(
            !causes(&subtracted).iter().any(is_gravity),
            "{seed}: {:?}",
            subtracted.findings
        );
    }
}

/// A payload that is configured in the controller as another one than the given one is named as it
/// is there.
#[test]
fn another_configured_payload_is_named() {
    for (setup, seed) in others(5) {
        let (mut given, mut draws) = (setup.recorded(seed), Draws::new(seed));
        of_a_real_sensor(&mut given, &mut draws);
        let configured = SubtractedLoad {
            body: InertialParameters::from(MassProperties {
                mass_kg: 0.5 * setup.mass_kg,
                center_of_mass: Vector3::new(0.0, 0.01, 0.05),
                inertia: Matrix3::zeros(),
            }),
            with_inertia: false,
        };
        let equations = EquationSettings {
            subtracted: Some(configured),
            ..EquationSettings::default()
        };
        let result = given.identify_with(equations, BatchSettings::default());
        let found = causes(&result);
        let first = found.first().unwrap();
        assert_eq!(
            first.cause,
            Hypothesis::Weight,
            "{seed}: {:?}",
            result.findings
        );
        assert!((first.assumed[0] - 0.5 * setup.mass_kg).abs() < 1e-12);
        assert!((first.assumed[3] - 0.05).abs() < 1e-12);
        assert!(
            first.values[0].abs() < 0.1 * setup.mass_kg,
            "{:?}",
            first.values
        );
        let words = Finding::WrongAssumption((*first).clone()).to_string();
        let advice = "The wrenches are raw: leave out `configured_payload` and `wrench_is`.";
        assert!(words.ends_with(advice), "{words}");
    }
}
