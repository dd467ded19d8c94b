//! Updates of the online identifier through the C interface: `c_updates c_update COUNT` makes COUNT
//! of them, for `bench/instructions.py` to count their instructions, `c_updates` prints that name,
//! and `c_updates times` the mean time of an update beside that of the same samples without the
//! interface.

#![allow(clippy::unwrap_used, clippy::panic)]
#![expect(clippy::print_stdout, reason = "an example prints")]

#[path = "../../identify/tests/common/mod.rs"]
mod common;

use std::ffi::{CString, c_char};
use std::hint::black_box;
use std::ptr::{null, null_mut};
use std::time::Instant as Clock;

use common::{Experiment, Instant, Noise, SENSORS, TOOL, URDF, identifier};
use rand::{SeedableRng, rngs::SmallRng};
use tactid::{
    tactid_estimate, tactid_identifier, tactid_identifier_contact_wrench,
    tactid_identifier_estimate, tactid_identifier_free, tactid_identifier_new,
    tactid_identifier_push, tactid_options, tactid_sample, tactid_wrench,
};
use tactid_identify::{EquationSettings, Identifier, WrenchFrame};

/// Number of samples before the updates that are counted, in which the noise is estimated several
/// times.
const FIRST_SAMPLES: usize = 1100;

/// Number of times that all samples are presented; the shortest time of each counts.
const ROUNDS: usize = 15;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["c_update", count] => {
            let count: usize = count.parse().unwrap();
            let mut updates = Updates::new(2.4);
            for k in 0..FIRST_SAMPLES + count {
                updates.of_c(k);
            }
        }
        ["times"] => print_times(),
        [] => println!("c_update"),
        ref others => panic!("no update {others:?}"),
    }
}

/// Prints the mean time of an update after the first 1.1 s, each in its shortest time.
fn print_times() {
    let mut updates = Updates::new(10.0);
    let mut shortest_us = vec![[f64::INFINITY; 2]; updates.instants.len()];
    for _ in 0..ROUNDS {
        updates.restart();
        for (k, of_sample) in shortest_us.iter_mut().enumerate() {
            for (shortest, update) in of_sample.iter_mut().zip([Updates::of_rust, Updates::of_c]) {
                let start = Clock::now();
                update(&mut updates, k);
                *shortest = shortest.min(start.elapsed().as_secs_f64() * 1e6);
            }
        }
    }
    let later = &shortest_us[FIRST_SAMPLES..];
    let [rust, c] =
        [0, 1].map(|which| later.iter().map(|of| of[which]).sum::<f64>() / later.len() as f64);
    println!(
        "one update at 1 kHz, sample to estimate with covariance and contact wrench: Rust {rust:.2} µs, C {c:.2} µs, ratio {:.3}",
        c / rust
    );
}

/// The same samples for an identifier and for one behind the C interface.
struct Updates {
    experiment: Experiment,
    instants: Vec<Instant>,
    samples: Vec<(Vec<f64>, Vec<f64>)>,
    rust: Identifier,
    c: *mut tactid_identifier,
    estimate: tactid_estimate,
    contact: tactid_wrench,
    frame: WrenchFrame,
}

impl Updates {
    fn new(duration_s: f64) -> Self {
        let experiment = Experiment {
            duration_s,
            ..Experiment::default()
        };
        let (noise, mut random) = (Noise::fraction(0.01), SmallRng::seed_from_u64(0));
        let instants: Vec<_> = experiment
            .run()
            .iter()
            .map(|i| noise.on(i, &mut random))
            .collect();
        let rust = identifier(&experiment, &EquationSettings::default());
        let frame = rust.wrench_frame(TOOL, None).unwrap();
        Self {
            rust,
            samples: instants
                .iter()
                .map(|instant| (instant.base_numbers(), instant.wrench_numbers()))
                .collect(),
            c: created(),
            estimate: tactid_estimate::default(),
            contact: tactid_wrench::default(),
            frame,
            experiment,
            instants,
        }
    }

    fn restart(&mut self) {
        // SAFETY: it was created, and nothing uses it any more.
        unsafe { tactid_identifier_free(self.c) };
        self.c = created();
        self.rust = identifier(&self.experiment, &EquationSettings::default());
    }

    fn of_rust(&mut self, k: usize) {
        black_box(
            self.rust
                .push(&black_box(&self.instants[k]).sample())
                .unwrap(),
        );
        black_box((self.rust.estimate(), self.rust.covariance()));
        black_box((self.rust.is_settled(), self.rust.estimate_before_change()));
        black_box(self.rust.contact_wrench(&self.frame));
    }

    fn of_c(&mut self, k: usize) {
        let ((base, wrenches), instant) = (&self.samples[k], &self.instants[k]);
        let sample = tactid_sample {
            size: size_of::<tactid_sample>(),
            time_s: instant.time_s,
            joint_count: instant.position.len(),
            position: instant.position.as_ptr(),
            velocity: instant.velocity.as_ptr(),
            effort: null(),
            wrench_count: instant.wrenches.len(),
            wrenches: wrenches.as_ptr(),
            base: base.as_ptr(),
            base_acceleration: null(),
        };
        // SAFETY: the identifier was created, and the arrays have the numbers that the sample
        // counts.
        unsafe { tactid_identifier_push(self.c, black_box(&raw const sample)) };
        // SAFETY: the identifier was created, and the struct has its size.
        unsafe { tactid_identifier_estimate(self.c, black_box(&raw mut self.estimate)) };
        // SAFETY: as above.
        unsafe { tactid_identifier_contact_wrench(self.c, black_box(&raw mut self.contact)) };
    }
}

fn created() -> *mut tactid_identifier {
    let text = |of: &str| CString::new(of).unwrap();
    let (urdf, tool) = (text(URDF), text(TOOL));
    let robot = Experiment::default().robot();
    let names: Vec<_> = robot.joint_names().iter().map(|name| text(name)).collect();
    let links = SENSORS.map(text);
    let joints: Vec<*const c_char> = names.iter().map(|name| name.as_ptr()).collect();
    let sensors = links.each_ref().map(|name| name.as_ptr());
    let options = tactid_options {
        floating_base: 1,
        sensors: sensors.as_ptr(),
        sensor_count: 2,
        ..Default::default()
    };
    let mut made = null_mut();
    // SAFETY: the texts end with zero, and the counts are those of the arrays.
    let status = unsafe {
        tactid_identifier_new(
            urdf.as_ptr(),
            tool.as_ptr(),
            joints.as_ptr(),
            joints.len(),
            &raw const options,
            &raw mut made,
        )
    };
    assert_eq!(status as i32, 0);
    made
}
