//! Identifies the payload of a recording: `cargo run --release -p tactid-recordings --example
//! identify_log -- run.mcap`.

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use tactid_recordings::{Identification, Request, VALUE_NAMES, identify_log};

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: identify_log <log>");
        return ExitCode::FAILURE;
    };
    let result = identify_log(&path, &Request::default(), &mut |_| {
        ControlFlow::Continue(())
    });
    match result {
        Ok(result) => {
            // The request leaves the estimator at its default.
            result.into_least_squares().as_ref().map(print);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn print(result: &Identification) {
    let estimate = &result.estimate;
    println!("Payload in the frame {}, SI units:", estimate.frame);
    let rows = VALUE_NAMES.iter().zip(estimate.values());
    for ((name, value), std_dev) in rows.zip(estimate.std_devs) {
        println!("{name:>6} {value:12.6} ± {std_dev:.6}");
    }
    for finding in &result.recording.findings {
        println!("{finding}");
    }
    println!("{:#?}", result.recording.faults);
}
