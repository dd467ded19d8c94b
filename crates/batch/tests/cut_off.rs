//! A sensor whose channels are cut off at a limit, and whose values are rounded, filtered or noisy
//! afterwards, so that no sample is at the limit.

use tactid_batch::{BatchResult, BatchSettings, Hypothesis};
use tactid_dynamics::Wrench;

use crate::faults::{Draws, of_a_real_sensor};
use crate::setups::{Recording, UR10};
use crate::wrong_assumptions::{causes, others};

/// Cuts a force off at the value that a fraction of the samples exceeds, N, which is returned with
/// its axis: that of the largest range.
fn cut_off(given: &mut Recording, fraction: f64) -> (usize, f64) {
    let sorted = |axis: usize| {
        let mut values: Vec<f64> = given.wrenches.iter().map(|w| w.force[axis]).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let range = |axis: usize| {
        let values = sorted(axis);
        values[values.len() - 1] - values[0]
    };
    let axis = (0..3)
        .max_by(|a, b| range(*a).total_cmp(&range(*b)))
        .unwrap();
    let values = sorted(axis);
    let limit = values[((1.0 - fraction) * values.len() as f64) as usize];
    for wrench in &mut given.wrenches {
        wrench.force[axis] = wrench.force[axis].min(limit);
    }
    (axis, limit)
}

/// What follows a limit.
#[derive(Clone, Copy, Debug)]
enum Then {
    Noise,
    Rounded,
    Filtered,
}

impl Then {
    fn change(self, wrenches: &mut [Wrench], draws: &mut Draws) {
        let mut last = wrenches[0].force;
        for wrench in wrenches {
            wrench.force = match self {
                Self::Noise => wrench.force + draws.vector() * 0.3,
                Self::Rounded => wrench.force.map(f64::round),
                Self::Filtered => last + (wrench.force - last) * 0.5,
            };
            last = wrench.force;
        }
    }
}

/// Returns whether the first cause is that a force is cut off at about a limit.
fn names_limit(result: &BatchResult, (axis, limit): (usize, f64)) -> bool {
    let channel = ["force x", "force y", "force z"][axis];
    causes(result).first().is_some_and(|first| {
        let mut ends = first.names.iter().zip(&first.values);
        let near = 0.1 * limit.abs().max(5.0);
        first.cause == Hypothesis::Saturation
            && ends.any(|(name, value)| name == channel && (value - limit).abs() < near)
    })
}

/// The limit is the first cause, or mass and centre of mass are right, because robust weights or the
/// search for contacts leave out what is cut off.
#[test]
fn a_limit_is_named_whatever_follows_it() {
    for then in [Then::Noise, Then::Rounded, Then::Filtered] {
        let (mut named, mut tried) = (0, 0);
        for (setup, seed) in others(10).chain((0..5).map(|seed| (&UR10, seed))) {
            for fraction in [0.15, 0.3] {
                let (mut given, mut draws) = (setup.recorded(seed), Draws::new(seed));
                of_a_real_sensor(&mut given, &mut draws);
                let limit = cut_off(&mut given, fraction);
                then.change(&mut given.wrenches, &mut draws);
                let result = given.identify(BatchSettings::default());
                let is_named = names_limit(&result, limit);
                let (body, held) = (&result.estimate.body, setup.payload());
                let is_right = (body.mass_kg / held.mass_kg - 1.0).abs() < 0.01
                    && (body.center_of_mass - held.center_of_mass).norm() < 2e-3;
                assert!(
                    is_named || is_right,
                    "{then:?} {seed} {fraction}: {:?}",
                    result.findings
                );
                tried += 1;
                named += usize::from(is_named);
            }
        }
        assert!(4 * named >= 3 * tried, "{then:?}: {named} of {tried}");
    }
}
