//! Time to 1 % on all ten values.

use std::ops::ControlFlow;

use rand::{SeedableRng, rngs::StdRng};
use tactid_excitation::{FourierMotion, Motion, Problem, ShortestSettings, shortest};

use crate::Result;
use crate::arms::Arm;
use crate::random::{OneAtATime, largest_of};

/// Accelerations at full speed, rad/s²: a careful one, and an industrial arm's.
const ACCELERATIONS: [f64; 2] = [5.0, 20.0];

/// Random motions of each duration, of which the median counts, and the ratio of two durations.
const RANDOM: usize = 20;
const LONGER: f64 = 1.1;

/// Longest duration of the random motions, s: as long as the shortest designed motion by default.
const LONGEST_RANDOM_S: f64 = 60.0;

/// Factor by which each kind of limit is relaxed, one by one.
const RELAXED: f64 = 3.0;

/// Prints a row for each arm and acceleration, and how much each kind of limit costs.
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
            let found = designed_s(&problem);
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
    measure_relaxed(arms)
}

/// Prints the duration where a kind of limit is relaxed, a row for each arm at the largest
/// acceleration.
fn measure_relaxed(arms: &[Arm]) -> Result<()> {
    let [_, acceleration] = ACCELERATIONS;
    println!(
        "\n{:28} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}",
        "seconds to 1 %, 3 times", "nothing", "speed", "accel.", "torque", "all", "cutoff"
    );
    for arm in arms {
        let mut problem = arm.problem(0, 1.0)?;
        for limits in &mut problem.limits {
            limits.acceleration = acceleration;
        }
        let relaxed = |speed: f64, acceleration: f64, effort: f64, cutoff: f64| {
            let mut relaxed = problem.clone();
            for limits in &mut relaxed.limits {
                limits.velocity *= speed;
                limits.acceleration *= acceleration;
                limits.effort *= effort;
            }
            relaxed.sensing.equations.cutoff_hz *= cutoff;
            designed_s(&relaxed)
        };
        println!(
            "{:28} {:10.3} {:10.3} {:10.3} {:10.3} {:10.3} {:10.3}",
            format!("{}, {acceleration} rad/s2", arm.name),
            relaxed(1.0, 1.0, 1.0, 1.0),
            relaxed(RELAXED, 1.0, 1.0, 1.0),
            relaxed(1.0, RELAXED, 1.0, 1.0),
            relaxed(1.0, 1.0, RELAXED, 1.0),
            relaxed(RELAXED, RELAXED, RELAXED, 1.0),
            relaxed(1.0, 1.0, 1.0, RELAXED)
        );
    }
    Ok(())
}

/// Returns the duration of the shortest designed motion, s, or NaN where there is none.
fn designed_s(problem: &Problem) -> f64 {
    let mut observer = |_: &_| ControlFlow::Continue(());
    let found = shortest(problem, &ShortestSettings::default(), &mut observer);
    found.map_or(f64::NAN, |design| design.trajectory.duration_s())
}

/// Returns the least duration at which half of random motions reach the targets, s, or infinity
/// where it exceeds [`LONGEST_RANDOM_S`].
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
