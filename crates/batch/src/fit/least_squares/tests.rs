//! The batch fit on synthetic equations.

use nalgebra::{SMatrix, SVector, Vector6};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_identify::KnownMass;
use tactid_identify::equations::{Channels, Row};

use super::*;
use crate::fit::normal_equations::NormalEquations;

mod lasting_errors;

const FORCE_NOISE: f64 = 0.3;
const MOMENT_NOISE: f64 = 0.02;

fn truth() -> SVector<f64, 10> {
    SVector::from([3.0, 0.2, -0.1, 0.4, 0.5, 0.01, -0.02, 0.6, 0.03, 0.3])
}

/// Wrenches of a smooth random motion with white noise, each `delay_s` later than its motion.
pub(super) fn equations(count: usize, seed: u64, noise: f64, delay_s: f64) -> Vec<Equation> {
    let mut random = SmallRng::seed_from_u64(seed);
    let mut phases = [[0.0; 10]; 6];
    let mut rates = [[0.0; 10]; 6];
    for value in phases.iter_mut().flatten() {
        *value = random.random_range(0.0..6.0);
    }
    for value in rates.iter_mut().flatten() {
        *value = random.random_range(2.0..9.0);
    }
    let row_at = |channel: usize, time_s: f64| {
        SVector::<f64, 10>::from_fn(|k, _| (rates[channel][k] * time_s + phases[channel][k]).sin())
    };
    let mut equation_at = |time_s: f64| {
        let mut equation = Equation::new(6);
        equation.time_s = time_s;
        for channel in 0..6 {
            let target = |at_s: f64| row_at(channel, at_s).dot(&truth());
            let size = if channel < 3 {
                FORCE_NOISE
            } else {
                MOMENT_NOISE
            };
            let draw: f64 = random.sample(StandardNormal);
            equation.rows[channel] = Row {
                regressor: row_at(channel, time_s),
                target: target(time_s - delay_s) + noise * size * draw,
                gravity: nalgebra::Vector4::zeros(),
                gain_error: 0.0,
            };
            let step_s = 1e-4;
            equation.rates[channel] = (target(time_s - delay_s + step_s)
                - target(time_s - delay_s - step_s))
                / (2.0 * step_s);
        }
        equation
    };
    (0..count).map(|k| equation_at(0.05 * k as f64)).collect()
}

fn fit_wrench(equations: &[Equation]) -> Fit {
    fit(equations, FitOptions::new(&Channels::of_wrench())).unwrap()
}

/// Without noise the parameters are exact to rounding.
#[test]
fn exact_equations_give_exact_parameters() {
    let found = fit_wrench(&equations(60, 1, 0.0, 0.0));
    assert!((found.parameters - truth()).amax() < 1e-12);
}

/// Over 400 draws of the noise, the estimate has no bias, the channels have the standard deviations
/// that were drawn, and the errors have the covariance of the fit. The mean of 400 squares of a
/// standard normal variable has a standard deviation of 0.07.
#[test]
fn errors_have_the_covariance_of_the_fit() {
    const RUNS: u64 = 400;
    let mut squares = SVector::<f64, 10>::zeros();
    let mut sum = SVector::<f64, 10>::zeros();
    let mut channels = [0.0; 6];
    for seed in 0..RUNS {
        let found = fit_wrench(&equations(300, seed, 1.0, 0.0));
        let std_devs = found.covariance.diagonal().map(f64::sqrt);
        let error = (found.parameters - truth()).component_div(&std_devs);
        sum += error;
        squares += error.component_mul(&error);
        for (mean, std_dev) in channels.iter_mut().zip(&found.noise.std_devs) {
            *mean += std_dev / RUNS as f64;
        }
    }
    let mean = sum / (RUNS as f64).sqrt();
    assert!(mean.amax() < 4.0, "bias {mean}");
    let ratio = squares / RUNS as f64;
    assert!(ratio.min() > 0.75 && ratio.max() < 1.35, "{ratio}");
    for (channel, mean) in channels.into_iter().enumerate() {
        let size = if channel < 3 {
            FORCE_NOISE
        } else {
            MOMENT_NOISE
        };
        assert!((mean / size - 1.0).abs() < 0.05, "{channel}: {mean}");
    }
}

/// Noise in the motion biases plain least squares towards zero. The errors-in-variables bias
/// correction removes the bias. The noise is a tenth of the motion, so the bias would be a
/// hundredth.
#[test]
fn noise_in_the_motion_causes_no_bias() {
    const RUNS: u64 = 100;
    let mut sums = [SVector::<f64, 10>::zeros(); 2];
    let mut squares = SVector::<f64, 10>::zeros();
    for seed in 0..RUNS {
        let mut noisy = equations(400, seed, 0.1, 0.0);
        let mut random = SmallRng::seed_from_u64(1000 + seed);
        for equation in &mut noisy {
            for (row, difference) in equation.rows.iter_mut().zip(&mut equation.differences) {
                for k in 0..10 {
                    let half = |draw: f64| 0.1 * draw / std::f64::consts::SQRT_2;
                    let even = half(random.sample(StandardNormal));
                    let odd = half(random.sample(StandardNormal));
                    row.regressor[k] += even + odd;
                    difference.regressor[k] = even - odd;
                }
            }
        }
        let corrected = fit_wrench(&noisy);
        for equation in &mut noisy {
            equation.differences.fill(Row::zero());
        }
        let plain = fit_wrench(&noisy);
        for (sum, found) in sums.iter_mut().zip([&corrected, &plain]) {
            *sum += (found.parameters - truth()) / RUNS as f64;
        }
        squares += (corrected.parameters - truth()).map(|error| error * error);
    }
    let std_devs = squares.map(|square| square.sqrt() / RUNS as f64);
    let [corrected, plain] = sums.map(|sum| sum.component_div(&std_devs));
    assert!(corrected.amax() < 4.0, "{corrected}");
    assert!(plain[0] < -10.0, "{plain}");
}

/// Noise that channels share is separated from the motion: the error falls to that of the
/// independent noise.
#[test]
fn shared_noise_is_separated() {
    let (mut squares, mut variances) = (0.0, 0.0);
    for seed in 0..100 {
        let mut shaken = equations(300, seed, 0.1, 0.0);
        let mut random = SmallRng::seed_from_u64(2000 + seed);
        for equation in &mut shaken {
            let draw: f64 = random.sample(StandardNormal);
            for row in &mut equation.rows[..3] {
                row.target += FORCE_NOISE * draw;
            }
        }
        let found = fit_wrench(&shaken);
        squares += (found.parameters[0] - truth()[0]).powi(2);
        variances += found.covariance[(0, 0)];
    }
    // Three channels with the same noise have two differences, with a tenth of the noise: 600 rows
    // of mean square 1/2 determine a parameter to 0.1 · 0.3 / √300. With independent noise it would
    // be ten times that.
    let expected = 100.0 * (0.1 * FORCE_NOISE).powi(2) / 300.0;
    assert!(squares < 2.0 * expected, "{squares} {expected}");
    assert!(
        (squares / variances - 1.0).abs() < 0.6,
        "{squares} {variances}"
    );
}

/// 28 windows, with noise that is correlated between neighbours as by the filter, and with the
/// noise of the forces in the moments, which depend on nine of ten parameters. Of 1000 intervals of
/// 95 % at least 91 % contain the truth, with a scatter of 0.7 %. Twice as many fail where the
/// fitted part of the noise is ignored.
#[test]
fn intervals_from_few_windows_have_their_coverage() {
    const RUNS: u64 = 1000;
    // Correlation 0.27 between neighbours, as for windows of white noise that overlap by two
    // thirds.
    const SHARED: f64 = 0.29;
    let mut inside = SVector::<f64, 10>::zeros();
    for seed in 0..RUNS {
        let mut noisy = equations(28, seed, 0.0, 0.0);
        let mut random = SmallRng::seed_from_u64(10_000 + seed);
        let mut draw = || SVector::<f64, 6>::from_fn(|_, _| random.sample(StandardNormal));
        let mut before = draw();
        for equation in &mut noisy {
            let now = draw();
            let noise = (now + SHARED * before) / (1.0 + SHARED * SHARED).sqrt();
            before = now;
            // Forces depend on mass and centre of mass, moments on all but the mass.
            for row in &mut equation.rows[..3] {
                row.regressor.fixed_rows_mut::<6>(4).fill(0.0);
                row.target = row.regressor.dot(&truth());
            }
            for row in &mut equation.rows[3..] {
                row.regressor[0] = 0.0;
                row.target = row.regressor.dot(&truth());
            }
            for channel in 0..3 {
                let moment = MOMENT_NOISE * (noise[channel + 3] + 3.0 * noise[channel]);
                equation.rows[channel].target += FORCE_NOISE * noise[channel];
                equation.rows[channel + 3].target += moment;
            }
        }
        let found = fit_wrench(&noisy);
        let std_devs = found.covariance.diagonal().map(f64::sqrt);
        let error = (found.parameters - truth()).component_div(&std_devs);
        inside += error.map(|error| f64::from(error.abs() < 1.96) / RUNS as f64);
    }
    assert!(inside.min() > 0.91 && inside.max() < 0.97, "{inside}");
}

/// Outliers of a hundred standard deviations in one window of twenty move the estimate by less than
/// the noise, and are identified.
#[test]
fn outliers_have_no_influence() {
    let clean = equations(400, 7, 1.0, 0.0);
    let mut hit = clean.clone();
    for equation in hit.iter_mut().step_by(20) {
        for row in &mut equation.rows[..3] {
            row.target += 100.0 * FORCE_NOISE;
        }
    }
    let (without, with) = (fit_wrench(&clean), fit_wrench(&hit));
    let std_devs = without.covariance.diagonal().map(f64::sqrt);
    let moved = (with.parameters - without.parameters).component_div(&std_devs);
    assert!(moved.amax() < 1.0, "{moved}");
    for window in 0..hit.len() {
        assert_eq!(with.is_outlier(window), window % 20 == 0, "{window}");
    }
}

/// A short delay of the load is estimated with its sign and within its standard deviation; without
/// noise, to second order.
#[test]
fn a_delay_is_estimated() {
    let channels = Channels::of_wrench();
    let delay_of = |equations: &[Equation]| {
        let options = FitOptions::new(&channels);
        delay(equations, &fit_wrench(equations), options).unwrap()
    };
    let Delay { delay_s, .. } = delay_of(&equations(300, 3, 0.0, 1e-4));
    assert!((delay_s - 1e-4).abs() < 1e-7, "{delay_s}");
    let Delay { delay_s, std_dev_s } = delay_of(&equations(300, 3, 1.0, -2e-3));
    assert!(
        (delay_s + 2e-3).abs() < 4.0 * std_dev_s,
        "{delay_s} {std_dev_s}"
    );
    assert!(std_dev_s < 1e-3, "{std_dev_s}");
}

/// A parameter that no row contains is unobservable, and does not affect the others.
#[test]
fn a_direction_without_rows_is_unobservable() {
    let mut blind = equations(60, 5, 0.0, 0.0);
    for row in blind.iter_mut().flat_map(|equation| &mut equation.rows) {
        row.target -= row.regressor[4] * truth()[4];
        row.regressor[4] = 0.0;
    }
    let found = fit_wrench(&blind);
    let unobservable = found.null_space.directions();
    assert_eq!(unobservable.len(), 1);
    assert!((unobservable[0][4].abs() - 1.0).abs() < 1e-9);
    let mut error = found.parameters - truth();
    error[4] = 0.0;
    assert!(error.amax() < 1e-12, "{error}");
}

/// There is no fit to too few rows.
#[test]
fn too_few_equations_have_no_fit() {
    assert!(
        fit(
            &equations(3, 1, 0.0, 0.0),
            FitOptions::new(&Channels::of_wrench())
        )
        .is_none()
    );
    assert!(fit(&[], FitOptions::new(&Channels::of_wrench())).is_none());
}

fn fit_with_mass(equations: &[Equation], mass_kg: f64, std_dev_kg: f64) -> Fit {
    let mass = KnownMass {
        mass_kg,
        std_dev_kg,
    };
    let channels = Channels::of_wrench();
    let options = FitOptions {
        known_mass: Some(mass.with(0.0)),
        ..FitOptions::new(&channels)
    };
    fit(equations, options).unwrap()
}

/// An exact mass moves the other parameters as conditioning the estimate without it does, and their
/// covariance is the conditional one. With fixed weights both are exact to rounding.
#[test]
fn a_known_mass_conditions_the_others() {
    let equations = equations(200, 11, 1.0, 0.0);
    let alone = fit_wrench(&equations);
    let channels = Channels::of_wrench();
    let with_mass = |mass| {
        let options = FitOptions {
            weights_of: Some(&alone),
            known_mass: mass,
            ..FitOptions::new(&channels)
        };
        fit(&equations, options).unwrap()
    };
    let exact = KnownMass {
        mass_kg: 3.0,
        std_dev_kg: 0.0,
    };
    let (alone, found) = (with_mass(None), with_mass(Some(exact.with(0.0))));
    assert!((found.parameters[0] - 3.0).abs() < 1e-9);
    // The metric is that of the information, not of the covariance, which depends on the residuals.
    let mut normal_equations = NormalEquations::with_known_mass(&alone);
    for (window, equation) in equations.iter().enumerate() {
        normal_equations.add(equation, window);
    }
    let scales = SMatrix::from_diagonal(alone.scales());
    let inverse = scales * normal_equations.information().try_inverse().unwrap() * scales;
    let gain = inverse.column(0) / inverse[(0, 0)];
    let expected = alone.parameters + gain * (3.0 - alone.parameters[0]);
    let std_devs = alone.covariance.diagonal().map(f64::sqrt);
    let off = (found.parameters - expected).component_div(&std_devs);
    assert!(off.amax() < 1e-6, "{off}");
    let narrower = found
        .covariance
        .diagonal()
        .map(f64::sqrt)
        .component_div(&std_devs);
    assert!(narrower[0] < 1e-5 && narrower.max() < 1.1, "{narrower}");
}

/// A known mass with the standard deviation of the estimate without it improves the mass by about
/// the root of two, and all errors have the covariance of the fit.
#[test]
fn errors_with_a_known_mass_have_the_covariance_of_the_fit() {
    const RUNS: u64 = 100;
    let (mut squares, mut variances) = (SVector::<f64, 10>::zeros(), SVector::<f64, 10>::zeros());
    let mut alone = 0.0;
    for seed in 0..RUNS {
        let equations = equations(200, seed, 1.0, 0.0);
        let without = fit_wrench(&equations);
        alone += without.covariance[(0, 0)];
        let std_dev_kg = without.covariance[(0, 0)].sqrt();
        let mut random = SmallRng::seed_from_u64(3000 + seed);
        let draw: f64 = random.sample(StandardNormal);
        let found = fit_with_mass(&equations, truth()[0] + std_dev_kg * draw, std_dev_kg);
        squares += (found.parameters - truth()).map(|error| error * error);
        variances += found.covariance.diagonal();
    }
    // The mean of 100 squares scatters by 14 %.
    let ratio = squares.component_div(&variances);
    assert!(ratio.min() > 0.5 && ratio.max() < 1.6, "{ratio}");
    let gain = variances[0] / alone;
    assert!((0.45..0.6).contains(&gain), "{gain}");
}

/// Where the rows determine only the sum of mass and a first moment, a known mass determines both.
#[test]
fn a_known_mass_makes_the_first_moment_observable() {
    let mut mixed = equations(100, 12, 0.1, 0.0);
    for row in mixed.iter_mut().flat_map(|equation| &mut equation.rows) {
        row.target += (row.regressor[1] - row.regressor[0]) * truth()[0];
        row.regressor[0] = row.regressor[1];
    }
    assert_eq!(fit_wrench(&mixed).null_space.directions().len(), 1);
    let found = fit_with_mass(&mixed, 3.0, 0.0);
    assert_eq!(found.null_space.directions().len(), 0);
    let off = found.parameters - truth();
    let std_devs = found
        .covariance
        .diagonal()
        .map(|variance| 4.0 * variance.sqrt() + 1e-8);
    assert!(off.component_div(&std_devs).amax() < 1.0, "{off}");
}

/// An unknown offset in each channel is estimated with its standard deviation, and the errors of
/// the parameters have the covariance of the fit. A fit without offsets has far larger residuals.
#[test]
fn constant_offsets_are_estimated() {
    const RUNS: u64 = 200;
    let offsets = [4.0, -2.0, 1.0, 0.3, 0.1, -0.2];
    let channels = Channels::of_wrench().with_offsets(true);
    let mut squares = SVector::<f64, 10>::zeros();
    let mut of_offsets = SVector::<f64, 6>::zeros();
    for seed in 0..RUNS {
        let mut equations = equations(300, seed, 1.0, 0.0);
        for equation in &mut equations {
            for (row, offset) in equation.rows.iter_mut().zip(offsets) {
                row.target += offset;
            }
        }
        let found = fit(&equations, FitOptions::new(&channels)).unwrap();
        let std_devs = found.covariance.diagonal().map(f64::sqrt);
        let error = (found.parameters - truth()).component_div(&std_devs);
        squares += error.component_mul(&error);
        let known = found.offsets.unwrap();
        let std_devs = known.std_devs(&found.covariance, &found.null_space);
        let errors =
            (known.values - Vector6::from(offsets)).component_div(&Vector6::from(std_devs));
        of_offsets += errors.component_mul(&errors);
        let without = fit_wrench(&equations);
        assert!(without.noise.std_devs[0] > 2.0 * found.noise.std_devs[0]);
    }
    let (ratio, of_offsets) = (squares / RUNS as f64, of_offsets / RUNS as f64);
    assert!(ratio.min() > 0.65 && ratio.max() < 1.45, "{ratio}");
    // The standard deviation allows for correlated windows, and these are independent.
    assert!(
        of_offsets.min() > 0.4 && of_offsets.max() < 1.0,
        "{of_offsets}"
    );
}

/// Without noise the offsets are exact to rounding, in the batch fit and window by window.
#[test]
fn exact_equations_give_exact_offsets() {
    let mut equations = equations(60, 1, 0.0, 0.0);
    for equation in &mut equations {
        equation.rows[4].target -= 3.0;
    }
    let channels = Channels::of_wrench().with_offsets(true);
    let found = fit(&equations, FitOptions::new(&channels)).unwrap();
    assert!((found.parameters - truth()).amax() < 1e-11);
    assert!((found.offsets.unwrap().values[4] + 3.0).abs() < 1e-11);
    let mut normal_equations = NormalEquations::with_known_mass(&found);
    for (window, equation) in equations.iter().enumerate() {
        normal_equations.add(equation, window);
    }
    let scaled = normal_equations
        .information()
        .cholesky()
        .unwrap()
        .solve(&normal_equations.target());
    let solution = scaled.component_mul(found.scales());
    assert!((solution - truth()).amax() < 1e-8, "{solution}");
}
