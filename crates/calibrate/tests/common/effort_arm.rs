//! Simulated arms of four and six joints: efforts have gains, friction, load-dependent friction and
//! noise.

#![allow(dead_code, reason = "each test file uses its own part")]

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Matrix3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::{Distribution, StandardNormal};
use tactid_calibrate::{
    CalibrationResult, CalibrationSettings, EffortRecorder, EffortRecording, KnownPayload,
    calibrate,
};
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, Manipulator, MassProperties, Workspace,
    forces, motion, symmetric_entries, wrench_regressor,
};
use tactid_identify::{BaseState, Sample};

pub(crate) const JOINTS: usize = 4;
pub(crate) const TOOL: &str = "tool";
pub(crate) const RATE_HZ: f64 = 125.0;
const NOISE: f64 = 0.01;

/// What an arm of `N` joints is built like.
struct Design<const N: usize> {
    /// Origin and axis of each joint, and mass, kg, and centre of mass of the link that it moves.
    joints: [(&'static str, &'static str, f64, &'static str); N],
    /// Pose of the tool on the last link.
    mount: &'static str,
    /// Typical friction of each joint, N m and N m s/rad.
    friction: [f64; N],
    /// Middle of the motion of each joint, rad.
    middle: [f64; N],
}

const FOUR_AXES: Design<JOINTS> = Design {
    joints: [
        ("0 0 0.13", "0 0 1", 7.8, "0 0 0.02"),
        ("0 0.1 0", "0 1 0", 13.0, "0.25 0 0.05"),
        ("0.6 0 0", "0 1 0", 4.0, "0.2 0 0.02"),
        ("0.5 0 0.1", "1 0 0", 2.0, "0.05 0.02 0.01"),
    ],
    // The tool is beside the axis of the last joint, which would else feel little of a payload.
    mount: "xyz='0.05 0 0.15' rpy='0.2 0.3 0.1'",
    friction: [12.0, 12.0, 8.0, 3.0],
    middle: [0.0, -1.0, 1.0, 0.0],
};

/// An arm like a UR10.
const SIX_AXES: Design<6> = Design {
    joints: [
        ("0 0 0.13", "0 0 1", 7.8, "0 0 0.02"),
        ("0 0.18 0", "0 1 0", 12.9, "0.3 0 0.05"),
        ("0.61 -0.14 0", "0 1 0", 3.9, "0.25 0 0.02"),
        ("0.57 0 0", "0 1 0", 2.0, "0 0.05 0"),
        ("0 0.115 0", "0 0 1", 2.0, "0 0 0.05"),
        ("0 0 0.115", "0 1 0", 0.4, "0 0.03 0"),
    ],
    mount: "xyz='0 0.09 0' rpy='-1.57 0 0'",
    friction: [12.0, 12.0, 8.0, 3.0, 2.0, 1.5],
    middle: [0.0, -1.0, 1.2, 0.3, 1.0, 0.0],
};

impl<const N: usize> Design<N> {
    /// Returns the arm with the mass and inertia of each link multiplied by a factor.
    fn arm(&self, factors: &[f64; N], base: BaseKind) -> Manipulator {
        let mut urdf = String::from("<robot name='arm'><link name='link_0'/>");
        for (k, ((origin, axis, mass, center), factor)) in
            self.joints.iter().zip(factors).enumerate()
        {
            let (mass, inertia) = (mass * factor, 0.02 * mass * factor);
            let (parent, child) = (k, k + 1);
            urdf += &format!(
                "<link name='link_{child}'><inertial><origin xyz='{center}'/><mass value='{mass}'/>\
                 <inertia ixx='{inertia}' ixy='0' ixz='0' iyy='{inertia}' iyz='0' izz='{inertia}'/></inertial></link>\
                 <joint name='joint_{child}' type='continuous'><parent link='link_{parent}'/><child link='link_{child}'/>\
                 <origin xyz='{origin}'/><axis xyz='{axis}'/></joint>"
            );
        }
        let mount = self.mount;
        urdf += &format!(
            "<link name='tool'/><joint name='mount' type='fixed'><parent link='link_{N}'/><child link='tool'/>\
             <origin {mount}/></joint></robot>"
        );
        Manipulator::from_urdf(&urdf, base).unwrap()
    }
}

/// Returns the arm of four joints with the mass and inertia of each link multiplied by a factor.
pub(crate) fn arm(factors: &[f64; JOINTS], base: BaseKind) -> Manipulator {
    FOUR_AXES.arm(factors, base)
}

/// Returns the arm of four joints as its description says.
pub(crate) fn described() -> Manipulator {
    arm(&[1.0; JOINTS], BaseKind::Fixed)
}

/// The true arm.
#[derive(Clone)]
pub(crate) struct World<const N: usize = JOINTS> {
    pub(crate) random: SmallRng,
    robot: Manipulator,
    /// The arm as its description says.
    pub(crate) described: Manipulator,
    /// Middle of the motion of each joint, rad.
    middle: [f64; N],
    /// Torque over measured effort.
    pub(crate) gains: [f64; N],
    efficiencies: [f64; N],
    coulomb: [f64; N],
    viscous: [f64; N],
    /// Scale of the motion of each joint; 0 for one that stands still.
    pub(crate) motion: [f64; N],
    /// Velocity that is added to each joint, rad/s.
    pub(crate) drift: [f64; N],
    /// Time by which efforts lag the motion, s.
    pub(crate) delay_s: f64,
}

impl World {
    /// Draws an arm of four joints with gains 5 to 20 % off, efficiencies of 0.85 to 0.95,
    /// friction, and links 10 % off.
    pub(crate) fn new(seed: u64) -> Self {
        Self::of(&FOUR_AXES, seed)
    }
}

impl World<6> {
    /// Draws an arm of six joints as [`World::new`] does.
    pub(crate) fn six_axes(seed: u64) -> Self {
        Self::of(&SIX_AXES, seed)
    }
}

impl<const N: usize> World<N> {
    fn of(design: &Design<N>, seed: u64) -> Self {
        let mut random = SmallRng::seed_from_u64(seed);
        let factors = [(); N].map(|()| random.random_range(0.9..1.1));
        let gain = |random: &mut SmallRng| {
            let off: f64 = random.random_range(0.05..0.2);
            if random.random_bool(0.5) {
                1.0 + off
            } else {
                1.0 - off
            }
        };
        let friction = design.friction;
        Self {
            robot: design.arm(&factors, BaseKind::Fixed),
            described: design.arm(&[1.0; N], BaseKind::Fixed),
            middle: design.middle,
            gains: [(); N].map(|()| gain(&mut random)),
            efficiencies: [(); N].map(|()| random.random_range(0.85..0.95)),
            coulomb: friction.map(|f| f * random.random_range(0.7..1.3)),
            viscous: friction.map(|f| f * random.random_range(0.7..1.3)),
            motion: [1.0; N],
            drift: [0.0; N],
            delay_s: 0.0,
            random,
        }
    }

    /// Multiplies Coulomb and viscous friction of all joints by a factor.
    pub(crate) fn scale_friction(&mut self, factor: f64) {
        for friction in self.coulomb.iter_mut().chain(&mut self.viscous) {
            *friction *= factor;
        }
    }

    /// Returns the exact motion of a random Fourier series at 125 Hz, up to 0.5 Hz, and that at
    /// times which are earlier by the delay.
    fn trajectory(&mut self, duration_s: f64) -> [Vec<[[f64; N]; 3]>; 2] {
        let count = (duration_s * RATE_HZ) as usize;
        let mut both = [0.0, self.delay_s].map(|delay_s| (delay_s, vec![[[0.0; N]; 3]; count]));
        for joint in 0..N {
            let mut waves: [(f64, f64); 5] = [(0.0, 0.0); 5];
            for (k, wave) in waves.iter_mut().enumerate() {
                let amplitude = self.random.random_range(0.3..1.0) / (k + 1) as f64;
                *wave = (amplitude, self.random.random_range(0.0..TAU));
            }
            let velocity = |t: f64| -> f64 {
                let each = waves.iter().enumerate();
                each.map(|(k, (amplitude, phase))| {
                    let rate = TAU * 0.1 * (k + 1) as f64;
                    amplitude * rate * (rate * t + phase).cos()
                })
                .sum()
            };
            let times = (0..count).map(|k| k as f64 / RATE_HZ);
            let fastest = times.map(|t| velocity(t).abs()).fold(0.0, f64::max);
            let scale = self.motion[joint] * self.random.random_range(0.7..1.2) / fastest;
            let all = both.iter_mut().flat_map(|(delay_s, states)| {
                let states = states.iter_mut().enumerate();
                states.map(|(k, state)| (k as f64 / RATE_HZ - *delay_s, state))
            });
            for (t, state) in all {
                for (k, (amplitude, phase)) in waves.iter().enumerate() {
                    let rate = TAU * 0.1 * (k + 1) as f64;
                    let (sin, cos) = (rate * t + phase).sin_cos();
                    state[0][joint] += scale * amplitude * sin;
                    state[1][joint] += scale * amplitude * rate * cos;
                    state[2][joint] -= scale * amplitude * rate * rate * sin;
                }
                state[0][joint] += self.middle[joint] + self.drift[joint] * t;
                state[1][joint] += self.drift[joint];
            }
        }
        both.map(|(_, states)| states)
    }

    /// Returns measured efforts of a motion: torques of arm and payload, friction, and gains.
    fn efforts(&self, states: &[[[f64; N]; 3]], held: Option<&MassProperties>) -> Vec<[f64; N]> {
        let gravity = BaseKind::Fixed.default_gravity();
        let mut workspace = Workspace::new(&self.robot);
        let tool = self.robot.frame(TOOL).unwrap();
        let base = FrameMotion::at_rest(Isometry3::identity());
        let load = held.map_or(InertialParameters::zero(), |body| (*body).into());
        let of_state = |[position, velocity, acceleration]: &[[f64; N]; 3]| {
            let joints = JointMotion {
                position,
                velocity,
                acceleration,
            };
            motion(&mut workspace, &base, joints).unwrap();
            forces(&mut workspace, &gravity);
            let mut jacobian = vec![nalgebra::Vector6::zeros(); N];
            workspace.jacobian(tool, &mut jacobian).unwrap();
            let in_tool = workspace.frame_motion(tool).in_frame(&gravity);
            let wrench = wrench_regressor(&in_tool) * load.as_vector();
            let torques = workspace.joint_torques().unwrap();
            std::array::from_fn(|joint| {
                let torque = torques[joint] + jacobian[joint].dot(&wrench);
                let sign = velocity[joint].signum();
                let friction = self.coulomb[joint] * sign + self.viscous[joint] * velocity[joint];
                let lost = (1.0 - self.efficiencies[joint]) * torque.abs() * sign;
                (torque + lost + friction) / self.gains[joint]
            })
        };
        states.iter().map(of_state).collect()
    }

    /// Adds white noise of 1 % of each channel's standard deviation.
    fn add_noise<'a>(&mut self, channel: impl Iterator<Item = &'a mut f64>) {
        let mut values: Vec<&mut f64> = channel.collect();
        let count = values.len() as f64;
        let mean = values.iter().map(|value| **value).sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (**value - mean).powi(2)).sum();
        let std_dev = NOISE * (squares / count).sqrt();
        for value in &mut values {
            let noise: f64 = StandardNormal.sample(&mut self.random);
            **value += std_dev * noise;
        }
    }

    /// Returns measured positions, velocities and efforts of a random motion.
    pub(crate) fn measure(
        &mut self,
        held: Option<&MassProperties>,
        duration_s: f64,
    ) -> Vec<[[f64; N]; 3]> {
        let [mut states, earlier] = self.trajectory(duration_s);
        let efforts = self.efforts(&earlier, held);
        for (state, effort) in states.iter_mut().zip(efforts) {
            state[2] = effort;
        }
        for joint in 0..N {
            for kind in 0..3 {
                self.add_noise(states.iter_mut().map(|state| &mut state[kind][joint]));
            }
        }
        states
    }
}

/// Returns a recording of a random motion, with the arm as described.
pub(crate) fn record<const N: usize>(
    world: &mut World<N>,
    held: Option<&MassProperties>,
    duration_s: f64,
) -> EffortRecording {
    let measured = world.measure(held, duration_s);
    recorded(&world.described, &measured, &CalibrationSettings::default())
}

/// Returns the recording of measured positions, velocities and efforts.
pub(crate) fn recorded<const N: usize>(
    robot: &Manipulator,
    measured: &[[[f64; N]; 3]],
    settings: &CalibrationSettings,
) -> EffortRecording {
    let mut recorder = EffortRecorder::new(robot, TOOL, settings).unwrap();
    for (k, [position, velocity, effort]) in measured.iter().enumerate() {
        let sample = Sample {
            time_s: k as f64 / RATE_HZ,
            base: BaseState::fixed(),
            joint_position: position,
            joint_velocity: velocity,
            joint_effort: effort,
            wrenches: &[],
        };
        recorder.push(&sample).unwrap();
    }
    recorder.finish().unwrap()
}

/// Returns a random body of so many kg, some 12 cm off the tool frame's origin.
pub(crate) fn payload<const N: usize>(mass_kg: f64, world: &mut World<N>) -> MassProperties {
    let mut vector =
        |low: f64, high: f64| Vector3::from_fn(|_, _| world.random.random_range(low..high));
    let size = vector(0.03, 0.1);
    let squares = size.component_mul(&size);
    let turn = Rotation3::from_scaled_axis(vector(-2.0, 2.0));
    let moments = Matrix3::from_diagonal(&(Vector3::repeat(squares.sum()) - squares));
    MassProperties {
        mass_kg,
        center_of_mass: vector(-0.12, 0.12),
        inertia: mass_kg * (turn * moments * turn.inverse()),
    }
}

/// Returns the ten values of a body.
pub(crate) fn values(body: &MassProperties) -> [f64; 10] {
    let c = &body.center_of_mass;
    let [xx, xy, xz, yy, yz, zz] = symmetric_entries(&body.inertia);
    [body.mass_kg, c.x, c.y, c.z, xx, xy, xz, yy, yz, zz]
}

/// Settings of a calibration with gains known to 20 %.
pub(crate) fn uncertain_gains() -> CalibrationSettings {
    CalibrationSettings {
        gain_std_dev: 0.2,
        ..CalibrationSettings::default()
    }
}

/// Calibrates an arm with unknown gains by a recording without payload, and one with a payload of
/// known mass, each of a duration, s.
pub(crate) fn calibrated<const N: usize>(
    world: &mut World<N>,
    duration_s: f64,
) -> CalibrationResult {
    let weight = payload(2.805, world);
    let unloaded = record(world, None, duration_s);
    let loaded = record(world, Some(&weight), duration_s);
    let known = KnownPayload::of_mass(2.805, 0.001);
    let recordings = [(unloaded, None), (loaded, Some(known))];
    calibrate(&recordings, &uncertain_gains()).unwrap()
}
