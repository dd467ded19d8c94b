//! Identifies the payload of a recording: `cargo run --release --example identify_log -- run.mcap`.

#![allow(clippy::print_stdout, reason = "an example shows what it found")]

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use tactid_identify::{Request, VALUE_NAMES, identify_log};

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: identify_log <log>");
        return ExitCode::FAILURE;
    };
    match identify_log(&path, &Request::default(), &mut |_| {
        ControlFlow::Continue(())
    }) {
        Ok(found) => {
            println!("{VALUE_NAMES:?}");
            println!("{:#?}", found.estimate);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
