//! How long one sample takes, from measurements to estimate with uncertainty.

#![allow(clippy::unwrap_used)]
#![expect(clippy::print_stdout, reason = "a table is what it is for")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;

use common::{Experiment, identifier};
use tactid_identify::{Settings, Way};

fn main() {
    let experiment = Experiment {
        duration_s: 10.0,
        ..Experiment::default()
    };
    let instants = experiment.run();
    println!("one update of a 6-joint arm, sample to estimate with uncertainty, µs");
    println!(
        "{:<24}{:>8}{:>8}{:>8}{:>8}",
        "way", "mean", "median", "99 %", "99.9 %"
    );
    for (name, way) in [
        ("tactile", Way::Tactile),
        ("joint-sensing", Way::JointSensing),
        ("combined", Way::Combined { effort: false }),
    ] {
        let settings = Settings {
            way,
            ..Settings::least_squares()
        };
        let mut identifier = identifier(&experiment, settings);
        let mut times_us: Vec<f64> = instants
            .iter()
            .map(|instant| {
                let sample = instant.sample();
                let start = Instant::now();
                black_box(identifier.push(black_box(&sample)).unwrap());
                black_box(identifier.estimate());
                start.elapsed().as_secs_f64() * 1e6
            })
            .collect();
        let mean = times_us.iter().sum::<f64>() / times_us.len() as f64;
        times_us.sort_by(f64::total_cmp);
        let at = |part: f64| times_us[(part * (times_us.len() - 1) as f64) as usize];
        println!(
            "{name:<24}{mean:8.2}{:8.2}{:8.2}{:8.2}",
            at(0.5),
            at(0.99),
            at(0.999)
        );
    }
}
