//! Time of one update, from the measurements of a sample to the estimate with its uncertainty.
//!
//! The same samples are presented several times, each time to a new identifier. The time of a sample is the shortest of
//! them, so that interruptions by other processes do not count. The name of a method as argument selects it alone.

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

/// Number of samples of the first 1.1 s, at three of which the noise is estimated from all windows so far.
const FIRST_SAMPLES: usize = 1100;

fn main() {
    let experiment = Experiment {
        duration_s: 10.0,
        ..Experiment::default()
    };
    let mut random = SmallRng::seed_from_u64(0);
    let noise = Noise::fraction(0.01);
    let exact = experiment.run();
    let instants: Vec<_> = exact.iter().map(|i| noise.on(i, &mut random)).collect();
    let mut methods = vec![
        ("tactile", Method::Tactile),
        ("joint-sensing", Method::JointSensing),
        ("combined", Method::Combined { effort: false }),
    ];
    let selected: Vec<String> = std::env::args().skip(1).collect();
    if selected.iter().any(|name| !name.starts_with('-')) {
        methods.retain(|(method, _)| selected.iter().any(|name| name == method));
    }
    let mut times_us = vec![vec![f64::INFINITY; instants.len()]; methods.len()];
    for _ in 0..ROUNDS {
        for ((_, method), times_us) in methods.iter().zip(&mut times_us) {
            let settings = EquationSettings {
                method: *method,
                ..EquationSettings::default()
            };
            let mut identifier = identifier(&experiment, &settings);
            for (instant, shortest_us) in instants.iter().zip(times_us) {
                let sample = instant.sample();
                let start = Instant::now();
                black_box(identifier.push(black_box(&sample)).unwrap());
                black_box(identifier.estimate());
                *shortest_us = shortest_us.min(start.elapsed().as_secs_f64() * 1e6);
            }
        }
    }
    println!("one update at 1 kHz of a 6-joint arm, sample to estimate with uncertainty, µs");
    println!(
        "{:<16}{:>8}{:>10}{:>10}{:>10}{:>26}",
        "method", "mean", "median", "worst", "of mean", "worst of the first 1.1 s"
    );
    for ((name, _), times_us) in methods.iter().zip(&mut times_us) {
        let (first, later) = times_us.split_at_mut(FIRST_SAMPLES);
        first.sort_by(f64::total_cmp);
        later.sort_by(f64::total_cmp);
        let mean = later.iter().sum::<f64>() / later.len() as f64;
        let worst = later[later.len() - 1];
        println!(
            "{name:<16}{mean:8.2}{:10.2}{worst:10.2}{:10.1}{:26.1}",
            later[later.len() / 2],
            worst / mean,
            first[first.len() - 1]
        );
    }
}
