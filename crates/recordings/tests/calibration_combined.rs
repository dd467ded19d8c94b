//! One payload from several recordings that were identified with one calibration.

use tactid_batch::PriorKnowledge;
use tactid_batch::{BatchSettings, LinearEstimate};
use tactid_calibrate::{Calibration, EffortRecording};
use tactid_identify::HALF_WIDTH_95;
use tactid_recordings::{Combination, combine_estimates};

use crate::effort_arm::{World, calibrated, payload, record, values};

/// Returns what a loaded recording says, with unloaded recordings of its day.
fn identified(
    calibration: &Calibration,
    loaded: EffortRecording,
    unloaded: &[EffortRecording],
) -> LinearEstimate {
    let found = calibration.identify(&[loaded], unloaded, &BatchSettings::default());
    found.unwrap().result.linear
}

fn combined(runs: &[LinearEstimate]) -> Combination {
    combine_estimates("tool", runs, &PriorKnowledge::default(), None).unwrap()
}

/// Returns the variance of the mass that two runs share.
fn shared_variance(first: &LinearEstimate, second: &LinearEstimate) -> f64 {
    let columns = second.shared.unknowns.iter().enumerate();
    let products = columns.filter_map(|(k, unknown)| {
        let of_first = first
            .shared
            .unknowns
            .iter()
            .position(|other| other == unknown)?;
        Some(first.shared.changes[(0, of_first)] * second.shared.changes[(0, k)])
    });
    products.sum()
}

/// Three recordings on three days, on each of which friction and gains are others, each with an
/// unloaded recording of its day: they agree, and the intervals of the combination contain the
/// payload.
#[test]
fn recordings_of_several_days_agree() {
    let (mut held, mut agreed, arms) = (0, 0, 10);
    for seed in 200..200 + arms {
        let mut world = World::new(seed);
        let calibration = calibrated(&mut world, 20.0).calibration;
        let body = payload(2.5, &mut world);
        let runs = [(1.1, 1.03), (1.2, 0.97), (0.9, 1.05)].map(|(friction, gain)| {
            world.scale_friction(friction);
            world.gains = world.gains.map(|of_joint| of_joint * gain);
            let unloaded = [record(&mut world, None, 20.0)];
            identified(
                &calibration,
                record(&mut world, Some(&body), 20.0),
                &unloaded,
            )
        });
        let found = combined(&runs);
        agreed += u32::from(found.agreement.agree);
        let pairs = found.estimate.values().into_iter().zip(values(&body));
        let pairs = pairs.zip(found.estimate.std_devs).take(4);
        held += pairs
            .filter(|((value, truth), std_dev)| (value - truth).abs() <= HALF_WIDTH_95 * std_dev)
            .count();
    }
    assert!(agreed >= 8, "{agreed} of {arms}");
    assert!(held >= 35, "{held} of {}", 4 * arms);
}

/// What recordings share is what they have in common: the calibration always, the unloaded
/// recordings where they are the same. No number of recordings reduces it.
#[test]
fn recordings_share_the_calibration_and_their_unloaded_recordings() {
    let mut world = World::new(210);
    let calibration = calibrated(&mut world, 20.0).calibration;
    let body = payload(2.5, &mut world);
    let days = [(); 2].map(|()| record(&mut world, None, 20.0));
    let [first, second] = [(); 2].map(|()| record(&mut world, Some(&body), 20.0));
    let of = |loaded: &EffortRecording, day: usize| {
        identified(&calibration, loaded.clone(), &days[day..=day])
    };
    let one = of(&first, 0);
    let (same_day, another_day) = (of(&second, 0), of(&second, 1));
    let of_calibration = shared_variance(&one, &another_day);
    let of_both = shared_variance(&one, &same_day);
    assert!(0.0 < of_calibration && of_calibration < of_both);
    for (run, variance) in [(another_day, of_calibration), (same_day, of_both)] {
        let found = combined(&[one.clone(), run]);
        let std_dev = found.estimate.std_devs[0];
        assert!(
            std_dev > 0.9 * variance.sqrt(),
            "{std_dev} {}",
            variance.sqrt()
        );
    }
}
