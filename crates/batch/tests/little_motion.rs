//! Motions that excite little: one joint alone, a turn about the vertical, rest.

use nalgebra::Vector3;
use tactid_batch::{BatchResult, BatchSettings, Finding, Hypothesis};
use tactid_identify::EquationSettings;

use crate::faults::Draws;
use crate::setups::{OTHERS, Recording, Setup, UR10};

fn with_offset(shown_offset: bool) -> BatchSettings {
    BatchSettings {
        shown_offset,
        ..BatchSettings::default()
    }
}

/// Adds a zero of the sensor that was never set.
fn add_offset(given: &mut Recording) {
    for wrench in &mut given.wrenches {
        wrench.force += Vector3::new(1.0, 2.0, 3.0);
        wrench.moment += Vector3::new(0.1, 0.1, 0.1);
    }
}

/// Asserts that the intervals of mass and centre of mass contain the truth, and returns that of the
/// mass relative to it.
fn assert_right(given: &Recording, result: &BatchResult, context: &str) -> f64 {
    let (values, std_devs) = (result.estimate.values(), result.estimate.std_devs);
    let (mass_kg, [x, y, z]) = (given.setup.mass_kg, given.setup.center_of_mass);
    for (k, truth) in [mass_kg, x, y, z].into_iter().enumerate() {
        let (error, std_dev) = (values[k] - truth, std_devs[k]);
        assert!(
            error.abs() < 4.0 * std_dev,
            "{context}, value {k}: {error} {std_dev}, {:?}",
            result.findings
        );
    }
    std_devs[0] / mass_kg
}

/// Joints that hold still show nothing, exact or with noise, where their velocities and
/// accelerations are derived: what noise and rounding alone excite moves neither the mass nor an
/// offset.
#[test]
fn one_joint_shows_the_mass_without_velocities() {
    let slow = EquationSettings {
        cutoff_hz: 3.0,
        ..EquationSettings::default()
    };
    for (setup, joint) in [(&UR10, 2), (&UR10, 3), (&OTHERS[0], 3), (&OTHERS[3], 5)] {
        for noise_rad in [0.0, 1e-4] {
            for has_offset in [false, true] {
                let mut given = setup.recorded_with(1, |k| if k == joint { 5.0 } else { 0.0 });
                let mut draws = Draws::new(1);
                for [position, velocity] in &mut given.joints {
                    velocity.clear();
                    for angle in position {
                        *angle += noise_rad * draws.vector().x;
                    }
                }
                if has_offset {
                    add_offset(&mut given);
                }
                let context = format!("joint {joint}, noise {noise_rad}, offset {has_offset}");
                let result = given.identify_with(slow.clone(), with_offset(true));
                let std_dev = assert_right(&given, &result, &context);
                assert!(
                    std_dev < 0.005,
                    "{context}: {std_dev} {:?}",
                    result.findings
                );
                let is_applied = |found: &Finding| {
                    matches!(found, Finding::WrongAssumption(found)
                        if found.cause == Hypothesis::Offset && found.is_applied)
                };
                assert_eq!(
                    result.findings.iter().any(is_applied),
                    has_offset,
                    "{context}: {:?}",
                    result.findings
                );
            }
        }
    }
}

/// A turn about the vertical does not tell the weight from a zero that was never set: the result is
/// contradicted, unless the zero is given. Where small accelerations tell them apart, both are
/// identified.
#[test]
fn weight_and_offset_are_one_where_gravity_does_not_turn() {
    let about_the_vertical = |k: usize| if k == 0 { 0.2 } else { 0.0 };
    for has_offset in [false, true] {
        let mut given = UR10.recorded_with(1, about_the_vertical);
        if has_offset {
            add_offset(&mut given);
        }
        let found = given.identify(with_offset(true)).findings;
        let first = found.first();
        assert_eq!(first, Some(&Finding::WeightOrOffset { is_known: false }));
    }
    let sound = UR10.recorded_with(1, about_the_vertical);
    let result = sound.identify(with_offset(false));
    assert!(assert_right(&sound, &result, "a zero that is given") < 0.005);
    assert_eq!(result.findings, []);

    let mut given = UR10.recorded_with(1, |_| 0.1);
    add_offset(&mut given);
    let result = given.identify(with_offset(true));
    assert_right(&given, &result, "small accelerations");
    let first = result.findings.first();
    assert_eq!(first, Some(&Finding::WeightOrOffset { is_known: true }));
}

/// At rest, the centre of mass is anywhere on a vertical line: where that is not quite across an
/// axis of the tool, the interval of the coordinate along the axis contains it. A load at rest has
/// no delay.
#[test]
fn what_a_rest_does_not_show_is_in_the_intervals() {
    let tilted = Setup {
        posture: &[0.0, -1.2, 1.6, -0.4, 1.574, 0.0],
        ..UR10
    };
    let given = tilted.recorded_with(1, |_| 0.0);
    let result = given.identify(BatchSettings {
        delay: true,
        ..with_offset(false)
    });
    assert_right(&given, &result, "at rest");
    assert!(result.estimate.std_devs[1] < 0.01);
    assert_eq!(result.delay, None);
}

/// Noise in the derivative of a load that hardly changes makes no delay shorter.
#[test]
fn the_delay_of_a_slow_motion_has_no_bias() {
    let mut given = UR10.recorded_with(1, |_| 0.3);
    let late = 2;
    let wrenches = given.wrenches.clone();
    given.wrenches[late..].copy_from_slice(&wrenches[..wrenches.len() - late]);
    let result = given.identify(BatchSettings {
        delay: true,
        ..with_offset(false)
    });
    let delay = result.delay.unwrap();
    let error_s = delay.delay_s - late as f64 / UR10.rate_hz;
    assert!(error_s.abs() < 4.0 * delay.std_dev_s, "{delay:?}");
    assert!(delay.std_dev_s < 0.002, "{delay:?}");
}
