//! Compares designed motions with the best of many random Fourier motions at equal limits.
//!
//! `cargo run --release -p tactid-excitation --example compare -- BUILT_IN.urdf [ARM.urdf TIP]...`
//!
//! The first robot floats, free and then with its grip and its attitude bounded, and its rows come last; the others stand on the
//! ground, at full speed and at 30 %. The columns are the largest predicted 95 % interval relative to 1 % of the largest value of its kind, that of the
//! best random motion, their ratio, the time of the design, the largest fraction of a limit that the design uses, and the
//! largest angle of the base.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use nalgebra::{Matrix3, Point3, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use tactid_dynamics::{BaseKind, InertialParameters, MassProperties, Urdf};
use tactid_excitation::{
    BaseBounds, DesignSettings, FourierMotion, Grip, JointLimits, Problem, Sensing, design,
    predict, targets_within,
};
use tactid_identify::EquationSettings;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Random Fourier motions that a design is compared with.
const RANDOM: usize = 100;

fn body(mass_kg: f64, center: [f64; 3], moments: [f64; 3]) -> InertialParameters {
    MassProperties {
        mass_kg,
        center_of_mass: center.into(),
        inertia: Matrix3::from_diagonal(&Vector3::from(moments)),
    }
    .into()
}

fn problem(path: &str, tool: &str, base: BaseKind, payload: InertialParameters) -> Result<Problem> {
    let urdf = Urdf::from_file(Path::new(path))?;
    let robot = urdf.manipulator(base)?;
    let acceleration = if base == BaseKind::Fixed { 5.0 } else { 1.0 };
    let limits = JointLimits::of_urdf(&urdf, &robot, acceleration, 1.0)?;
    let sensing = Sensing {
        sensors: vec![tool.to_owned()],
        equations: EquationSettings {
            wrench_noise: vec![[0.5, 0.5, 0.5, 0.05, 0.05, 0.05]],
            ..EquationSettings::default()
        },
        rate_hz: 500.0,
        base_noise: None,
    };
    let start = vec![0.0; robot.dof()];
    let targets = targets_within(&payload, 0.01).ok_or("no mass")?;
    Ok(Problem::new(
        robot, tool, &start, limits, sensing, payload, targets,
    ))
}

#[expect(clippy::print_stdout, reason = "an example prints its table")]
fn compare(name: &str, problem: &Problem) -> Result<()> {
    let began = Instant::now();
    let found = design(problem, &DesignSettings::default());
    let seconds = began.elapsed().as_secs_f64();
    let found = match found {
        Ok(found) => found,
        Err(error) => {
            println!("{name:28} {error}");
            return Ok(());
        }
    };
    let mut random = StdRng::seed_from_u64(1);
    let mut best = f64::INFINITY;
    for _ in 0..RANDOM {
        let motion = FourierMotion::within_limits(&mut random, problem)?;
        if let Ok(prediction) = predict(problem, &motion) {
            best = best.min(prediction.largest().1);
        }
    }
    let largest = found.prediction.largest().1;
    let worst = found.margins.iter().map(|m| m.used).fold(0.0, f64::max);
    println!(
        "{name:28} {largest:8.4} {best:8.4} {:6.3} {seconds:9.2} {worst:9.6} {:8.4}",
        largest / best,
        found.excursion.attitude_rad.to_degrees()
    );
    Ok(())
}

fn spacecraft(path: &str) -> Result<()> {
    let payload = body(100.0, [0.5, 0.0, 0.0], [10.0, 20.0, 10.0]);
    let mut free = problem(path, "tool0", BaseKind::Floating, payload)?;
    free.start = vec![
        0.0,
        -1.2,
        1.6,
        -0.4,
        std::f64::consts::FRAC_PI_2,
        0.0,
        0.0,
        0.0,
    ];
    let grip = Grip {
        center: Point3::new(0.22, 0.0, 0.075),
        normal: Vector3::y_axis(),
        distance_m: 0.04,
        grip_force_n: 1500.0,
        friction: 0.8,
        torsion_radius_m: 0.06,
        used_fraction: 0.7,
    };
    let bounded = BaseBounds {
        attitude_rad: Some(0.1f64.to_radians()),
        position_m: None,
    };
    compare("spacecraft", &free)?;
    free.grip = Some(grip);
    compare("spacecraft, grip", &free)?;
    free.base = bounded;
    compare("spacecraft, grip, 0.1 deg", &free)
}

#[expect(clippy::print_stdout, reason = "an example prints its table")]
fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    println!(
        "{:28} {:>8} {:>8} {:>6} {:>9} {:>9} {:>8}",
        "largest interval over 1 %", "design", "random", "ratio", "seconds", "used", "base deg"
    );
    let (built_in, arms) = arguments.split_first().ok_or("no URDF")?;
    for arm in arms.chunks(2) {
        let [path, tool] = arm else {
            return Err("each arm is a URDF and a link".into());
        };
        let payload = body(2.0, [0.03, -0.02, 0.08], [0.01, 0.015, 0.02]);
        let mut random = StdRng::seed_from_u64(7);
        for speed in [1.0, 0.3] {
            let mut arm = problem(path, tool, BaseKind::Fixed, payload)?;
            for limits in &mut arm.limits {
                limits.velocity *= speed;
                limits.acceleration *= speed;
            }
            let moving = arm.moving_joints()?;
            for joint in moving {
                let (low, high) = arm.limits[joint].position;
                let (low, high) = (low.max(-1.5), high.min(1.5));
                arm.start[joint] =
                    0.5 * (low + high) + 0.3 * (high - low) * random.random_range(-1.0..1.0);
            }
            let file = Path::new(path).file_stem().ok_or("no file")?;
            compare(&format!("{} {speed}", file.to_string_lossy()), &arm)?;
        }
    }
    spacecraft(built_in)
}
