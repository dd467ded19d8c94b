//! Repeats one update of an estimator, or of the online identifier on the project's robot, or the
//! fit of a recording, for `bench/instructions.py` to count its instructions.
//!
//! `updates NAME COUNT` makes COUNT updates or fits; `updates` prints the names.

#![allow(clippy::unwrap_used, clippy::panic)]
#![expect(clippy::print_stdout, reason = "an example prints")]

#[path = "../../identify/tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::{Experiment, Instant, Noise, SENSORS, TOOL, identifier};
use nalgebra::SVector;
use rand::{SeedableRng, rngs::SmallRng};
use tactid_batch::{BatchIdentifier, BatchSettings};
use tactid_identify::EquationSettings;
use tactid_nlms::{Estimator, Nlms, Rls};

const NAMES: [&str; 6] = [
    "nlms_row",
    "rls_row",
    "rls_block",
    "online_update",
    "batch_sample",
    "batch_fit",
];

/// Rows that enter together in blocks: those of one window of a wrench.
const BLOCK: usize = 6;

/// Number of samples before the updates that are counted, in which the noise is estimated several
/// times.
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
        "rls_block" => update_by_blocks(Rls::starting_at(SVector::zeros()), count),
        "online_update" => update_online(count),
        "batch_sample" => drop(recorded(FIRST_SAMPLES + count)),
        "batch_fit" => fit(&recorded(FIRST_SAMPLES), count),
        _ => panic!("no update {name}"),
    }
}

/// Updates an estimator by some rows of ten entries, and asks for its parameters at the end.
fn update_by_rows(mut estimator: impl Estimator<10>, count: usize) {
    let rows: [_; 7] = std::array::from_fn(row);
    for row in rows.iter().cycle().take(count) {
        estimator.update(black_box(row), 1.0);
    }
    black_box(estimator.parameters());
}

/// Updates recursive least squares by blocks of rows, and asks for its parameters at the end.
fn update_by_blocks(mut rls: Rls<10>, count: usize) {
    let block: [_; BLOCK] = std::array::from_fn(|k| (row(k), 1.0));
    for _ in 0..count {
        rls.update_all(&mut black_box(block));
    }
    black_box(rls.parameters());
}

fn row(number: usize) -> SVector<f64, 10> {
    SVector::from_fn(|entry, _| ((10 * number + entry) as f64).sin())
}

/// Updates the identifier by noisy samples of wrenches, and asks for the estimate after each.
fn update_online(count: usize) {
    let experiment = experiment();
    let mut identifier = identifier(&experiment, &EquationSettings::default());
    for instant in &noisy(&experiment)[..FIRST_SAMPLES + count] {
        black_box(identifier.push(&instant.sample()).unwrap());
        black_box(identifier.estimate());
    }
}

/// Records some noisy samples of wrenches.
fn recorded(count: usize) -> BatchIdentifier {
    let experiment = experiment();
    let (equations, settings) = (EquationSettings::default(), BatchSettings::default());
    let robot = experiment.robot();
    let mut batch = BatchIdentifier::new(&robot, TOOL, &SENSORS, equations, settings).unwrap();
    for instant in &noisy(&experiment)[..count] {
        black_box(batch.push(&instant.sample()).unwrap());
    }
    batch
}

/// Fits a recording some times.
fn fit(recording: &BatchIdentifier, count: usize) {
    for _ in 0..count {
        black_box(recording.solve().unwrap());
    }
}

fn experiment() -> Experiment {
    Experiment {
        duration_s: DURATION_S,
        ..Experiment::default()
    }
}

fn noisy(experiment: &Experiment) -> Vec<Instant> {
    let mut random = SmallRng::seed_from_u64(0);
    let noise = Noise::fraction(0.01);
    let exact = experiment.run();
    exact.iter().map(|i| noise.on(i, &mut random)).collect()
}
