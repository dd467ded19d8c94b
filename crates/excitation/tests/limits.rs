//! Limits of designed motions, checked by the dynamics alone at closely spaced times.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, Workspace, free_base_motion, inverse_dynamics,
    wrench_regressor,
};
use tactid_excitation::{
    BaseBounds, Criterion, Design, DesignSettings, End, ExcitationError, Grip, JointStates, Limit,
    Motion, Problem, design, margins,
};

use crate::common::{TOOL, in_orbit, on_ground};

/// Excess of a limit, as a fraction of it, that counts as none.
const TOLERANCE: f64 = 1e-6;

fn grip() -> Grip {
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

/// Returns the largest fraction of friction that two pads use, from forces and not from cones.
fn friction_used(grip: &Grip, force: Vector3<f64>, moment: Vector3<f64>) -> f64 {
    let n = grip.normal.into_inner();
    let moment = moment - grip.center.coords.cross(&force);
    let of_pad = |side: f64| {
        let arm = n * (0.5 * side * grip.distance_m);
        // The pads carry the moment across the normal by ±g: arm × g - arm × -g = m.
        let across = moment - n * moment.dot(&n);
        let couple = across.cross(&n) * (side / grip.distance_m);
        assert!((arm.cross(&couple) * 2.0 - across).norm() < 1e-9 * (1.0 + across.norm()));
        let along = (force - n * force.dot(&n)) * 0.5 + couple;
        let torsion = 0.5 * moment.dot(&n) / grip.torsion_radius_m;
        let pressed_n = grip.grip_force_n - 0.5 * side * force.dot(&n);
        along.norm().hypot(torsion) / (grip.used_fraction * grip.friction * pressed_n)
    };
    of_pad(1.0).max(of_pad(-1.0))
}

/// Returns the largest fraction of any limit that a motion uses.
fn used(problem: &Problem, motion: &dyn Motion, steps: usize) -> f64 {
    let mut worst = 0.0f64;
    let tool = problem.robot.frame(TOOL).unwrap();
    let gravity = problem.robot.base_kind().default_gravity();
    for payload in &problem.payloads {
        let mut workspace = Workspace::new(&problem.robot.with_payload(tool, payload));
        let mut base = FrameMotion::at_rest(Isometry3::identity());
        let step_s = motion.duration_s() / steps as f64;
        for k in 0..=steps {
            let states = motion.at(k as f64 * step_s);
            if problem.robot.base_kind() == BaseKind::Floating {
                base = free_base_motion(&mut workspace, &base.pose, states.joints()).unwrap();
            } else {
                inverse_dynamics(&mut workspace, &base, states.joints(), &gravity).unwrap();
            }
            for joint in 0..6 {
                let limits = &problem.limits[joint];
                let (low, high) = limits.position;
                let middle = 0.5 * (low + high);
                worst = worst
                    .max((states.position[joint] - middle).abs() / (high - middle))
                    .max(states.velocity[joint].abs() / limits.velocity)
                    .max(states.acceleration[joint].abs() / limits.acceleration)
                    .max(workspace.joint_torques().unwrap()[joint].abs() / limits.effort);
            }
            let wrench =
                wrench_regressor(&workspace.tool_motion(tool, &gravity)) * payload.as_vector();
            for (entry, limit) in wrench.iter().zip(problem.wrench.iter().flatten()) {
                worst = worst.max(entry.abs() / limit);
            }
            if let Some(grip) = &problem.grip {
                let (force, moment) = (wrench.fixed_rows::<3>(0), wrench.fixed_rows::<3>(3));
                worst = worst.max(friction_used(grip, force.into(), moment.into()));
            }
            if let Some(bound) = problem.base.attitude_rad {
                worst = worst.max(base.pose.rotation.angle() / bound);
            }
            if let Some(bound) = problem.base.position_m {
                worst = worst.max(base.pose.translation.vector.norm() / bound);
            }
            base.pose = later(&base, step_s);
        }
    }
    worst
}

/// Returns the pose of the base a step later, to second order.
fn later(base: &FrameMotion, step_s: f64) -> Isometry3<f64> {
    let half = 0.5 * step_s * step_s;
    let turn = base.angular_velocity * step_s + base.angular_acceleration * half;
    let shift = base.velocity * step_s + base.acceleration * half;
    Isometry3::from_parts(
        (base.pose.translation.vector + shift).into(),
        UnitQuaternion::from_scaled_axis(turn) * base.pose.rotation,
    )
}

fn quick(seed: u64) -> DesignSettings {
    DesignSettings {
        seed,
        starts: 1,
        iterations: 8,
        ..DesignSettings::default()
    }
}

fn steps(problem: &Problem) -> usize {
    (problem.duration_s * 1000.0) as usize
}

/// All limits hold at each millisecond for random limits, postures, durations, ends and criteria,
/// also those that depend on the payload.
#[test]
fn limits_hold_for_random_problems() {
    let mut random = StdRng::seed_from_u64(1);
    let (mut designs, mut binding) = (0, 0);
    for seed in 0..30 {
        let mut problem = on_ground();
        problem.duration_s = random.random_range(0.6..4.0);
        for joint in 0..6 {
            let limits = &mut problem.limits[joint];
            let start = &mut problem.start[joint];
            *start += random.random_range(-0.3..0.3);
            limits.position = (
                *start - random.random_range(0.05..2.0),
                *start + random.random_range(0.05..2.0),
            );
            limits.velocity = random.random_range(0.5..3.0);
            limits.acceleration = random.random_range(2.0..12.0);
        }
        problem.limits[3].effort = 10.0;
        problem.limits[4].effort = random.random_range(4.0..9.0);
        problem.wrench = Some([40.0, 40.0, 40.0, 2.5, 2.5, 2.5]);
        problem.end = if seed % 2 == 0 { End::Start } else { End::Free };
        if seed % 3 == 0 {
            problem.criterion = Criterion::Volume;
        }
        let heavier = problem.payloads[0].as_vector() * 1.15;
        problem
            .payloads
            .push(InertialParameters::from_vector(heavier));
        match design(&problem, &quick(seed)) {
            Ok(design) => {
                let used = used(&problem, &design.trajectory, steps(&problem));
                assert!(used <= 1.0 + TOLERANCE, "{seed}: {used}");
                (designs, binding) = (designs + 1, binding + usize::from(used > 0.95));
            }
            // Some postures cannot hold the payload, or hardly.
            Err(ExcitationError::Impossible { limit, .. }) => {
                assert!(
                    matches!(limit, Limit::Effort(_) | Limit::Wrench(_)),
                    "{limit}"
                );
            }
            Err(error) => panic!("{seed}: {error}"),
        }
    }
    assert!(
        designs > 10 && 2 * binding > designs,
        "{binding} of {designs}"
    );
}

/// A free-floating base keeps its attitude with the grip, for the payload and for one that is 10 %
/// heavier, and all ten values are still determined.
#[test]
fn a_free_base_keeps_its_attitude() {
    let mut problem = in_orbit();
    problem.base = BaseBounds {
        attitude_rad: Some(0.1f64.to_radians()),
        position_m: Some(0.01),
    };
    problem.grip = Some(grip());
    let design = design(&problem, &quick(0)).unwrap();
    assert!(used(&problem, &design.trajectory, steps(&problem)) <= 1.0 + TOLERANCE);
    let attitude = &design.excursion().attitude_rad;
    assert!((0.02..=0.1).contains(&attitude.to_degrees()), "{attitude}");
    let heavier = problem.payloads[0].as_vector() * 1.1;
    let mut other = problem.clone();
    other.payloads = vec![InertialParameters::from_vector(heavier)];
    other.base = BaseBounds {
        attitude_rad: Some(0.2f64.to_radians()),
        position_m: None,
    };
    assert!(used(&other, &design.trajectory, steps(&problem)) <= 1.0);
    let without = tactid_excitation::design(&in_orbit(), &quick(0)).unwrap();
    assert!(without.excursion().attitude_rad.to_degrees() > 1.0);
    assert!(without.prediction.largest().1 < design.prediction.largest().1);
}

/// A weak grip limits the motion, and the design says so.
#[test]
fn a_weak_grip_binds() {
    let mut problem = in_orbit();
    let weak = Grip {
        grip_force_n: 200.0,
        ..grip()
    };
    problem.grip = Some(weak);
    let design = design(&problem, &quick(0)).unwrap();
    let used = used(&problem, &design.trajectory, steps(&problem));
    assert!((0.95..=1.0 + TOLERANCE).contains(&used), "{used}");
    let is_grip = |limit: &Limit| matches!(limit, Limit::Grip(_));
    assert!(design.binding().any(is_grip), "{:?}", design.margins);
    let mut loose = on_ground();
    loose.grip = Some(Grip {
        grip_force_n: 0.5,
        ..grip()
    });
    let expected = "no motion is possible: the payload pulls off pad 0 at the start";
    assert_eq!(message(&loose), expected);
}

fn message(problem: &Problem) -> String {
    let failed = |design: Design| panic!("{:?}", design.prediction);
    design(problem, &quick(0)).map_or_else(|error| error.to_string(), failed)
}

/// A problem without a solution names the limit that makes it impossible.
#[test]
fn impossible_problems_name_the_limit() {
    let mut outside = on_ground();
    outside.limits[2].position = (-1.0, 1.0);
    let expected = "no motion is possible: the position of joint joint_3 is 1.600 times its limit at the start";
    assert_eq!(message(&outside), expected);
    let mut weak = on_ground();
    weak.limits[1].effort = 10.0;
    assert!(
        message(&weak).contains("the effort of joint joint_2"),
        "{}",
        message(&weak)
    );
    let mut slipping = on_ground();
    slipping.grip = Some(Grip {
        grip_force_n: 10.0,
        ..grip()
    });
    assert!(
        message(&slipping).contains("friction of the grip"),
        "{}",
        message(&slipping)
    );
    let mut sensor = on_ground();
    sensor.wrench = Some([1.0; 6]);
    assert!(
        message(&sensor).contains("on the payload is"),
        "{}",
        message(&sensor)
    );
    let mut short = on_ground();
    short.duration_s = 0.05;
    assert!(message(&short).contains("too short"), "{}", message(&short));
    let mut single = on_ground();
    single.joints = vec![5];
    assert!(
        message(&single).contains("determines all ten"),
        "{}",
        message(&single)
    );
    let mut noise = on_ground();
    noise.sensing.equations.wrench_noise = Vec::new();
    assert!(
        message(&noise).contains("force x is unknown"),
        "{}",
        message(&noise)
    );
    let mut bounded = on_ground();
    bounded.base.attitude_rad = Some(0.1);
    assert!(
        message(&bounded).contains("the base is fixed"),
        "{}",
        message(&bounded)
    );
}

/// Problems that no motion and no duration solves name their cause.
#[test]
fn windows_without_samples_and_links_that_do_not_move_are_errors() {
    let mut coarse = on_ground();
    coarse.sensing.equations.cutoff_hz = 600.0;
    let expected = "the averaging window of 0.002 s, for a cutoff of 600 Hz, has too few samples at 200 Hz: raise \
                    `sample_rate`, or lower the cutoff";
    assert_eq!(message(&coarse), expected);
    let mut fixed = on_ground();
    fixed.tool = "base_link".to_owned();
    let expected =
        "`tip` is base_link, which no joint moves: expected a link at the end of the arm";
    assert_eq!(message(&fixed), expected);
}

/// Torques of joints that rest are limited, too: they change with the motion of the others.
#[test]
fn torques_of_resting_joints_are_limited() {
    let mut problem = on_ground();
    problem.duration_s = 2.0;
    problem.joints = vec![3, 4, 5];
    let name = Limit::Effort(problem.robot.joint_names()[1].clone());
    let effort_used = |problem: &Problem, motion: &dyn Motion| {
        let (all, _) = margins(problem, motion).unwrap();
        all.into_iter().find(|m| m.limit == name).unwrap().used
    };
    let mut rest = problem.clone();
    rest.joints = vec![5];
    let holding = problem.limits[1].effort * effort_used(&rest, &Resting(problem.start.clone()));
    let free = design(&problem, &quick(0)).unwrap();
    problem.limits[1].effort = 1.01 * holding;
    let exceeded = effort_used(&problem, &free.trajectory);
    assert!(exceeded > 1.01, "{exceeded}");
    let design = design(&problem, &quick(0)).unwrap();
    let used = used(&problem, &design.trajectory, steps(&problem));
    assert!((0.99..=1.0 + TOLERANCE).contains(&used), "{used}");
}

/// A motion at rest.
struct Resting(Vec<f64>);

impl Motion for Resting {
    fn duration_s(&self) -> f64 {
        1.0
    }

    fn at(&self, _time_s: f64) -> JointStates {
        JointStates::at_rest(&self.0)
    }
}

/// A motion may start exactly at the end of a range.
#[test]
fn a_start_on_a_limit_is_possible() {
    let mut problem = on_ground();
    for joint in [1, 4] {
        problem.limits[joint].position = (problem.start[joint], problem.start[joint] + 1.1);
    }
    let design = design(&problem, &quick(0)).unwrap();
    let used = used(&problem, &design.trajectory, steps(&problem));
    assert!(used <= 1.0 + TOLERANCE, "{used}");
    let largest = |joint: usize| {
        let at = |k: u32| design.trajectory.at(0.03 * f64::from(k)).position[joint];
        (0..100).map(at).fold(f64::NEG_INFINITY, f64::max) - problem.start[joint]
    };
    assert!(largest(1) > 0.02 && largest(4) > 0.02);
}

/// A number that is out of range is an error that names the field.
#[test]
fn bad_numbers_are_errors() {
    type Change = fn(&mut Problem);
    let changes: [(&str, Change); 16] = [
        ("`start[1] (joint_2)` is NaN", |p| p.start[1] = f64::NAN),
        ("`end[0] (joint_1)` is inf", |p| {
            p.end = End::At(vec![f64::INFINITY; 8])
        }),
        ("start", |p| p.start.truncate(3)),
        ("`limits` is 7", |p| p.limits.truncate(7)),
        ("less than its upper end 1", |p| {
            p.limits[0].position = (2.0, 1.0)
        }),
        ("`limits[0].position (joint_1)` is -1", |p| {
            p.limits[0].position = (-1.0, f64::INFINITY)
        }),
        ("`payloads` is 0", |p| p.payloads.clear()),
        ("`targets[4]` is 0", |p| p.targets[4] = 0.0),
        ("`joints[1]` is 9", |p| p.joints = vec![0, 9]),
        ("`joints[2]` is 3; expected each joint once", |p| {
            p.joints = vec![3, 4, 3];
        }),
        ("does not move", |p| {
            p.joints = vec![3, 4, 5];
            let mut end = p.start.clone();
            end[0] += 0.1;
            p.end = End::At(end);
        }),
        (
            "`limits[3].velocity (joint_4)` is inf; expected a finite",
            |p| p.limits[3].velocity = f64::INFINITY,
        ),
        ("`base_noise` is NaN", |p| {
            p.sensing.base_noise = Some([1.0, 1.0, f64::NAN, 1.0, 1.0, 1.0]);
        }),
        ("`payloads[1]` is NaN", |p| {
            let broken = p.payloads[0].as_vector() * f64::NAN;
            p.payloads.push(InertialParameters::from_vector(broken));
        }),
        ("`grip.friction` is 0", |p| {
            p.grip = Some(Grip {
                friction: 0.0,
                ..grip()
            });
        }),
        ("`base.attitude_rad` is 4; expected at most pi", |p| {
            p.base.attitude_rad = Some(4.0);
        }),
    ];
    for (expected, change) in changes {
        let mut problem = on_ground();
        change(&mut problem);
        let found = message(&problem);
        assert!(found.contains(expected), "{found} does not name {expected}");
    }
}
