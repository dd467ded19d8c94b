//! Problems for the built-in arm, on the ground and on a free-floating base.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use tactid_dynamics::{BaseKind, InertialParameters, Manipulator, MassProperties, Urdf};
use tactid_excitation::{JointLimits, Problem, Sensing, targets_within};
use tactid_identify::EquationSettings;

pub(crate) const TOOL: &str = "tool0";

/// Standard deviations of one sample of the wrench, N and N m.
pub(crate) const NOISE: [f64; 6] = [0.5, 0.6, 0.4, 0.05, 0.04, 0.06];

/// Joints of the arm bent, the gripper open.
pub(crate) const POSTURE: [f64; 8] = [0.0, -1.2, 1.6, -0.4, 1.5, 0.0, 0.0, 0.0];

pub(crate) fn urdf() -> Urdf {
    Urdf::from_xml(include_str!("../../../sim/robots/tactid.urdf")).unwrap()
}

/// Returns a body that is no plate, with its principal axes turned.
pub(crate) fn body(mass_kg: f64, center: [f64; 3], size_m: [f64; 3]) -> InertialParameters {
    let [x, y, z] = size_m.map(|size| size * size / 12.0);
    let moments = Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y));
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.2)).to_rotation_matrix();
    MassProperties {
        mass_kg,
        center_of_mass: center.into(),
        inertia: mass_kg * (turn * moments * turn.transpose()),
    }
    .into()
}

fn problem(robot: Manipulator, payload: InertialParameters, acceleration: f64) -> Problem {
    let limits = JointLimits::of_robot(&robot, acceleration, 1.0).unwrap();
    let sensing = Sensing {
        sensors: vec![TOOL.to_owned()],
        equations: EquationSettings {
            wrench_noise: vec![NOISE],
            ..EquationSettings::default()
        },
        rate_hz: 200.0,
        base_noise: None,
    };
    let targets = targets_within(&payload, 0.01).unwrap();
    let mut problem = Problem::new(robot, TOOL, &POSTURE, limits, sensing, payload, targets);
    problem.duration_s = 3.0;
    problem
}

/// Returns the problem of the arm on the ground with a payload of 1.5 kg.
pub(crate) fn on_ground() -> Problem {
    let payload = body(1.5, [0.03, -0.02, 0.08], [0.2, 0.12, 0.16]);
    let robot = urdf().manipulator(BaseKind::Fixed).unwrap();
    problem(robot, payload, 5.0)
}

/// Returns the problem of the free-floating spacecraft with a payload of 60 kg.
pub(crate) fn in_orbit() -> Problem {
    let payload = body(60.0, [0.4, 0.05, -0.03], [0.8, 0.5, 0.6]);
    let robot = urdf().manipulator(BaseKind::Floating).unwrap();
    let mut problem = problem(robot, payload, 1.0);
    problem.duration_s = 6.0;
    problem
}
