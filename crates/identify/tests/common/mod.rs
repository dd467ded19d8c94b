//! An experiment on the project's own robot without a physics engine: the equations of motion are
//! integrated with steps so small that the samples are exact.

#![allow(dead_code, reason = "no test file uses all of it")]

pub(crate) mod integration;

use std::f64::consts::{FRAC_PI_2, TAU};

use self::integration::runge_kutta;
use nalgebra::{Isometry3, Matrix3, Vector3};
use rand::{RngExt, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, Manipulator, MassProperties, Workspace,
    Wrench, base_acceleration, forces, motion, wrench_regressor,
};
use tactid_identify::{
    BaseState, EquationSettings, Identifier, PayloadEstimate, Sample, values_of_body,
};

pub(crate) const TOOL: &str = "tool0";
pub(crate) const SENSORS: [&str; 2] = ["finger_left_link", "finger_right_link"];
pub(crate) const URDF: &str = include_str!("../../../sim/robots/tactid.urdf");

/// A posture at which joints 3, 5 and 6 rotate the tool about all three axes, rad.
pub(crate) const IDENTIFIABLE: [f64; 6] = [0.0, -1.2, 1.6, -0.4, FRAC_PI_2, 0.0];
/// The posture of the paper's Table 1, rad: joints 3 and 6 are parallel.
pub(crate) const TABLE_1: [f64; 6] = [0.0; 6];

pub(crate) fn payload() -> MassProperties {
    MassProperties {
        mass_kg: 100.0,
        center_of_mass: Vector3::new(0.5, 0.0, 0.0),
        inertia: Matrix3::from_diagonal(&Vector3::new(10.0, 20.0, 10.0)),
    }
}

/// One recorded instant.
#[derive(Clone)]
pub(crate) struct Instant {
    pub(crate) time_s: f64,
    pub(crate) base: BaseState,
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    /// Torques of the motors, N m, or forces, N.
    pub(crate) effort: Vec<f64>,
    pub(crate) wrenches: Vec<Wrench>,
}

impl Instant {
    pub(crate) fn sample(&self) -> Sample<'_> {
        Sample {
            time_s: self.time_s,
            base: self.base,
            joint_position: &self.position,
            joint_velocity: &self.velocity,
            joint_effort: &self.effort,
            wrenches: &self.wrenches,
        }
    }

    /// The state of the base as C has it: position, orientation x, y, z, w, velocity, angular
    /// velocity.
    pub(crate) fn base_numbers(&self) -> Vec<f64> {
        let (pose, base) = (&self.base.pose, &self.base);
        let pose = pose
            .translation
            .vector
            .iter()
            .chain(pose.rotation.coords.iter());
        let velocities = base.velocity.iter().chain(&base.angular_velocity);
        pose.chain(velocities).copied().collect()
    }

    /// The wrenches of the sensors as C has them: of each the force, then the moment.
    pub(crate) fn wrench_numbers(&self) -> Vec<f64> {
        let each = self.wrenches.iter();
        each.flat_map(|wrench| wrench.force.iter().chain(&wrench.moment).copied())
            .collect()
    }
}

/// Standard deviations of white noise on every sample.
#[derive(Clone, Copy)]
pub(crate) struct Noise {
    /// Noise of joint positions, rad, and of joint velocities, rad/s.
    pub(crate) joints: [f64; 2],
    /// Noise of the base's linear and angular velocity, m/s and rad/s.
    pub(crate) base: [f64; 2],
    /// Noise of each finger's force and moment, N and N m.
    pub(crate) wrench: [f64; 2],
    /// Noise of efforts, N m or N.
    pub(crate) effort: f64,
}

impl Noise {
    /// Noise that is a fraction of the amplitude of each channel in the experiment.
    pub(crate) fn fraction(fraction: f64) -> Self {
        Self {
            joints: [0.3 * fraction, 0.5 * fraction],
            base: [0.3 * fraction, 0.3 * fraction],
            wrench: [300.0 * fraction, 30.0 * fraction],
            effort: 0.0,
        }
    }

    pub(crate) fn on(&self, instant: &Instant, random: &mut SmallRng) -> Instant {
        let mut draw = |std_dev: f64| -> f64 {
            let normal: f64 = random.sample(StandardNormal);
            std_dev * normal
        };
        let mut noisy = instant.clone();
        for k in 0..noisy.position.len() {
            noisy.position[k] += draw(self.joints[0]);
            noisy.velocity[k] += draw(self.joints[1]);
        }
        noisy.base.velocity += Vector3::from_fn(|_, _| draw(self.base[0]));
        noisy.base.angular_velocity += Vector3::from_fn(|_, _| draw(self.base[1]));
        for wrench in &mut noisy.wrenches {
            wrench.force += Vector3::from_fn(|_, _| draw(self.wrench[0]));
            wrench.moment += Vector3::from_fn(|_, _| draw(self.wrench[1]));
        }
        // Exact efforts draw nothing, so that the noise of the others is the same with and without
        // them.
        if self.effort > 0.0 {
            noisy
                .effort
                .iter_mut()
                .for_each(|effort| *effort += draw(self.effort));
        }
        noisy
    }
}

pub(crate) struct Experiment {
    pub(crate) urdf: String,
    pub(crate) base: BaseKind,
    pub(crate) gravity: Vector3<f64>,
    pub(crate) posture: [f64; 6],
    /// Numbers of the arm joints that move, counted from one.
    pub(crate) moving: Vec<usize>,
    /// Whether the joints move one after another, as in the paper, instead of all at once.
    pub(crate) in_sequence: bool,
    pub(crate) duration_s: f64,
    pub(crate) step_s: f64,
    /// Time of a payload change, s, and the payload after it.
    pub(crate) swap: Option<(f64, MassProperties)>,
}

impl Default for Experiment {
    fn default() -> Self {
        Self {
            urdf: URDF.to_owned(),
            base: BaseKind::Floating,
            gravity: Vector3::zeros(),
            posture: IDENTIFIABLE,
            moving: vec![1, 2, 3, 4, 5, 6],
            in_sequence: false,
            duration_s: 5.0,
            step_s: 1e-3,
            swap: None,
        }
    }
}

impl Experiment {
    fn payload_at(&self, t: f64) -> InertialParameters {
        let swapped = self.swap.filter(|(swap_s, _)| t >= *swap_s);
        InertialParameters::from(swapped.map_or_else(payload, |(_, other)| other))
    }

    pub(crate) fn robot(&self) -> Manipulator {
        Manipulator::from_urdf(&self.urdf, self.base).unwrap()
    }

    /// Returns position, velocity and acceleration of all joints, including those of the fingers.
    fn joints(&self, t: f64) -> [Vec<f64>; 3] {
        let mut joints = [vec![0.0; 8], vec![0.0; 8], vec![0.0; 8]];
        joints[0][..6].copy_from_slice(&self.posture);
        for (k, &joint) in self.moving.iter().enumerate() {
            // Different frequencies make the joints' accelerations independent. In sequence, each
            // joint makes whole swings of 5 s, which end where they begin.
            let swing_s = self.duration_s / self.moving.len() as f64;
            let turn = (t / swing_s).floor() as usize;
            if self.in_sequence && turn != k {
                continue;
            }
            let w = TAU
                * if self.in_sequence {
                    0.2
                } else {
                    0.2 + 0.07 * k as f64
                };
            let t = if self.in_sequence {
                t - turn as f64 * swing_s
            } else {
                t
            };
            joints[0][joint - 1] += (1.0 - (w * t).cos()) / (w * w);
            joints[1][joint - 1] = (w * t).sin() / w;
            joints[2][joint - 1] = (w * t).cos();
        }
        joints
    }

    pub(crate) fn run(&self) -> Vec<Instant> {
        let robot = self.robot();
        let tool = robot.frame(TOOL).unwrap();
        let whole = robot.with_payload(tool, &self.payload_at(0.0));
        let mut workspace = Workspace::new(&whole);
        let mut base = FrameMotion::at_rest(Isometry3::identity());
        let count = (self.duration_s / self.step_s).round() as usize;
        let mut instants = Vec::with_capacity(count);
        for k in 0..=count {
            let t = k as f64 * self.step_s;
            let [position, velocity, acceleration] = self.joints(t);
            if self.swap.is_some() {
                let whole = robot.with_payload(tool, &self.payload_at(t));
                workspace = Workspace::new(&whole);
            }
            if self.base == BaseKind::Floating {
                self.accelerate(&mut workspace, &mut base, t);
            } else {
                let joints = JointMotion {
                    position: &position,
                    velocity: &velocity,
                    acceleration: &acceleration,
                };
                motion(&mut workspace, &base, joints).unwrap();
            }
            forces(&mut workspace, &self.gravity);
            instants.push(Instant {
                time_s: t,
                base: BaseState {
                    pose: base.pose,
                    velocity: base.velocity,
                    angular_velocity: base.angular_velocity,
                    acceleration: None,
                    angular_acceleration: None,
                },
                effort: workspace.joint_torques().unwrap().to_vec(),
                wrenches: self.finger_wrenches(&workspace, t),
                position,
                velocity,
            });
            if self.base == BaseKind::Floating {
                let step_s = self.step_s;
                base = runge_kutta(&base, step_s, |at, fraction| {
                    self.accelerate(&mut workspace, at, t + fraction * step_s);
                });
            }
        }
        instants
    }

    /// Returns the wrench of each finger on the payload, in the finger's frame: a given one of the
    /// left finger, and the rest of the right one.
    fn finger_wrenches(&self, workspace: &Workspace, t: f64) -> Vec<Wrench> {
        let robot = workspace.robot();
        let tool = robot.frame(TOOL).unwrap();
        let motion = workspace.frame_motion(tool).in_frame(&self.gravity);
        let both = wrench_regressor(&motion) * self.payload_at(t).as_vector();
        let both = Wrench {
            force: both.fixed_rows::<3>(0).into(),
            moment: both.fixed_rows::<3>(3).into(),
        };
        let left = Wrench {
            force: Vector3::new(30.0, -1500.0, 7.0),
            moment: Vector3::new(1.0, -2.0, 3.0),
        };
        let in_finger = |wrench: Wrench, sensor: &str| {
            let finger = workspace.pose(robot.frame(sensor).unwrap());
            wrench.expressed_in(&(finger.inverse() * workspace.pose(tool)))
        };
        vec![
            in_finger(left, SENSORS[0]),
            in_finger(both - left, SENSORS[1]),
        ]
    }

    /// Computes the base's accelerations and the motion of all bodies in the workspace.
    fn accelerate(&self, workspace: &mut Workspace, base: &mut FrameMotion, t: f64) {
        let [position, velocity, acceleration] = self.joints(t);
        let joints = JointMotion {
            position: &position,
            velocity: &velocity,
            acceleration: &acceleration,
        };
        let found = base_acceleration(workspace, base, joints).unwrap();
        (base.acceleration, base.angular_acceleration) = (found.linear, found.angular);
    }
}

pub(crate) fn identifier(experiment: &Experiment, settings: &EquationSettings) -> Identifier {
    Identifier::new(&experiment.robot(), TOOL, &SENSORS, settings).unwrap()
}

/// Checks that each value lies within four standard deviations of that of the [`payload`].
pub(crate) fn assert_holds_truth(estimate: &PayloadEstimate, seed: u64) {
    let values = estimate
        .values()
        .into_iter()
        .zip(values_of_body(&payload()));
    for ((value, truth), std_dev) in values.zip(estimate.std_devs) {
        let error = (value - truth).abs();
        assert!(error < 4.0 * std_dev, "{seed}: {value} {truth} {std_dev}");
    }
}

/// Returns the error of each value in percent of its nominal value, or of the largest of its kind
/// where that is zero.
pub(crate) fn errors_percent(body: &MassProperties) -> [f64; 10] {
    let truth = payload();
    let (a, i) = (
        body.center_of_mass - truth.center_of_mass,
        body.inertia - truth.inertia,
    );
    [
        (body.mass_kg - 100.0) / 100.0,
        a.x / 0.5,
        a.y / 0.5,
        a.z / 0.5,
        i[(0, 0)] / 10.0,
        i[(0, 1)] / 20.0,
        i[(0, 2)] / 20.0,
        i[(1, 1)] / 20.0,
        i[(1, 2)] / 20.0,
        i[(2, 2)] / 10.0,
    ]
    .map(|relative| 100.0 * relative)
}

pub(crate) fn worst_percent(body: &MassProperties) -> f64 {
    errors_percent(body)
        .into_iter()
        .fold(0.0, |worst, error| worst.max(error.abs()))
}
