//! How good designs are, and what they cost.

use std::ops::ControlFlow;

use rand::{SeedableRng, rngs::StdRng};
use tactid_excitation::{
    Criterion, DesignSettings, End, ExcitationError, FourierMotion, Limit, Motion, Problem,
    Progress, ShortestSettings, design, design_observed, margins, predict, shortest,
};
use tactid_identify::Method;
use tactid_identify::equations::window;

use crate::common::{in_orbit, on_ground};

/// Returns the joint of a limit that depends on the motion of this joint only.
fn joint_of(limit: &Limit) -> Option<&String> {
    match limit {
        Limit::Position(joint) | Limit::Velocity(joint) | Limit::Acceleration(joint) => Some(joint),
        _ => None,
    }
}

/// Returns the least largest interval of so many random Fourier motions within the limits, relative
/// to its target.
fn best_of_random(problem: &Problem, count: usize) -> f64 {
    let mut random = StdRng::seed_from_u64(3);
    let mut best = f64::INFINITY;
    for _ in 0..count {
        let motion = FourierMotion::within_limits(&mut random, problem).unwrap();
        let (margins, _) = margins(problem, &motion).unwrap();
        assert!(
            margins.iter().all(|margin| margin.used <= 1.0),
            "{margins:?}"
        );
        let reaches = |is_of: &dyn Fn(&Limit) -> bool| {
            let mut all = margins.iter();
            all.any(|margin| is_of(&margin.limit) && margin.used > 0.9)
        };
        let is_common = |limit: &Limit| joint_of(limit).is_none();
        let mut joints = problem.moving_joints().unwrap().into_iter();
        let names = problem.robot.joint_names();
        let all = joints.all(|joint| reaches(&|limit| joint_of(limit) == Some(&names[joint])));
        assert!(all || reaches(&is_common), "{margins:?}");
        best = best.min(predict(problem, &motion).unwrap().largest().1);
    }
    best
}

/// At equal limits a design is better than the best of random motions, by a factor of two on the
/// ground and of three in orbit.
#[test]
fn designs_beat_random_motions() {
    let mut ground = on_ground();
    ground.duration_s = 10.0;
    for (problem, bar) in [(ground, 0.5), (in_orbit(), 0.33)] {
        let design = design(&problem, &DesignSettings::default()).unwrap();
        let ratio = design.prediction.largest().1 / best_of_random(&problem, 20);
        assert!(ratio < bar, "{ratio}");
    }
}

/// On the ground, a longer motion is better.
#[test]
fn a_longer_motion_on_the_ground_is_better() {
    longer_is_better(on_ground());
}

/// In orbit, a longer motion is better, while the base turns by no more than a bound.
#[test]
fn a_longer_motion_in_orbit_is_better() {
    let mut problem = in_orbit();
    problem.base.attitude_rad = Some(0.01);
    longer_is_better(problem);
}

/// Asserts that a motion of the double duration has intervals that are at most 0.75 times as wide (a
/// repetition gives 0.71), within the same limits.
fn longer_is_better(mut problem: Problem) {
    problem.duration_s = 10.0;
    let mut before = design(&problem, &DesignSettings::default()).unwrap();
    for duration_s in [20.0, 40.0] {
        problem.duration_s = duration_s;
        let longer = design(&problem, &DesignSettings::default()).unwrap();
        assert!((longer.trajectory.duration_s() - duration_s).abs() < 1e-9);
        let ratio = longer.prediction.largest().1 / before.prediction.largest().1;
        assert!(ratio < 0.75, "{duration_s} s: {ratio}");
        let (margins, excursion) = margins(&problem, &longer.trajectory).unwrap();
        for margin in &margins {
            assert!(margin.used < 1.0 + 1e-3, "{margin:?}");
        }
        let turned = longer.excursion().attitude_rad;
        assert!((excursion.attitude_rad - turned).abs() < 1e-3 * turned.max(1e-9));
        before = longer;
    }
}

/// The positions of a motion with several passes are continuous, and velocities and accelerations
/// are their derivatives.
#[test]
fn passes_join_smoothly() {
    let mut problem = on_ground();
    problem.duration_s = 18.0;
    let quick = DesignSettings {
        starts: 1,
        iterations: 4,
        ..DesignSettings::default()
    };
    let motion = design(&problem, &quick).unwrap().trajectory;
    assert_eq!(motion.passes(), 2);
    let step_s = 1e-5;
    for k in 0..1800 {
        let time_s = 0.01 * f64::from(k) + 0.003;
        let (before, at, after) = (
            motion.at(time_s - step_s),
            motion.at(time_s),
            motion.at(time_s + step_s),
        );
        for joint in 0..at.position.len() {
            let velocity = (after.position[joint] - before.position[joint]) / (2.0 * step_s);
            assert!((velocity - at.velocity[joint]).abs() < 1e-6);
            let acceleration = (after.velocity[joint] - before.velocity[joint]) / (2.0 * step_s);
            assert!((acceleration - at.acceleration[joint]).abs() < 1e-4);
        }
    }
}

/// The same seed gives the same motion, to the last digit; another seed gives another one.
#[test]
fn a_seed_determines_the_motion() {
    let problem = on_ground();
    let with = |seed| {
        let settings = DesignSettings {
            seed,
            starts: 1,
            iterations: 4,
            ..DesignSettings::default()
        };
        let design = design(&problem, &settings).unwrap();
        let splines = design.trajectory.splines();
        splines
            .flat_map(|(_, spline)| [0.7, 1.5, 2.2].map(|time_s| spline.at(time_s)))
            .collect::<Vec<[f64; 3]>>()
    };
    assert_eq!(with(5), with(5));
    assert_ne!(with(5), with(6));
}

/// The criterion of volume gives a smaller ellipsoid, the criterion of intervals a smaller largest
/// interval.
#[test]
fn each_criterion_is_the_better_at_its_own() {
    let mut problem = on_ground();
    let intervals = design(&problem, &DesignSettings::default())
        .unwrap()
        .prediction;
    problem.criterion = Criterion::Volume;
    let volume = design(&problem, &DesignSettings::default())
        .unwrap()
        .prediction;
    assert!(intervals.largest().1 < volume.largest().1);
    assert!(volume.covariance.determinant() < intervals.covariance.determinant());
}

/// Joint efforts and all measurements combined have designs, too, and the combination is better.
#[test]
fn other_methods_have_designs() {
    let settings = DesignSettings {
        starts: 1,
        iterations: 10,
        ..DesignSettings::default()
    };
    let mut problem = on_ground();
    problem.sensing.equations.effort_noise = vec![0.3];
    problem.sensing.equations.method = Method::Effort;
    let effort = design(&problem, &settings).unwrap().prediction.largest().1;
    problem.sensing.equations.method = Method::Combined { effort: true };
    let combined = design(&problem, &settings).unwrap().prediction.largest().1;
    assert!(combined < effort, "{combined} {effort}");
    let mut orbit = in_orbit();
    orbit.sensing.equations.method = Method::JointSensing;
    let failed = design(&orbit, &settings);
    let error = failed.err().unwrap();
    assert_eq!(error.option(), Some("base_noise"), "{error}");
    orbit.sensing.base_noise = Some([1.0, 1.0, 1.0, 0.5, 0.5, 0.5]);
    let noisy = orbit
        .sensing
        .base_noise
        .map(|noise| noise.map(|std_dev| 3.0 * std_dev));
    let quiet = design(&orbit, &settings).unwrap();
    orbit.sensing.base_noise = noisy;
    let noisy = predict(&orbit, &quiet.trajectory).unwrap();
    let ratio = noisy.largest().1 / quiet.prediction.largest().1;
    assert!((ratio - 3.0).abs() < 1e-9, "{ratio}");
}

/// The shortest motion reaches its targets without exceeding them much, and targets out of reach
/// are an error.
#[test]
fn the_shortest_motion_just_reaches_the_targets() {
    let mut problem = on_ground();
    problem.targets = problem.targets.map(|target| 3.0 * target);
    let settings = ShortestSettings::default();
    let mut observer = |_: &_| ControlFlow::Continue(());
    let found = shortest(&problem, &settings, &mut observer).unwrap();
    let (_, ratio) = found.prediction.largest();
    assert!((0.8..=1.0).contains(&ratio), "{ratio}");
    problem.targets = problem.targets.map(|target| 1e-5 * target);
    let settings = ShortestSettings {
        longest_s: 4.0,
        ..settings
    };
    let error = shortest(&problem, &settings, &mut observer).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with("no motion of up to 4 s"), "{message}");
    assert!(message.contains(" binds"), "{message}");
}

/// A first duration in which the end cannot be reached is not the last one that is tried.
#[test]
fn the_shortest_motion_is_long_enough_for_its_end() {
    let mut problem = on_ground();
    problem.targets = problem.targets.map(|target| 30.0 * target);
    problem.duration_s = 0.4;
    let mut end = problem.start.clone();
    end[5] += 2.0;
    problem.end = End::At(end);
    let quick = DesignSettings {
        starts: 1,
        iterations: 4,
        ..DesignSettings::default()
    };
    let alone = design(&problem, &quick);
    assert!(matches!(alone, Err(ExcitationError::Impossible { .. })));
    let settings = ShortestSettings {
        design: quick,
        precision: 1.2,
        ..ShortestSettings::default()
    };
    let mut observer = |_: &_| ControlFlow::Continue(());
    let found = shortest(&problem, &settings, &mut observer).unwrap();
    let turned = found.trajectory.at(60.0).position[5] - problem.start[5];
    assert!((turned - 2.0).abs() < 1e-12, "{turned}");
}

/// The search ends where the shortest duration that is tried is a little too short.
#[test]
fn the_shortest_motion_may_be_a_little_longer_than_the_least() {
    let mut problem = on_ground();
    let shortest_s = 2.0 * window::length_s(problem.sensing.equations.cutoff_hz);
    let quick = DesignSettings {
        starts: 1,
        iterations: 4,
        ..DesignSettings::default()
    };
    problem.duration_s = 1.1 * shortest_s;
    let (_, ratio) = design(&problem, &quick).unwrap().prediction.largest();
    problem.targets = problem.targets.map(|target| 1.01 * ratio * target);
    let settings = ShortestSettings {
        design: quick,
        longest_s: problem.duration_s,
        precision: 1.001,
    };
    let mut designs = 0;
    let mut observer = |progress: &Progress| {
        designs += usize::from(progress.iteration == 0);
        if designs < 40 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    };
    let found = shortest(&problem, &settings, &mut observer).unwrap();
    let duration_s = found.trajectory.duration_s();
    assert!(
        duration_s > shortest_s && duration_s <= problem.duration_s,
        "{duration_s}"
    );
}

/// Settings of a search that would not end, or that have no duration to try, are errors.
#[test]
fn bad_settings_of_the_shortest_motion_are_errors() {
    let problem = on_ground();
    let settings = ShortestSettings::default();
    let with = |longest_s, precision| ShortestSettings {
        longest_s,
        precision,
        ..settings
    };
    let cases = [
        (
            with(0.01, 1.03),
            "`longest_s` is 0.01; expected at least two",
        ),
        (with(f64::NAN, 1.03), "`longest_s` is NaN"),
        (with(60.0, 1.0), "`precision` is 1; expected more than 1"),
        (with(60.0, f64::NAN), "`precision` is NaN"),
    ];
    for (settings, expected) in cases {
        let mut observer = |_: &_| ControlFlow::Continue(());
        let error = shortest(&problem, &settings, &mut observer).unwrap_err();
        assert!(error.to_string().starts_with(expected), "{error}");
    }
}

/// The observer sees the search progress, and stops it.
#[test]
fn an_observer_stops_the_search() {
    let problem = on_ground();
    let mut seen = Vec::new();
    let result = design_observed(&problem, &DesignSettings::default(), &mut |progress| {
        seen.push(progress.objective);
        if seen.len() < 6 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    assert!(matches!(result, Err(ExcitationError::Interrupted)));
    assert_eq!(seen.len(), 6);
    assert!(seen[5] < seen[0]);
}
