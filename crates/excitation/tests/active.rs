//! Active identification in closed loop, with exact dynamics and noisy sensors.

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use tactid_dynamics::{FrameMotion, InertialParameters, MassProperties, Workspace, motion};
use tactid_excitation::{
    ActiveSettings, BaseBounds, CollisionModel, Grip, JointStates, Limit, Motion, OrientedBox,
    Planner, Prior, PriorBound, Problem, Step, Trajectory, margins,
};
use tactid_identify::{HALF_WIDTH_95, Identifier, largest_of_kind, values_of_body};

use crate::closed_loop::{Loop, Noise, Outcome, identify};
use crate::common::{NOISE, TOOL, in_orbit, on_ground, urdf};

const HEAVY: Prior = Prior {
    mass_kg: (5.0, 100.0),
    center_of_mass_m: 0.5,
    half_diagonal_m: 0.7,
};

const LIGHT: Prior = Prior {
    mass_kg: (0.2, 3.0),
    center_of_mass_m: 0.12,
    half_diagonal_m: 0.2,
};

/// Returns the spacecraft with its grip and its attitude bounded.
fn bounded() -> Problem {
    let mut problem = in_orbit();
    problem.base = BaseBounds {
        attitude_rad: Some(0.1f64.to_radians()),
        position_m: None,
    };
    problem.grip = Some(Grip {
        center: Point3::new(0.22, 0.0, 0.075),
        normal: Vector3::y_axis(),
        distance_m: 0.04,
        grip_force_n: 1500.0,
        friction: 0.8,
        torsion_radius_m: 0.06,
        used_fraction: 0.7,
    });
    problem
}

fn settings(within: f64) -> ActiveSettings {
    ActiveSettings {
        within,
        velocity_noise: vec![1e-3; 8],
        ..ActiveSettings::default()
    }
}

fn noise() -> Noise {
    Noise {
        position: vec![1e-4; 8],
        velocity: vec![1e-3; 8],
        pose: [1e-5; 6],
        twist: [1e-5; 6],
        wrench: NOISE,
    }
}

fn run(problem: &Problem, prior: Prior, within: f64, seed: u64) -> Outcome {
    let mut noise = noise();
    noise.wrench = problem.sensing.equations.wrench_noise[0];
    let mut planner = Planner::new(problem.clone(), prior, settings(within)).unwrap();
    let mut cycles = Loop::new(problem, &problem.payloads[0], &noise, seed).unwrap();
    identify(&mut cycles, &mut planner, 20.0).unwrap()
}

/// Returns the largest fraction of any limit that a motion uses, with a payload.
fn used(problem: &Problem, payload: InertialParameters, motion: &dyn Motion) -> (Limit, f64) {
    let mut held = problem.clone();
    held.payloads = vec![payload];
    let (margins, _) = margins(&held, motion).unwrap();
    let worst = margins.into_iter().max_by(|a, b| a.used.total_cmp(&b.used));
    let worst = worst.unwrap();
    (worst.limit, worst.used)
}

/// From the prior alone to intervals of 5 %, on the ground and in orbit: the true values are near,
/// all limits hold for the true payload, and the robot comes to rest.
#[test]
fn identifies_a_payload_and_stops() {
    let mut ground = on_ground();
    // Its load is a fortieth of that in orbit.
    ground.sensing.equations.wrench_noise = vec![NOISE.map(|std_dev| 0.02 * std_dev)];
    for (problem, prior) in [(ground, LIGHT), (bounded(), HEAVY)] {
        let outcome = run(&problem, prior, 0.05, 1);
        let Some(reached_s) = outcome.reached_s else {
            panic!("{:?} {:?}", outcome.ratios, outcome.failure);
        };
        assert!((0.5..15.0).contains(&reached_s), "{reached_s}");
        let truth = values_of_body(&problem.payloads[0].mass_properties().unwrap());
        let largest = largest_of_kind(&truth);
        // Half the width is 1.96 standard deviations: five are exceeded once in a million.
        let allowed = 0.05 * 5.0 / HALF_WIDTH_95;
        for k in 0..10 {
            let error = (outcome.values[k] - truth[k]).abs() / largest[k];
            assert!(error < allowed, "{k}: {error}");
        }
        let (limit, used) = used(&problem, problem.payloads[0], &outcome.motion);
        assert!(used <= 1.0, "{limit} {used}");
        let end = outcome.motion.at(outcome.motion.duration_s());
        let still = |rates: &[f64]| rates.iter().all(|rate| rate.abs() < 1e-9);
        assert!(still(&end.velocity) && still(&end.acceleration), "{end:?}");
    }
}

/// Plans keep tool and payload in a box and bodies apart, which plans without these limits do not.
#[test]
fn keeps_bodies_in_their_place_and_apart() {
    let mut free = on_ground();
    free.sensing.equations.wrench_noise = vec![NOISE.map(|std_dev| 0.02 * std_dev)];
    free.payload_box = Some(OrientedBox::between([0.1, -0.1, -0.05], [0.3, 0.1, 0.15]));
    let no_files = &mut |_: &str| panic!("the built-in robot has no meshes");
    let mut bounded = free.clone();
    bounded.collisions = Some(CollisionModel::of_urdf(&urdf(), &free.robot, no_files).unwrap());
    let mut workspace = Workspace::new(&free.robot);
    let base = FrameMotion::at_rest(Isometry3::identity());
    let start = JointStates::at_rest(&free.start);
    motion(&mut workspace, &base, start.joints()).unwrap();
    let tool = workspace.pose(free.robot.frame(TOOL).unwrap());
    let center = (tool * Point3::new(0.2, 0.0, 0.05)).coords;
    let half = Vector3::repeat(0.35);
    bounded.workspace.inside = Some(OrientedBox::between(
        (center - half).into(),
        (center + half).into(),
    ));
    let kept = run(&bounded, LIGHT, 0.01, 3);
    assert!(kept.plans.len() > 1, "{:?} {:?}", kept.ratios, kept.failure);
    let (limit, fraction) = used(&bounded, bounded.payloads[0], &kept.motion);
    assert!(fraction <= 1.0, "{limit} {fraction}");
    let left = run(&free, LIGHT, 0.01, 3);
    let (limit, fraction) = used(&bounded, bounded.payloads[0], &left.motion);
    let is_of_place = matches!(limit, Limit::Workspace(..) | Limit::Distance(..));
    assert!(is_of_place && fraction > 1.1, "{limit} {fraction}");
}

/// Positions, velocities and accelerations are continuous where one plan follows another.
#[test]
fn plans_join_smoothly() {
    let outcome = run(&bounded(), HEAVY, 0.02, 2);
    let planner = Planner::new(bounded(), HEAVY, settings(0.02)).unwrap();
    assert!(outcome.plans.len() > 1);
    for k in 1..outcome.plans.len() {
        let at_s = k as f64 * planner.followed_s();
        let before = outcome.motion.at(at_s - 1e-6);
        let after = outcome.motion.at(at_s + 1e-6);
        let pairs = [
            (&before.position, &after.position, 1e-5),
            (&before.velocity, &after.velocity, 1e-4),
            (&before.acceleration, &after.acceleration, 1e-3),
        ];
        for (before, after, tolerance) in pairs {
            let mut pairs = before.iter().zip(after);
            assert!(pairs.all(|(a, b)| (a - b).abs() < tolerance), "{k}");
        }
    }
}

/// Returns the first plan, before any sample.
fn first_plan(problem: &Problem, prior: Prior) -> impl Motion {
    let mut planner = Planner::new(problem.clone(), prior, settings(0.01)).unwrap();
    let equations = &problem.sensing.equations;
    let identifier = Identifier::new(&problem.robot, TOOL, &[TOOL], equations).unwrap();
    let base = Isometry3::identity();
    match planner.plan(&identifier.estimate(), None, &base).unwrap() {
        Step::Move(motion) => motion,
        other => panic!("{other:?}"),
    }
}

/// Returns a payload of a prior with the largest mass: a rod, a plate or a box in any direction,
/// its centre of mass in any direction at the largest distance.
fn heaviest_drawn(prior: &Prior, random: &mut StdRng, dimensions: usize) -> InertialParameters {
    let mut direction = |entries: usize| {
        let entry = |k| {
            if k < entries {
                random.random_range(-1.0..1.0)
            } else {
                0.0
            }
        };
        Vector3::from_iterator((0..3).map(entry)).normalize()
    };
    let [x, y, z] = (direction(dimensions) * prior.half_diagonal_m)
        .map(|half| half * half / 3.0)
        .into();
    let body = MassProperties {
        mass_kg: prior.mass_kg.1,
        center_of_mass: Vector3::zeros(),
        inertia: Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y)) * prior.mass_kg.1,
    };
    let turn = UnitQuaternion::from_scaled_axis(direction(3) * std::f64::consts::PI);
    let center = direction(3) * prior.center_of_mass_m;
    InertialParameters::from(body).expressed_in(&Isometry3::from_parts(center.into(), turn))
}

/// The first motion is safe for a thousand payloads of the prior for which it was not planned, and
/// a wider prior makes it gentler.
#[test]
fn starts_gently() {
    let problem = bounded();
    let motion = first_plan(&problem, HEAVY);
    let mut random = StdRng::seed_from_u64(11);
    let mut held = problem.clone();
    let draws = (0..1000).map(|k| heaviest_drawn(&HEAVY, &mut random, 1 + k % 3));
    held.payloads = draws.collect();
    let (margins, _) = margins(&held, &motion).unwrap();
    for margin in margins {
        assert!(margin.used <= 1.0, "{} {}", margin.limit, margin.used);
    }
    let light = Prior {
        mass_kg: (5.0, 10.0),
        ..HEAVY
    };
    let faster = first_plan(&problem, light);
    let heaviest = HEAVY.samples()[1];
    let (_, used_by_faster) = used(&problem, heaviest, &faster);
    assert!(used_by_faster > 1.5, "{used_by_faster}");
}

/// Where an estimate becomes uncertain, payloads are possible again with which even the way to a
/// standstill exceeds a limit. The robot then goes this way, and no limit is relaxed for a next
/// motion.
#[test]
fn comes_to_a_standstill_where_an_estimate_is_lost() {
    let problem = bounded();
    let noise = noise();
    let mut planner = Planner::new(problem.clone(), HEAVY, settings(1e-4)).unwrap();
    let mut cycles = Loop::new(&problem, &problem.payloads[0], &noise, 4).unwrap();
    let base = Isometry3::identity();
    let mut motions = Vec::new();
    for growth in [1.0, 1.0, 1e8] {
        let estimate = cycles.identifier.estimate();
        let covariance = cycles.identifier.covariance();
        let covariance = covariance.map(|covariance| covariance * growth);
        let step = planner.plan(&estimate, covariance.as_ref(), &base);
        let Step::Move(motion) = step.unwrap() else {
            panic!("the targets are out of reach");
        };
        let begins_s = cycles.time_s();
        let motion = Later { motion, begins_s };
        while cycles.time_s() < begins_s + planner.followed_s() - 1e-9 {
            cycles.cycle(&motion).unwrap();
        }
        motions.push(motion.motion);
    }
    for k in 0..=20 {
        let time_s = 0.1 * f64::from(k);
        let rest = motions[1].at(time_s + planner.followed_s());
        let found = motions[2].at(time_s);
        let pairs = found.position.iter().zip(&rest.position);
        let largest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(largest < 1e-9, "{time_s}: {largest}");
    }
}

/// A motion that begins later.
struct Later {
    motion: Trajectory,
    begins_s: f64,
}

impl Motion for Later {
    fn duration_s(&self) -> f64 {
        self.begins_s + self.motion.duration_s()
    }

    fn at(&self, time_s: f64) -> JointStates {
        self.motion.at(time_s - self.begins_s)
    }
}

/// Targets that noise does not allow end the identification, with the value that is the furthest
/// from its target.
#[test]
fn stops_where_targets_are_out_of_reach() {
    let problem = bounded();
    let mut planner = Planner::new(problem.clone(), HEAVY, settings(1e-4)).unwrap();
    let noise = noise();
    let mut cycles = Loop::new(&problem, &problem.payloads[0], &noise, 3).unwrap();
    // The robot rests: nothing that is planned makes an interval smaller.
    let first = first_plan(&problem, HEAVY);
    for _ in 0..600 {
        cycles.cycle(&first).unwrap();
    }
    let estimate = cycles.identifier.estimate();
    let covariance = cycles.identifier.covariance();
    let mut steps = Vec::new();
    for _ in 0..8 {
        let base = Isometry3::identity();
        steps.push(planner.plan(&estimate, covariance.as_ref(), &base).unwrap());
    }
    let Some(Step::OutOfReach { ratio, .. }) = steps.last() else {
        panic!("{:?}", steps.last());
    };
    assert!(*ratio > 1.0);
    assert!(matches!(steps[0], Step::Move(_)));
}

/// A payload heavier than the prior allows shows in its estimate, and nothing more is planned.
#[test]
fn stops_where_the_prior_is_wrong() {
    let problem = bounded();
    let light = Prior {
        mass_kg: (5.0, 40.0),
        ..HEAVY
    };
    let mut planner = Planner::new(problem.clone(), light, settings(0.01)).unwrap();
    let noise = noise();
    let mut cycles = Loop::new(&problem, &problem.payloads[0], &noise, 5).unwrap();
    let outcome = identify(&mut cycles, &mut planner, 20.0).unwrap();
    assert!(outcome.reached_s.is_none());
    let estimate = cycles.identifier.estimate();
    let covariance = cycles.identifier.covariance();
    let step = planner.plan(&estimate, covariance.as_ref(), &Isometry3::identity());
    let Step::Contradicted(found) = step.unwrap() else {
        panic!("{:?}", outcome.failure);
    };
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(
        (found[0].bound, found[0].bound_value),
        (PriorBound::LargestMass, 40.0)
    );
    assert!((found[0].estimate - 60.0).abs() < 5.0 * found[0].std_dev);
}

/// Numbers out of range are errors that name them.
#[test]
fn bad_settings_are_errors() {
    let defaults = ActiveSettings::default;
    let cases = [
        (
            ActiveSettings {
                within: 0.0,
                ..defaults()
            },
            "`within` is 0",
        ),
        (
            ActiveSettings {
                spans: 3,
                ..defaults()
            },
            "`spans` is 3; expected at least four",
        ),
        (
            ActiveSettings {
                followed_spans: 10,
                ..defaults()
            },
            "`followed_spans` is 10; expected from 1 to less than `spans`",
        ),
        (
            ActiveSettings {
                span_s: f64::NAN,
                ..defaults()
            },
            "`span_s` is NaN",
        ),
        (
            ActiveSettings {
                velocity_noise: vec![0.0, -1.0],
                ..defaults()
            },
            "`velocity_noise[1]` is -1; expected at least zero",
        ),
        (
            ActiveSettings {
                velocity_noise: vec![0.1],
                ..defaults()
            },
            "velocity_noise",
        ),
    ];
    for (settings, expected) in cases {
        let error = Planner::new(bounded(), HEAVY, settings)
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// A prior without mass is an error.
#[test]
fn a_bad_prior_is_an_error() {
    let empty = Prior {
        mass_kg: (0.0, 1.0),
        ..HEAVY
    };
    let error = Planner::new(bounded(), empty, ActiveSettings::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("prior.mass_kg.0"), "{error}");
}
