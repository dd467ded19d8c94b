//! Where motion and payload at once would be wrong, or have no advantage, and what it does with
//! what is known of sensors.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{BatchIdentifier, BatchResult, BatchSettings, Finding, MotionEstimate};
use tactid_dynamics::MassProperties;
use tactid_identify::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use tactid_identify::{EquationSettings, Method, values_of_body};

use crate::common::{
    Experiment, Instant, Noise, SENSORS, TOOL, assert_holds_truth, errors_percent, payload,
};

const COMBINED: Method = Method::Combined { effort: true };

fn experiment() -> Experiment {
    Experiment {
        duration_s: 1.5,
        ..Experiment::default()
    }
}

/// Noise on every channel but the pose of the base, with which no source outdoes the others.
fn noisy(instants: &[Instant], seed: u64) -> Vec<Instant> {
    let noise = Noise {
        wrench: [0.2, 0.02],
        effort: 0.05,
        ..Noise::fraction(0.003)
    };
    let mut random = SmallRng::seed_from_u64(seed);
    let drawn = instants
        .iter()
        .map(|instant| noise.on(instant, &mut random));
    drawn.collect()
}

fn solve(instants: &[Instant], equations: EquationSettings) -> BatchResult {
    solve_with(instants, equations, BatchSettings::default())
}

fn solve_with(
    instants: &[Instant],
    equations: EquationSettings,
    settings: BatchSettings,
) -> BatchResult {
    let robot = experiment().robot();
    let mut identifier = BatchIdentifier::new(&robot, TOOL, &SENSORS, equations, settings).unwrap();
    for instant in instants {
        identifier.push(&instant.sample()).unwrap();
    }
    identifier.solve().unwrap()
}

fn with(method: Method) -> EquationSettings {
    EquationSettings {
        method,
        ..EquationSettings::default()
    }
}

/// Standard deviations of the noise of the linear and the angular acceleration, m/s² and rad/s².
const OF_ACCELERATIONS: [f64; 2] = [1e-3; 2];

/// Sets the accelerations of the base that are measured, linear and angular, to those of the exact
/// motion with noise. The first and the last instant have none and go.
pub(crate) fn accelerated(
    instants: &[Instant],
    exact: &[Instant],
    are_measured: [bool; 2],
    random: &mut SmallRng,
) -> Vec<Instant> {
    let mut accelerated = instants.to_vec();
    for k in 1..exact.len() - 1 {
        let step_s = exact[k + 1].time_s - exact[k - 1].time_s;
        let [before, after] = [&exact[k - 1].base, &exact[k + 1].base];
        let mut noise = |std_dev: f64| -> Vector3<f64> {
            Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal))
        };
        let linear = (after.velocity - before.velocity) / step_s + noise(OF_ACCELERATIONS[0]);
        let turning = (after.angular_velocity - before.angular_velocity) / step_s;
        let angular = turning + noise(OF_ACCELERATIONS[1]);
        let base = &mut accelerated[k].base;
        base.acceleration = are_measured[0].then_some(linear);
        base.angular_acceleration = are_measured[1].then_some(angular);
    }
    accelerated.remove(0);
    accelerated.pop();
    accelerated
}

/// Returns instants with noise of 1 mm and 1 mrad on the pose of the base, and of 2 mm/s and 2 mrad/s
/// on its velocities.
fn with_noisy_base(mut instants: Vec<Instant>, seed: u64) -> Vec<Instant> {
    let mut random = SmallRng::seed_from_u64(50 + seed);
    for Instant { base, .. } in &mut instants {
        let mut noise = |std_dev: f64| {
            Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal))
        };
        base.pose.translation.vector += noise(1e-3);
        base.pose.rotation = UnitQuaternion::from_scaled_axis(noise(1e-3)) * base.pose.rotation;
        base.velocity += noise(2e-3);
        base.angular_velocity += noise(2e-3);
    }
    instants
}

/// Measured accelerations of the base, linear, angular or both, make errors and standard deviations
/// smaller, and the intervals hold the truth.
#[test]
fn accelerations_that_are_measured_help() {
    let exact = experiment().run();
    let truth = values_of_body(&payload());
    let measured = [[false, false], [true, false], [false, true], [true, true]];
    let [mut errors, mut sizes] = [[0.0; 4]; 2];
    let (mut held, mut all) = (0, 0);
    for seed in 0..6 {
        let instants = with_noisy_base(noisy(&exact, seed), seed);
        for (k, are_measured) in measured.into_iter().enumerate() {
            let mut random = SmallRng::seed_from_u64(100 + seed);
            let instants = accelerated(&instants, &exact, are_measured, &mut random);
            let found = solve(&instants, with(Method::JointSensing));
            assert_eq!(found.fit.motion, MotionEstimate::WithPayload);
            let values = values_of_body(&found.estimate.body);
            for ((value, truth), std_dev) in values.iter().zip(truth).zip(found.estimate.std_devs) {
                held += u32::from((value - truth).abs() < 1.96 * std_dev);
                all += 1;
                sizes[k] += std_dev.ln();
            }
            let of_body = errors_percent(&found.estimate.body);
            errors[k] += of_body.iter().map(|error| error * error).sum::<f64>();
        }
    }
    for [without, linear, angular, both] in [errors, sizes] {
        assert!(linear.max(angular) < without, "{errors:?} {sizes:?}");
        assert!(both < linear.min(angular), "{errors:?} {sizes:?}");
    }
    assert!(held * 100 > all * 93, "{held} of {all}");
}

/// Poses and velocities that lag behind measured accelerations contradict them. Windows then follow
/// the accelerations.
#[test]
fn accelerations_are_preferred_to_velocities_that_lag() {
    let exact = experiment().run();
    for lag in [5, 20, 40] {
        let mut random = SmallRng::seed_from_u64(3);
        let mut lagging = noisy(&exact, 3);
        for (instant, slow) in lagging[lag..].iter_mut().zip(&exact) {
            instant.base.velocity = slow.base.velocity;
            instant.base.pose.translation = slow.base.pose.translation;
        }
        let instants = accelerated(&lagging[lag..], &exact[lag..], [true; 2], &mut random);
        let found = solve(&instants, with(Method::JointSensing));
        assert_eq!(found.fit.motion, MotionEstimate::Unexplained, "{lag}");
        let error_kg = found.estimate.body.mass_kg - 100.0;
        assert!(
            error_kg.abs() < 3.0 * found.estimate.std_devs[0],
            "{lag}: {error_kg}"
        );
    }
}

/// Accelerations that only some samples have keep windows.
#[test]
fn accelerations_of_some_samples_keep_windows() {
    let exact = experiment().run();
    let mut random = SmallRng::seed_from_u64(3);
    let mut instants = accelerated(&noisy(&exact, 3), &exact, [true; 2], &mut random);
    for instant in &mut instants[700..] {
        instant.base.acceleration = None;
    }
    let found = solve(&instants, with(Method::JointSensing));
    assert_eq!(found.fit.motion, MotionEstimate::Smoothed);
}

/// Returns an experiment with a payload of 80 g from the beginning.
pub(crate) fn with_light_payload(experiment: Experiment) -> Experiment {
    let body = MassProperties {
        mass_kg: 0.08,
        center_of_mass: Vector3::new(0.1, 0.0, 0.0),
        inertia: Matrix3::identity() * 0.004,
    };
    Experiment {
        swap: Some((-1.0, body)),
        ..experiment
    }
}

/// What is found about the mass agrees with the interval of the mass.
#[test]
fn a_light_payload_is_held() {
    let exact = with_light_payload(experiment()).run();
    for seed in 0..8 {
        let found = solve(&noisy(&exact, seed), with(Method::JointSensing));
        let is_empty = found
            .findings
            .iter()
            .any(|finding| matches!(finding, Finding::NothingHeld { .. }));
        let mass = found.linear.parameters[0];
        let std_dev = found.linear.covariance[(0, 0)].sqrt();
        assert_eq!(is_empty, mass.abs() < 3.0 * std_dev, "{mass} {std_dev}");
    }
}

/// The proportions of known noise weigh the channels: a joint whose effort is given as a hundred
/// times as noisy hardly counts.
#[test]
fn known_noise_weighs_channels() {
    let mut instants = noisy(&experiment().run(), 5);
    let mut effort_noise = vec![0.05; 8];
    effort_noise[3] = 5.0;
    let equations = EquationSettings {
        effort_noise,
        ..with(Method::Effort)
    };
    let before = solve(&instants, equations.clone());
    assert_eq!(before.fit.motion, MotionEstimate::WithPayload);
    let mut random = SmallRng::seed_from_u64(8);
    for instant in &mut instants {
        instant.effort[3] += 0.05 * random.sample::<f64, _>(StandardNormal);
    }
    let after = solve(&instants, equations);
    assert_eq!(after.fit.motion, MotionEstimate::WithPayload);
    let [one, other] = [before, after].map(|found| {
        (
            values_of_body(&found.estimate.body),
            found.estimate.std_devs,
        )
    });
    for k in 0..10 {
        let moved = (one.0[k] - other.0[k]).abs() / one.1[k];
        assert!(moved < 0.03, "{k}: {moved}");
    }
}

/// One channel of the load that no model explains is enough.
#[test]
fn one_unexplained_channel_is_enough() {
    let mut instants = noisy(&experiment().run(), 4);
    for instant in &mut instants {
        instant.effort[3] += 0.07 * (TAU * 5.0 * instant.time_s).sin();
    }
    let found = solve(&instants, with(COMBINED));
    assert_eq!(found.fit.motion, MotionEstimate::Unexplained);
}

/// A fault of a second, of which little shows in all residuals, is enough.
#[test]
fn a_short_fault_is_not_diluted() {
    let long = Experiment {
        duration_s: 12.0,
        step_s: 1.0 / 100.0,
        ..experiment()
    };
    let exact = long.run();
    let motion = |begin: usize| {
        let mut instants = noisy(&exact, 4);
        for instant in instants.iter_mut().skip(begin).take(120) {
            instant.effort[3] += 0.12 * (TAU * 5.0 * instant.time_s).sin();
        }
        solve(&instants, with(COMBINED)).fit.motion
    };
    assert_eq!(motion(1200), MotionEstimate::WithPayload);
    for begin in [0, 500, 1080] {
        assert_eq!(motion(begin), MotionEstimate::Unexplained, "{begin}");
    }
}

/// Velocities that are zero because nobody measures them are not taken for measurements.
#[test]
fn velocities_of_zero_beside_a_motion_are_not_measured() {
    let instants = noisy(&experiment().run(), 6);
    let mut of_joints = instants.clone();
    let mut of_base = instants.clone();
    let mut of_rotation = instants;
    for k in 0..of_joints.len() {
        of_joints[k].velocity.fill(0.0);
        of_base[k].base.velocity = Vector3::zeros();
        of_rotation[k].base.angular_velocity = Vector3::zeros();
    }
    for instants in [of_joints, of_base, of_rotation] {
        let found = solve(&instants, with(COMBINED));
        assert_eq!(found.fit.motion, MotionEstimate::NoVelocities);
    }
}

/// Velocities of a joint that is locked are zero, and noise of its positions that is not white does
/// not show that they are not measured.
#[test]
fn velocities_of_zero_of_a_locked_joint_are_measured() {
    const KEPT: f64 = 0.98;
    for seed in 0..3 {
        let mut instants = noisy(&experiment().run(), 6);
        let mut random = SmallRng::seed_from_u64(seed);
        let mut noise = [0.0; 2];
        for instant in &mut instants {
            for (finger, noise) in noise.iter_mut().enumerate() {
                let drawn: f64 = random.sample(StandardNormal);
                *noise = KEPT * *noise + 4e-5 * drawn;
                instant.position[6 + finger] = *noise;
                instant.velocity[6 + finger] = 0.0;
            }
        }
        let found = solve(&instants, with(COMBINED));
        assert_eq!(found.fit.motion, MotionEstimate::WithPayload, "{seed}");
        assert_holds_truth(&found.estimate, seed);
    }
}

/// Uncertain gains, and reasons that samples do not show, keep windows.
#[test]
fn settings_keep_windows() {
    let instants = noisy(&experiment().run(), 6);
    let equations = EquationSettings {
        effort_gain_std_dev: vec![0.05],
        ..with(Method::Effort)
    };
    let found = solve(&instants, equations);
    assert_eq!(found.fit.motion, MotionEstimate::Smoothed);
    for reason in [MotionEstimate::GivenCutoff, MotionEstimate::NoVelocities] {
        let settings = BatchSettings {
            smoothed: Some(reason),
            ..BatchSettings::default()
        };
        let found = solve_with(&instants, with(COMBINED), settings);
        assert_eq!(found.fit.motion, reason);
    }
}

/// Of a long recording, the first 6000 bins are used where they are more precise than all windows.
/// Residuals are those of all windows.
#[test]
fn a_long_recording_uses_its_first_bins() {
    let long = Experiment {
        duration_s: 130.0,
        step_s: 1.0 / 50.0,
        ..experiment()
    };
    let equations = EquationSettings {
        cutoff_hz: 2.0,
        ..with(COMBINED)
    };
    let mut instants = noisy(&long.run(), 6);
    let found = solve(&instants, equations.clone());
    assert_eq!(found.fit.motion, MotionEstimate::WithPayload);
    assert!(found.fit.times_s.last().unwrap() - found.fit.times_s[0] > 125.0);
    let until_s = found.fit.motion_until_s.unwrap();
    assert!((until_s - instants[5999].time_s).abs() < 1e-9, "{until_s}");
    let settings = BatchSettings {
        smoothed: Some(MotionEstimate::Smoothed),
        ..BatchSettings::default()
    };
    let windows = solve_with(&instants, equations.clone(), settings);
    let std_devs = [&found, &windows].map(|of| of.estimate.std_devs);
    let ratios = std_devs[0].iter().zip(std_devs[1]).map(|(a, b)| a / b);
    assert!(ratios.product::<f64>() < 1.0, "{std_devs:?}");
    // Friction that begins later is in no bin, but in the residuals.
    for instant in &mut instants[6100..] {
        instant.effort[3] += 2.0 * instant.velocity[3].signum();
    }
    let later = solve(&instants, equations);
    let rms = later.fit.residual_rms.iter().zip(&found.fit.residual_rms);
    let ratios: Vec<f64> = rms.map(|(later, found)| later / found).collect();
    assert!(ratios.iter().any(|ratio| *ratio > 2.0), "{ratios:?}");
}

/// Few samples do not determine splines. Otherwise splines are used, also with a gap, and with
/// angles that start again after a turn.
#[test]
fn splines_need_some_samples() {
    let motion = |step_s: f64, duration_s: f64, cutoff_hz: f64| {
        let rare = Experiment {
            duration_s,
            step_s,
            ..experiment()
        };
        let equations = EquationSettings {
            cutoff_hz,
            ..with(COMBINED)
        };
        let found = solve(&noisy(&rare.run(), 6), equations);
        found.fit.motion
    };
    assert_eq!(motion(1.0 / 22.0, 3.0, 2.0), MotionEstimate::TooFew);
    assert_eq!(motion(1.0 / 50.0, 3.0, 2.0), MotionEstimate::WithPayload);
    let mut apart = noisy(&experiment().run(), 6);
    let mut pieces = apart.clone();
    pieces.retain(|instant| instant.time_s.rem_euclid(0.42) < 0.3);
    let found = solve(&pieces, with(COMBINED));
    assert_eq!(found.fit.motion, MotionEstimate::TooFew);
    apart.retain(|instant| !(0.6..0.75).contains(&instant.time_s));
    for instant in &mut apart {
        let angle = &mut instant.position[0];
        *angle = (*angle + 3.0).rem_euclid(TAU) - 3.0;
    }
    let found = solve(&apart, with(COMBINED));
    assert_eq!(found.fit.motion, MotionEstimate::WithPayload);
}
