//! What it costs to hold the attitude for payloads that differ from the expected one.

use std::time::Instant;

use tactid_dynamics::{InertialParameters, MassProperties};
use tactid_excitation::{BaseBounds, DesignSettings, Problem, design, margins};

use crate::Result;
use crate::arms::{grip, spacecraft};

/// Bound on the attitude, degrees, and errors of mass and centre of mass, as fractions.
const BOUND_DEG: f64 = 0.1;
const ERROR: f64 = 0.1;

/// Prints a row for a design for the expected payload alone, and for one for all corners.
pub(crate) fn measure(built_in: &str) -> Result<()> {
    println!(
        "\n{:28} {:>9} {:>12} {:>12} {:>9}",
        "spacecraft, grip, 0.1 deg", "interval", "expected deg", "corners deg", "seconds"
    );
    let mut problem = spacecraft(built_in)?;
    problem.grip = Some(grip());
    problem.base = BaseBounds {
        attitude_rad: Some(BOUND_DEG.to_radians()),
        position_m: None,
    };
    let mut all = problem.clone();
    all.payloads.extend(corners(&problem)?);
    for (name, own) in [
        ("for the expected payload", &problem),
        ("for all corners", &all),
    ] {
        let began = Instant::now();
        let found = design(own, &DesignSettings::default())?;
        let seconds = began.elapsed().as_secs_f64();
        let mut worst = 0.0f64;
        for payload in &all.payloads {
            let mut other = problem.clone();
            other.payloads = vec![*payload];
            let (_, excursion) = margins(&other, &found.trajectory)?;
            worst = worst.max(excursion.attitude_rad.to_degrees());
        }
        println!(
            "{name:28} {:9.4} {:12.4} {worst:12.4} {seconds:9.2}",
            found.prediction.largest().1,
            found.excursion().attitude_rad.to_degrees()
        );
    }
    Ok(())
}

/// Returns the payloads with mass, centre of mass and inertia changed by the errors, each up or
/// down.
fn corners(problem: &Problem) -> Result<Vec<InertialParameters>> {
    let body = problem.payloads[0].mass_properties().ok_or("no mass")?;
    let corner = |signs: usize| {
        let factor = |bit: usize| {
            if signs >> bit & 1 == 0 {
                1.0 - ERROR
            } else {
                1.0 + ERROR
            }
        };
        MassProperties {
            mass_kg: factor(0) * body.mass_kg,
            center_of_mass: body.center_of_mass * factor(1),
            inertia: body.inertia * factor(2),
        }
        .into()
    };
    Ok((0..8).map(corner).collect())
}
