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
    for way in [Way::Tactile, Way::JointSensing] {
        for settings in [Settings::default(), Settings::least_squares()] {
            let mut identifier = identifier(&experiment, Settings { way, ..settings });
            let allocations = measure(|| {
                for instant in &instants {
                    identifier.push(&instant.sample()).unwrap();
                }
                assert_eq!(identifier.estimate().intervals, 14);
            });
            assert_eq!(allocations.count_total, 0);
        }
    }
}
