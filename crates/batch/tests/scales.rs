//! One problem in other units of mass, length and time: every relative result is the same to 1e-9.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Isometry3, Matrix3, Vector3, Vector6};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{BatchIdentifier, BatchSettings};
use tactid_dynamics::{
    BaseKind, DhLink, DhRobot, FrameMotion, InertialParameters, JointKind, JointMotion,
    Manipulator, MassProperties, Workspace, Wrench, forces, motion, wrench_regressor,
};
use tactid_identify::{
    BaseState, EquationSettings, Identifier, Method, PayloadEstimate, PushOutcome, Sample,
};

const JOINTS: usize = 6;
const TOOL: &str = "link_5";

/// Sample rate where the unit of time is a second, Hz: a power of two, whose stamps are exact.
const RATE_HZ: f64 = 512.0;

/// Units in which the problem is stated.
#[derive(Clone, Copy, Debug)]
struct Units {
    mass_kg: f64,
    length_m: f64,
    time_s: f64,
    /// Stamp of the first sample, s.
    start_s: f64,
}

const SI: Units = Units {
    mass_kg: 1.0,
    length_m: 1.0,
    time_s: 1.0,
    start_s: 0.0,
};

impl Units {
    fn acceleration(&self) -> f64 {
        self.length_m / (self.time_s * self.time_s)
    }

    fn force(&self) -> f64 {
        self.mass_kg * self.acceleration()
    }

    fn moment(&self) -> f64 {
        self.force() * self.length_m
    }

    /// Returns the units of the ten values of an estimate.
    fn of_values(&self) -> [f64; 10] {
        std::array::from_fn(|k| match k {
            0 => self.mass_kg,
            1..=3 => self.length_m,
            _ => self.mass_kg * self.length_m * self.length_m,
        })
    }

    /// Returns gravity, in m/s².
    fn gravity(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -9.81) * self.acceleration()
    }

    /// Returns a body whose mass, centre of mass and squared size are given in these units.
    fn body(&self, mass: f64, center: [f64; 3], square: f64) -> InertialParameters {
        let shape = Matrix3::new(1.0, 0.1, 0.0, 0.1, 1.3, 0.2, 0.0, 0.2, 0.8);
        InertialParameters::from(MassProperties {
            mass_kg: mass * self.mass_kg,
            center_of_mass: Vector3::from(center) * self.length_m,
            inertia: shape * (mass * square * self.of_values()[9]),
        })
    }

    /// Returns a serial arm on a fixed base.
    fn arm(&self) -> Manipulator {
        let table = [
            (0.1273, 0.0, FRAC_PI_2, 7.778),
            (0.0, -0.612, 0.0, 12.93),
            (0.0, -0.5723, 0.0, 3.87),
            (0.163941, 0.0, FRAC_PI_2, 1.96),
            (0.1157, 0.0, -FRAC_PI_2, 1.96),
            (0.0922, 0.0, 0.0, 0.202),
        ];
        let link = |(k, (d, a, alpha, mass)): (usize, (f64, f64, f64, f64))| DhLink {
            joint: format!("joint_{k}"),
            link: format!("link_{k}"),
            kind: JointKind::Revolute,
            theta: 0.0,
            d: d * self.length_m,
            a: a * self.length_m,
            alpha,
            parameters: self.body(mass, [-0.5 * a, 0.0, 0.0], 0.02),
        };
        Manipulator::from_dh(&DhRobot {
            base_kind: BaseKind::Fixed,
            base: "base".into(),
            base_parameters: self.body(80.0, [0.0; 3], 0.1),
            base_from_table: Isometry3::identity(),
            links: table.into_iter().enumerate().map(link).collect(),
        })
        .unwrap()
    }

    /// Returns the settings for a cutoff of 10 over the unit of time.
    fn settings(&self, method: Method, wrench_offset: bool) -> EquationSettings {
        EquationSettings {
            method,
            wrench_offset,
            gravity: Some(self.gravity()),
            cutoff_hz: 10.0 / self.time_s,
            max_gap_s: 0.1 * self.time_s,
            ..EquationSettings::default()
        }
    }

    /// Returns a measurement in units of the problem in SI units.
    fn of(&self, instant: &Instant) -> Instant {
        Instant {
            time_s: self.start_s + instant.time_s * self.time_s,
            position: instant.position,
            velocity: instant.velocity.map(|rate| rate / self.time_s),
            effort: instant.effort.map(|effort| effort * self.moment()),
            wrench: Wrench {
                force: instant.wrench.force * self.force(),
                moment: instant.wrench.moment * self.moment(),
            },
        }
    }
}

/// What is measured at one time.
#[derive(Clone, Copy)]
struct Instant {
    time_s: f64,
    position: [f64; JOINTS],
    velocity: [f64; JOINTS],
    effort: [f64; JOINTS],
    wrench: Wrench,
}

/// A problem in SI units.
#[derive(Clone, Copy, Debug)]
struct Problem {
    /// Number of joints that move, beginning at the tool. With few, some directions are
    /// unobservable.
    moving: usize,
    /// Time at rest before the motion, s.
    rest_s: f64,
    /// Time of a payload change, s.
    swap_s: f64,
    /// Noise, as a fraction of a typical measurement.
    noise: f64,
    wrench_offset: bool,
    method: Method,
}

const PROBLEM: Problem = Problem {
    moving: JOINTS,
    rest_s: 0.0,
    swap_s: f64::INFINITY,
    noise: 0.003,
    wrench_offset: false,
    method: Method::Tactile,
};

impl Problem {
    /// Returns position, velocity and acceleration of the joints.
    fn joints(&self, time_s: f64) -> [[f64; JOINTS]; 3] {
        let posture = [0.0, -1.2, 1.6, -0.4, FRAC_PI_2, 0.3];
        let mut joints = [posture, [0.0; JOINTS], [0.0; JOINTS]];
        let moving_s = (time_s - self.rest_s).max(0.0);
        let [position, velocity, acceleration] = &mut joints;
        let all = position.iter_mut().zip(velocity).zip(acceleration);
        for (k, ((position, velocity), acceleration)) in all.enumerate().skip(JOINTS - self.moving)
        {
            let w = TAU * (0.3 + 0.11 * k as f64);
            let (sin, cos) = (w * moving_s).sin_cos();
            *position += 0.6 * (1.0 - cos);
            *velocity = 0.6 * w * sin;
            *acceleration = 0.6 * w * w * cos;
        }
        joints
    }

    /// Returns the noisy measurements of 6 s.
    fn instants(&self) -> Vec<Instant> {
        let mut random = SmallRng::seed_from_u64(16);
        let robot = SI.arm();
        let tool = robot.frame(TOOL).unwrap();
        let mut workspace = Workspace::new(&robot);
        let base = FrameMotion::at_rest(Isometry3::identity());
        let payloads = [
            SI.body(3.0, [0.05, -0.02, 0.08], 0.01),
            SI.body(1.0, [-0.03, 0.04, 0.12], 0.02),
        ];
        let of_time = |k: usize| {
            let time_s = k as f64 / RATE_HZ;
            let [position, velocity, acceleration] = self.joints(time_s);
            let joints = JointMotion {
                position: &position,
                velocity: &velocity,
                acceleration: &acceleration,
            };
            motion(&mut workspace, &base, joints).unwrap();
            forces(&mut workspace, &SI.gravity());
            let mut jacobian = vec![Vector6::zeros(); JOINTS];
            workspace.jacobian(tool, &mut jacobian).unwrap();
            let in_tool = workspace.frame_motion(tool).in_frame(&SI.gravity());
            let payload = &payloads[usize::from(time_s >= self.swap_s)];
            let wrench = wrench_regressor(&in_tool) * payload.as_vector();
            let torques = workspace.joint_torques().unwrap();
            let mut noise = |size: f64| {
                let normal: f64 = random.sample(StandardNormal);
                size * self.noise * normal
            };
            Instant {
                time_s,
                position: position.map(|angle| angle + noise(0.1)),
                velocity: velocity.map(|rate| rate + noise(1.0)),
                effort: std::array::from_fn(|k| {
                    torques[k] + jacobian[k].dot(&wrench) + noise(10.0)
                }),
                wrench: Wrench {
                    force: wrench.fixed_rows::<3>(0) + Vector3::from_fn(|_, _| noise(30.0)),
                    moment: wrench.fixed_rows::<3>(3) + Vector3::from_fn(|_, _| noise(3.0)),
                },
            }
        };
        (0..6 * RATE_HZ as usize).map(of_time).collect()
    }

    /// Returns relative results of the online identifier after each payload change, at some times
    /// and at the end, and those of the batch identifier.
    fn results(&self, instants: &[Instant], units: &Units) -> Vec<Relative> {
        let robot = units.arm();
        let settings = units.settings(self.method, self.wrench_offset);
        let sensors: &[&str] = if self.method == Method::Effort {
            &[]
        } else {
            &[TOOL]
        };
        let mut online = Identifier::new(&robot, TOOL, sensors, &settings).unwrap();
        let batch_settings = BatchSettings::default();
        let mut batch =
            BatchIdentifier::new(&robot, TOOL, sensors, settings, batch_settings).unwrap();
        let mut results = Vec::new();
        for (k, instant) in instants.iter().enumerate() {
            let scaled = units.of(instant);
            let sample = Sample {
                time_s: scaled.time_s,
                base: BaseState::fixed(),
                joint_position: &scaled.position,
                joint_velocity: &scaled.velocity,
                joint_effort: &scaled.effort,
                wrenches: &[scaled.wrench][..sensors.len()],
            };
            batch.push(&sample).unwrap();
            let outcome = online.push(&sample).unwrap();
            if k % 100 == 99 || outcome == PushOutcome::PayloadChanged {
                let name = format!("online after {k}");
                results.push(Relative::new(name, units, &online.estimate()));
            }
        }
        online.finish();
        results.push(Relative::new("online".into(), units, &online.estimate()));
        let solved = batch.solve().unwrap();
        results.push(Relative::new("batch".into(), units, &solved.estimate));
        results
    }
}

/// An estimate in units of its problem.
#[derive(Debug)]
struct Relative {
    name: String,
    values: [f64; 10],
    std_devs: [f64; 10],
    estimate: PayloadEstimate,
}

impl Relative {
    fn new(name: String, units: &Units, estimate: &PayloadEstimate) -> Self {
        let of_values = units.of_values();
        let (values, std_devs) = (estimate.values(), estimate.std_devs);
        Self {
            name,
            values: std::array::from_fn(|k| values[k] / of_values[k]),
            std_devs: std::array::from_fn(|k| std_devs[k] / of_values[k]),
            estimate: estimate.clone(),
        }
    }

    /// Asserts that a result differs by less than 1e-9 of the largest value of its kind, and of its
    /// standard deviation.
    fn assert_equal(&self, other: &Self, context: &str) {
        let context = format!("{context}, {}: {self:?} {other:?}", self.name);
        let (own, others) = (&self.estimate, &other.estimate);
        assert_eq!(own.observability, others.observability, "{context}");
        assert_eq!(own.payload_changes, others.payload_changes, "{context}");
        assert_eq!(own.windows, others.windows, "{context}");
        for kind in [0..1, 1..4, 4..10] {
            let largest = self.values[kind.clone()]
                .iter()
                .fold(0.0, |a, b| f64::max(a, b.abs()));
            for k in kind {
                let difference = (self.values[k] - other.values[k]).abs();
                assert!(difference <= 1e-9 * largest, "value {k}, {context}");
                let (a, b) = (self.std_devs[k], other.std_devs[k]);
                assert!(
                    a == b || (a - b).abs() <= 1e-9 * a,
                    "std_dev {k}, {context}"
                );
            }
        }
    }
}

/// Asserts that the results of a problem are the same in other units.
fn assert_scale_free(problem: &Problem, others: &[Units]) {
    let instants = problem.instants();
    let expected = problem.results(&instants, &SI);
    for units in others {
        let found = problem.results(&instants, units);
        assert_eq!(found.len(), expected.len());
        for (expected, found) in expected.iter().zip(&found) {
            expected.assert_equal(found, &format!("{problem:?} {units:?}"));
        }
    }
}

/// Returns SI units with other ones of mass, length and time.
fn units(mass_kg: f64, length_m: f64, time_s: f64) -> Units {
    Units {
        mass_kg,
        length_m,
        time_s,
        start_s: 0.0,
    }
}

/// Units of mass, length and time through nine orders of magnitude, each alone. They are powers of
/// two, so that measurements in them have the same digits: a result that differs has an absolute
/// threshold or start behind it.
fn binary_units() -> Vec<Units> {
    let powers = [-15, -7, 8, 15].map(|exponent| 2f64.powi(exponent));
    let alone = powers.map(|scale| {
        [
            units(scale, 1.0, 1.0),
            units(1.0, scale, 1.0),
            units(1.0, 1.0, scale),
        ]
    });
    alone.into_iter().flatten().collect()
}

/// Payloads of 1 g and 1000 t with lever arms from 1 mm to 100 m, at sample rates from 10 Hz to 20
/// kHz. The measurements have other digits than those in SI units.
fn decimal_units() -> Vec<Units> {
    let mut all = Vec::new();
    for mass_kg in [1e-3 / 3.0, 1e6 / 3.0] {
        for length_m in [1e-2, 1e3] {
            for rate_hz in [10.0, 20e3] {
                all.push(units(mass_kg, length_m, RATE_HZ / rate_hz));
            }
        }
    }
    all
}

#[test]
fn wrenches() {
    assert_scale_free(&PROBLEM, &binary_units());
    assert_scale_free(&PROBLEM, &decimal_units());
}

#[test]
fn efforts() {
    let problem = Problem {
        method: Method::Effort,
        noise: 0.001,
        ..PROBLEM
    };
    assert_scale_free(&problem, &binary_units());
    assert_scale_free(&problem, &decimal_units());
}

/// A motion of two joints leaves directions unobservable, and so does the rest before it.
#[test]
fn unobservable_directions() {
    for moving in [0, 1, 2] {
        let problem = Problem {
            moving,
            rest_s: 1.0,
            ..PROBLEM
        };
        assert_scale_free(&problem, &binary_units());
    }
}

#[test]
fn payload_changes_and_offsets() {
    let problem = Problem {
        swap_s: 3.0,
        ..PROBLEM
    };
    assert_scale_free(&problem, &binary_units());
    let problem = Problem {
        wrench_offset: true,
        ..problem
    };
    assert_scale_free(&problem, &binary_units());
}

/// Stamps since 1970 are multiples of 2.4e-7 s. Those of this problem are, so that only the
/// arithmetic could differ.
#[test]
fn stamps_since_1970() {
    let since_1970 = |time_s: f64| Units {
        start_s: 1.7e9,
        ..units(1.0, 1.0, time_s)
    };
    // Sample rates of 8 Hz, 512 Hz and 16 384 Hz.
    let all = [64.0, 1.0, 1.0 / 32.0].map(since_1970);
    assert_scale_free(&PROBLEM, &all);
}
