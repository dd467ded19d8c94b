//! The identifier in a control loop.

#![allow(clippy::unwrap_used)]

mod common;

use allocation_counter::measure;
use common::{Experiment, identifier};
use tactid_identify::{Settings, Way};

/// Neither a sample nor a question allocates, in either way and with either estimator.
#[test]
fn pushing_and_asking_allocate_nothing() {
    let experiment = Experiment {
        duration_s: 0.5,
        ..Experiment::default()
    };
    let instants = experiment.run();
    let combined = Way::Combined { effort: false };
    for (way, settings) in [
        (Way::Tactile, Settings::default()),
        (Way::Tactile, Settings::least_squares()),
        (Way::JointSensing, Settings::default()),
        (Way::JointSensing, Settings::least_squares()),
        (combined, Settings::least_squares()),
    ] {
        let mut identifier = identifier(&experiment, Settings { way, ..settings });
        let allocations = measure(|| {
            for instant in &instants {
                identifier.push(&instant.sample()).unwrap();
            }
            assert_eq!(identifier.estimate().intervals, 13);
        });
        assert_eq!(allocations.count_total, 0);
    }
}
