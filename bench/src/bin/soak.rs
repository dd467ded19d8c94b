//! A day of samples at 1 kHz through the online identifier, as fast as they can be computed.
//!
//! A sensor that is swung by hand carries payloads that change, with rests, gaps, steps of the
//! clock and bursts of NaN. The run ends with an error if the process grows by more than 1 MB after
//! the first minute, if the covariance is not positive definite, if the 95 % intervals of the last
//! hour hold fewer than 93 or more than 97 % of the true values, or 3 % fewer than those of the
//! first, if a value has no interval at the end of a payload's 20 s, or if in an hour more than one
//! of a hundred payload changes is missed, or more than one alarm is false.
//!
//! `soak 86400` is the full run; the number is that of the simulated seconds.

#![forbid(unsafe_code)]

#[path = "../swing.rs"]
mod swing;

use std::env;
use std::f64::consts::PI;
use std::process::ExitCode;

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::{
    FrameMotion, InertialParameters, Manipulator, MassProperties, Wrench, wrench_regressor,
};
use tactid_identify::{
    BaseState, EquationSettings, HALF_WIDTH_95, Identifier, PushOutcome, Sample, values_of_body,
};

/// Time from one sample to the next, s.
const PERIOD_S: f64 = 1e-3;

/// Samples from one payload change to the next, 20 s.
const CHANGE_EVERY: u64 = 20_000;

/// Samples from one fault to the next.
const FAULT_EVERY: u64 = 7_300;

/// Samples of an hour.
const HOUR: u64 = 3_600_000;

/// Samples after a payload change within which an alarm detects it, 2 s.
const DETECTED_WITHIN: u64 = 2_000;

/// Time from a payload change to the rest that follows, time until the motion goes on, and time in
/// which it slows down or gets faster, s.
const REST: (f64, f64, f64) = (12.0, 14.0, 0.5);

/// Standard deviations of the noise of one sample, N and N m.
const NOISE: (f64, f64) = (0.1, 0.01);

/// Gravitational acceleration in the world, m/s².
const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// Growth of the process after the first minute that is an error, bytes.
const MAX_GROWTH: u64 = 1 << 20;

/// Range of the coverage of the last hour.
const COVERAGE: std::ops::RangeInclusive<f64> = 0.93..=0.97;

/// Largest loss of coverage of the last hour against the first, where there are several: twice the
/// standard deviation of the difference. An hour has 1800 values, the ten of a payload being
/// correlated.
const MAX_LOSS: f64 = 0.03;

/// Largest fraction of an hour's payload changes that is missed.
const MAX_MISSED: f64 = 0.01;

/// Largest number of false alarms in an hour.
const MAX_FALSE: u64 = 1;

/// Shortest time to simulate, s: memory is compared with that after the first minute, and intervals
/// are counted.
const SHORTEST_S: f64 = 120.0;

fn main() -> ExitCode {
    let duration_s = env::args()
        .nth(1)
        .map_or(Ok(600.0), |text| text.parse::<f64>());
    let Some(duration_s) = duration_s.ok().filter(|&s| s >= SHORTEST_S) else {
        eprintln!("soak SECONDS: the number of seconds to simulate, {SHORTEST_S} or more");
        return ExitCode::from(2);
    };
    match run(duration_s) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::FAILURE
        }
    }
}

fn run(duration_s: f64) -> Result<(), String> {
    let robot = Manipulator::lone_body("flange");
    let settings = EquationSettings {
        gravity: Some(GRAVITY),
        ..EquationSettings::default()
    };
    let identifier = Identifier::new(&robot, "flange", &["flange"], &settings);
    let mut identifier = identifier.map_err(|error| error.to_string())?;
    let mut source = Source::new();
    let samples = (duration_s / PERIOD_S) as u64;
    let mut hour = Hour::default();
    let mut first_hour = None;
    let mut first_minute_bytes = 0;
    for k in 0..samples {
        let (time_s, base, wrench) = source.next(k);
        let sample = Sample {
            time_s,
            base,
            joint_position: &[],
            joint_velocity: &[],
            joint_effort: &[],
            wrenches: &[wrench],
        };
        let outcome = identifier
            .push(&sample)
            .map_err(|error| error.to_string())?;
        if outcome == PushOutcome::PayloadChanged {
            hour.count_alarm(k);
        }
        if k % CHANGE_EVERY == CHANGE_EVERY - 1 {
            hour.compare(&identifier, &source.payload)?;
            hour.count_change(k >= CHANGE_EVERY);
        }
        if k == 60_000 {
            first_minute_bytes = swing::resident_bytes()?;
        }
        // The last one is longer by what is left of the time: a part of an hour has too few values.
        let left = samples - 1 - k;
        if k % HOUR == HOUR - 1 && left >= HOUR || left == 0 {
            println!("{}", hour.describe(k + 1, swing::resident_bytes()?));
            hour.check_alarms()?;
            first_hour.get_or_insert(hour.coverage());
            if left > 0 {
                hour = Hour::default();
            }
        }
    }
    let growth = swing::resident_bytes()?.saturating_sub(first_minute_bytes);
    let (first, last) = (first_hour.unwrap_or_default(), hour.coverage());
    println!(
        "coverage of the first hour {first:.4}, of the last {last:.4}; growth after the first minute {growth} bytes"
    );
    if growth > MAX_GROWTH {
        return Err(format!(
            "the process grew by {growth} bytes after the first minute"
        ));
    }
    if !COVERAGE.contains(&last) || first - last > MAX_LOSS {
        return Err(format!(
            "the intervals of the last hour hold {last:.4} of the true values, those of the first {first:.4}"
        ));
    }
    Ok(())
}

/// What is counted in an hour.
#[derive(Default)]
struct Hour {
    /// Values that were compared, and those whose intervals hold the truth.
    values: u64,
    held: u64,
    /// Payload changes, those without an alarm in time, and all other alarms.
    changes: u64,
    missed: u64,
    false_alarms: u64,
    /// Whether the last payload change was detected in time.
    is_detected: bool,
}

impl Hour {
    /// Compares an estimate with the true payload, and checks its covariance.
    fn compare(&mut self, identifier: &Identifier, payload: &MassProperties) -> Result<(), String> {
        let estimate = identifier.estimate();
        let covariance = identifier.covariance().ok_or("no covariance after 20 s")?;
        if covariance.cholesky().is_none() {
            return Err(format!(
                "the covariance is not positive definite: {covariance}"
            ));
        }
        let (values, truth) = (values_of_body(&estimate.body), values_of_body(payload));
        for ((value, truth), std_dev) in values.iter().zip(&truth).zip(estimate.std_devs) {
            if !std_dev.is_finite() {
                return Err("a value has no interval after 20 s".to_owned());
            }
            self.values += 1;
            self.held += u64::from((value - truth).abs() <= HALF_WIDTH_95 * std_dev);
        }
        Ok(())
    }

    /// Counts an alarm at a sample: the first one soon after a payload change detects it, and any
    /// other one is false.
    fn count_alarm(&mut self, sample: u64) {
        let is_in_time = sample >= CHANGE_EVERY && sample % CHANGE_EVERY < DETECTED_WITHIN;
        if is_in_time && !self.is_detected {
            self.is_detected = true;
        } else {
            self.false_alarms += 1;
        }
    }

    /// Counts the last payload change; before the first one nothing has changed.
    fn count_change(&mut self, has_changed: bool) {
        self.changes += u64::from(has_changed);
        self.missed += u64::from(has_changed && !self.is_detected);
        self.is_detected = false;
    }

    fn check_alarms(&self) -> Result<(), String> {
        let changes = self.changes as f64;
        if self.missed as f64 > MAX_MISSED * changes || self.false_alarms > MAX_FALSE {
            return Err(format!(
                "of {changes} payload changes {} were missed, and {} alarms were false",
                self.missed, self.false_alarms
            ));
        }
        Ok(())
    }

    fn coverage(&self) -> f64 {
        self.held as f64 / self.values.max(1) as f64
    }

    fn describe(&self, samples: u64, bytes: u64) -> String {
        format!(
            "{samples} samples: coverage {:.4} of {} values, {} payload changes, {} missed, {} false alarms, {:.3} MB resident",
            self.coverage(),
            self.values,
            self.changes,
            self.missed,
            self.false_alarms,
            bytes as f64 / 1e6
        )
    }
}

/// Simulates the sensor, its faults and its clock.
struct Source {
    random: SmallRng,
    payload: MassProperties,
    parameters: InertialParameters,
    /// Time by which gaps have moved the motion on, s.
    skipped_s: f64,
    /// Difference of the clock to the time of the motion, s.
    clock_s: f64,
}

impl Source {
    fn new() -> Self {
        let payload = MassProperties {
            mass_kg: 2.0,
            center_of_mass: Vector3::new(0.02, 0.0, 0.1),
            inertia: Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, 0.005)),
        };
        Self {
            random: SmallRng::seed_from_u64(16),
            parameters: payload.into(),
            payload,
            skipped_s: 0.0,
            clock_s: 0.0,
        }
    }

    /// Returns time, state and wrench of a sample.
    fn next(&mut self, k: u64) -> (f64, BaseState, Wrench) {
        if k > 0 && k.is_multiple_of(CHANGE_EVERY) {
            self.change();
        }
        let fault = k % FAULT_EVERY;
        // Faults take turns: a gap of 0.5 s, a step of the clock by 0.05 s back, one by an hour
        // ahead, a burst of NaN.
        let turn = (k / FAULT_EVERY) % 4;
        if k >= FAULT_EVERY && fault == 0 {
            self.clock_s += [0.5, -0.05, 3600.0, 0.0][turn as usize];
            self.skipped_s += [0.5, 0.0, 0.0, 0.0][turn as usize];
        }
        let is_nan = k >= FAULT_EVERY && turn == 3 && fault < 50;
        let motion = self.motion(k);
        let exact = wrench_regressor(&motion.in_frame(&GRAVITY)) * self.parameters.as_vector();
        let mut noise = |std_dev: f64| {
            Vector3::from_fn(|_, _| std_dev * self.random.sample::<f64, _>(StandardNormal))
        };
        let wrench = Wrench {
            force: if is_nan {
                Vector3::repeat(f64::NAN)
            } else {
                exact.fixed_rows::<3>(0) + noise(NOISE.0)
            },
            moment: exact.fixed_rows::<3>(3) + noise(NOISE.1),
        };
        let base = BaseState {
            pose: motion.pose,
            velocity: motion.velocity,
            angular_velocity: motion.angular_velocity,
            acceleration: None, // differentiated from the velocities
            angular_acceleration: None,
        };
        (k as f64 * PERIOD_S + self.clock_s, base, wrench)
    }

    /// Puts on the next payload, of at least a third more or less mass.
    fn change(&mut self) {
        let before = self.payload.mass_kg;
        let mass_kg = loop {
            let mass_kg = self.random.random_range(0.5..5.0);
            if !(before / 1.5..before * 1.5).contains(&mass_kg) {
                break mass_kg;
            }
        };
        let mut within = |range: std::ops::Range<f64>| self.random.random_range(range);
        let center_of_mass =
            Vector3::new(within(-0.05..0.05), within(-0.05..0.05), within(0.05..0.15));
        let sides = Vector3::from_fn(|_, _| within(0.05..0.2)); // m, of a cuboid
        let squares = sides.component_mul(&sides);
        let moments = Vector3::repeat(squares.sum()) - squares;
        self.payload = MassProperties {
            mass_kg,
            center_of_mass,
            inertia: Matrix3::from_diagonal(&(moments * (mass_kg / 12.0))),
        };
        self.parameters = self.payload.into();
    }

    /// Returns the motion of the flange, which goes on while samples are missing.
    fn motion(&self, k: u64) -> FrameMotion {
        let [phase, rate, acceleration] = phase(k);
        swing::motion([phase + self.skipped_s, rate, acceleration])
    }
}

/// Returns the phase of the motion, s, with its first and second derivative. It stops during the
/// rests.
fn phase(k: u64) -> [f64; 3] {
    let (begin, end, ramp) = REST;
    let advance = CHANGE_EVERY as f64 * PERIOD_S - (end - begin) + ramp;
    let before = (k / CHANGE_EVERY) as f64 * advance;
    let time_s = (k % CHANGE_EVERY) as f64 * PERIOD_S;
    let slowed = |fraction: f64, sign: f64| {
        let (sin, cos) = (PI * fraction).sin_cos();
        let covered = ramp / 2.0 * (fraction + sign * sin / PI);
        [
            covered,
            (1.0 + sign * cos) / 2.0,
            -sign * PI * sin / (2.0 * ramp),
        ]
    };
    let [covered, rate, acceleration] = if time_s < begin {
        [time_s, 1.0, 0.0]
    } else if time_s < begin + ramp {
        let [covered, rate, acceleration] = slowed((time_s - begin) / ramp, 1.0);
        [begin + covered, rate, acceleration]
    } else if time_s < end - ramp {
        [begin + ramp / 2.0, 0.0, 0.0]
    } else if time_s < end {
        let [covered, rate, acceleration] = slowed((time_s - end + ramp) / ramp, -1.0);
        [begin + ramp / 2.0 + covered, rate, acceleration]
    } else {
        [begin + ramp + time_s - end, 1.0, 0.0]
    };
    [before + covered, rate, acceleration]
}
