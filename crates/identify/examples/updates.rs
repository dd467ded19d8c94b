//! Repeats one update of an estimator, or of the online identifier on the project's robot, for `bench/instructions.py` to count
//! its instructions.
//!
//! `updates NAME COUNT` makes COUNT updates; `updates` prints the names.

#![allow(clippy::unwrap_used)]
#![expect(clippy::print_stdout, reason = "an example prints")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::{Experiment, Noise, identifier};
use nalgebra::SVector;
use rand::{SeedableRng, rngs::SmallRng};
use tactid_identify::EquationSettings;
use tactid_nlms::{Estimator, Nlms, Rls};

const NAMES: [&str; 3] = ["nlms_row", "rls_row", "online_update"];

/// Number of samples before the updates that are counted, in which the noise is estimated several times.
const FIRST_SAMPLES: usize = 1100;

/// Duration of the experiment, s, at 1 kHz.
const DURATION_S: f64 = 2.4;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let (Some(name), Some(count)) = (arguments.next(), arguments.next()) else {
        return println!("{}", NAMES.join("\n"));
    };
    let count = count.parse().unwrap();
    match name.as_str() {
        "nlms_row" => update_by_rows(Nlms::paper().starting_at(SVector::zeros()), count),
        "rls_row" => update_by_rows(Rls::starting_at(SVector::zeros()), count),
        "online_update" => update_online(count),
        _ => println!("no update {name}"),
    }
}

/// Updates an estimator by some rows of ten entries, and asks for its parameters at the end.
fn update_by_rows(mut estimator: impl Estimator<10>, count: usize) {
    let rows: [SVector<f64, 10>; 7] =
        std::array::from_fn(|k| SVector::from_fn(|entry, _| ((10 * k + entry) as f64).sin()));
    for row in rows.iter().cycle().take(count) {
        estimator.update(black_box(row), 1.0);
    }
    black_box(estimator.parameters());
}

/// Updates the identifier by noisy samples of wrenches, and asks for the estimate after each.
fn update_online(count: usize) {
    let experiment = Experiment {
        duration_s: DURATION_S,
        ..Experiment::default()
    };
    let mut random = SmallRng::seed_from_u64(0);
    let noise = Noise::fraction(0.01);
    let exact = experiment.run();
    let samples: Vec<_> = exact.iter().map(|i| noise.on(i, &mut random)).collect();
    let mut identifier = identifier(&experiment, &EquationSettings::default());
    for instant in &samples[..FIRST_SAMPLES + count] {
        black_box(identifier.push(&instant.sample()).unwrap());
        black_box(identifier.estimate());
    }
}
