//! Designs beside the best of random Fourier motions, and beside single-joint motions.

use std::time::Instant;

use rand::{SeedableRng, rngs::StdRng};
use tactid_excitation::{
    BaseBounds, DesignSettings, FourierMotion, JointLimits, JointStates, Motion, Problem, design,
    predict,
};

use crate::Result;
use crate::arms::{Arm, grip, spacecraft};

/// Random motions that a design is compared with.
const RANDOM: usize = 100;

/// Postures of each arm.
const POSTURES: u64 = 4;

/// Prints a row for each arm, posture and speed, and median and worst ratio.
pub(crate) fn measure(built_in: &str, arms: &[Arm]) -> Result<()> {
    println!(
        "{:28} {:>8} {:>8} {:>6} {:>9} {:>9} {:>8} {:>10}",
        "largest interval over 1 %",
        "design",
        "random",
        "ratio",
        "seconds",
        "used",
        "base deg",
        "one joint"
    );
    let mut ratios = Vec::new();
    for arm in arms {
        for posture in 0..POSTURES {
            for speed in [1.0, 0.3] {
                let problem = arm.problem(posture, speed)?;
                ratios.extend(row(&format!("{} {posture} {speed}", arm.name), &problem)?);
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    if let (Some(median), Some(worst)) = (ratios.get(ratios.len() / 2), ratios.last()) {
        println!(
            "{} ratios: median {median:.3}, worst {worst:.3}",
            ratios.len()
        );
    }
    let mut problem = spacecraft(built_in)?;
    row("spacecraft", &problem)?;
    problem.grip = Some(grip());
    row("spacecraft, grip", &problem)?;
    problem.base = BaseBounds {
        attitude_rad: Some(0.1f64.to_radians()),
        position_m: None,
    };
    row("spacecraft, grip, 0.1 deg", &problem)?;
    Ok(())
}

/// Prints a row, and returns the ratio of the design's intervals and the best random motion's.
fn row(name: &str, problem: &Problem) -> Result<Option<f64>> {
    let began = Instant::now();
    let found = design(problem, &DesignSettings::default());
    let seconds = began.elapsed().as_secs_f64();
    let found = match found {
        Ok(found) => found,
        Err(error) => {
            println!("{name:28} {error}");
            return Ok(None);
        }
    };
    let best = best_random(problem)?;
    let largest = found.prediction.largest().1;
    let worst = found.margins.iter().map(|m| m.used).fold(0.0, f64::max);
    let single = largest_of(problem, &OneAtATime::new(problem)?);
    println!(
        "{name:28} {largest:8.4} {best:8.4} {:6.3} {seconds:9.2} {worst:9.6} {:8.4} {single:10.4}",
        largest / best,
        found.excursion().attitude_rad.to_degrees()
    );
    Ok(Some(largest / best))
}

/// Returns the largest interval of a motion relative to its target; infinite where it does not
/// determine all values.
pub(crate) fn largest_of(problem: &Problem, motion: &dyn Motion) -> f64 {
    predict(problem, motion).map_or(f64::INFINITY, |prediction| prediction.largest().1)
}

fn best_random(problem: &Problem) -> Result<f64> {
    let mut random = StdRng::seed_from_u64(1);
    let mut best = f64::INFINITY;
    for _ in 0..RANDOM {
        let motion = FourierMotion::within_limits(&mut random, problem)?;
        best = best.min(largest_of(problem, &motion));
    }
    Ok(best)
}

/// The paper's motion: one joint after another goes away from its start and back, as far as its
/// limits allow.
pub(crate) struct OneAtATime {
    duration_s: f64,
    posture: Vec<f64>,
    joints: Vec<usize>,
    amplitudes: Vec<f64>,
}

impl OneAtATime {
    pub(crate) fn new(problem: &Problem) -> Result<Self> {
        let joints = problem.moving_joints()?;
        let share_s = problem.duration_s / joints.len() as f64;
        let rate = std::f64::consts::TAU / share_s;
        let amplitude = |&joint: &usize| {
            let JointLimits {
                position: (low, high),
                velocity,
                acceleration,
                ..
            } = problem.limits[joint];
            let start = problem.start[joint];
            let (up, down) = (high - start, start - low);
            let sign = if up >= down { 1.0 } else { -1.0 };
            let reach = (2.0 * acceleration / (rate * rate)).min(2.0 * velocity / rate);
            sign * reach.min(up.max(down))
        };
        Ok(Self {
            duration_s: problem.duration_s,
            posture: problem.start.clone(),
            amplitudes: joints.iter().map(amplitude).collect(),
            joints,
        })
    }
}

impl Motion for OneAtATime {
    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn at(&self, time_s: f64) -> JointStates {
        let mut states = JointStates::at_rest(&self.posture);
        let share_s = self.duration_s / self.joints.len() as f64;
        let place = (time_s / share_s) as usize;
        if let Some(&joint) = self.joints.get(place) {
            let half = 0.5 * self.amplitudes[place];
            let rate = std::f64::consts::TAU / share_s;
            let (sin, cos) = (rate * (time_s - place as f64 * share_s)).sin_cos();
            states.position[joint] += half * (1.0 - cos);
            states.velocity[joint] = half * rate * sin;
            states.acceleration[joint] = half * rate * rate * cos;
        }
        states
    }
}
