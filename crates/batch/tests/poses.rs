//! Poses at rest: the payload from a few attitudes, without times.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{Finding, RestIdentifier};
use tactid_dynamics::{InertialParameters, Manipulator, MassProperties};
use tactid_identify::{EquationSettings, KnownTool, Wrench};

use crate::at_rest::*;

/// Exact wrenches give exact values, in a tip frame that is not that of the sensor and with a known
/// tool. The inertia is unobservable.
#[test]
fn exact_wrenches_give_exact_values() {
    let tool = MassProperties {
        mass_kg: 0.5,
        center_of_mass: Vector3::new(0.0, 0.01, 0.02),
        inertia: nalgebra::Matrix3::identity() * 1e-3,
    };
    let robot = sensor_below_the_tip();
    let identifier = RestIdentifier::new(
        &robot,
        "tip",
        &["sensor"],
        &settings(true),
        Some(tool.into()),
    )
    .unwrap();
    let samples = poses(6, &mut SmallRng::seed_from_u64(1));
    let attitudes: Vec<_> = samples.iter().map(|sample| sample.0).collect();
    let result = solve(identifier, &exact(&attitudes)).unwrap();
    let tip = Isometry3::new(Vector3::new(0.0, 0.02, 0.1), Vector3::z() * 0.5);
    let whole = tip.inverse_transform_vector(&(CENTER - tip.translation.vector));
    let center = (whole * MASS_KG - tool.center_of_mass * 0.5) / (MASS_KG - 0.5);
    let body = &result.estimate.body;
    assert!((body.mass_kg - 0.7).abs() < 1e-9, "{body:?}");
    assert!((body.center_of_mass - center).norm() < 1e-9, "{body:?}");
    let unobservable: Vec<_> = result.estimate.unobservable().collect();
    assert_eq!(unobservable, ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"]);
    let offset = result.fit.wrench_offset.as_ref().unwrap();
    assert_eq!(&*offset.frame, "sensor");
    for (found, truth) in offset.values().iter().zip(OFFSET) {
        assert!((found - truth).abs() < 1e-9, "{offset:?}");
    }
}

/// A sensor of three forces, or of one, determines no more than they show, with intervals that
/// contain the truth: the mass alone where it stands at the tip.
#[test]
fn forces_alone_determine_the_mass() {
    for measured in [vec![0, 1, 2], vec![2]] {
        let unmeasured = std::array::from_fn(|channel| !measured.contains(&channel));
        let given = EquationSettings {
            unmeasured,
            ..settings(true)
        };
        let (mut inside, draws) = (0, 200);
        for seed in 0..draws {
            let mut samples = poses(8, &mut SmallRng::seed_from_u64(seed));
            for (_, wrench) in &mut samples {
                wrench.moment.fill(0.0);
                for axis in (0..3).filter(|axis| unmeasured[*axis]) {
                    wrench.force[axis] = 0.0;
                }
            }
            let robot = Manipulator::lone_body("sensor");
            let identifier = RestIdentifier::new(&robot, "sensor", &["sensor"], &given, None);
            let result = solve(identifier.unwrap(), &samples).unwrap();
            assert_eq!(resting(&result).attitudes, 8);
            let [low, high] = result.estimate.intervals[0];
            inside += usize::from((low..high).contains(&MASS_KG));
            let identifiable: Vec<_> = result.estimate.identifiable().into_iter().collect();
            assert!(identifiable[0] && !identifiable[1..].contains(&true));
            let found = resting(&result);
            assert_eq!(found.moment_noise, 0.0);
            assert!((0.01..0.15).contains(&found.force_noise), "{found:?}");
            let next = found.next.as_ref().unwrap();
            assert!((0.0..=1.0).contains(&next.fraction), "{found:?}");
            let freedom = result.linear.degrees_of_freedom;
            let expected = 7.0 * measured.len() as f64 - 1.0;
            assert!((freedom - expected).abs() < 1e-6, "{freedom}");
            let words = Finding::PosesAtRest(found.clone()).to_string();
            assert!(!words.contains("N m"), "{words}");
        }
        assert!((184..=198).contains(&inside), "{measured:?}: {inside}");
    }
}

/// The 95 % intervals of mass, centre of mass and offset contain the truth in 93 to 97 % of 2000
/// draws of 6 to 24 poses.
#[test]
fn intervals_hold_for_few_and_many_poses() {
    let mut inside = [0; 10];
    const DRAWS: usize = 2000;
    for seed in 0..DRAWS {
        let mut random = SmallRng::seed_from_u64(seed as u64);
        let count = random.random_range(6..25);
        let result = identify(&poses(count, &mut random)).unwrap();
        count_inside(&result, &mut inside);
    }
    let all: usize = inside.iter().sum();
    assert!(
        (0.94..0.96).contains(&(all as f64 / (10.0 * DRAWS as f64))),
        "{inside:?}"
    );
    check_coverage(&inside, DRAWS);
}

/// Two attitudes leave a direction of the centre of mass open. An axis that is almost across it has
/// an interval that contains the truth, or none.
#[test]
fn intervals_hold_for_two_attitudes() {
    let (mut known, mut missed) = (0, 0);
    for seed in 0..1000 {
        let result = identify(&poses(2, &mut SmallRng::seed_from_u64(seed))).unwrap();
        for (k, truth) in CENTER.iter().enumerate() {
            let [low, high] = result.estimate.intervals[1 + k];
            known += usize::from(high.is_finite());
            missed += usize::from(!(low..high).contains(truth));
        }
    }
    assert!(20 * missed <= known, "{missed} of {known}");
}

/// A hundred samples of one pose are one equation: the result is that of their mean.
#[test]
fn samples_of_a_pose_count_once() {
    let mut random = SmallRng::seed_from_u64(5);
    let means = poses(8, &mut random);
    let many: Vec<_> = means
        .iter()
        .flat_map(|(attitude, mean)| {
            (0..100).map(|k| {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                let shift = Vector3::new(0.3, 0.1, -0.2) * sign;
                let noisy = Wrench {
                    force: mean.force + shift,
                    moment: mean.moment + 0.1 * shift,
                };
                (*attitude, noisy)
            })
        })
        .collect();
    let [once, many] = [means, many].map(|samples| identify(&samples).unwrap());
    assert_eq!((resting(&many).attitudes, resting(&many).samples), (8, 800));
    for k in 0..4 {
        let relative = many.estimate.std_devs[k] / once.estimate.std_devs[k];
        assert!((relative - 1.0).abs() < 1e-6, "{k}: {relative}");
    }
}

/// One attitude cannot distinguish an offset from a weight; two determine the mass, and three the
/// centre of mass.
#[test]
fn the_number_of_attitudes_decides_what_is_identifiable() {
    let all = [
        UnitQuaternion::identity(),
        about(Vector3::x(), 1.5),
        about(Vector3::y(), 1.2),
    ];
    for turned in [all[0], about(Vector3::z(), 1.0)] {
        let error = identify(&exact(&[all[0], turned])).unwrap_err();
        assert_eq!(error.option(), Some("wrench_offset"), "{error}");
    }
    let determined = |count: usize| {
        let result = identify(&exact(&all[..count])).unwrap();
        let determines = result.estimate.identifiable();
        [
            determines[0],
            determines[1] && determines[2] && determines[3],
        ]
    };
    assert_eq!([2, 3].map(determined), [[true, false], [true, true]]);
    let robot = Manipulator::lone_body("sensor");
    let nothing = RestIdentifier::new(&robot, "sensor", &["sensor"], &settings(true), None);
    assert!(nothing.unwrap().solve().is_err());
}

/// The further attitude is one that shows what the others do not: gravity has been along -z, -y and
/// -z again, so that the centre of mass along x is missing.
#[test]
fn the_next_attitude_is_across_the_others() {
    let attitudes = [
        UnitQuaternion::identity(),
        about(Vector3::x(), 1.5),
        about(Vector3::x(), -1.5),
        about(Vector3::x(), 3.1),
    ];
    let mut noise = SmallRng::seed_from_u64(7);
    let mut noise = || noise.sample(StandardNormal);
    let samples: Vec<_> = attitudes
        .iter()
        .map(|each| (*each, wrench(each, &mut noise)))
        .collect();
    let result = identify(&samples).unwrap();
    let next = resting(&result).next.as_ref().unwrap();
    assert!(next.gravity[0] != 0.0, "{next:?}");
    assert_eq!(next.gravity[1..], [0.0, 0.0], "{next:?}");
}

/// The covariance of a known tool has a share in the inertia, which poses do not show: that makes
/// no inertia of the payload inconsistent.
#[test]
fn an_uncertain_tool_is_subtracted() {
    let tool = MassProperties {
        mass_kg: 0.5,
        center_of_mass: Vector3::new(0.0, 0.0, 0.06),
        inertia: nalgebra::Matrix3::identity() * 1e-3,
    };
    let parameters = InertialParameters::from(tool);
    let variances = parameters.as_vector().map(|value| (0.01 * value).powi(2));
    let tool = KnownTool {
        body: tool,
        covariance: nalgebra::SMatrix::from_diagonal(&variances),
    };
    let robot = Manipulator::lone_body("sensor");
    let sensors = ["sensor"];
    let identifier = RestIdentifier::new(&robot, "sensor", &sensors, &settings(true), Some(tool));
    let samples = poses(8, &mut SmallRng::seed_from_u64(3));
    let estimate = solve(identifier.unwrap(), &samples).unwrap().estimate;
    let error_kg = estimate.body.mass_kg - (MASS_KG - 0.5);
    assert!(error_kg.abs() < 3.0 * estimate.std_devs[0], "{estimate:?}");
    assert!(estimate.std_devs[0] < 0.02);
}
