//! Errors of identifications beside what was predicted, with noise on every channel.

use nalgebra::Isometry3;
use rand::{SeedableRng, rngs::StdRng};
use rand_distr::{Distribution, StandardNormal};
use tactid_batch::{BatchIdentifier, BatchSettings};
use tactid_dynamics::{FrameMotion, Workspace, motion, wrench_regressor};
use tactid_excitation::{Design, DesignSettings, Motion, Problem, design, predict};
use tactid_identify::{BaseState, Sample, VALUE_NAMES, Wrench, values_of_body};

use crate::Result;
use crate::arms::Arm;

/// Identifications of each arm.
const RUNS: usize = 200;

/// Noise of each channel, as a fraction of its root mean square about its mean along the motion.
const FRACTION: f64 = 0.01;

/// Channels of one sample: positions, velocities, and the wrench.
type Channels = Vec<f64>;

/// Prints for each arm the ratios of achieved errors to predicted ones, with noise on the wrenches,
/// and on all channels.
pub(crate) fn measure(arms: &[Arm]) -> Result<()> {
    let names = VALUE_NAMES.map(|name| format!("{name:>6.6}")).concat();
    println!("\n{:35} {names}", "achieved error over predicted");
    for arm in arms {
        let mut problem = arm.problem(0, 1.0)?;
        let found = design(&problem, &DesignSettings::default())?;
        let exact = exact(&problem, &found)?;
        let noise = one_percent(&exact);
        let dof = problem.robot.dof();
        problem.sensing.equations.wrench_noise =
            vec![std::array::from_fn(|entry| noise[2 * dof + entry])];
        let predicted = predict(&problem, &found.trajectory)?.std_devs;
        for (what, first) in [("wrench", 2 * dof), ("every channel", 0)] {
            let ratios = ratios(&problem, &exact, &noise, first, &predicted)?;
            let ratios = ratios.map(|ratio| format!("{ratio:6.2}")).concat();
            println!("{:35} {ratios}", format!("{}, 1 % on {what}", arm.name));
        }
    }
    Ok(())
}

/// Returns all channels at all samples without noise.
fn exact(problem: &Problem, design: &Design) -> Result<Vec<Channels>> {
    let tool = problem.robot.frame(&problem.tool)?;
    let mut workspace = Workspace::new(&problem.robot);
    let gravity = problem.robot.base_kind().default_gravity();
    let base = FrameMotion::at_rest(Isometry3::identity());
    let count = (problem.duration_s * problem.sensing.rate_hz) as usize;
    let mut samples = Vec::with_capacity(count + 1);
    for k in 0..=count {
        let states = design.trajectory.at(k as f64 / problem.sensing.rate_hz);
        motion(&mut workspace, &base, states.joints())?;
        let regressor = wrench_regressor(&workspace.tool_motion(tool, &gravity));
        let wrench = regressor * problem.payloads[0].as_vector();
        let channels = [states.position, states.velocity].concat();
        samples.push([channels.as_slice(), wrench.as_slice()].concat());
    }
    Ok(samples)
}

/// Returns the standard deviation of the noise of each channel.
fn one_percent(samples: &[Channels]) -> Channels {
    let count = samples.len() as f64;
    let of_channel = |channel: usize| {
        let values = samples.iter().map(|sample| sample[channel]);
        let mean = values.clone().sum::<f64>() / count;
        FRACTION * (values.map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt()
    };
    (0..samples[0].len()).map(of_channel).collect()
}

/// Returns the root mean square errors of the ten values over what was predicted, with noise on the
/// channels from an index on.
fn ratios(
    problem: &Problem,
    exact: &[Channels],
    noise: &[f64],
    first: usize,
    predicted: &[f64; 10],
) -> Result<[f64; 10]> {
    let dof = problem.robot.dof();
    let body = problem.payloads[0].mass_properties().ok_or("no mass")?;
    let truth = values_of_body(&body);
    let mut random = StdRng::seed_from_u64(3);
    let mut squares = [0.0; 10];
    for _ in 0..RUNS {
        let mut identifier = BatchIdentifier::new(
            &problem.robot,
            &problem.tool,
            &[&problem.tool],
            problem.sensing.equations.clone(),
            BatchSettings::default(),
        )?;
        for (k, sample) in exact.iter().enumerate() {
            let mut noisy = sample.clone();
            for (value, std_dev) in noisy.iter_mut().zip(noise).skip(first) {
                let normal: f64 = StandardNormal.sample(&mut random);
                *value += std_dev * normal;
            }
            let wrench = Wrench {
                force: [noisy[2 * dof], noisy[2 * dof + 1], noisy[2 * dof + 2]].into(),
                moment: [noisy[2 * dof + 3], noisy[2 * dof + 4], noisy[2 * dof + 5]].into(),
            };
            identifier.push(&Sample {
                time_s: k as f64 / problem.sensing.rate_hz,
                base: BaseState::fixed(),
                joint_position: &noisy[..dof],
                joint_velocity: &noisy[dof..2 * dof],
                joint_effort: &[],
                wrenches: &[wrench],
            })?;
        }
        let estimate = identifier.solve()?.estimate;
        for (square, (value, truth)) in squares
            .iter_mut()
            .zip(estimate.values().into_iter().zip(truth))
        {
            *square += (value - truth).powi(2) / RUNS as f64;
        }
    }
    Ok(std::array::from_fn(|k| squares[k].sqrt() / predicted[k]))
}
