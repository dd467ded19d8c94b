//! Gives samples of any lengths and numbers to the online identifier, whose estimate stays finite
//! and physical.

use crate::{Number, base_kind, estimate::assert_estimate, numbers, parsed, robot};
use arbitrary::Arbitrary;
use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::Wrench;
use tactid_identify::{BaseState, EquationSettings, Identifier, Method, Sample};

#[derive(Arbitrary, Debug)]
struct Input {
    method: u8,
    floating: bool,
    offset: bool,
    cutoff_hz: Number,
    max_gap_s: Number,
    wrench_noise: Vec<[Number; 6]>,
    effort_noise: Vec<Number>,
    /// Seconds from one sample to the next, where the sample has no time of its own.
    period_s: Number,
    samples: Vec<Measured>,
}

#[derive(Arbitrary, Debug)]
struct Measured {
    time_s: Option<Number>,
    /// How often the sample repeats, with positions that move on.
    repeats: u8,
    base: [Number; 9],
    position: Vec<Number>,
    velocity: Vec<Number>,
    effort: Vec<Number>,
    wrenches: Vec<[Number; 6]>,
}

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold.
pub fn run(bytes: &[u8]) {
    let Some(input) = parsed::<Input>(bytes) else {
        return;
    };
    let base = base_kind(input.floating);
    let settings = EquationSettings {
        method: [
            Method::Tactile,
            Method::JointSensing,
            Method::Effort,
            Method::Combined { effort: true },
        ][usize::from(input.method % 4)],
        cutoff_hz: input.cutoff_hz.0,
        max_gap_s: input.max_gap_s.0,
        wrench_offset: input.offset,
        wrench_noise: input
            .wrench_noise
            .iter()
            .map(|noise| noise.map(|number| number.0))
            .collect(),
        effort_noise: numbers(&input.effort_noise),
        ..EquationSettings::default()
    };
    let Ok(mut identifier) = Identifier::new(robot(base), "tool0", &["tool0"], &settings) else {
        return;
    };
    let mut time_s = 0.0;
    for measured in &input.samples {
        for repeat in 0..=measured.repeats {
            time_s = measured.time_s.map_or(time_s + input.period_s.0, |time| {
                time.0 + f64::from(repeat) * input.period_s.0
            });
            push(&mut identifier, measured, time_s, f64::from(repeat));
        }
        check(&identifier);
    }
    identifier.finish();
    check(&identifier);
}

fn push(identifier: &mut Identifier, measured: &Measured, time_s: f64, repeat: f64) {
    let moved = |all: &[Number], by: f64| -> Vec<f64> {
        numbers(all)
            .iter()
            .enumerate()
            .map(|(k, x)| x + by * (repeat * (0.1 + 0.07 * k as f64)).sin())
            .collect()
    };
    let base = measured.base.map(|number| number.0);
    let wrench = |all: &[Number; 6]| Wrench {
        force: Vector3::new(all[0].0, all[1].0, all[2].0),
        moment: Vector3::new(all[3].0, all[4].0, all[5].0),
    };
    let wrenches: Vec<Wrench> = measured.wrenches.iter().map(wrench).collect();
    let _ = identifier.push(&Sample {
        time_s,
        base: BaseState {
            pose: Isometry3::new(Vector3::new(base[0], base[1], base[2]), Vector3::zeros()),
            velocity: Vector3::new(base[3], base[4], base[5]),
            angular_velocity: Vector3::new(base[6], base[7], base[8]),
            acceleration: None,
            angular_acceleration: None,
        },
        joint_position: &moved(&measured.position, 0.5),
        joint_velocity: &moved(&measured.velocity, 0.0),
        joint_effort: &moved(&measured.effort, 1.0),
        wrenches: &wrenches,
    });
}

fn check(identifier: &Identifier) {
    assert_estimate(&identifier.estimate());
    if let Some(covariance) = identifier.covariance() {
        assert!(covariance.iter().all(|x| x.is_finite()), "{covariance}");
        assert!(
            covariance.diagonal().iter().all(|&x| x >= 0.0),
            "{covariance}"
        );
    }
}
