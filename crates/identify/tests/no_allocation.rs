//! The identifier in a control loop.

#![allow(clippy::unwrap_used)]

mod common;

use allocation_counter::measure;
use common::{Experiment, Noise, identifier, payload};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_dynamics::MassProperties;
use tactid_identify::{Settings, Method};

/// Neither does what follows a change of payload: noise is learnt, the change is seen, all begins anew.
#[test]
fn another_payload_allocates_nothing() {
    let experiment = Experiment {
        swap: Some((
            2.0,
            MassProperties {
                mass_kg: 60.0,
                ..payload()
            },
        )),
        ..Experiment::default()
    };
    let mut random = SmallRng::seed_from_u64(1);
    let noise = Noise::part(0.01);
    let instants: Vec<_> = experiment.run();
    let noisy: Vec<_> = instants
        .iter()
        .map(|instant| noise.on(instant, &mut random))
        .collect();
    let combined = Method::Combined { effort: false };
    for (method, wrench_offset) in [
        (Method::Tactile, false),
        (Method::Tactile, true),
        (combined, false),
    ] {
        let settings = Settings {
            method,
            wrench_offset,
            ..Settings::default()
        };
        let mut identifier = identifier(&experiment, settings);
        let allocations = measure(|| {
            for instant in &noisy {
                identifier.push(&instant.sample()).unwrap();
                let _ = identifier.estimate();
            }
        });
        assert_eq!(identifier.estimate().changes, 1);
        assert_eq!(allocations.count_total, 0);
    }
}

/// Neither a sample nor a question allocates, in either way and with either estimator.
#[test]
fn pushing_and_asking_allocate_nothing() {
    let experiment = Experiment {
        duration_s: 0.5,
        ..Experiment::default()
    };
    let instants = experiment.run();
    let combined = Method::Combined { effort: false };
    for (method, settings) in [
        (Method::Tactile, Settings::paper()),
        (Method::Tactile, Settings::default()),
        (Method::JointSensing, Settings::paper()),
        (Method::JointSensing, Settings::default()),
        (combined, Settings::default()),
    ] {
        let mut identifier = identifier(&experiment, Settings { method, ..settings });
        let allocations = measure(|| {
            for instant in &instants {
                identifier.push(&instant.sample()).unwrap();
            }
            assert_eq!(identifier.estimate().intervals, 13);
        });
        assert_eq!(allocations.count_total, 0);
    }
}
