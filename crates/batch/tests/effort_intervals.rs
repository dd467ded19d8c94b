//! Intervals of the effort method: noise of the motion enters through the torques of the arm
//! itself, by amounts that depend on the posture, and errors of the efforts' gains at all times
//! alike. The 95 % intervals hold the truth nevertheless.

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{BatchIdentifier, BatchResult, BatchSettings};
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, Workspace, forces, motion,
};
use tactid_identify::{BaseState, EquationSettings, Method, Sample, VALUE_NAMES};

use crate::arm::{self, JOINTS, Run, TOOL, arm, body};

const RATE_HZ: f64 = 100.0;
/// Standard deviation of the noise relative to the root mean square of each channel.
const NOISE: f64 = 0.01;
/// Positions, velocities and efforts of the joints.
const CHANNELS: usize = 3 * JOINTS;

/// Returns positions, velocities and efforts of the joints of a fixed arm that carries a payload of
/// 8 kg, without noise.
fn measured(run: &Run) -> Vec<[f64; CHANNELS]> {
    let robot = arm(BaseKind::Fixed);
    let tool = robot.frame(TOOL).unwrap();
    let payload = InertialParameters::from(run.payloads[0].1);
    let mut workspace = Workspace::new(&robot.with_payload(tool, &payload));
    let base = FrameMotion::at_rest(Isometry3::identity());
    let of_instant = |instant: &arm::Instant| {
        let [position, velocity, acceleration] = &instant.joints;
        let joints = JointMotion {
            position,
            velocity,
            acceleration,
        };
        motion(&mut workspace, &base, joints).unwrap();
        forces(&mut workspace, &Vector3::new(0.0, 0.0, -9.81));
        let mut row = [0.0; CHANNELS];
        row[..JOINTS].copy_from_slice(position);
        row[JOINTS..2 * JOINTS].copy_from_slice(velocity);
        row[2 * JOINTS..].copy_from_slice(workspace.joint_torques().unwrap());
        row
    };
    run.instants().iter().map(of_instant).collect()
}

/// Returns the ten values of the run's payload.
fn truth(run: &Run) -> [f64; 10] {
    let payload = run.payloads[0].1;
    let (a, i) = (payload.center_of_mass, payload.inertia);
    let mut truth = [payload.mass_kg, a.x, a.y, a.z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    truth[4..].copy_from_slice(&[i.m11, i.m12, i.m13, i.m22, i.m23, i.m33]);
    truth
}

/// Returns a run of 25 windows with a payload of 8 kg.
fn run() -> Run {
    Run {
        base: BaseKind::Fixed,
        rate_hz: RATE_HZ,
        payloads: vec![(0.0, body(8.0, [0.06, -0.04, 0.15], [0.5, 0.4, 0.6]))],
        duration_s: 6.0,
        gap_s: None,
        motion_seed: 3,
    }
}

/// Identifies the payload with noise and errors of the gains that a seed draws. The gains have the
/// standard deviation that is claimed.
fn identified(
    rows: &[[f64; CHANNELS]],
    cutoff_hz: f64,
    gain_std_dev: f64,
    seed: u64,
) -> BatchResult {
    let size = |channel: usize| {
        let squares: f64 = rows.iter().map(|row| row[channel].powi(2)).sum();
        NOISE * (squares / rows.len() as f64).sqrt()
    };
    let std_devs: [f64; CHANNELS] = std::array::from_fn(size);
    let settings = EquationSettings {
        method: Method::Effort,
        cutoff_hz,
        effort_gain_std_dev: vec![gain_std_dev],
        ..EquationSettings::default()
    };
    let mut random = SmallRng::seed_from_u64(seed);
    let mut of_gains = SmallRng::seed_from_u64(seed + 1000);
    let gains: [f64; JOINTS] = std::array::from_fn(|_| {
        let normal: f64 = of_gains.sample(StandardNormal);
        1.0 + gain_std_dev * normal
    });
    let robot = arm(BaseKind::Fixed);
    let knowledge = BatchSettings::default();
    let mut identifier = BatchIdentifier::new(&robot, TOOL, &[], settings, knowledge).unwrap();
    for (k, row) in rows.iter().enumerate() {
        let mut noisy: [f64; CHANNELS] = std::array::from_fn(|channel| {
            let normal: f64 = random.sample(StandardNormal);
            row[channel] + std_devs[channel] * normal
        });
        for (effort, gain) in noisy[2 * JOINTS..].iter_mut().zip(&gains) {
            *effort *= gain;
        }
        let sample = Sample {
            time_s: k as f64 / RATE_HZ,
            base: BaseState::fixed(),
            joint_position: &noisy[..JOINTS],
            joint_velocity: &noisy[JOINTS..2 * JOINTS],
            joint_effort: &noisy[2 * JOINTS..],
            wrenches: &[],
        };
        identifier.push(&sample).unwrap();
    }
    identifier.solve().unwrap()
}

/// Returns the ten errors of a result, each in its reported standard deviations.
fn errors(result: &BatchResult, truth: &[f64; 10]) -> [f64; 10] {
    let estimate = &result.estimate;
    let (values, std_devs) = (estimate.values(), estimate.std_devs);
    std::array::from_fn(|k| (values[k] - truth[k]) / std_devs[k])
}

/// Fraction of the intervals of each value that hold the truth, and mean errors in standard
/// deviations, over some runs.
fn coverage(cutoff_hz: f64, runs: u64) -> ([f64; 10], [f64; 10]) {
    let run = run();
    let (rows, truth) = (measured(&run), truth(&run));
    let (mut inside, mut sums) = ([0.0; 10], [0.0; 10]);
    for seed in 0..runs {
        let errors = errors(&identified(&rows, cutoff_hz, 0.0, seed), &truth);
        for (k, error) in errors.into_iter().enumerate() {
            inside[k] += f64::from(u8::from(error.abs() <= 1.96)) / runs as f64;
            sums[k] += error / runs as f64;
        }
    }
    (inside, sums)
}

/// 25 windows with 1 % noise on positions, velocities and efforts, at the cutoff that a recording
/// of this noise chooses: of 400 intervals of each value between 91.5 and 98.5 % hold the truth (95
/// % scatter by 1.1 %), on average 94 to 96.5 %, and the mean error is below a fifth of a standard
/// deviation. Where the noise counts as the same in all windows and positions are smoothed without
/// the velocities, 88 % hold the mass and 91 % the values on average, and the mean error of the
/// mass is 0.27.
#[test]
fn intervals_of_efforts_hold_the_truth() {
    let (inside, mean_errors) = coverage(1.45, 400);
    for (k, name) in VALUE_NAMES.iter().enumerate() {
        assert!((0.915..0.985).contains(&inside[k]), "{name}: {inside:?}");
        assert!(mean_errors[k].abs() < 0.2, "{name}: {mean_errors:?}");
    }
    let mean = inside.iter().sum::<f64>() / 10.0;
    assert!((0.94..0.965).contains(&mean), "{inside:?}");
}

/// At twice the cutoff the samples are so sparse that polynomials are fitted to neighbours. If the
/// position at an instant were their mean, half-differences between instants would lack most of its
/// noise, and 85 % of the intervals of Ixy would hold the truth. A fraction of 200 runs scatters by
/// 1.6 %, the average over ten values by 0.7 %.
#[test]
fn intervals_of_sparse_efforts_hold_the_truth() {
    let (inside, _) = coverage(2.9, 200);
    assert!(inside.iter().all(|&fraction| fraction > 0.88), "{inside:?}");
    let mean = inside.iter().sum::<f64>() / 10.0;
    assert!((0.93..0.97).contains(&mean), "{inside:?}");
}

/// Of the intervals of 200 draws of gains with a standard deviation of 1 %, between 92 and 98 %
/// hold the truth on average, and at least 90 % those of each value (95 % scatter by 1.5 %). Most
/// of the variance of the mass is that of the gains: intervals of the noise alone hold it in less
/// than a quarter of the draws. Gains that are off by 5 % cause most of the residuals, from which
/// weights and noise follow, too: the intervals are then too wide, and 99 % hold the truth.
#[test]
fn intervals_with_uncertain_gains_hold_the_truth() {
    const DRAWS: u64 = 200;
    let run = run();
    let (rows, truth) = (measured(&run), truth(&run));
    for (std_dev, expected) in [(0.01, 0.92..0.98), (0.05, 0.97..1.0)] {
        let (mut inside, mut of_noise) = ([0.0; 10], 0.0);
        for seed in 0..DRAWS {
            let result = identified(&rows, 1.45, std_dev, seed);
            let errors = errors(&result, &truth);
            for (inside, error) in inside.iter_mut().zip(errors) {
                *inside += f64::from(u8::from(error.abs() <= 1.96)) / DRAWS as f64;
            }
            let half_width = 1.96 * result.fit.noise_fraction[0].sqrt();
            of_noise += f64::from(u8::from(errors[0].abs() <= half_width)) / DRAWS as f64;
        }
        let mean = inside.iter().sum::<f64>() / 10.0;
        assert!(expected.contains(&mean), "{mean}: {inside:?}");
        assert!(inside.iter().all(|inside| *inside > 0.9), "{inside:?}");
        assert!(of_noise < 0.25, "{of_noise}");
    }
}
