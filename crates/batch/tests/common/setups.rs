//! Arms of several makers with what they hold, and recordings of their motions with noise on the
//! wrist sensor.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Isometry3, Matrix3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use tactid_batch::{BatchIdentifier, BatchResult, BatchSettings};
use tactid_dynamics::{
    BaseKind, DhLink, DhRobot, FrameMotion, InertialParameters, JointKind, JointMotion,
    Manipulator, MassProperties, Workspace, Wrench, motion, wrench_regressor,
};
use tactid_identify::{BaseState, EquationSettings, Sample};

use crate::faults::Draws;

const TOOL: &str = "flange";

/// Gravity, m/s².
pub(crate) const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// An arm, what it holds, and how it is recorded.
#[derive(Clone, Copy)]
pub(crate) struct Setup {
    /// Denavit-Hartenberg table: d, m, a, m, and alpha, rad, of each joint.
    pub(crate) table: &'static [(f64, f64, f64)],
    /// Positions about which the joints move, rad.
    pub(crate) posture: &'static [f64],
    /// Mass of the payload, kg.
    pub(crate) mass_kg: f64,
    /// Centre of mass of the payload in the flange, m.
    pub(crate) center_of_mass: [f64; 3],
    /// Edges of the payload, m.
    pub(crate) size_m: [f64; 3],
    /// Number of samples a second, Hz.
    pub(crate) rate_hz: f64,
    pub(crate) duration_s: f64,
    /// Speed of the motion relative to one within 1.3 rad/s.
    pub(crate) speed: f64,
    /// Standard deviations of white noise on force, N, and moment, N m.
    pub(crate) noise: [f64; 2],
}

/// A UR10 with a payload of 2.1 kg.
pub(crate) static UR10: Setup = Setup {
    table: &[
        (0.1273, 0.0, FRAC_PI_2),
        (0.0, -0.612, 0.0),
        (0.0, -0.5723, 0.0),
        (0.163941, 0.0, FRAC_PI_2),
        (0.1157, 0.0, -FRAC_PI_2),
        (0.0922, 0.0, 0.0),
    ],
    posture: &[0.0, -1.2, 1.6, -0.4, FRAC_PI_2, 0.0],
    mass_kg: 2.1,
    center_of_mass: [0.03, -0.02, 0.08],
    size_m: [0.2, 0.12, 0.16],
    rate_hz: 200.0,
    duration_s: 10.0,
    speed: 2.0,
    noise: [0.1, 0.007],
};

/// Arms with the kinematics of a Panda, a Kinova Gen3, an xArm 6, an iiwa and a UR5e.
pub(crate) static OTHERS: [Setup; 5] = [
    Setup {
        table: &[
            (0.333, 0.0, -FRAC_PI_2),
            (0.0, 0.0, FRAC_PI_2),
            (0.316, 0.0825, FRAC_PI_2),
            (0.0, -0.0825, -FRAC_PI_2),
            (0.384, 0.0, FRAC_PI_2),
            (0.0, 0.088, FRAC_PI_2),
            (0.107, 0.0, 0.0),
        ],
        posture: &[0.0, -0.6, 0.2, -1.9, 0.3, 1.6, 0.8],
        mass_kg: 1.2,
        center_of_mass: [-0.01, 0.02, 0.11],
        size_m: [0.08, 0.15, 0.2],
        rate_hz: 500.0,
        duration_s: 8.0,
        speed: 1.5,
        noise: [0.05, 0.004],
    },
    Setup {
        table: &[
            (-0.2848, 0.0, FRAC_PI_2),
            (-0.0118, 0.0, FRAC_PI_2),
            (-0.4208, 0.0, FRAC_PI_2),
            (-0.0128, 0.0, FRAC_PI_2),
            (-0.3143, 0.0, FRAC_PI_2),
            (0.0, 0.0, FRAC_PI_2),
            (-0.1674, 0.0, PI),
        ],
        posture: &[0.1, 0.4, 3.0, -1.8, 0.2, -0.9, 1.5],
        mass_kg: 0.8,
        center_of_mass: [0.0, 0.03, 0.06],
        size_m: [0.1, 0.1, 0.12],
        rate_hz: 100.0,
        duration_s: 15.0,
        speed: 2.0,
        noise: [0.08, 0.003],
    },
    Setup {
        table: &[
            (0.267, 0.0, -FRAC_PI_2),
            (0.0, 0.2895, 0.0),
            (0.0, 0.0775, -FRAC_PI_2),
            (0.3425, 0.0, FRAC_PI_2),
            (0.0, 0.076, -FRAC_PI_2),
            (0.097, 0.0, 0.0),
        ],
        posture: &[0.0, -1.4, 1.1, 0.3, 1.2, -0.2],
        mass_kg: 3.4,
        center_of_mass: [0.02, 0.0, 0.05],
        size_m: [0.12, 0.2, 0.1],
        rate_hz: 250.0,
        duration_s: 12.0,
        speed: 1.6,
        noise: [0.15, 0.006],
    },
    Setup {
        table: &[
            (0.34, 0.0, -FRAC_PI_2),
            (0.0, 0.0, FRAC_PI_2),
            (0.4, 0.0, FRAC_PI_2),
            (0.0, 0.0, -FRAC_PI_2),
            (0.4, 0.0, -FRAC_PI_2),
            (0.0, 0.0, FRAC_PI_2),
            (0.126, 0.0, 0.0),
        ],
        posture: &[0.2, 0.6, 0.0, -1.3, 0.4, 1.0, 0.0],
        mass_kg: 6.5,
        center_of_mass: [0.06, -0.05, 0.15],
        size_m: [0.3, 0.15, 0.25],
        rate_hz: 200.0,
        duration_s: 20.0,
        speed: 1.4,
        noise: [0.3, 0.02],
    },
    Setup {
        table: &[
            (0.1625, 0.0, FRAC_PI_2),
            (0.0, -0.425, 0.0),
            (0.0, -0.3922, 0.0),
            (0.1333, 0.0, FRAC_PI_2),
            (0.0997, 0.0, -FRAC_PI_2),
            (0.0996, 0.0, 0.0),
        ],
        posture: &[0.5, -1.5, 1.7, -1.2, -FRAC_PI_2, 0.4],
        mass_kg: 1.0,
        center_of_mass: [0.0, 0.0, 0.12],
        size_m: [0.08, 0.08, 0.24],
        rate_hz: 125.0,
        duration_s: 10.0,
        speed: 1.8,
        noise: [0.2, 0.01],
    },
];

impl Setup {
    pub(crate) fn payload(&self) -> MassProperties {
        crate::arm::body(self.mass_kg, self.center_of_mass, self.size_m)
    }

    /// The arm. Its links have some mass, of which a wrist sensor measures nothing.
    fn robot(&self) -> Manipulator {
        let link = |(k, (d, a, alpha)): (usize, &(f64, f64, f64))| DhLink {
            joint: format!("joint_{k}"),
            link: if k + 1 == self.table.len() {
                TOOL.into()
            } else {
                format!("link_{k}")
            },
            kind: JointKind::Revolute,
            theta: 0.0,
            d: *d,
            a: *a,
            alpha: *alpha,
            parameters: InertialParameters::from(MassProperties {
                mass_kg: 1.0,
                center_of_mass: Vector3::zeros(),
                inertia: Matrix3::identity() * 0.01,
            }),
        };
        Manipulator::from_dh(&DhRobot {
            base_kind: BaseKind::Fixed,
            base: "base".into(),
            base_parameters: InertialParameters::from(self.payload()),
            base_from_table: Isometry3::identity(),
            links: self.table.iter().enumerate().map(link).collect(),
        })
        .unwrap()
    }

    /// Returns positions, velocities and accelerations of the joints at a time.
    fn joints_at(&self, sines: &[[[f64; 3]; 2]], time_s: f64) -> [Vec<f64>; 3] {
        let still = vec![0.0; self.table.len()];
        let mut joints = [self.posture.to_vec(), still.clone(), still];
        for (joint, sines) in sines.iter().enumerate() {
            for [amplitude, w, phase] in sines {
                let (sin, cos) = (w * self.speed * time_s + phase).sin_cos();
                joints[0][joint] -= amplitude / (w * w) * sin;
                joints[1][joint] -= self.speed * (amplitude / w * cos);
                joints[2][joint] += self.speed * self.speed * (amplitude * sin);
            }
        }
        joints
    }

    /// Returns a recording of a random motion, without a fault.
    pub(crate) fn recorded(&self, seed: u64) -> Recording {
        self.recorded_with(seed, |_| 1.0)
    }

    /// Returns a recording of a random motion in which each joint moves by a factor less.
    pub(crate) fn recorded_with(&self, seed: u64, factor: impl Fn(usize) -> f64) -> Recording {
        let robot = self.robot();
        let tool = robot.frame(TOOL).unwrap();
        let mut workspace = Workspace::new(&robot);
        let mut draws = Draws::new(seed);
        let mut of_motion = SmallRng::seed_from_u64(seed);
        let mut sine = || {
            [
                of_motion.random_range(0.1..0.8),
                TAU * of_motion.random_range(0.2..0.7),
                of_motion.random_range(0.0..TAU),
            ]
        };
        let mut sines: Vec<_> = self.table.iter().map(|_| [sine(), sine()]).collect();
        for (joint, sines) in sines.iter_mut().enumerate() {
            sines.iter_mut().for_each(|sine| sine[0] *= factor(joint));
        }
        let base = FrameMotion::at_rest(Isometry3::identity());
        let parameters = InertialParameters::from(self.payload());
        let count = (self.duration_s * self.rate_hz).round() as u32;
        let times_s: Vec<f64> = (0..count).map(|k| f64::from(k) / self.rate_hz).collect();
        let (mut joints, mut wrenches) = (Vec::new(), Vec::new());
        for time_s in &times_s {
            let [position, velocity, acceleration] = self.joints_at(&sines, *time_s);
            let exact = JointMotion {
                position: &position,
                velocity: &velocity,
                acceleration: &acceleration,
            };
            motion(&mut workspace, &base, exact).unwrap();
            let tool_motion = workspace.tool_motion(tool, &DOWN);
            let wrench = wrench_regressor(&tool_motion) * parameters.as_vector();
            joints.push([position, velocity]);
            wrenches.push(Wrench {
                force: wrench.fixed_rows::<3>(0) + draws.vector() * self.noise[0],
                moment: wrench.fixed_rows::<3>(3) + draws.vector() * self.noise[1],
            });
        }
        Recording {
            setup: *self,
            robot,
            times_s,
            joints,
            wrenches,
        }
    }
}

/// What an arm recorded.
pub(crate) struct Recording {
    pub(crate) setup: Setup,
    robot: Manipulator,
    times_s: Vec<f64>,
    /// Positions, rad, and velocities, rad/s, of each sample.
    pub(crate) joints: Vec<[Vec<f64>; 2]>,
    /// Wrenches in the flange, N and N m.
    pub(crate) wrenches: Vec<Wrench>,
}

impl Recording {
    /// Returns a vector of the world in the tool frame at all samples.
    pub(crate) fn in_tool(&self, vector: Vector3<f64>) -> Vec<Vector3<f64>> {
        let tool = self.robot.frame(TOOL).unwrap();
        let mut workspace = Workspace::new(&self.robot);
        let base = FrameMotion::at_rest(Isometry3::identity());
        let still = vec![0.0; self.setup.table.len()];
        let at = |joints: &[Vec<f64>; 2]| {
            let joints = JointMotion {
                position: &joints[0],
                velocity: &joints[1],
                acceleration: &still,
            };
            motion(&mut workspace, &base, joints).unwrap();
            workspace.vector_in_frame(tool, &vector)
        };
        self.joints.iter().map(at).collect()
    }

    /// Identifies the payload.
    pub(crate) fn identify(&self, settings: BatchSettings) -> BatchResult {
        self.identify_with(EquationSettings::default(), settings)
    }

    /// Identifies the payload with settings of the equations.
    pub(crate) fn identify_with(
        &self,
        equations: EquationSettings,
        settings: BatchSettings,
    ) -> BatchResult {
        let identifier = BatchIdentifier::new(&self.robot, TOOL, &[TOOL], equations, settings);
        let mut identifier = identifier.unwrap();
        for (k, &time_s) in self.times_s.iter().enumerate() {
            let sample = Sample {
                time_s,
                base: BaseState::fixed(),
                joint_position: &self.joints[k][0],
                joint_velocity: &self.joints[k][1],
                joint_effort: &[],
                wrenches: &self.wrenches[k..=k],
            };
            identifier.push(&sample).unwrap();
        }
        identifier.solve().unwrap()
    }
}
