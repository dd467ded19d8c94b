use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::{Distribution, StandardNormal};

use super::*;
use tactid_dynamics::InertialParameters;
use tactid_identify::solve::values_of;
use tactid_identify::{BoundingBox, VALUE_NAMES, body_of_values, values_of_body};

/// A payload of 2 kg with all values different from zero.
pub(super) fn truth() -> Vector {
    let body = body_of_values(&[
        2.0, 0.03, -0.02, 0.11, 0.011, 1e-3, -2e-3, 0.017, 5e-4, 0.021,
    ]);
    *InertialParameters::from(body).as_vector()
}

/// A covariance of the linear parameters, with standard deviations of about 1 % and correlations.
pub(super) fn covariance(random: &mut SmallRng) -> Matrix {
    let size = [2.0, 0.2, 0.2, 0.2, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02];
    let mixed = Matrix::from_fn(|i, j| {
        let mixed: f64 = random.random_range(-0.3..0.3);
        0.01 * size[i] * if i == j { 1.0 } else { mixed }
    });
    mixed * mixed.transpose()
}

pub(super) fn normal(random: &mut SmallRng) -> Vector {
    Vector::from_fn(|_, _| StandardNormal.sample(random))
}

/// A run at a point, with noise of its covariance.
pub(super) fn run(random: &mut SmallRng, at: &Vector) -> LinearEstimate {
    let covariance = covariance(random);
    let root = covariance.cholesky().unwrap().l();
    LinearEstimate::with_known_noise(
        at + root * normal(random),
        covariance.try_inverse().unwrap(),
    )
}

pub(super) fn combined(runs: &[LinearEstimate]) -> Combination {
    combine_estimates("tool", runs, &PriorKnowledge::default(), None).unwrap()
}

pub(super) fn half_widths(combination: &Combination) -> [f64; 10] {
    combination.estimate.std_devs.map(|s| 1.96 * s)
}

#[track_caller]
fn assert_near(found: [f64; 10], expected: [f64; 10], relative: f64) {
    for k in 0..10 {
        let error = (found[k] - expected[k]).abs();
        assert!(
            error <= relative * expected[k].abs(),
            "{k}: {} {}",
            found[k],
            expected[k]
        );
    }
}

/// One run is its own combination. Four with the same information have its covariance divided by
/// four.
#[test]
fn covariance_is_divided_by_the_number_of_runs() {
    let mut random = SmallRng::seed_from_u64(1);
    let one = run(&mut random, &truth());
    let alone = combined(std::slice::from_ref(&one));
    assert_eq!(alone.agreement.degrees_of_freedom, 0.0);
    assert!(alone.agreement.agree && alone.findings.is_empty());
    let covariance = one.information.try_inverse().unwrap();
    let body = InertialParameters::from_vector(one.parameters);
    assert_near(
        alone.estimate.values(),
        values_of_body(&body.mass_properties().unwrap()),
        1e-9,
    );
    assert!((half_widths(&alone)[0] / (1.96 * covariance[(0, 0)].sqrt()) - 1.0).abs() < 1e-6);
    let near = |k: i32| LinearEstimate {
        parameters: one.parameters * (1.0 + 1e-9 * f64::from(k)),
        ..one.clone()
    };
    let four = combined(&[near(-2), near(-1), near(1), near(2)]);
    assert_near(four.estimate.values(), alone.estimate.values(), 1e-6);
    assert_near(
        half_widths(&four),
        half_widths(&alone).map(|half| half / 2.0),
        1e-6,
    );
    assert!((four.agreement.degrees_of_freedom - 30.0).abs() < 1e-6);
    assert!(four.agreement.p_value > 0.999 && four.between_runs == [0.0; 10]);
}

/// The order of the runs changes nothing but the indices.
#[test]
fn the_order_of_the_runs_does_not_matter() {
    let mut random = SmallRng::seed_from_u64(2);
    let mut runs: Vec<_> = [1.0, 1.0, 1.2, 1.0]
        .iter()
        .map(|gain| run(&mut random, &(truth() * *gain)))
        .collect();
    let forward = combined(&runs);
    runs.reverse();
    let backward = combined(&runs);
    assert_near(forward.estimate.values(), backward.estimate.values(), 1e-6);
    assert_near(half_widths(&forward), half_widths(&backward), 1e-6);
    let (a, b) = (&forward.agreement, &backward.agreement);
    assert!((a.chi_square / b.chi_square - 1.0).abs() < 1e-9);
    assert_eq!((a.largest.unwrap().run, b.largest.unwrap().run), (2, 1));
}

/// Runs without information along some directions are joined: each value is that of the run that
/// determines it, and only what both determine is compared.
#[test]
fn complementary_directions_become_identifiable() {
    let mut random = SmallRng::seed_from_u64(3);
    let only = |kept: &[usize], random: &mut SmallRng| {
        let whole = run(random, &truth());
        let keep = Matrix::from_diagonal(&Vector::from_fn(|k, _| {
            f64::from(u8::from(kept.contains(&k)))
        }));
        // Without information on the other parameters, whatever they are.
        let covariance = whole.information.try_inverse().unwrap();
        let rest = Matrix::identity() - keep;
        let information = keep * (keep * covariance * keep + rest).try_inverse().unwrap() * keep;
        LinearEstimate::with_known_noise(keep * whole.parameters, information)
    };
    let first = only(&[0, 1, 2, 4, 5, 7], &mut random);
    let second = only(&[0, 3, 6, 8, 9], &mut random);
    for alone in [&first, &second] {
        let alone = combined(std::slice::from_ref(alone));
        assert!(alone.estimate.identifiable().iter().any(|known| !known));
    }
    let both = combined(&[first.clone(), second]);
    assert_eq!(both.estimate.identifiable(), [true; 10]);
    assert!((both.agreement.degrees_of_freedom - 1.0).abs() < 1e-6);
    let error = both.estimate.body.center_of_mass.x - 0.03;
    assert!(error.abs() < half_widths(&both)[1] && half_widths(&both)[1] < 0.01);
    // A direction that no run determines stays unknown.
    let third = only(&[0, 1, 2, 4, 5, 7], &mut random);
    let same = combined(&[first, third]);
    assert!(same.estimate.std_devs[3].is_infinite());
    assert!((same.agreement.degrees_of_freedom - 6.0).abs() < 1e-6);
}

/// Fraction of draws in which the interval of each value contains the truth, and in which the runs
/// agree.
fn coverage(draws: u64, runs: usize, relative_spread: f64) -> ([f64; 10], f64) {
    let mut random = SmallRng::seed_from_u64(4);
    let (mut held, mut agreed) = ([0.0; 10], 0.0);
    let expected = values_of(&truth()).unwrap();
    let [mass, length] = size(&truth());
    for _ in 0..draws {
        let runs: Vec<LinearEstimate> = (0..runs)
            .map(|_| {
                let drawn = normal(&mut random);
                let varied = std::array::from_fn(|k| {
                    let unit = [mass, length, mass * length * length][kind(k)];
                    expected[k] + relative_spread * unit * drawn[k]
                });
                let body = InertialParameters::from(body_of_values(&varied));
                run(&mut random, body.as_vector())
            })
            .collect();
        let found = combined(&runs);
        let (values, half_widths) = (found.estimate.values(), half_widths(&found));
        for k in 0..10 {
            let is_held = (values[k] - expected[k]).abs() <= half_widths[k];
            held[k] += f64::from(u8::from(is_held)) / draws as f64;
        }
        agreed += f64::from(u8::from(found.agreement.agree)) / draws as f64;
    }
    (held, agreed)
}

/// The 95 % intervals contain the truth in 93 to 97.5 % of 800 draws, with and without a spread
/// between the runs, and the verdict is right: a false alarm is rare, and a spread of some times
/// the noise is always noticed.
#[test]
fn intervals_hold_with_and_without_spread() {
    for (runs, spread) in [(2, 0.0), (3, 0.0), (6, 0.0), (3, 0.1), (6, 0.03)] {
        let (held, agreed) = coverage(800, runs, spread);
        for (name, held) in VALUE_NAMES.iter().zip(held) {
            assert!(
                (0.93..=0.975).contains(&held),
                "{runs} {spread} {name}: {held}"
            );
        }
        if spread == 0.0 {
            assert!((0.96..=0.995).contains(&agreed), "{runs}: {agreed}");
        } else {
            assert_eq!(agreed, 0.0);
        }
    }
}

/// One run with a gain that is 10 % off is named with the value and the difference. It widens the
/// interval of what it changes, even where its own noise is the smallest, and leaves the centre of
/// mass known.
#[test]
fn a_run_with_another_gain_is_named() {
    let mut random = SmallRng::seed_from_u64(5);
    let (mut covered, mut others_agree) = (0, 0);
    for draw in 0..50 {
        let mut runs: Vec<_> = (0..3).map(|_| run(&mut random, &truth())).collect();
        let odd = draw % 3;
        runs[odd].information *= 25.0;
        runs[odd].covariance /= 25.0;
        runs[odd].parameters = 1.1 * truth() + 0.2 * (runs[odd].parameters - truth());
        let found = combined(&runs);
        assert!(!found.agreement.agree);
        let [Finding::Data(Data::RunsDisagree(disagreement))] = &found.findings[..] else {
            panic!("{:?}", found.findings);
        };
        let name = format!("recording {}", odd + 1);
        assert_eq!(
            (disagreement.run.as_ref(), disagreement.runs),
            (Some(&name), 3)
        );
        let (sigmas, others) = (
            disagreement.sigmas.unwrap(),
            disagreement.of_others.unwrap(),
        );
        assert!(sigmas * others > 0.0, "{disagreement:?}");
        let half_widths = half_widths(&found);
        covered += u32::from((found.estimate.body.mass_kg - 2.0).abs() < half_widths[0]);
        let others: Vec<_> = (0..3)
            .filter(|k| *k != odd)
            .map(|k| runs[k].clone())
            .collect();
        let others = combined(&others);
        if others.agreement.agree {
            others_agree += 1;
            assert!(half_widths[0] > 3.0 * self::half_widths(&others)[0]);
        }
        let known = half_widths[1] / half_widths[0] * found.estimate.body.mass_kg;
        assert!(known < 0.3, "{known}");
    }
    assert!(
        covered >= 48 && others_agree >= 47,
        "{covered} {others_agree}"
    );
}

/// Of two runs that disagree none is named, and the interval is that of one degree of freedom.
#[test]
fn two_runs_that_disagree_have_a_wide_interval() {
    let information = Matrix::from_diagonal(&truth().map(|entry| (0.001 * entry).powi(-2)));
    let at = |gain: f64| LinearEstimate::with_known_noise(gain * truth(), information);
    let found = combined(&[at(1.0), at(1.1)]);
    let [Finding::Data(Data::RunsDisagree(disagreement))] = &found.findings[..] else {
        panic!("{:?}", found.findings);
    };
    assert_eq!(
        (&disagreement.run, disagreement.others_agree),
        (&None, false)
    );
    // Half of the difference, 0.1 kg, is the standard deviation of the mean of two; t = 12.706.
    let half_width = half_widths(&found)[0];
    assert!(
        (half_width / (12.706 * 0.1) - 1.0).abs() < 1e-3,
        "{half_width}"
    );
    let (difference, others) = (disagreement.difference, disagreement.of_others);
    let relative = difference.unwrap() / others.unwrap();
    assert!((relative - 0.1).abs() < 0.02, "{disagreement:?}");
}

/// A value that only one run determines has the relative spread that the others show.
#[test]
fn a_value_of_one_run_has_the_spread_of_the_others() {
    let mut random = SmallRng::seed_from_u64(6);
    let gains = [1.0, 1.1, 0.9];
    let mut runs = gains.map(|gain| run(&mut random, &(gain * truth())));
    for run in &mut runs[1..] {
        let known = run.information.try_inverse().unwrap();
        let known = known.fixed_view::<4, 4>(0, 0).try_inverse().unwrap();
        let mut information = Matrix::zeros();
        information.fixed_view_mut::<4, 4>(0, 0).copy_from(&known);
        *run = LinearEstimate::with_known_noise(run.parameters, information);
    }
    let found = combined(&runs);
    let of_mass = found.between_runs[0] / found.estimate.body.mass_kg;
    let [mass, length] = size(&truth());
    let of_inertia = found.between_runs[4] / (mass * length * length);
    assert!(
        of_mass > 0.05 && of_inertia > 0.9 * of_mass,
        "{of_mass} {of_inertia}"
    );
    let half_width = half_widths(&found)[4];
    assert!(half_width > 2.0 * found.between_runs[4], "{half_width}");
}

/// A known mass counts once, and makes an exact mass exact.
#[test]
fn a_known_mass_counts_once() {
    let mut random = SmallRng::seed_from_u64(7);
    let runs: Vec<_> = (0..4).map(|_| run(&mut random, &truth())).collect();
    let with = |std_dev_kg| {
        let settings = PriorKnowledge {
            known_mass: Some(KnownMass {
                mass_kg: 2.0,
                std_dev_kg,
            }),
            bounding_box: None,
        };
        combine_estimates("tool", &runs, &settings, None).unwrap()
    };
    assert!((with(1e-4).estimate.std_devs[0] / 1e-4 - 1.0).abs() < 1e-3);
    let exact = with(0.0).estimate;
    assert_eq!(exact.std_devs[0], 0.0);
    assert!((exact.body.mass_kg - 2.0).abs() < 1e-6);
}

/// The combined payload is a body that can exist, within the box, and one far from the runs is
/// reported.
#[test]
fn the_combined_payload_is_consistent() {
    let mut random = SmallRng::seed_from_u64(8);
    let plate = *InertialParameters::from(body_of_values(&[
        2.0, 0.0, 0.0, 0.1, 0.01, 0.0, 0.0, 0.02, 0.0, 0.01,
    ]))
    .as_vector();
    let runs: Vec<_> = (0..3).map(|_| run(&mut random, &plate)).collect();
    assert!(combined(&runs).estimate.is_physical);
    let settings = PriorKnowledge {
        known_mass: None,
        bounding_box: Some(BoundingBox {
            min: nalgebra::Vector3::new(-0.3, -0.3, -0.3),
            max: nalgebra::Vector3::new(0.3, 0.3, 0.0),
        }),
    };
    let found = combine_estimates("tool", &runs, &settings, None).unwrap();
    assert!(found.estimate.body.center_of_mass.z <= 0.0);
    let [Finding::Data(Data::Inconsistent { within_box, .. })] = found.findings[..] else {
        panic!("{:?}", found.findings);
    };
    assert!(within_box);
}

/// A weighing knows nothing of the noise of the recordings, so the test of a shape has the degrees of
/// freedom of the recordings, whether the mass is known or not.
#[test]
fn a_known_mass_leaves_the_degrees_of_freedom_of_the_noise() {
    let mut measured = run(&mut SmallRng::seed_from_u64(10), &truth());
    measured.degrees_of_freedom = 13.0;
    let mean = truth().remove_row(0) / truth()[0];
    let std_devs = mean.map(|entry| 0.02 * entry);
    let shape = ShapePrior {
        mean: mean.into(),
        covariance: nalgebra::SMatrix::from_diagonal(&std_devs.component_mul(&std_devs)).into(),
    };
    let weighed = KnownMass {
        mass_kg: 2.0,
        std_dev_kg: 1e-3,
    };
    for known_mass in [None, Some(weighed)] {
        let prior = PriorKnowledge {
            known_mass,
            bounding_box: None,
        };
        let runs = std::slice::from_ref(&measured);
        let found = combine_estimates("tool", runs, &prior, Some(&shape)).unwrap();
        let fit = found.shape.unwrap();
        let expected =
            tactid_batch::distributions::f_p(fit.chi_square, fit.degrees_of_freedom, 13.0);
        assert_eq!(fit.p_value, expected, "{known_mass:?}");
    }
}

/// No runs, and information that is none, are errors that name the run. Runs without any
/// information are not.
#[test]
fn bad_input_is_an_error() {
    let settings = PriorKnowledge::default();
    let error = combine_estimates("tool", &[], &settings, None).unwrap_err();
    assert_eq!(error.to_string(), "there is no recording to combine");
    let good = run(&mut SmallRng::seed_from_u64(9), &truth());
    let with = |change: &dyn Fn(&mut LinearEstimate)| {
        let mut bad = good.clone();
        change(&mut bad);
        combine_estimates("tool", &[good.clone(), bad], &settings, None)
    };
    let changes: [&dyn Fn(&mut LinearEstimate); 8] = [
        &|bad| bad.degrees_of_freedom = 0.0,
        &|bad| bad.parameters[3] = f64::NAN,
        &|bad| bad.information[(1, 2)] = f64::INFINITY,
        &|bad| bad.information[(1, 1)] *= -1.0,
        &|bad| bad.covariance[(1, 1)] *= -1.0,
        &|bad| bad.covariance[(1, 1)] = f64::NAN,
        &|bad| bad.shared.changes = GainErrors::repeat(1, f64::NAN),
        &|bad| bad.information[(0, 1)] += 1e3 * bad.information[(0, 0)],
    ];
    for change in changes {
        let error = with(change).unwrap_err();
        let place = "the information or the covariance of recording 2 ";
        assert!(error.to_string().starts_with(place), "{error}");
    }
    let nothing = with(&|none| none.information = Matrix::zeros()).unwrap();
    assert!(nothing.agreement.agree && nothing.estimate.identifiable() == [true; 10]);
    let none = LinearEstimate::with_known_noise(Vector::zeros(), Matrix::zeros());
    let unknown = combined(&[none.clone(), none]);
    assert_eq!(unknown.estimate.identifiable(), [false; 10]);
    assert!(unknown.agreement.agree && unknown.agreement.degrees_of_freedom == 0.0);
}
