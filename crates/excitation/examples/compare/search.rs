//! How much a longer search or more control points improve a design.

use std::time::Instant;

use tactid_excitation::{DesignSettings, design};

use crate::Result;
use crate::arms::Arm;

/// Starts, iterations and control points that are tried; `None` for the default number.
const SETTINGS: [(usize, usize, Option<usize>); 6] = [
    (6, 50, None),
    (6, 200, None),
    (24, 50, None),
    (6, 50, Some(17)),
    (6, 50, Some(23)),
    (6, 50, Some(36)),
];

/// Prints for each arm the largest interval and the time of each design.
pub(crate) fn measure(arms: &[Arm]) -> Result<()> {
    println!("\nlargest interval (seconds) by starts, iterations and control points");
    for arm in arms {
        let problem = arm.problem(1, 1.0)?;
        for (starts, iterations, control_points) in SETTINGS {
            let began = Instant::now();
            let settings = DesignSettings {
                starts,
                iterations,
                control_points,
                ..DesignSettings::default()
            };
            let largest = design(&problem, &settings)?.prediction.largest().1;
            let seconds = began.elapsed().as_secs_f64();
            let points = control_points.map_or("default".to_owned(), |count| count.to_string());
            println!(
                "{:12} {starts:3} {iterations:4} {points:>8} {largest:8.4} ({seconds:.2})",
                arm.name
            );
        }
    }
    Ok(())
}
