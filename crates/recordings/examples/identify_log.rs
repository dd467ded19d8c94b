//! Identifies the payload of a recording: `cargo run --release -p tactid-recordings --example identify_log --
//! run.mcap`.

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use tactid_recordings::{Request, VALUE_NAMES, identify_log};

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
            let estimate = &result.estimate;
            let std_devs = estimate.std_devs.unwrap_or([f64::NAN; 10]);
            println!("Payload in the frame {}, SI units:", estimate.frame);
            for (k, name) in VALUE_NAMES.iter().enumerate() {
                println!(
                    "{name:>6} {:12.6} ± {:.6}",
                    estimate.values()[k],
                    std_devs[k]
                );
            }
            for finding in &result.findings {
                println!("{finding}");
            }
            println!("{:#?}", result.faults);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
