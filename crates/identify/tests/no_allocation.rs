//! The online identifier allocates nothing in a control loop.

use crate::common::{Experiment, Noise, TOOL, identifier, payload};
use allocation_counter::measure;
use rand::{SeedableRng, rngs::SmallRng};
use tactid_dynamics::MassProperties;
use tactid_identify::{EquationSettings, Method, Sample, WORLD};

/// A payload change allocates nothing: the noise is estimated, the change is detected, and the
/// estimate starts again.
#[test]
fn a_payload_change_allocates_nothing() {
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
    let noise = Noise::fraction(0.01);
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
        let settings = EquationSettings {
            method,
            wrench_offset,
            ..EquationSettings::default()
        };
        let mut identifier = identifier(&experiment, &settings);
        let frame = identifier.wrench_frame(TOOL, Some(WORLD)).unwrap();
        let allocations = measure(|| {
            for instant in &noisy {
                identifier.push(&instant.sample()).unwrap();
                let _ = (identifier.estimate(), identifier.wrench_offset());
                let _ = (
                    identifier.estimate_before_change(),
                    identifier.joint_covariance(),
                );
                let _ = (
                    identifier.contact_wrench(&frame),
                    identifier.load_wrench(&frame),
                );
            }
        });
        assert_eq!(identifier.estimate().payload_changes, 1);
        assert_eq!(allocations.count_total, 0);
    }
}

/// Neither a sample nor an estimate allocates, with any method.
#[test]
fn push_and_estimate_allocate_nothing() {
    let experiment = Experiment {
        duration_s: 0.5,
        ..Experiment::default()
    };
    let instants = experiment.run();
    let settings_of = |method| EquationSettings {
        method,
        ..EquationSettings::default()
    };
    for method in [
        Method::Tactile,
        Method::JointSensing,
        Method::Effort,
        Method::Combined { effort: false },
        Method::Combined { effort: true },
    ] {
        let mut identifier = identifier(&experiment, &settings_of(method));
        let allocations = measure(|| {
            for instant in &instants {
                identifier.push(&instant.sample()).unwrap();
            }
            assert_eq!(identifier.estimate().windows, 13);
        });
        assert_eq!(allocations.count_total, 0);
    }
}

/// A snapshot is updated without allocation, from the first sample on, and has what a new one has.
#[test]
fn a_snapshot_allocates_nothing() {
    let experiment = Experiment::default();
    let settings = EquationSettings {
        method: Method::Combined { effort: true },
        ..EquationSettings::default()
    };
    let mut identifier = identifier(&experiment, &settings);
    let mut snapshot = identifier.snapshot();
    for instant in experiment.run() {
        let velocity: Vec<f64> = instant.velocity.iter().map(|v| 57.3 * v).collect();
        let sample = Sample {
            joint_velocity: &velocity,
            ..instant.sample()
        };
        identifier.push(&sample).unwrap();
        let allocations = measure(|| identifier.update_snapshot(&mut snapshot));
        assert_eq!(allocations.count_total, 0);
    }
    let recent = format!("{:?}", snapshot.recent.in_order());
    assert!(recent.contains("time_s"), "{recent}");
    assert_eq!(
        recent,
        format!("{:?}", identifier.snapshot().recent.in_order())
    );
}

/// A sample of a wrong size is refused without an allocation; only its message allocates.
#[test]
fn an_error_allocates_nothing() {
    let experiment = Experiment {
        duration_s: 0.01,
        ..Experiment::default()
    };
    let instants = experiment.run();
    let mut identifier = identifier(&experiment, &EquationSettings::default());
    let sample = instants[0].sample();
    let wrong = [
        Sample {
            joint_position: &[0.0],
            ..sample
        },
        Sample {
            wrenches: &[],
            ..sample
        },
    ];
    for sample in wrong {
        let mut refused = None;
        let allocations = measure(|| refused = identifier.push(&sample).err());
        assert_eq!(allocations.count_total, 0);
        let message = refused.unwrap().to_string();
        assert!(
            message.contains("joint_1, ")
                || message.contains("0 wrenches, but there are 2 sensors"),
            "{message}"
        );
    }
}
