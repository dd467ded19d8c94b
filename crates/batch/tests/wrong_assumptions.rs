//! Wrong assumptions about a wrist sensor, gravity and the joints are named: random motions of
//! arms, one fault each.

use nalgebra::{Rotation3, Vector3};
use tactid_batch::{BatchResult, BatchSettings, Finding, Hypothesis, WrongAssumption};
use tactid_dynamics::{Notice, Severity};
use tactid_identify::{EquationSettings, Unknowns};

use crate::faults::{Draws, Fault, of_a_real_sensor};
use crate::setups::{DOWN, OTHERS, Recording, Setup, UR10};

fn solved(given: &Recording) -> BatchResult {
    given.identify(BatchSettings::default())
}

pub(crate) fn causes(result: &BatchResult) -> Vec<&WrongAssumption> {
    let causes = result.findings.iter().filter_map(|finding| match finding {
        Finding::WrongAssumption(found) => Some(found),
        _ => None,
    });
    causes.collect()
}

/// Returns the recording of a setup and a seed with some faults.
fn faulty(setup: &'static Setup, faults: &[Fault], seed: u64) -> Recording {
    let (mut given, mut draws) = (setup.recorded(seed), Draws::new(1000 + seed));
    for fault in faults {
        fault.put(&mut given, &mut draws);
    }
    of_a_real_sensor(&mut given, &mut draws);
    given
}

/// Returns whether a hypothesis that says the same as a fault is a cause or its runner-up.
fn names(found: &WrongAssumption, fault: Fault) -> bool {
    let is_cause = |each: Hypothesis| fault.causes().contains(&each);
    is_cause(found.cause) || found.runner_up.is_some_and(is_cause)
}

/// Asserts that the first finding of 95 % of recordings with one fault is its cause, or has it as
/// the runner-up.
fn assert_named_first(setups: impl Iterator<Item = (&'static Setup, u64)> + Clone) {
    let (mut named, mut tried) = (0, 0);
    for fault in Fault::ALL {
        for (setup, seed) in setups.clone() {
            let result = solved(&faulty(setup, &[fault], seed));
            let is_named = causes(&result)
                .first()
                .is_some_and(|first| names(first, fault));
            tried += 1;
            named += usize::from(is_named);
            if !is_named {
                eprintln!("{fault:?} {seed}: {:?}", result.findings);
            }
        }
    }
    assert!(
        named as f64 >= 0.95 * f64::from(tried),
        "{named} of {tried}"
    );
}

/// Asserts that no recording without a fault has a cause.
fn assert_without_cause(setups: impl Iterator<Item = (&'static Setup, u64)>) {
    let mut wrong = 0;
    for (setup, seed) in setups {
        let result = solved(&faulty(setup, &[], seed));
        if !causes(&result).is_empty() {
            wrong += 1;
            eprintln!("{seed}: {:?}", result.findings);
        }
    }
    assert_eq!(wrong, 0);
}

/// Returns so many recordings of the other arms, each with its seed.
pub(crate) fn others(count: u64) -> impl Iterator<Item = (&'static Setup, u64)> + Clone {
    OTHERS.iter().cycle().zip(100..100 + count)
}

/// 132 recordings with one fault.
#[test]
fn the_cause_is_named_first() {
    assert_named_first((0..12).map(|seed| (&UR10, seed)));
}

/// 110 recordings with one fault.
#[test]
fn the_cause_is_named_first_for_other_arms() {
    assert_named_first(others(10));
}

/// Cross-talk of half a percent and noise that stays for a while are no cause.
#[test]
fn a_sound_sensor_has_no_cause() {
    assert_without_cause((0..100).map(|seed| (&UR10, seed)).chain(others(100)));
}

/// A channel of the opposite sign has a gain of -1, which is no other cause.
#[test]
fn a_sign_is_no_gain() {
    for seed in 0..12 {
        let result = solved(&faulty(&UR10, &[Fault::Sign], seed));
        let gains = Some(Hypothesis::AxisGains);
        let is_gains = |found: &&WrongAssumption| found.runner_up == gains;
        let found = causes(&result);
        assert!(!found.iter().any(is_gains), "{seed}: {found:?}");
    }
}

/// An offset that leaves half of the residuals beside a force that wanders is not the only cause.
#[test]
fn an_offset_that_leaves_most_is_not_the_only_cause() {
    let mut given = UR10.recorded(0);
    let (mut draws, mut wandering) = (Draws::new(0), Vector3::zeros());
    for wrench in &mut given.wrenches {
        wandering = wandering * 0.995 + draws.vector() * 0.2;
        wrench.force += Vector3::new(3.0, 0.0, 0.0) + wandering;
    }
    let findings = solved(&given).findings;
    let [
        Finding::LoadUnexplained(_),
        offset @ Finding::WrongAssumption(_),
        ..,
    ] = &findings[..]
    else {
        panic!("{findings:?}");
    };
    let sentence = offset.to_string();
    assert!(
        sentence.contains("something else is wrong, too"),
        "{sentence}"
    );
}

/// Of recordings with two faults, both are named in 85 %.
#[test]
fn two_causes_are_named() {
    let pairs = [
        [Fault::Offset, Fault::Weight],
        [Fault::Offset, Fault::Turn],
        [Fault::Offset, Fault::Gravity],
        [Fault::Turn, Fault::Offset],
        [Fault::Weight, Fault::Turn],
        [Fault::Offset, Fault::Delay],
        [Fault::Gain, Fault::Offset],
        [Fault::Sign, Fault::Offset],
    ];
    let (mut named, mut tried) = (0, 0);
    for pair in pairs {
        for seed in 20..28 {
            let result = solved(&faulty(&UR10, &pair, seed));
            let found = causes(&result);
            let is_found = |fault: &Fault| found.iter().any(|each| names(each, *fault));
            let both = pair.iter().all(is_found);
            tried += 1;
            named += usize::from(both);
            if !both {
                let found: Vec<_> = found
                    .iter()
                    .map(|each| (each.cause, each.runner_up))
                    .collect();
                eprintln!("{pair:?} {seed}: {found:?}");
            }
        }
    }
    assert!(
        named as f64 >= 0.85 * f64::from(tried),
        "{named} of {tried}"
    );
}

/// Asserts that of recordings with two faults both causes are named in 85 %.
fn assert_both(fault: impl Fn(&mut Recording, &mut Draws), both: [Hypothesis; 2]) {
    let is_right = |seed: &u64| {
        let (mut given, mut draws) = (UR10.recorded(*seed), Draws::new(*seed));
        fault(&mut given, &mut draws);
        of_a_real_sensor(&mut given, &mut draws);
        let result = solved(&given);
        let found = causes(&result);
        let is_named = |each: &Hypothesis| found.iter().any(|cause| cause.cause == *each);
        both.iter().all(is_named)
    };
    let right = (20..28).filter(is_right).count();
    assert!(right >= 7, "{right} of 8");
}

/// An axis of the opposite sign is found beside the offset of a sensor that was zeroed with its
/// load, which is larger than what the sign changes.
#[test]
fn a_sign_is_found_beside_a_large_offset() {
    let fault = |given: &mut Recording, draws: &mut Draws| {
        Fault::Sign.put(given, draws);
        let first = given.wrenches[0];
        for wrench in &mut given.wrenches {
            wrench.force -= first.force;
            wrench.moment -= first.moment;
        }
    };
    assert_both(fault, [Hypothesis::Offset, Hypothesis::Axes]);
}

/// Tilts the base as [`tilt_base`] does, by random angles, and subtracts the weight of a body as a
/// controller does that knows this, or that does not.
fn subtract_from_tilted(given: &mut Recording, draws: &mut Draws, is_known: bool) {
    let tilt = Vector3::new(draws.between(0.3, 1.2), draws.between(-0.5, 0.5), 0.0);
    tilt_base(given, tilt);
    let gravity = if is_known {
        Rotation3::new(tilt) * DOWN
    } else {
        DOWN
    };
    let mass_kg = draws.between(0.4, 1.5);
    let weights = given.in_tool(gravity * mass_kg);
    let at = draws.vector() * 0.03;
    for (wrench, weight) in given.wrenches.iter_mut().zip(&weights) {
        wrench.force += weight;
        wrench.moment += at.cross(weight);
    }
}

/// A controller subtracts a weight in the direction in which gravity acts, or in the one that is
/// assumed, because it does not know how its base is mounted.
#[test]
fn a_weight_is_found_beside_another_gravity() {
    for is_known in [true, false] {
        let fault = |given: &mut Recording, draws: &mut Draws| {
            subtract_from_tilted(given, draws, is_known);
        };
        assert_both(fault, [Hypothesis::Gravity, Hypothesis::Weight]);
    }
}

/// Beside a gravity whose direction is identified, a weight along the given gravity is named and
/// contradicts the result; with this weight among the unknowns, the result is right.
#[test]
fn a_weight_along_the_given_gravity_is_named_and_identified() {
    for (setup, seed) in others(5) {
        let (mut given, mut draws) = (setup.recorded(seed), Draws::new(seed));
        subtract_from_tilted(&mut given, &mut draws, false);
        of_a_real_sensor(&mut given, &mut draws);
        let solved =
            |weight| given.identify_with(unknown_gravity(weight), BatchSettings::default());
        let result = solved(false);
        let found = causes(&result);
        let first = found
            .first()
            .map(|found| (found.cause, found.along_m_s2.is_some()));
        assert_eq!(
            first,
            Some((Hypothesis::Weight, true)),
            "{seed}: {:?}",
            result.findings
        );
        let mut severities = result.findings.iter().map(Notice::severity);
        assert!(severities.any(|each| each == Severity::Contradicts));
        let result = solved(true);
        // Cross-talk is no noise.
        let error_kg = (result.estimate.body.mass_kg - setup.mass_kg).abs();
        assert!(error_kg < 0.03 * setup.mass_kg, "{seed}: {error_kg}");
        let weight = result.fit.subtracted_weight.unwrap();
        assert_eq!(weight.along_m_s2, Some(DOWN.into()), "{seed}");
    }
}

/// Settings with gravity, and a subtracted weight where asked for, among the unknowns.
fn unknown_gravity(weight: bool) -> EquationSettings {
    EquationSettings {
        unknowns: Unknowns {
            weight,
            gravity: true,
        },
        ..EquationSettings::default()
    }
}

/// Asserts that a fault is the first cause and contradicts the result where the direction of
/// gravity is identified, for each of the other arms.
fn assert_named_beside_unknown_gravity(
    cause: Hypothesis,
    fault: impl Fn(&mut Recording, &mut Draws),
) {
    for (setup, seed) in others(5) {
        let (mut given, mut draws) = (setup.recorded(seed), Draws::new(seed));
        fault(&mut given, &mut draws);
        of_a_real_sensor(&mut given, &mut draws);
        let result = given.identify_with(unknown_gravity(false), BatchSettings::default());
        let first = causes(&result).first().map(|found| found.cause);
        assert_eq!(first, Some(cause), "{seed}: {:?}", result.findings);
        let mut severities = result.findings.iter().map(Notice::severity);
        assert!(severities.any(|each| each == Severity::Contradicts));
    }
}

/// A gravity whose direction is identified has the given size, and explains no weight that the
/// controller has subtracted, be the base level or tilted.
#[test]
fn an_unknown_gravity_hides_no_weight() {
    for tilt in [0.0, 0.4] {
        let subtracted = |given: &mut Recording, draws: &mut Draws| {
            tilt_base(given, Vector3::x() * tilt);
            let gravity = Rotation3::new(Vector3::x() * tilt) * DOWN;
            let mass_kg = given.setup.mass_kg * draws.between(0.3, 0.6);
            // Of the payload itself, whose mass is configured as too small.
            let at = given.setup.payload().center_of_mass;
            let weights = given.in_tool(gravity * mass_kg);
            for (wrench, weight) in given.wrenches.iter_mut().zip(weights) {
                wrench.force += weight;
                wrench.moment += at.cross(&weight);
            }
        };
        assert_named_beside_unknown_gravity(Hypothesis::Weight, subtracted);
    }
}

/// A gravity whose direction is identified does not explain what accelerates a payload whose
/// wrenches have the opposite sign. Beside an offset, the sign is that of the mass.
#[test]
fn an_unknown_gravity_hides_no_sign() {
    for tilt in [0.0, 1.4] {
        let negated = |given: &mut Recording, _: &mut Draws| negate(given, tilt, Vector3::zeros());
        assert_named_beside_unknown_gravity(Hypothesis::Axes, negated);
    }
    for tilt in [0.0, 0.5] {
        let (mut given, mut draws) = (UR10.recorded(4), Draws::new(4));
        negate(&mut given, tilt, Vector3::new(0.4, -3.1, 5.4));
        of_a_real_sensor(&mut given, &mut draws);
        let result = given.identify_with(unknown_gravity(false), BatchSettings::default());
        let findings = &result.findings;
        let found: Vec<_> = causes(&result).iter().map(|found| found.cause).collect();
        assert!(found.contains(&Hypothesis::Offset), "{tilt}: {findings:?}");
        assert!(!found.contains(&Hypothesis::Weight), "{tilt}: {findings:?}");
        let is_sign = |finding: &Finding| matches!(finding, Finding::NegativeMass { .. });
        let is_named = found.contains(&Hypothesis::Axes) || findings.iter().any(is_sign);
        assert!(is_named, "{tilt}: {findings:?}");
    }
}

/// Tilts the base about the x axis by an angle, rad, and gives the wrenches the opposite sign and an
/// offset of the force, N.
fn negate(given: &mut Recording, tilt: f64, offset: Vector3<f64>) {
    tilt_base(given, Vector3::x() * tilt);
    for wrench in &mut given.wrenches {
        (wrench.force, wrench.moment) = (-wrench.force - offset, -wrench.moment);
    }
}

/// Tilts the base by a rotation vector in the world, rad.
fn tilt_base(given: &mut Recording, tilt: Vector3<f64>) {
    let tilted = Rotation3::new(tilt) * DOWN;
    let payload = given.setup.payload();
    let changes = given.in_tool((DOWN - tilted) * payload.mass_kg);
    for (wrench, change) in given.wrenches.iter_mut().zip(changes) {
        wrench.force += change;
        wrench.moment += payload.center_of_mass.cross(&change);
    }
}

/// One attitude at rest does not distinguish the weight from an offset of the sensor. That is the
/// first finding, and no assumption is blamed; with a sensor whose offset is known it is none.
#[test]
fn one_attitude_does_not_show_an_offset() {
    let (mut given, mut draws) = (UR10.recorded(0), Draws::new(0));
    let posture = given.joints[0][0].clone();
    let still = vec![0.0; posture.len()];
    given.joints.fill([posture, still]);
    let com = given.setup.payload().center_of_mass;
    let offset = draws.vector() * 5.0;
    let weights = given.in_tool(-DOWN * UR10.mass_kg);
    // Friction of a cable, which no model explains.
    let mut wandering = Vector3::zeros();
    for (wrench, weight) in given.wrenches.iter_mut().zip(weights) {
        wandering = wandering * 0.995 + draws.vector() * 0.3;
        wrench.force = weight + offset + wandering + draws.vector() * 0.1;
        wrench.moment = com.cross(&weight) + draws.vector() * 0.01;
    }
    for shown_offset in [true, false] {
        let result = given.identify(BatchSettings {
            shown_offset,
            ..BatchSettings::default()
        });
        let findings = &result.findings;
        let is_reported = |found: &Finding| {
            matches!(found, Finding::WeightOrOffset { .. })
                && found.severity() == Severity::Contradicts
        };
        assert_eq!(
            findings.first().is_some_and(is_reported),
            shown_offset,
            "{findings:?}"
        );
        assert_eq!(
            findings.iter().filter(|found| is_reported(found)).count(),
            usize::from(shown_offset)
        );
        assert_eq!(causes(&result), Vec::<&WrongAssumption>::new());
    }
}

/// A shown offset is identified: the values of the first result are right, and their intervals
/// contain the truth.
#[test]
fn a_shown_offset_is_identified() {
    let auto = BatchSettings {
        shown_offset: true,
        ..BatchSettings::default()
    };
    for seed in 40..50 {
        let (mut given, mut draws) = (UR10.recorded(seed), Draws::new(seed));
        Fault::Offset.put(&mut given, &mut draws);
        let result = given.identify(auto.clone());
        let found = causes(&result);
        assert!(
            matches!(found[..], [found] if found.cause == Hypothesis::Offset && found.is_applied),
            "{seed}: {:?}",
            result.findings
        );
        let error_kg = result.estimate.body.mass_kg - UR10.mass_kg;
        let std_dev_kg = result.estimate.std_devs[0];
        assert!(error_kg.abs() < 4.0 * std_dev_kg, "{error_kg} {std_dev_kg}");
        let clean = UR10.recorded(seed);
        let with = clean.identify(auto.clone());
        let without = solved(&clean);
        assert_eq!(with.estimate, without.estimate);
    }
}
