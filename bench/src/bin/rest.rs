//! Ten million samples at rest through the online identifier, after ten seconds of motion.
//!
//! Nothing must drift, overflow or grow: the run ends with an error if an entry of the contact
//! wrench or the mass is off by more than six of its standard deviations at any sample, if a
//! payload change is reported, if the payload is no longer known at the end as it was when the
//! motion stopped, or if the process grows by more than 1 MB.
//!
//! `rest SAMPLES` has another number of samples.

#![forbid(unsafe_code)]

#[path = "../swing.rs"]
mod swing;

use std::env;
use std::f64::consts::PI;
use std::process::ExitCode;
use std::time::Instant;

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use swing::{motion, resident_bytes};
use tactid_dynamics::{InertialParameters, Manipulator, MassProperties, Wrench, wrench_regressor};
use tactid_identify::{BaseState, EquationSettings, Identifier, Sample};

/// Time from one sample to the next, s.
const PERIOD_S: f64 = 1e-3;

/// Time at which the motion begins to stop, and how long that takes, s.
const STOP: (f64, f64) = (10.0, 0.5);

/// Standard deviations of the noise of one sample, N and N m.
const NOISE: (f64, f64) = (0.1, 0.01);

/// Gravitational acceleration in the world, m/s².
const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// Largest error, in stated standard deviations.
const MAX_ERROR: f64 = 6.0;

/// Growth of the process during the rest that is an error, bytes.
const MAX_GROWTH: u64 = 1 << 20;

fn main() -> ExitCode {
    let samples = env::args()
        .nth(1)
        .map_or(Ok(10_000_000), |text| text.parse());
    let Ok(samples) = samples else {
        eprintln!("rest SAMPLES: the number of samples");
        return ExitCode::from(2);
    };
    match run(samples) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::FAILURE
        }
    }
}

fn run(samples: u64) -> Result<(), String> {
    let robot = Manipulator::lone_body("flange");
    let settings = EquationSettings {
        gravity: Some(GRAVITY),
        wrench_offset: true,
        ..EquationSettings::default()
    };
    let identifier = Identifier::new(&robot, "flange", &["flange"], &settings);
    let mut identifier = identifier.map_err(|error| error.to_string())?;
    let frame = identifier.wrench_frame("flange", None);
    let frame = frame.map_err(|error| error.to_string())?;
    let payload = MassProperties {
        mass_kg: 2.0,
        center_of_mass: Vector3::new(0.02, 0.0, 0.1),
        inertia: Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, 0.005)),
    };
    let parameters = InertialParameters::from(payload);
    let mut random = SmallRng::seed_from_u64(5);
    let (mut worst, mut at_stop, mut begun) = ([0.0f64; 2], None, (Instant::now(), 0));
    for k in 0..samples {
        let time_s = k as f64 * PERIOD_S;
        let motion = motion(phase(time_s));
        let exact = wrench_regressor(&motion.in_frame(&GRAVITY)) * parameters.as_vector();
        let mut noise = |std_dev: f64| {
            Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal))
        };
        let wrench = Wrench {
            force: exact.fixed_rows::<3>(0) + noise(NOISE.0),
            moment: exact.fixed_rows::<3>(3) + noise(NOISE.1),
        };
        let sample = Sample {
            time_s,
            base: BaseState {
                pose: motion.pose,
                velocity: motion.velocity,
                angular_velocity: motion.angular_velocity,
                acceleration: None,
                angular_acceleration: None,
            },
            joint_position: &[],
            joint_velocity: &[],
            joint_effort: &[],
            wrenches: &[wrench],
        };
        identifier
            .push(&sample)
            .map_err(|error| error.to_string())?;
        if time_s < STOP.0 + 2.0 * STOP.1 {
            continue;
        }
        let estimate = identifier.estimate();
        if at_stop.is_none() {
            at_stop = Some(estimate.std_devs);
            begun = (Instant::now(), resident_bytes()?);
        }
        let contact = identifier
            .contact_wrench(&frame)
            .ok_or("no wrench of a contact")?;
        let of_mass = (estimate.body.mass_kg - payload.mass_kg) / estimate.std_devs[0];
        let entries = contact.wrench.entries().into_iter().zip(contact.std_devs());
        let of_contact = entries.map(|(value, std_dev)| value.abs() / std_dev);
        worst = [
            worst[0].max(of_mass.abs()),
            of_contact.fold(worst[1], f64::max),
        ];
        if !(worst[0] < MAX_ERROR && worst[1] < MAX_ERROR) || estimate.payload_changes > 0 {
            return Err(format!(
                "at {time_s} s: {worst:?} standard deviations, {estimate:?}"
            ));
        }
    }
    let at_stop = at_stop.ok_or("the motion has not stopped")?;
    let seconds = begun.0.elapsed().as_secs_f64();
    let growth = resident_bytes()?.saturating_sub(begun.1);
    let end = identifier.estimate();
    println!(
        "{samples} samples: mass {:.5} ± {:.5} kg (when the motion stopped ± {:.5}), largest errors {:.1} standard \
         deviations of the mass and {:.1} of the contact, growth {growth} bytes, {:.2} µs a sample",
        end.body.mass_kg,
        end.std_devs[0],
        at_stop[0],
        worst[0],
        worst[1],
        1e6 * seconds / samples as f64
    );
    let is_forgotten = end
        .std_devs
        .iter()
        .zip(&at_stop)
        .any(|(now, then)| *now > 1.1 * then);
    if growth > MAX_GROWTH || is_forgotten {
        return Err(format!(
            "the process grew, or the payload was forgotten: {:?}",
            end.std_devs
        ));
    }
    Ok(())
}

/// Returns the phase of the motion, s, with its first and second derivative.
fn phase(time_s: f64) -> [f64; 3] {
    let (stop_s, ramp_s) = STOP;
    let fraction = ((time_s - stop_s) / ramp_s).clamp(0.0, 1.0);
    let (sin, cos) = (PI * fraction).sin_cos();
    let covered = ramp_s / 2.0 * (fraction + sin / PI);
    let acceleration = if fraction < 1.0 {
        -PI * sin / (2.0 * ramp_s)
    } else {
        0.0
    };
    [
        time_s.min(stop_s) + covered,
        (1.0 + cos) / 2.0,
        acceleration,
    ]
}
