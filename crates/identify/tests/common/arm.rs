//! Simulation of an arm with payload changes. The dynamics are exact; a test adds noise.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::common::integration::runge_kutta;
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use tactid_dynamics::{
    BaseKind, DhLink, DhRobot, FrameMotion, InertialParameters, JointKind, JointMotion,
    Manipulator, MassProperties, Workspace, Wrench, base_acceleration, motion, wrench_regressor,
};
use tactid_identify::{BaseState, Sample};

pub(crate) const TOOL: &str = "flange";
pub(crate) const JOINTS: usize = 6;

/// Returns a serial arm with the Denavit-Hartenberg table and the link masses of a Universal Robots
/// UR10.
pub(crate) fn arm(base_kind: BaseKind) -> Manipulator {
    let table = [
        (0.1273, 0.0, FRAC_PI_2, 7.778),
        (0.0, -0.612, 0.0, 12.93),
        (0.0, -0.5723, 0.0, 3.87),
        (0.163941, 0.0, FRAC_PI_2, 1.96),
        (0.1157, 0.0, -FRAC_PI_2, 1.96),
        (0.0922, 0.0, 0.0, 0.202),
    ];
    let solid = |mass_kg: f64, center_of_mass, square_m2: f64| {
        let inertia = Matrix3::identity() * (mass_kg * square_m2);
        InertialParameters::from(MassProperties {
            mass_kg,
            center_of_mass,
            inertia,
        })
    };
    let link = |(k, (d, a, alpha, mass_kg)): (usize, (f64, f64, f64, f64))| DhLink {
        joint: format!("joint_{k}"),
        link: if k + 1 == JOINTS {
            TOOL.into()
        } else {
            format!("link_{k}")
        },
        kind: JointKind::Revolute,
        theta: 0.0,
        d,
        a,
        alpha,
        parameters: solid(
            mass_kg,
            Vector3::new(-0.5 * a, 0.0, 0.0),
            0.01 + a * a / 12.0,
        ),
    };
    Manipulator::from_dh(&DhRobot {
        base_kind,
        base: "base".into(),
        base_parameters: solid(80.0, Vector3::zeros(), 0.1),
        base_from_table: Isometry3::identity(),
        links: table.into_iter().enumerate().map(link).collect(),
    })
    .unwrap()
}

/// Returns a body in the tool frame. Its inertia about the centre of mass is that of a rotated
/// cuboid.
pub(crate) fn body(mass_kg: f64, center_of_mass: [f64; 3], size_m: [f64; 3]) -> MassProperties {
    let [x, y, z] = size_m.map(|size| size * size / 12.0);
    let moments = Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y));
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.2)).to_rotation_matrix();
    MassProperties {
        mass_kg,
        center_of_mass: center_of_mass.into(),
        inertia: mass_kg * (turn * moments * turn.transpose()),
    }
}

/// The payloads of a run in order, each with the time from which it is held, s.
pub(crate) type Payloads = Vec<(f64, MassProperties)>;

/// Base, payloads and motion of one simulation, without noise.
#[derive(Clone)]
pub(crate) struct Run {
    pub(crate) base: BaseKind,
    pub(crate) rate_hz: f64,
    pub(crate) payloads: Payloads,
    pub(crate) duration_s: f64,
    /// Begin and end of a gap without samples, s.
    pub(crate) gap_s: Option<(f64, f64)>,
    /// Seed of the frequencies, amplitudes and phases of the joints.
    pub(crate) motion_seed: u64,
}

/// Exact state of base and joints, and wrench on the payload, at one time of a run.
pub(crate) struct Instant {
    pub(crate) time_s: f64,
    pub(crate) base: BaseState,
    /// Positions, velocities and accelerations, rad, rad/s and rad/s².
    pub(crate) joints: [[f64; JOINTS]; 3],
    pub(crate) wrench: Wrench,
}

/// The sines of one joint: amplitude of the acceleration, rad/s², angular frequency, rad/s, and
/// phase, rad.
pub(crate) type Sines = [[f64; 3]; 2];

impl Instant {
    pub(crate) fn sample<'a>(&'a self, wrenches: &'a [Wrench]) -> Sample<'a> {
        Sample {
            time_s: self.time_s,
            base: self.base,
            joint_position: &self.joints[0],
            joint_velocity: &self.joints[1],
            joint_effort: &[],
            wrenches,
        }
    }
}

impl Run {
    /// Returns the index of the payload that is held at a time.
    pub(crate) fn held_at(&self, time_s: f64) -> usize {
        let held = self
            .payloads
            .iter()
            .rposition(|(from_s, _)| time_s >= *from_s);
        held.unwrap()
    }

    pub(crate) fn is_in_gap(&self, time_s: f64) -> bool {
        self.gap_s
            .is_some_and(|(from_s, to_s)| (from_s..to_s).contains(&time_s))
    }

    /// Returns a smooth motion of all joints, within 1.3 rad/s and 1.6 rad/s².
    pub(crate) fn sines(&self) -> [Sines; JOINTS] {
        let mut random = SmallRng::seed_from_u64(self.motion_seed);
        std::array::from_fn(|_| {
            std::array::from_fn(|_| {
                [
                    random.random_range(0.1..0.8),
                    TAU * random.random_range(0.2..0.7),
                    random.random_range(0.0..TAU),
                ]
            })
        })
    }

    pub(crate) fn instants(&self) -> Vec<Instant> {
        let robot = arm(self.base);
        let tool = robot.frame(TOOL).unwrap();
        let gravity = match self.base {
            // The defaults of the identifier.
            BaseKind::Fixed => Vector3::new(0.0, 0.0, -9.81),
            BaseKind::Floating => Vector3::zeros(),
        };
        let sines = self.sines();
        let step_s = self.rate_hz.recip();
        let holding = self.payloads.iter().map(|(_, payload)| {
            Workspace::new(&robot.with_payload(tool, &InertialParameters::from(*payload)))
        });
        let mut workspaces: Vec<Workspace> = holding.collect();
        let mut base = FrameMotion::at_rest(Isometry3::identity());
        let count = (self.duration_s * self.rate_hz).round() as usize;
        let mut instants = Vec::with_capacity(count);
        for k in 0..count {
            let time_s = k as f64 * step_s;
            let held = self.held_at(time_s);
            let workspace = &mut workspaces[held];
            move_base(workspace, &mut base, &joints_at(&sines, time_s));
            let motion = workspace.frame_motion(tool).in_frame(&gravity);
            let payload = InertialParameters::from(self.payloads[held].1);
            let wrench = wrench_regressor(&motion) * payload.as_vector();
            instants.push(Instant {
                time_s,
                base: BaseState {
                    pose: base.pose,
                    velocity: base.velocity,
                    angular_velocity: base.angular_velocity,
                    acceleration: None,
                    angular_acceleration: None,
                },
                joints: joints_at(&sines, time_s),
                wrench: Wrench {
                    force: wrench.fixed_rows::<3>(0).into(),
                    moment: wrench.fixed_rows::<3>(3).into(),
                },
            });
            if self.base == BaseKind::Floating {
                base = runge_kutta(&base, step_s, |at, fraction| {
                    move_base(
                        workspace,
                        at,
                        &joints_at(&sines, time_s + fraction * step_s),
                    );
                });
            }
        }
        instants
    }
}

/// Returns positions, velocities and accelerations of the joints.
pub(crate) fn joints_at(sines: &[Sines; JOINTS], time_s: f64) -> [[f64; JOINTS]; 3] {
    let posture = [0.0, -1.2, 1.6, -0.4, FRAC_PI_2, 0.0];
    let mut joints = [posture, [0.0; JOINTS], [0.0; JOINTS]];
    for (joint, sines) in sines.iter().enumerate() {
        for [amplitude, w, phase] in sines {
            let (sin, cos) = (w * time_s + phase).sin_cos();
            joints[0][joint] -= amplitude / (w * w) * sin;
            joints[1][joint] -= amplitude / w * cos;
            joints[2][joint] += amplitude * sin;
        }
    }
    joints
}

/// Computes the motion of all bodies in the workspace, and the accelerations of a floating base in
/// `base`.
pub(crate) fn move_base(
    workspace: &mut Workspace,
    base: &mut FrameMotion,
    joints: &[[f64; JOINTS]; 3],
) {
    let joints = JointMotion {
        position: &joints[0],
        velocity: &joints[1],
        acceleration: &joints[2],
    };
    if workspace.robot().base_kind() == BaseKind::Floating {
        let found = base_acceleration(workspace, base, joints).unwrap();
        (base.acceleration, base.angular_acceleration) = (found.linear, found.angular);
    } else {
        motion(workspace, base, joints).unwrap();
    }
}
