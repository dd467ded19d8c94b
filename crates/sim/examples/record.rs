//! Runs an experiment and writes its log.
//!
//! `cargo run --release -p tactid-sim --example record LOG.mcap [EXPERIMENT.toml]`

use std::ops::ControlFlow;
use std::path::Path;

use tactid_sim::{Experiment, run};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let log = arguments.next().ok_or("the path of the log is missing")?;
    let experiment = match arguments.next() {
        Some(path) => Experiment::from_file(Path::new(&path))?,
        None => Experiment::paper(),
    };
    let report = run(&experiment, Path::new(&log), |_| ControlFlow::Continue(()))?;
    eprintln!("{report:#?}");
    Ok(())
}
