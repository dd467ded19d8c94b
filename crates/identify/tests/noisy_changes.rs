//! Payload changes whose effect in a window is below the noise.

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::MassProperties;
use tactid_identify::{EquationSettings, Method, PushOutcome};

use crate::common::{Experiment, Instant, identifier};

const SWAP_S: f64 = 5.0;

/// Runs of a robot with a base that floats, whose payload of 100 kg becomes one of 60 kg, or stays.
fn experiments() -> [Experiment; 2] {
    let light = MassProperties {
        mass_kg: 60.0,
        center_of_mass: Vector3::new(0.4, 0.1, -0.1),
        inertia: Matrix3::from_diagonal(&Vector3::new(6.0, 9.0, 7.0)),
    };
    [Some((SWAP_S, light)), None].map(|swap| Experiment {
        duration_s: 14.0,
        swap,
        ..Experiment::default()
    })
}

/// Returns the root mean square of a channel.
fn rms(instants: &[Instant], channel: impl Fn(&Instant) -> f64) -> f64 {
    let squares = instants.iter().map(|each| channel(each).powi(2));
    (squares.sum::<f64>() / instants.len() as f64).sqrt()
}

/// Returns instants with noise relative to the root mean square of each channel: 9 % of the
/// velocities of the base, 5 % of those of the joints, 10 % of the wrenches and 6 % of the efforts.
fn noisy(instants: &[Instant], seed: u64) -> Vec<Instant> {
    let mut random = SmallRng::seed_from_u64(seed);
    let mut draw = |std_dev: f64| std_dev * random.sample::<f64, _>(StandardNormal);
    let mut noisy = instants.to_vec();
    for joint in 0..instants[0].position.len() {
        let of_velocity = 0.05 * rms(instants, |each| each.velocity[joint]);
        let of_effort = 0.06 * rms(instants, |each| each.effort[joint]);
        for each in &mut noisy {
            each.position[joint] += draw(0.1 * of_velocity);
            each.velocity[joint] += draw(of_velocity);
            each.effort[joint] += draw(of_effort);
        }
    }
    let of_axis =
        |fraction: f64, norm: fn(&Instant) -> f64| fraction / 3f64.sqrt() * rms(instants, norm);
    let of_velocity = of_axis(0.09, |each| each.base.velocity.norm());
    let of_turning = of_axis(0.09, |each| each.base.angular_velocity.norm());
    let of_force = of_axis(0.1, |each| each.wrenches[1].force.norm());
    let of_moment = of_axis(0.1, |each| each.wrenches[1].moment.norm());
    for each in &mut noisy {
        let mut vector = |std_dev: f64| Vector3::from_fn(|_, _| draw(std_dev));
        each.base.velocity += vector(of_velocity);
        each.base.angular_velocity += vector(of_turning);
        for wrench in &mut each.wrenches {
            wrench.force += vector(of_force);
            wrench.moment += vector(of_moment);
        }
    }
    noisy
}

/// A change that no single window shows, because its effect alternates with the motion below the
/// noise, is detected within 2.5 s. The mass is then that of the new payload, which is known to a
/// tenth of the change by the end of the run. Without a change there is no alarm.
#[test]
fn a_change_below_the_noise_of_a_window_is_detected() {
    let runs = experiments().map(|experiment| (experiment.run(), experiment));
    for method in [
        Method::Combined { effort: true },
        Method::JointSensing,
        Method::Tactile,
    ] {
        let settings = EquationSettings {
            method,
            ..EquationSettings::default()
        };
        for (exact, experiment) in &runs {
            for seed in 0..3 {
                let mut identifier = identifier(experiment, &settings);
                let mut alarms_s = Vec::new();
                for instant in noisy(exact, seed) {
                    let outcome = identifier.push(&instant.sample()).unwrap();
                    if outcome == PushOutcome::PayloadChanged {
                        alarms_s.push(instant.time_s);
                    }
                }
                let place = format!("{}, seed {seed}: {alarms_s:?}", method.name());
                let changes = usize::from(experiment.swap.is_some());
                assert_eq!(alarms_s.len(), changes, "{place}");
                let is_soon = |&time_s: &f64| (SWAP_S..SWAP_S + 2.5).contains(&time_s);
                assert!(alarms_s.iter().all(is_soon), "{place}");
                let estimate = identifier.estimate();
                let (mass_kg, std_dev_kg) = (estimate.body.mass_kg, estimate.std_devs[0]);
                let expected_kg = if changes == 1 { 60.0 } else { 100.0 };
                let error_kg = (mass_kg - expected_kg).abs();
                assert!(error_kg < 4.0 * std_dev_kg, "{place} {mass_kg}");
                assert!(std_dev_kg < 4.0, "{place} {std_dev_kg}");
            }
        }
    }
}
