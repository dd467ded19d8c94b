//! Runs an experiment and identifies its payload from the samples by least squares, without log and
//! filter. The errors come from the simulation itself.
//!
//! `cargo run --release -p tactid-sim --example accuracy [EXPERIMENT.toml [SEED]]`

#[path = "../tests/common/mod.rs"]
mod common;

use std::path::Path;
use std::time::Instant;

use tactid_sim::{Experiment, Simulation};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut experiment = match arguments.next() {
        Some(path) => Experiment::from_file(Path::new(&path))?,
        None => Experiment::paper(),
    };
    if let Some(seed) = arguments.next() {
        experiment.seed = seed.parse()?;
    }
    let mut simulation = Simulation::new(&experiment)?;
    let nominal = experiment.payload.mass_properties();
    let center = simulation.payload_in_tool().center_of_mass;
    eprintln!(
        "each finger presses with {:.1} N",
        simulation.grip_force_n()
    );
    eprintln!(
        "the payload is {:.1e} m from its nominal position",
        (center - nominal.center_of_mass).norm()
    );

    let mut identifier = common::Identifier::new(&simulation)?;
    let mut busy_s = 0.0;
    for _ in 0..simulation.total_steps() {
        let start = Instant::now();
        simulation.step()?;
        busy_s += start.elapsed().as_secs_f64();
        identifier.push(simulation.sample())?;
    }
    eprintln!("{:.1} us a step", 1e6 * busy_s / simulation.steps() as f64);
    eprintln!("{:#?}", simulation.checks());
    eprintln!(
        "joint torques against inverse dynamics: {:.1e} of the torque, rms",
        identifier.torque_error()
    );
    let methods = [identifier.tactile()?, identifier.joint_sensing()?];
    let [tactile, joints] = methods.map(|payload| common::errors_percent(&payload, &nominal));
    eprintln!("error, %   tactile   joints");
    for ((name, tactile), (_, joints)) in tactile.iter().zip(&joints) {
        eprintln!("{name:4}     {tactile:9.5} {joints:9.5}");
    }
    Ok(())
}
