//! Robots and problems.

use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Point3, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use tactid_dynamics::{BaseKind, InertialParameters, MassProperties, Urdf};
use tactid_excitation::{Grip, JointLimits, Problem, Sensing, targets_within};
use tactid_identify::EquationSettings;

use crate::Result;

/// Acceleration of the arms on the ground at full speed, rad/s².
const ACCELERATION: f64 = 5.0;

/// An arm on the ground.
pub(crate) struct Arm {
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    pub(crate) tool: String,
}

/// Returns the arms of an argument list of paths and links.
pub(crate) fn read(arguments: &[String]) -> Result<Vec<Arm>> {
    let arm = |pair: &[String]| {
        let [path, tool] = pair else {
            return Err("each arm is a URDF and a link".into());
        };
        let file = Path::new(path).file_stem().ok_or("no file")?;
        Ok(Arm {
            name: file.to_string_lossy().into_owned(),
            path: PathBuf::from(path),
            tool: tool.clone(),
        })
    };
    arguments.chunks(2).map(arm).collect()
}

fn body(mass_kg: f64, center: [f64; 3], moments: [f64; 3]) -> InertialParameters {
    MassProperties {
        mass_kg,
        center_of_mass: center.into(),
        inertia: Matrix3::from_diagonal(&Vector3::from(moments)),
    }
    .into()
}

fn problem(
    path: &Path,
    tool: &str,
    base: BaseKind,
    acceleration: f64,
    payload: InertialParameters,
) -> Result<Problem> {
    let urdf = Urdf::from_file(path)?;
    let robot = urdf.manipulator(base)?;
    let limits = JointLimits::of_robot(&robot, acceleration, 1.0)?;
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

impl Arm {
    /// Returns the arm with a payload of 2 kg in a random posture, at a fraction of its speed and
    /// acceleration.
    pub(crate) fn problem(&self, posture: u64, speed: f64) -> Result<Problem> {
        let payload = body(2.0, [0.03, -0.02, 0.08], [0.01, 0.015, 0.02]);
        let mut problem = problem(
            &self.path,
            &self.tool,
            BaseKind::Fixed,
            ACCELERATION,
            payload,
        )?;
        for limits in &mut problem.limits {
            limits.velocity *= speed;
            limits.acceleration *= speed;
        }
        let mut random = StdRng::seed_from_u64(posture);
        for joint in problem.moving_joints()? {
            let (low, high) = problem.limits[joint].position;
            // A range around zero, or as near to it as the joint comes.
            let (low, high) = (low.max(high.min(1.5) - 3.0), high.min(low.max(-1.5) + 3.0));
            let place = 0.5 + 0.3 * random.random_range(-1.0..1.0);
            problem.start[joint] = low + place * (high - low);
        }
        Ok(problem)
    }
}

/// Returns the built-in spacecraft with a payload of 100 kg.
pub(crate) fn spacecraft(path: &str) -> Result<Problem> {
    let payload = body(100.0, [0.5, 0.0, 0.0], [10.0, 20.0, 10.0]);
    let mut free = problem(Path::new(path), "tool0", BaseKind::Floating, 1.0, payload)?;
    free.start = vec![0.0, -1.2, 1.6, -0.4, FRAC_PI_2, 0.0, 0.0, 0.0];
    Ok(free)
}

/// Returns the grip of the built-in gripper.
pub(crate) fn grip() -> Grip {
    Grip {
        center: Point3::new(0.22, 0.0, 0.075),
        normal: Vector3::y_axis(),
        distance_m: 0.04,
        grip_force_n: 1500.0,
        friction: 0.8,
        torsion_radius_m: 0.06,
        used_fraction: 0.7,
    }
}
