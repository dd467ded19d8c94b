//! An arm that holds still: gravity determines the mass, and the noise of the joints determines
//! nothing.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{BatchIdentifier, BatchResult, BatchSettings};
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, Manipulator, Workspace, Wrench, motion,
    wrench_regressor,
};
use tactid_identify::{BaseState, EquationSettings, HALF_WIDTH_95, Identifier, Sample};

use crate::arm;

/// An arm that holds a payload in one posture.
struct Still {
    robot: Manipulator,
    tool: &'static str,
    /// Positions of the joints, rad.
    posture: Vec<f64>,
    mass_kg: f64,
    rate_hz: f64,
    duration_s: f64,
    noise: Noise,
}

/// Standard deviations of white noise on every sample.
#[derive(Clone, Copy, Debug)]
struct Noise {
    /// Noise of joint positions, rad, and of joint velocities, rad/s.
    joints: [f64; 2],
    /// Noise of the force, N, and of the moment, N m.
    wrench: [f64; 2],
}

/// An arm of four joints whose tool is beside the axis of the last one. Wrenches need no masses.
const FOUR_JOINTS: &str = "<robot name='arm'><link name='link_0'/><link name='link_1'/>\
    <link name='link_2'/><link name='link_3'/><link name='link_4'/><link name='tool'/>\
    <joint name='joint_1' type='continuous'><parent link='link_0'/><child link='link_1'/>\
    <origin xyz='0 0 0.13'/><axis xyz='0 0 1'/></joint>\
    <joint name='joint_2' type='continuous'><parent link='link_1'/><child link='link_2'/>\
    <origin xyz='0 0.1 0'/><axis xyz='0 1 0'/></joint>\
    <joint name='joint_3' type='continuous'><parent link='link_2'/><child link='link_3'/>\
    <origin xyz='0.6 0 0'/><axis xyz='0 1 0'/></joint>\
    <joint name='joint_4' type='continuous'><parent link='link_3'/><child link='link_4'/>\
    <origin xyz='0.5 0 0.1'/><axis xyz='1 0 0'/></joint>\
    <joint name='mount' type='fixed'><parent link='link_4'/><child link='tool'/>\
    <origin xyz='0.05 0 0.15' rpy='0.2 0.3 0.1'/></joint></robot>";

impl Still {
    /// Returns an arm like a UR10 with 2 kg, at 500 Hz.
    fn six_joints(random: &mut SmallRng, duration_s: f64, noise: Noise) -> Self {
        Self {
            robot: arm::arm(BaseKind::Fixed),
            tool: arm::TOOL,
            posture: random_posture(random, arm::JOINTS),
            mass_kg: 2.0,
            rate_hz: 500.0,
            duration_s,
            noise,
        }
    }

    /// Returns an arm of four joints with 2 kg, at 500 Hz.
    fn four_joints(random: &mut SmallRng, duration_s: f64, noise: Noise) -> Self {
        Self {
            robot: Manipulator::from_urdf(FOUR_JOINTS, BaseKind::Fixed).unwrap(),
            tool: "tool",
            posture: random_posture(random, 4),
            ..Self::six_joints(random, duration_s, noise)
        }
    }

    /// Calls a function with each sample.
    fn record(&self, random: &mut SmallRng, mut push: impl FnMut(&Sample<'_>)) {
        let joints = self.posture.len();
        let mut workspace = Workspace::new(&self.robot);
        let base = FrameMotion::at_rest(Isometry3::identity());
        let zeros = vec![0.0; joints];
        let still = JointMotion {
            position: &self.posture,
            velocity: &zeros,
            acceleration: &zeros,
        };
        motion(&mut workspace, &base, still).unwrap();
        let tool = self.robot.frame(self.tool).unwrap();
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        let regressor = wrench_regressor(&workspace.frame_motion(tool).in_frame(&gravity));
        let payload = arm::body(self.mass_kg, [0.02, 0.01, 0.08], [0.1; 3]);
        let load = regressor * InertialParameters::from(payload).as_vector();
        for k in 0..(self.duration_s * self.rate_hz) as usize {
            let mut noisy = |exact: &[f64], std_dev: f64| -> Vec<f64> {
                let exact = exact.iter();
                exact.map(|value| value + draw(random, std_dev)).collect()
            };
            let position = noisy(&self.posture, self.noise.joints[0]);
            let velocity = noisy(&zeros, self.noise.joints[1]);
            let force = noisy(&load.as_slice()[..3], self.noise.wrench[0]);
            let moment = noisy(&load.as_slice()[3..], self.noise.wrench[1]);
            push(&Sample {
                time_s: k as f64 / self.rate_hz,
                base: BaseState::fixed(),
                joint_position: &position,
                joint_velocity: &velocity,
                joint_effort: &[],
                wrenches: &[Wrench {
                    force: Vector3::from_column_slice(&force),
                    moment: Vector3::from_column_slice(&moment),
                }],
            });
        }
    }

    fn batch(&self) -> BatchIdentifier {
        let (equations, settings) = (EquationSettings::default(), BatchSettings::default());
        BatchIdentifier::new(&self.robot, self.tool, &[self.tool], equations, settings).unwrap()
    }

    fn online(&self) -> Identifier {
        let settings = EquationSettings::default();
        Identifier::new(&self.robot, self.tool, &[self.tool], &settings).unwrap()
    }
}

fn draw(random: &mut SmallRng, std_dev: f64) -> f64 {
    let normal: f64 = random.sample(StandardNormal);
    std_dev * normal
}

fn random_posture(random: &mut SmallRng, joints: usize) -> Vec<f64> {
    let position = |_| random.random_range(-1.5..1.5);
    (0..joints).map(position).collect()
}

/// Identifies a payload in a random posture from a recording.
fn identify(seed: u64, duration_s: f64, joints: [f64; 2]) -> BatchResult {
    let mut random = SmallRng::seed_from_u64(seed);
    let wrench = [0.05, 0.005];
    let still = Still::six_joints(&mut random, duration_s, Noise { joints, wrench });
    let mut batch = still.batch();
    still.record(&mut random, |sample| {
        batch.push(sample).unwrap();
    });
    batch.solve().unwrap()
}

/// Noise of the joints, from rounding to that of a coarse encoder, leaves the mass as gravity shows
/// it, and contradicts nothing.
#[test]
fn noise_of_the_joints_does_not_move_the_mass() {
    let fine = [
        [0.0, 0.0],
        [0.0, 1e-13],
        [1e-9, 1e-9],
        [1e-6, 1e-6],
        [1e-5, 1e-3],
    ];
    for duration_s in [2.0, 10.0] {
        for noise in fine {
            check(noise, duration_s, 1e-3);
        }
    }
    check([1e-4, 1e-2], 10.0, 3e-3);
}

/// Asserts that the mass of ten postures is within its interval, of no more than this half width in
/// kg, without any finding.
fn check(noise: [f64; 2], duration_s: f64, widest_kg: f64) {
    for seed in 0..10 {
        let result = identify(seed, duration_s, noise);
        let about = format!("{noise:?}, {duration_s} s, {seed}: {result:?}");
        let mass_kg = result.estimate.values()[0];
        let half_width = HALF_WIDTH_95 * result.estimate.std_devs[0];
        assert!((mass_kg - 2.0).abs() < 2.0 * half_width, "{about}");
        assert!(half_width < widest_kg, "{about}");
        assert!(result.findings.is_empty(), "{about}");
    }
}

/// What the same samples show of the mass online and from their recording.
struct Comparison {
    /// Errors of the mass at the end, online and of the recording, in standard deviations of the
    /// recording.
    errors: [f64; 2],
    /// Root mean square error online, in the same unit. The error of a sample counts as what it
    /// would be at the end: errors shrink with the root of time.
    online_rms: f64,
    /// Largest change between two samples, in standard deviations.
    largest_change: f64,
    /// How often the mass entered or left the gate of 20 g about the true one.
    gate_changes: u32,
}

/// Identifies the payload online and from a recording. Changes count from 2 s on.
fn compare(still: &Still, random: &mut SmallRng) -> Comparison {
    let (mut online, mut batch) = (still.online(), still.batch());
    let (mut squares, mut count) = (0.0, 0.0);
    let (mut largest_change, mut gate_changes) = (0.0f64, 0);
    let mut before: Option<[f64; 2]> = None;
    still.record(random, |sample| {
        online.push(sample).unwrap();
        batch.push(sample).unwrap();
        if sample.time_s < 2.0 {
            return;
        }
        let estimate = online.estimate();
        let [mass_kg, std_dev] = [estimate.body.mass_kg, estimate.std_devs[0]];
        let is_near = |mass_kg: f64| (mass_kg - still.mass_kg).abs() < 0.02;
        if let Some([mass_before_kg, std_dev_before]) = before {
            let change = (mass_kg - mass_before_kg).abs() / std_dev.max(std_dev_before);
            largest_change = largest_change.max(change);
            gate_changes += u32::from(is_near(mass_kg) != is_near(mass_before_kg));
        }
        before = Some([mass_kg, std_dev]);
        squares += (mass_kg - still.mass_kg).powi(2) * sample.time_s / still.duration_s;
        count += 1.0;
    });
    online.finish();
    assert_eq!(online.estimate().payload_changes, 0);
    let recorded = batch.solve().unwrap().estimate;
    let unit = recorded.std_devs[0];
    let error = |mass_kg: f64| (mass_kg - still.mass_kg) / unit;
    Comparison {
        errors: [online.estimate(), recorded].map(|estimate| error(estimate.body.mass_kg)),
        online_rms: (squares / count).sqrt() / unit,
        largest_change,
        gate_changes,
    }
}

/// Online the mass of an arm that holds still is as good as from a recording, and no sample moves
/// it by more than its standard deviation, for any noise, rate, posture and arm.
#[test]
fn the_mass_is_steady_online() {
    let [fine, usual, coarse] = [[1e-6, 1e-5], [2e-5, 1e-3], [1e-4, 1e-2]];
    let [precise, ordinary] = [[0.03, 0.002], [0.3, 0.02]];
    let noises = [
        ([0.0, 0.0], ordinary),
        (fine, ordinary),
        (usual, ordinary),
        (usual, precise),
        (coarse, ordinary),
    ];
    // Of the errors at the end, online and of the recording, and of those on the way.
    let mut squares = [0.0; 3];
    for seed in 0..8 {
        for rate_hz in [125.0, 500.0, 1000.0] {
            for (joints, wrench) in noises {
                let mut random = SmallRng::seed_from_u64(seed);
                let noise = Noise { joints, wrench };
                let still = match seed {
                    0..2 => Still::four_joints(&mut random, 10.0, noise),
                    _ => Still::six_joints(&mut random, 10.0, noise),
                };
                // Gravity along an axis of the tool, and at the same angle to two of them.
                let posture = match seed {
                    2 => vec![0.0; arm::JOINTS],
                    3 => vec![0.0, -FRAC_PI_2, FRAC_PI_2, 0.0, FRAC_PI_4, 0.0],
                    _ => still.posture.clone(),
                };
                let still = Still {
                    rate_hz,
                    mass_kg: 3.2,
                    posture,
                    ..still
                };
                let found = compare(&still, &mut random);
                let about = format!("{noise:?}, {rate_hz} Hz, {seed}");
                let change = found.largest_change;
                assert!(change < 1.0, "{about}: {change}");
                assert_eq!(found.gate_changes, 0, "{about}");
                let [online, recorded] = found.errors;
                squares[0] += online * online;
                squares[1] += recorded * recorded;
                squares[2] += found.online_rms.powi(2);
            }
        }
    }
    assert!(squares[0] < 4.0 * squares[1], "{squares:?}");
    assert!(squares[2] < 4.0 * squares[1], "{squares:?}");
}
