//! Honesty of the online estimate: whenever a value is reported as known, its error is within six of
//! its standard deviations, also in the first second, after a gap and after changes of the payload.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::{
    BaseKind, DhLink, DhRobot, FrameMotion, InertialParameters, JointKind, JointMotion,
    Manipulator, MassProperties, Workspace, Wrench, base_acceleration, motion, wrench_regressor,
};
use tactid_identify::{BaseState, Identifier, PayloadEstimate, Pushed, Sample, Settings};

const TOOL: &str = "flange";
const JOINTS: usize = 6;

/// A serial arm with the Denavit-Hartenberg table and the link masses of a Universal Robots UR10.
fn arm(base_kind: BaseKind) -> Manipulator {
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

/// A body in the tool frame; its inertia about the centre of mass is that of a rotated cuboid.
fn body(mass_kg: f64, center_of_mass: [f64; 3], size_m: [f64; 3]) -> MassProperties {
    let [x, y, z] = size_m.map(|size| size * size / 12.0);
    let moments = Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y));
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.2)).to_rotation_matrix();
    MassProperties {
        mass_kg,
        center_of_mass: center_of_mass.into(),
        inertia: mass_kg * (turn * moments * turn.transpose()),
    }
}

/// The payloads of a run: the first one, and those that replace it, each with its time in s.
type Payloads = Vec<(f64, MassProperties)>;

/// A run of a simulated arm, with exact dynamics and white noise on the measured wrench.
#[derive(Clone)]
struct Run {
    base: BaseKind,
    rate_hz: f64,
    payloads: Payloads,
    duration_s: f64,
    /// No samples are delivered in this interval of time, s.
    gap_s: Option<(f64, f64)>,
    /// Selects frequencies, amplitudes and phases of the joints.
    motion_seed: u64,
}

/// One exact instant of a run.
struct Instant {
    time_s: f64,
    base: BaseState,
    joints: [[f64; JOINTS]; 3],
    wrench: Wrench,
}

/// The sines of one joint: amplitude of the acceleration in rad/s², angular frequency, phase.
type Sines = [[f64; 3]; 2];

impl Instant {
    fn sample<'a>(&'a self, wrenches: &'a [Wrench]) -> Sample<'a> {
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
    /// The index of the payload that is held at this time.
    fn held_at(&self, time_s: f64) -> usize {
        let held = self
            .payloads
            .iter()
            .rposition(|(from_s, _)| time_s >= *from_s);
        held.unwrap()
    }

    fn is_in_gap(&self, time_s: f64) -> bool {
        self.gap_s
            .is_some_and(|(from_s, to_s)| (from_s..to_s).contains(&time_s))
    }

    /// Smooth motion of all joints, within 1.3 rad/s and 1.6 rad/s².
    fn sines(&self) -> [Sines; JOINTS] {
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

    fn instants(&self) -> Vec<Instant> {
        let robot = arm(self.base);
        let tool = robot.frame(TOOL).unwrap();
        let gravity = match self.base {
            // As the identifier assumes.
            BaseKind::Fixed => Vector3::new(0.0, 0.0, -9.81),
            BaseKind::Floating => Vector3::zeros(),
        };
        let sines = self.sines();
        let step_s = self.rate_hz.recip();
        let mut whole: Vec<Manipulator> = Vec::new();
        for (_, payload) in &self.payloads {
            whole.push(robot.with_payload(tool, &InertialParameters::from(*payload)));
        }
        let mut workspace = Workspace::new(&robot);
        let mut base = FrameMotion::at_rest(Isometry3::identity());
        let count = (self.duration_s * self.rate_hz).round() as usize;
        let mut instants = Vec::with_capacity(count);
        for k in 0..count {
            let time_s = k as f64 * step_s;
            let held = self.held_at(time_s);
            let holding = &whole[held];
            move_base(
                holding,
                &mut workspace,
                &mut base,
                &joints_at(&sines, time_s),
            );
            let motion = workspace.frame_motion(holding, tool).in_frame(&gravity);
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
                base = runge_kutta(
                    holding,
                    &mut workspace,
                    &base,
                    |part| joints_at(&sines, time_s + part * step_s),
                    step_s,
                );
            }
        }
        instants
    }
}

/// Position, velocity and acceleration of the joints.
fn joints_at(sines: &[Sines; JOINTS], time_s: f64) -> [[f64; JOINTS]; 3] {
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

/// Leaves the motion of all bodies in the workspace, and the accelerations of a floating base in `base`.
fn move_base(
    robot: &Manipulator,
    workspace: &mut Workspace,
    base: &mut FrameMotion,
    joints: &[[f64; JOINTS]; 3],
) {
    let joints = JointMotion {
        position: &joints[0],
        velocity: &joints[1],
        acceleration: &joints[2],
    };
    if robot.base_kind() == BaseKind::Floating {
        let found = base_acceleration(robot, workspace, base, joints).unwrap();
        (base.acceleration, base.angular_acceleration) = (found.linear, found.angular);
    } else {
        motion(robot, workspace, base, joints).unwrap();
    }
}

fn runge_kutta(
    robot: &Manipulator,
    workspace: &mut Workspace,
    start: &FrameMotion,
    joints: impl Fn(f64) -> [[f64; JOINTS]; 3],
    step_s: f64,
) -> FrameMotion {
    let mut slopes: Vec<FrameMotion> = Vec::with_capacity(4);
    for part in [0.0, 0.5, 0.5, 1.0] {
        let mut at = slopes
            .last()
            .map_or(*start, |slope| advance(start, slope, part * step_s));
        move_base(robot, workspace, &mut at, &joints(part));
        slopes.push(at);
    }
    let mean = |f: &dyn Fn(&FrameMotion) -> Vector3<f64>| {
        (f(&slopes[0]) + (f(&slopes[1]) + f(&slopes[2])) * 2.0 + f(&slopes[3])) / 6.0
    };
    let slope = FrameMotion {
        velocity: mean(&|s| s.velocity),
        angular_velocity: mean(&|s| s.angular_velocity),
        acceleration: mean(&|s| s.acceleration),
        angular_acceleration: mean(&|s| s.angular_acceleration),
        ..*start
    };
    advance(start, &slope, step_s)
}

/// `start`, moved with the velocities and accelerations of `slope`.
fn advance(start: &FrameMotion, slope: &FrameMotion, duration_s: f64) -> FrameMotion {
    let turn = UnitQuaternion::from_scaled_axis(slope.angular_velocity * duration_s);
    let position = start.pose.translation.vector + slope.velocity * duration_s;
    FrameMotion {
        pose: Isometry3::from_parts(position.into(), turn * start.pose.rotation),
        velocity: start.velocity + slope.acceleration * duration_s,
        angular_velocity: start.angular_velocity + slope.angular_acceleration * duration_s,
        ..*start
    }
}

fn values(body: &MassProperties) -> [f64; 10] {
    let (a, i) = (&body.center_of_mass, &body.inertia);
    [
        body.mass_kg,
        a.x,
        a.y,
        a.z,
        i[(0, 0)],
        i[(0, 1)],
        i[(0, 2)],
        i[(1, 1)],
        i[(1, 2)],
        i[(2, 2)],
    ]
}

/// What a set of runs showed.
#[derive(Debug, Default)]
struct Verdict {
    /// Values that were reported as known, and how many of them were off by more than six deviations.
    judged: u64,
    off: u64,
    /// The same after the first alarm of a run.
    judged_after: u64,
    off_after: u64,
    /// The largest error in deviations, and where it occurred.
    worst: f64,
    worst_at: String,
    /// From each payload change to its alarm, s.
    delays_s: Vec<f64>,
    /// Alarms without a change, and changes without an alarm.
    false_alarms: u64,
    missed: u64,
    /// From an alarm until the mass is known to 5 % and 20 g, s.
    mass_known_after_s: Vec<f64>,
}

impl Verdict {
    /// Judges each sample's estimate in one run.
    ///
    /// From a change to its alarm the estimate is of windows before and after it. This time is not judged
    /// but recorded as the delay.
    fn judge(&mut self, run: &Run, instants: &[Instant], noise: [f64; 2], seed: u64) {
        let robot = arm(run.base);
        let mut identifier = Identifier::new(&robot, TOOL, &[TOOL], Settings::default()).unwrap();
        let mut random = SmallRng::seed_from_u64(seed);
        // The payload that the estimate is of, and the time of its alarm until the mass is known.
        let (mut estimated, mut alarm_s) = (0, None);
        for instant in instants
            .iter()
            .filter(|instant| !run.is_in_gap(instant.time_s))
        {
            let held = run.held_at(instant.time_s);
            let wrenches = [noisy(&instant.wrench, noise, &mut random)];
            if identifier.push(&instant.sample(&wrenches)).unwrap() == Pushed::Changed {
                if estimated == held {
                    self.false_alarms += 1;
                } else {
                    self.delays_s.push(instant.time_s - run.payloads[held].0);
                }
                (estimated, alarm_s) = (held, Some(instant.time_s));
            }
            if estimated != held {
                continue;
            }
            let mut estimate = identifier.estimate();
            self.compare(&estimate, &run.payloads[held].1, || {
                let place = format!(
                    "{:?} {} Hz, motion {}",
                    run.base, run.rate_hz, run.motion_seed
                );
                format!(
                    "{place}, seed {seed}, {} s, alarm {alarm_s:?}",
                    instant.time_s
                )
            });
            let deviation = estimate.deviations.unwrap()[0];
            if let Some(from_s) =
                alarm_s.filter(|_| deviation < 0.05 * estimate.body.mass_kg + 0.02)
            {
                self.mass_known_after_s.push(instant.time_s - from_s);
                alarm_s = None;
            }
            // Work that was deferred changes nothing about the honesty of an estimate.
            if estimate.intervals.is_multiple_of(16) {
                let mut finished = identifier.clone();
                finished.finish();
                estimate = finished.estimate();
                self.compare(&estimate, &run.payloads[held].1, || "finished".to_owned());
            }
        }
        self.missed += (run.payloads.len() - 1 - estimated) as u64;
    }

    fn compare(
        &mut self,
        estimate: &PayloadEstimate,
        truth: &MassProperties,
        place: impl Fn() -> String,
    ) {
        let after = u64::from(estimate.changes > 0);
        assert!(estimate.is_physical || estimate.body.mass_kg <= 0.0);
        let (found, expected) = (estimate.values(), values(truth));
        let deviations = estimate.deviations.unwrap();
        for k in (0..10).filter(|&k| deviations[k].is_finite()) {
            let ratio = (found[k] - expected[k]).abs() / deviations[k];
            self.judged += 1;
            // One that is not a number is off, too.
            let off = u64::from(ratio.is_nan() || ratio > 6.0);
            self.off += off;
            self.judged_after += after;
            self.off_after += after * off;
            if ratio.is_nan() || ratio > self.worst {
                self.worst = ratio;
                let [found, deviation, expected] = [found[k], deviations[k], expected[k]];
                self.worst_at = format!("{}: {k}: {found} ± {deviation}, not {expected}", place());
            }
        }
    }

    fn longest_delay_s(&self) -> f64 {
        self.delays_s
            .iter()
            .fold(0.0, |longest, &delay_s| f64::max(longest, delay_s))
    }
}

fn noisy(wrench: &Wrench, noise: [f64; 2], random: &mut SmallRng) -> Wrench {
    let mut draw = |deviation: f64| {
        Vector3::from_fn(|_, _| deviation * random.sample::<f64, _>(StandardNormal))
    };
    Wrench {
        force: wrench.force + draw(noise[0]),
        moment: wrench.moment + draw(noise[1]),
    }
}

/// Pairs of payloads: heavier, lighter, a change of the inertia alone, to nearly nothing and from it.
fn pairs() -> [[MassProperties; 2]; 5] {
    let heavy = body(4.2, [0.05, -0.02, 0.11], [0.2, 0.15, 0.25]);
    let light = body(1.5, [-0.02, 0.04, 0.06], [0.1, 0.1, 0.12]);
    let long = body(4.2, [0.05, -0.02, 0.11], [0.2, 0.15, 1.2]);
    let nothing = body(1e-3, [0.0, 0.0, 0.01], [0.02, 0.02, 0.02]);
    [
        [heavy, light],
        [light, heavy],
        [heavy, long],
        [heavy, nothing],
        [nothing, heavy],
    ]
}

/// Deviations of white noise on force in N and moment in N m: of a fine, a usual and a coarse sensor.
const NOISE: [[f64; 2]; 3] = [[0.05, 0.002], [0.5, 0.02], [2.0, 0.1]];

/// What happens in a run besides the change of the payload.
#[derive(Clone, Copy, Debug)]
enum Event {
    Nothing,
    /// The samples around the change are missing.
    Gap,
    /// The first payload comes back after 0.6 s, before the new one is known well.
    SecondChange,
}

/// A run of this seed; its motion, and the time of the change, are drawn from it.
fn run(
    base: BaseKind,
    rate_hz: f64,
    [before, after]: [MassProperties; 2],
    event: Event,
    seed: u64,
) -> Run {
    let swap_s = SmallRng::seed_from_u64(seed).random_range(2.0..2.8);
    let mut run = Run {
        base,
        rate_hz,
        payloads: vec![(0.0, before), (swap_s, after)],
        duration_s: swap_s + 2.0,
        gap_s: None,
        motion_seed: seed,
    };
    match event {
        Event::Nothing => {}
        Event::Gap => run.gap_s = Some((swap_s - 0.35, swap_s + 0.1)),
        Event::SecondChange => run.payloads.push((swap_s + 0.6, before)),
    }
    run
}

/// The payload of 4.2 kg on a fixed base becomes one of 1.5 kg: seen within 0.2 s, and from then on no
/// estimate is off by more than six of its deviations; the mass is known 0.2 s after the alarm.
#[test]
fn a_lighter_payload_is_reported_honestly() {
    let mut verdict = Verdict::default();
    for rate_hz in [200.0, 500.0, 1000.0] {
        for seed in 0..4 {
            let run = run(BaseKind::Fixed, rate_hz, pairs()[0], Event::Nothing, seed);
            verdict.judge(&run, &run.instants(), NOISE[1], seed);
        }
    }
    assert_eq!(
        (verdict.off, verdict.missed, verdict.false_alarms),
        (0, 0, 0),
        "{verdict:?}"
    );
    assert_eq!(verdict.delays_s.len(), 12);
    assert!(verdict.longest_delay_s() < 0.2, "{verdict:?}");
    assert_eq!(verdict.mass_known_after_s.len(), 12);
    assert!(
        verdict
            .mass_known_after_s
            .iter()
            .all(|&time_s| time_s < 0.25),
        "{verdict:?}"
    );
    assert!(verdict.judged > 250_000, "{verdict:?}");
}

/// No estimate is off by more than six of its deviations: with and without gravity, for all pairs of
/// payloads, all noise and rates, in the first second, after gaps, and after one change and two.
#[test]
fn no_estimate_is_absurd_and_certain() {
    let mut verdict = Verdict::default();
    sweep(1000..1001, &mut verdict);
    assert_eq!(verdict.off, 0, "{} at {}", verdict.worst, verdict.worst_at);
    assert_eq!(verdict.false_alarms, 0);
    assert!(verdict.judged > 3_000_000, "{}", verdict.judged);
}

/// The same so often that one estimate in a million would show. After a change there are fewer; in the first
/// seconds of a run, while the correlation of the noise between windows is known from few, errors of 30
/// draws of noise reached 7.3 deviations, and 1 estimate in 16 000 was off.
#[test]
#[ignore = "minutes in release mode: cargo test --release --test payload_change -- --ignored --nocapture"]
fn fewer_than_one_estimate_in_a_million_is_off() {
    let mut verdict = Verdict::default();
    sweep(2000..2030, &mut verdict);
    eprintln!("{} of {} off", verdict.off, verdict.judged);
    eprintln!(
        "{} of {} off after a change",
        verdict.off_after, verdict.judged_after
    );
    eprintln!("worst {} at {}", verdict.worst, verdict.worst_at);
    eprintln!(
        "{} alarms false, {} changes missed",
        verdict.false_alarms, verdict.missed
    );
    assert!(verdict.off_after * 1_000_000 < verdict.judged_after);
    assert!(verdict.off * 10_000 < verdict.judged);
    assert!(verdict.worst < 8.0);
}

fn sweep(seeds: std::ops::Range<u64>, verdict: &mut Verdict) {
    for seed in seeds {
        for base in [BaseKind::Fixed, BaseKind::Floating] {
            for rate_hz in [200.0, 500.0, 1000.0] {
                for pair in pairs() {
                    for event in [Event::Nothing, Event::Gap, Event::SecondChange] {
                        let run = run(base, rate_hz, pair, event, seed);
                        let instants = run.instants();
                        for noise in NOISE {
                            verdict.judge(&run, &instants, noise, seed);
                        }
                    }
                }
            }
        }
    }
}
