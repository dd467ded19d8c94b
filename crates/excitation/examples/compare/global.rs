//! Designs beside Fourier motions that are optimised globally.

use rand::{SeedableRng, rngs::StdRng};
use rand_distr::{Distribution, StandardNormal};
use tactid_excitation::{DesignSettings, FourierMotion, Prediction, Problem, design, predict};

use crate::Result;
use crate::arms::Arm;
use crate::cma::minimise;
use crate::random::largest_of;

/// Evaluations of each optimisation, and random motions of which the best is its start.
const EVALUATIONS: usize = 20_000;
const RANDOM: usize = 100;

/// Samples per second while a motion is optimised, Hz. At 50 Hz no motion has a prediction.
const RATE_HZ: f64 = 100.0;

/// Amplitudes of each joint: sine and cosine of five harmonics.
const AMPLITUDES: usize = 10;

/// Prints a row for each arm.
pub(crate) fn measure(arms: &[Arm]) -> Result<()> {
    println!(
        "\n{:28} {:>8} {:>9} {:>6} {:>9} {:>6}",
        "Fourier, 20 000 evaluations", "design", "condition", "ratio", "interval", "ratio"
    );
    for arm in arms {
        let problem = arm.problem(0, 1.0)?;
        let own = design(&problem, &DesignSettings::default())?
            .prediction
            .largest()
            .1;
        let condition = optimised(&problem, condition_number)?;
        let interval = optimised(&problem, |prediction| prediction.largest().1)?;
        println!(
            "{:28} {own:8.4} {condition:9.4} {:6.3} {interval:9.4} {:6.3}",
            arm.name,
            own / condition,
            own / interval
        );
    }
    Ok(())
}

/// Returns the condition number of the whitened regressor.
fn condition_number(prediction: &Prediction) -> f64 {
    let eigenvalues = prediction.covariance.symmetric_eigenvalues();
    (eigenvalues.max() / eigenvalues.min().max(f64::MIN_POSITIVE)).sqrt()
}

/// Returns the largest interval of the motion that is the best by another measure.
fn optimised(problem: &Problem, measure: impl Fn(&Prediction) -> f64) -> Result<f64> {
    let mut coarse = problem.clone();
    coarse.sensing.rate_hz = RATE_HZ;
    let value = |amplitudes: &[f64]| {
        let motion = FourierMotion::with_amplitudes(&coarse, amplitudes);
        let prediction = motion.and_then(|motion| predict(&coarse, &motion));
        prediction.map_or(f64::INFINITY, |prediction| measure(&prediction).ln())
    };
    let mut random = StdRng::seed_from_u64(1);
    let count = AMPLITUDES * problem.moving_joints()?.len();
    let mut start = (f64::INFINITY, Vec::new());
    for _ in 0..RANDOM {
        let normal = StandardNormal.sample_iter(&mut random);
        let amplitudes: Vec<f64> = normal.take(count).collect();
        let value = value(&amplitudes);
        if value < start.0 {
            start = (value, amplitudes);
        }
    }
    let best = minimise(value, &start.1, 0.5, EVALUATIONS, &mut random);
    let motion = FourierMotion::with_amplitudes(problem, &best)?.scaled_into_limits(problem)?;
    Ok(largest_of(problem, &motion))
}
