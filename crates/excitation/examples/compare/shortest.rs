//! Time to 1 % on all ten values.

use std::ops::ControlFlow;

use rand::{SeedableRng, rngs::StdRng};
use tactid_excitation::{FourierMotion, Motion, Problem, ShortestSettings, shortest};

use crate::Result;
use crate::arms::Arm;
use crate::random::{OneAtATime, largest_of};

/// Accelerations at full speed, rad/s²: a careful one, and that of industrial arms.
const ACCELERATIONS: [f64; 2] = [5.0, 20.0];

/// Random motions of each duration, of which the median counts, and the ratio of two durations.
const RANDOM: usize = 20;
const LONGER: f64 = 1.1;

/// Longest duration of the random motions, s: that of the shortest designed motion by default.
const LONGEST_RANDOM_S: f64 = 60.0;

/// Prints a row for each arm and acceleration.
pub(crate) fn measure(arms: &[Arm]) -> Result<()> {
    println!(
        "\n{:28} {:>10} {:>10} {:>10}",
        "seconds to 1 % on all ten", "design", "random", "one joint"
    );
    for arm in arms {
        for acceleration in ACCELERATIONS {
            let mut problem = arm.problem(0, 1.0)?;
            for limits in &mut problem.limits {
                limits.acceleration = acceleration;
            }
            let mut observer = |_: &_| ControlFlow::Continue(());
            let found = shortest(&problem, &ShortestSettings::default(), &mut observer);
            let found = found.map_or(f64::NAN, |design| design.trajectory.duration_s());
            // Motions of one joint are repeated: variances fall with their number.
            let single = largest_of(&problem, &OneAtATime::new(&problem)?);
            println!(
                "{:28} {found:10.3} {:10.3} {:10.1}",
                format!("{}, {acceleration} rad/s2", arm.name),
                random_s(&problem)?,
                problem.duration_s * single * single
            );
        }
    }
    Ok(())
}

/// Returns the least duration at which half of random motions reach the targets, s, or infinity where it exceeds
/// [`LONGEST_RANDOM_S`].
fn random_s(problem: &Problem) -> Result<f64> {
    let mut problem = problem.clone();
    problem.duration_s = 0.3;
    while problem.duration_s <= LONGEST_RANDOM_S {
        let mut random = StdRng::seed_from_u64(1);
        let mut reached = 0;
        for _ in 0..RANDOM {
            let motion = FourierMotion::within_limits(&mut random, &problem);
            reached += usize::from(motion.is_ok_and(|motion| largest_of(&problem, &motion) <= 1.0));
        }
        if 2 * reached >= RANDOM {
            return Ok(problem.duration_s);
        }
        problem.duration_s *= LONGER;
    }
    Ok(f64::INFINITY)
}
