//! Time of one update, from the measurements of a sample to the estimate with its uncertainty.

#![allow(clippy::unwrap_used)]
#![expect(clippy::print_stdout, reason = "the benchmark prints a table")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;

use common::{Experiment, Noise, identifier};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_identify::{EquationSettings, Method};

/// Most samples from the end of a window to the end of the next.
const PLACES: usize = 32;

fn main() {
    let experiment = Experiment {
        duration_s: 20.0,
        ..Experiment::default()
    };
    let mut random = SmallRng::seed_from_u64(0);
    let noise = Noise::fraction(0.01);
    let exact = experiment.run();
    let instants: Vec<_> = exact.iter().map(|i| noise.on(i, &mut random)).collect();
    println!("one update at 1 kHz of a 6-joint arm, sample to estimate with uncertainty, µs");
    println!(
        "{:<16}{:>8}{:>22}{:>22}{:>22}",
        "method", "mean", "median, most samples", "median, window's end", "slowest of its stages"
    );
    for (name, method) in [
        ("tactile", Method::Tactile),
        ("joint-sensing", Method::JointSensing),
        ("combined", Method::Combined { effort: false }),
    ] {
        let settings = EquationSettings {
            method,
            ..EquationSettings::default()
        };
        let mut identifier = identifier(&experiment, &settings);
        // Times by the number of samples since the end of a window.
        let mut times_us = vec![Vec::new(); PLACES];
        let (mut all_us, mut windows, mut place) = (0.0, 0, 0);
        for instant in &instants {
            let sample = instant.sample();
            let start = Instant::now();
            black_box(identifier.push(black_box(&sample)).unwrap());
            let estimate = black_box(identifier.estimate());
            let passed_us = start.elapsed().as_secs_f64() * 1e6;
            all_us += passed_us;
            place = if estimate.windows > windows {
                0
            } else {
                place + 1
            };
            windows = estimate.windows;
            times_us[place.min(PLACES - 1)].push(passed_us);
        }
        let medians: Vec<f64> = times_us.iter_mut().map(|times| median(times)).collect();
        println!(
            "{name:<16}{:8.2}{:22.2}{:22.2}{:22.2}",
            all_us / instants.len() as f64,
            median(&mut medians.clone()),
            medians[0],
            medians[1..].iter().fold(0.0, |a, &b| f64::max(a, b))
        );
    }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
