//! How long one sample takes, from measurements to the estimate with its uncertainty.

#![allow(clippy::unwrap_used)]
#![expect(clippy::print_stdout, reason = "a table is what it is for")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;

use common::{Experiment, Noise, identifier};
use rand::{SeedableRng, rngs::SmallRng};
use tactid_identify::{Settings, Way};

fn main() {
    let experiment = Experiment {
        duration_s: 20.0,
        ..Experiment::default()
    };
    let mut random = SmallRng::seed_from_u64(0);
    let noise = Noise::part(0.01);
    let exact = experiment.run();
    let instants: Vec<_> = exact.iter().map(|i| noise.on(i, &mut random)).collect();
    println!("one update at 1 kHz of a 6-joint arm, sample to estimate with uncertainty, µs");
    println!(
        "{:<16}{:>8}{:>22}{:>22}",
        "way", "mean", "median, most samples", "median, window's end"
    );
    for (name, way) in [
        ("tactile", Way::Tactile),
        ("joint-sensing", Way::JointSensing),
        ("combined", Way::Combined { effort: false }),
    ] {
        let settings = Settings {
            way,
            ..Settings::default()
        };
        let mut identifier = identifier(&experiment, settings);
        let (mut between, mut ends) = (Vec::new(), Vec::new());
        for instant in &instants {
            let windows = identifier.estimate().intervals;
            let sample = instant.sample();
            let start = Instant::now();
            black_box(identifier.push(black_box(&sample)).unwrap());
            let estimate = black_box(identifier.estimate());
            let passed_us = start.elapsed().as_secs_f64() * 1e6;
            if estimate.intervals > windows {
                ends.push(passed_us);
            } else {
                between.push(passed_us);
            }
        }
        let all = between.iter().chain(&ends).sum::<f64>() / instants.len() as f64;
        println!(
            "{name:<16}{all:8.2}{:22.2}{:22.2}",
            median(&mut between),
            median(&mut ends)
        );
    }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
