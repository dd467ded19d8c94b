//! Time of one update, from the measurements of a sample to the estimate with its uncertainty.
//!
//! The same samples are presented several times, each time to a new identifier. The time of a
//! sample is the shortest of them, so that interruptions by other processes do not count; the last
//! two columns count every pass, interruptions included. The name of a method as argument selects
//! it alone.

#![allow(clippy::unwrap_used)]
#![expect(clippy::print_stdout, reason = "the benchmark prints a table")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;

use common::{Experiment, Noise, identifier};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_identify::{EquationSettings, Method};

/// Number of times that the samples are presented.
const ROUNDS: usize = 15;

/// Number of samples of the first 1.1 s, at three of which the noise is estimated from all windows
/// so far.
const FIRST_SAMPLES: usize = 1100;

fn main() {
    let experiment = Experiment {
        duration_s: 10.0,
        ..Experiment::default()
    };
    let mut random = SmallRng::seed_from_u64(0);
    let noise = Noise {
        effort: 1.0,
        ..Noise::fraction(0.01)
    };
    let exact = experiment.run();
    let instants: Vec<_> = exact.iter().map(|i| noise.on(i, &mut random)).collect();
    let mut methods = vec![
        ("tactile", Method::Tactile),
        ("joint-sensing", Method::JointSensing),
        ("effort", Method::Effort),
        ("combined", Method::Combined { effort: true }),
        ("without efforts", Method::Combined { effort: false }),
    ];
    let selected: Vec<String> = std::env::args().skip(1).collect();
    if selected.iter().any(|name| !name.starts_with('-')) {
        methods.retain(|(method, _)| selected.iter().any(|name| name == method));
    }
    let measured = measure(&experiment, &instants, &methods);
    print(&methods, measured);
}

/// A name and what it stands for.
type Named = (&'static str, Method);

/// Times of the updates of one method, µs.
#[derive(Clone)]
struct Times {
    /// The shortest of each sample.
    shortest_us: Vec<f64>,
    /// All of the samples after the first 1.1 s.
    passes_us: Vec<f64>,
}

/// Presents the samples to new identifiers of each method in turn.
fn measure(experiment: &Experiment, instants: &[common::Instant], methods: &[Named]) -> Vec<Times> {
    let empty = Times {
        shortest_us: vec![f64::INFINITY; instants.len()],
        passes_us: Vec::with_capacity(ROUNDS * instants.len()),
    };
    let mut measured = vec![empty; methods.len()];
    for _ in 0..ROUNDS {
        for ((_, method), times) in methods.iter().zip(&mut measured) {
            let settings = EquationSettings {
                method: *method,
                ..EquationSettings::default()
            };
            let mut identifier = identifier(experiment, &settings);
            for (k, instant) in instants.iter().enumerate() {
                let sample = instant.sample();
                let start = Instant::now();
                black_box(identifier.push(black_box(&sample)).unwrap());
                black_box(identifier.estimate());
                let pass_us = start.elapsed().as_secs_f64() * 1e6;
                times.shortest_us[k] = times.shortest_us[k].min(pass_us);
                if k >= FIRST_SAMPLES {
                    times.passes_us.push(pass_us);
                }
            }
        }
    }
    measured
}

fn print(methods: &[Named], measured: Vec<Times>) {
    println!("one update at 1 kHz of a 6-joint arm, sample to estimate with uncertainty, µs");
    println!(
        "{:<16}{:>7}{:>8}{:>8}{:>9}{:>26}{:>8}{:>18}{:>9}",
        "method",
        "mean",
        "median",
        "worst",
        "of mean",
        "worst of the first 1.1 s",
        "longer",
        "median of passes",
        "99.9 %"
    );
    for ((name, _), mut times) in methods.iter().zip(measured) {
        let passes_us = &mut times.passes_us;
        let (first, later) = times.shortest_us.split_at_mut(FIRST_SAMPLES);
        first.sort_by(f64::total_cmp);
        later.sort_by(f64::total_cmp);
        passes_us.sort_by(f64::total_cmp);
        let mean = later.iter().sum::<f64>() / later.len() as f64;
        let worst = later[later.len() - 1];
        println!(
            "{name:<16}{mean:7.2}{:8.2}{worst:8.2}{:9.1}{:26.1}{:8}{:18.2}{:9.2}",
            later[later.len() / 2],
            worst / mean,
            first[first.len() - 1],
            first.iter().filter(|time_us| **time_us > worst).count(),
            passes_us[passes_us.len() / 2],
            passes_us[passes_us.len() * 999 / 1000]
        );
    }
}
