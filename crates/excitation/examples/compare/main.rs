//! Measures how good designed motions are, beside random, optimised and single-joint motions at
//! equal limits.
//!
//! `cargo run --release -p tactid-excitation --example compare -- BUILT_IN.urdf [ARM.urdf TIP]...`
//!
//! The first robot floats; the others, of which it may be one, stand on the ground. All intervals
//! are the largest predicted 95 % interval of a 10 s motion, relative to 1 % of the largest value
//! of its kind, with a noise of 0.5 N and 0.05 N m at 500 Hz.
//!
//! `--part NAME` measures one part only: `random`, `global`, `shortest`, `noise`, `attitude`,
//! `search` or `collisions`.

#![expect(clippy::print_stdout, reason = "an example prints its tables")]

mod arms;
mod attitude;
mod cma;
mod collisions;
mod global;
mod noise;
mod random;
mod search;
mod shortest;

use std::error::Error;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut part = None;
    if arguments.first().is_some_and(|first| first == "--part") {
        part = arguments.get(1).cloned();
        arguments.drain(..2.min(arguments.len()));
    }
    let (built_in, others) = arguments.split_first().ok_or("no URDF")?;
    let arms = arms::read(others)?;
    let is_asked = |name: &str| part.as_deref().is_none_or(|part| part == name);
    if is_asked("random") {
        random::measure(built_in, &arms)?;
    }
    if is_asked("global") {
        global::measure(&arms)?;
    }
    if is_asked("shortest") {
        shortest::measure(&arms)?;
    }
    if is_asked("noise") {
        noise::measure(&arms)?;
    }
    if is_asked("attitude") {
        attitude::measure(built_in)?;
    }
    if is_asked("search") {
        search::measure(&arms)?;
    }
    if is_asked("collisions") {
        collisions::measure(&arms)?;
    }
    Ok(())
}
