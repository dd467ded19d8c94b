//! Identifies payloads that the built-in spacecraft holds, with motions that are planned from
//! second to second.
//!
//! `cargo run --release -p tactid-excitation --example active -- BUILT_IN.urdf [PAYLOADS]
//! [acceleration=3] [cutoff=3] [attitude=0.1]`
//!
//! The arguments with names are the largest acceleration of the joints, rad/s², the cutoff of the
//! filter, Hz, and the bound on the attitude of the base, degrees, of which `none` lets it turn.
//!
//! The payload is known to have between 5 and 150 kg and its centre of mass within 0.5 m of the
//! tool. Each channel has white noise of 1 % of its peak in the motion that identifies the nominal
//! payload.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use tactid_dynamics::{BaseKind, InertialParameters, MassProperties, Urdf};
use tactid_excitation::{
    ActiveSettings, BaseBounds, FourierMotion, Grip, JointLimits, Limit, Planner, Prior, Problem,
    Sensing, margins, targets_within,
};
use tactid_identify::{EquationSettings, largest_of_kind, values_of_body};

#[path = "../tests/common/closed_loop.rs"]
mod closed_loop;

use closed_loop::{Loop, Noise, Outcome, identify};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Longest identification, s, and the same with random motions.
const LONGEST_S: f64 = 30.0;
const LONGEST_RANDOM_S: f64 = 60.0;

/// Random motions that are compared with.
const RANDOM: usize = 10;

/// Passes of the motion from which the noise follows.
const PASSES: usize = 2;

const PRIOR: Prior = Prior {
    mass_kg: (5.0, 150.0),
    center_of_mass_m: 0.5,
    half_diagonal_m: 0.78,
};

fn nominal() -> InertialParameters {
    MassProperties {
        mass_kg: 100.0,
        center_of_mass: [0.5, 0.0, 0.0].into(),
        inertia: Matrix3::from_diagonal(&Vector3::new(10.0, 20.0, 10.0)),
    }
    .into()
}

fn settings(noise: &Noise) -> ActiveSettings {
    ActiveSettings {
        velocity_noise: noise.velocity.clone(),
        ..ActiveSettings::default()
    }
}

/// Draws a box of constant density that the prior allows.
fn drawn(random: &mut StdRng) -> InertialParameters {
    let mut in_ball = |radius: f64| loop {
        let at = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        if at.norm() < 1.0 {
            break at * radius;
        }
    };
    let (center, sides) = (
        in_ball(PRIOR.center_of_mass_m),
        in_ball(PRIOR.half_diagonal_m),
    );
    let turn = UnitQuaternion::from_scaled_axis(in_ball(std::f64::consts::PI));
    let mass_kg = random.random_range(PRIOR.mass_kg.0..PRIOR.mass_kg.1);
    let [x, y, z] = [0, 1, 2].map(|axis| f64::max(sides[axis].abs(), 0.05).powi(2) / 3.0);
    let body = MassProperties {
        mass_kg,
        center_of_mass: Vector3::zeros(),
        inertia: Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y)) * mass_kg,
    };
    InertialParameters::from(body).expressed_in(&Isometry3::from_parts(center.into(), turn))
}

/// Limits of the experiment that the command line can change.
struct Choices {
    acceleration_rad_s2: f64,
    cutoff_hz: f64,
    attitude_deg: Option<f64>,
}

impl Choices {
    /// Reads the arguments with names. Another name is an error.
    fn read(arguments: &[String]) -> Result<Self> {
        let mut choices = Self {
            acceleration_rad_s2: 3.0,
            cutoff_hz: 3.0,
            attitude_deg: Some(0.1),
        };
        for argument in arguments {
            match argument.split_once('=') {
                Some(("acceleration", value)) => choices.acceleration_rad_s2 = value.parse()?,
                Some(("cutoff", value)) => choices.cutoff_hz = value.parse()?,
                Some(("attitude", "none")) => choices.attitude_deg = None,
                Some(("attitude", value)) => choices.attitude_deg = Some(value.parse()?),
                _ => return Err(format!("unknown argument {argument}").into()),
            }
        }
        Ok(choices)
    }
}

fn spacecraft(path: &str, choices: &Choices) -> Result<Problem> {
    let urdf = Urdf::from_file(Path::new(path))?;
    let robot = urdf.manipulator(BaseKind::Floating)?;
    let limits = JointLimits::of_robot(&robot, choices.acceleration_rad_s2, 1.0)?;
    let sensing = Sensing {
        sensors: vec!["tool0".to_owned()],
        equations: EquationSettings {
            wrench_noise: vec![[0.5, 0.5, 0.5, 0.05, 0.05, 0.05]],
            cutoff_hz: choices.cutoff_hz,
            ..EquationSettings::default()
        },
        rate_hz: 1000.0,
        base_noise: None,
    };
    let start = [0.0, -1.2, 1.6, -0.4, FRAC_PI_2, 0.0, 0.0, 0.0];
    let targets = targets_within(&nominal(), 0.01).ok_or("no mass")?;
    let mut problem = Problem::new(robot, "tool0", &start, limits, sensing, nominal(), targets);
    problem.grip = Some(Grip {
        center: Point3::new(0.22, 0.0, 0.075),
        normal: Vector3::y_axis(),
        distance_m: 0.04,
        grip_force_n: 1500.0,
        friction: 0.8,
        torsion_radius_m: 0.06,
        used_fraction: 0.7,
    });
    problem.base = BaseBounds {
        attitude_rad: choices.attitude_deg.map(f64::to_radians),
        position_m: None,
    };
    Ok(problem)
}

#[expect(clippy::print_stdout, reason = "an example prints its table")]
fn show(problem: &Problem, payload: InertialParameters, outcome: &Outcome) -> Result<()> {
    let mut held = problem.clone();
    held.payloads = vec![payload];
    let (margins, excursion) = margins(&held, &outcome.motion)?;
    let used = |is_of: &dyn Fn(&Limit) -> bool| {
        let of = margins.iter().filter(|margin| is_of(&margin.limit));
        of.map(|margin| margin.used).fold(0.0, f64::max)
    };
    let fraction = problem.grip.map_or(0.0, |grip| grip.used_fraction);
    let grip = used(&|limit| matches!(limit, Limit::Grip(_))) * fraction;
    let torque = used(&|limit| matches!(limit, Limit::Effort(_)));
    let truth = values_of_body(&payload.mass_properties().ok_or("no mass")?);
    let largest = largest_of_kind(&truth);
    let errors = (0..10).map(|k| (outcome.values[k] - truth[k]).abs() / largest[k]);
    let plans_ms: Vec<f64> = outcome
        .plans
        .iter()
        .map(|time| 1e3 * time.as_secs_f64())
        .collect();
    // The robot rests during the first plan.
    let (first_ms, others_ms) = plans_ms.split_first().ok_or("no plan")?;
    println!(
        "{:8.1} {:>8} {:8.3} {:8.3} {:8.4} {:8.2} {:8.1} {:8.1} {:8.1} {}",
        truth[0],
        outcome
            .reached_s
            .map_or("-".to_owned(), |s| format!("{s:.2}")),
        grip,
        torque,
        excursion.attitude_rad.to_degrees(),
        100.0 * errors.fold(0.0, f64::max),
        plans_ms.iter().sum::<f64>() / plans_ms.len() as f64,
        first_ms,
        others_ms.iter().copied().fold(0.0, f64::max),
        outcome.failure.clone().unwrap_or_default(),
    );
    Ok(())
}

/// Returns the time in which a random motion, safe for the whole prior, identifies a payload.
fn random_s(
    random: &mut StdRng,
    problem: &Problem,
    planner: &Planner,
    noise: &Noise,
) -> Result<f64> {
    let mut safe = problem.clone();
    safe.payloads.extend(PRIOR.samples());
    let motion = FourierMotion::within_limits(random, &safe)?;
    let mut cycles = Loop::new(problem, &nominal(), noise, 0)?;
    while cycles.time_s() < LONGEST_RANDOM_S {
        for _ in 0..100 {
            cycles.cycle(&motion)?;
        }
        if planner.largest_ratio(&cycles.identifier.estimate()).1 <= 1.0 {
            return Ok(cycles.time_s());
        }
    }
    Ok(f64::INFINITY)
}

#[expect(clippy::print_stdout, reason = "an example prints its table")]
fn main() -> Result<()> {
    let arguments = std::env::args().skip(1);
    let (named, places): (Vec<String>, Vec<String>) =
        arguments.partition(|argument| argument.contains('='));
    let path = places.first().ok_or("no URDF")?;
    let count = places.get(1).map_or(Ok(10), |count| count.parse())?;
    let mut problem = spacecraft(path, &Choices::read(&named)?)?;
    // The motion depends on the noise, so it is iterated.
    let mut noise = Noise::none(problem.robot.dof());
    noise.wrench = problem.sensing.equations.wrench_noise[0];
    for _ in 0..PASSES {
        let mut planner = Planner::new(problem.clone(), PRIOR, settings(&noise))?;
        let mut cycles = Loop::new(&problem, &nominal(), &noise, 0)?;
        let outcome = identify(&mut cycles, &mut planner, LONGEST_S)?;
        noise = Noise::of_peaks(0.01, &problem, &nominal(), &outcome.motion)?;
        problem.sensing.equations.wrench_noise = vec![noise.wrench];
    }
    println!(
        "{:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "kg", "s", "grip", "torque", "base deg", "error %", "plan ms", "first", "slowest"
    );
    let mut random = StdRng::seed_from_u64(1);
    let mut times = Vec::new();
    for seed in 0..=count {
        let is_nominal = seed == 0;
        let payload = if is_nominal {
            nominal()
        } else {
            drawn(&mut random)
        };
        let mut planner = Planner::new(problem.clone(), PRIOR, settings(&noise))?;
        let mut cycles = Loop::new(&problem, &payload, &noise, seed)?;
        let outcome = identify(&mut cycles, &mut planner, LONGEST_S)?;
        show(&problem, payload, &outcome)?;
        if !is_nominal {
            times.push(outcome.reached_s.unwrap_or(f64::INFINITY));
        }
    }
    times.sort_by(f64::total_cmp);
    if let Some(median) = times.get(times.len() / 2) {
        println!("median of the random payloads: {median:.2} s");
    }
    let planner = Planner::new(problem.clone(), PRIOR, settings(&noise))?;
    for _ in 0..RANDOM {
        let time_s = random_s(&mut random, &problem, &planner, &noise)?;
        println!("nominal payload, random motion that is safe for the whole prior: {time_s:.1} s");
    }
    Ok(())
}
