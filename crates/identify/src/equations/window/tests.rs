//! The means over windows, and the constants of their noise.

use super::*;

const CUTOFF_HZ: f64 = 9.26; // a window of 0.1 s

/// Returns time, mean, and mean of the derivative of one quantity, for each window.
fn filter(times: &[f64], value: impl Fn(f64) -> f64) -> Vec<(f64, f64, f64)> {
    let mut windows = Windows::of_means(CUTOFF_HZ, 1, 1, 0.0);
    let mut found = Vec::new();
    for &time_s in times {
        if let Some(window) = windows.push(time_s, &[value(time_s)]) {
            found.push((window.time_s, window.means[0], window.rates[0]));
        }
    }
    found
}

fn even(count: usize, step_s: f64) -> Vec<f64> {
    (0..count).map(|k| k as f64 * step_s).collect()
}

/// The mean of a straight line is its value in the middle of the window, and the mean of its
/// derivative is its slope.
#[test]
fn means_of_lines_are_exact() {
    let found = filter(&even(1001, 1e-3), |t| 4.0 - 3.0 * t);
    assert_eq!(found.len(), 27);
    for (k, (time_s, mean, rate)) in found.into_iter().enumerate() {
        assert!((time_s - 0.05 - 0.1 / 3.0 * k as f64).abs() < 1e-9);
        assert!((mean - (4.0 - 3.0 * time_s)).abs() < 1e-7, "{mean}");
        assert!((rate + 3.0).abs() < 1e-4, "{rate}");
    }
}

/// At the cutoff a sine has lost 3 dB at any sample rate. Uneven times change the mean by little.
#[test]
fn loses_three_decibel_at_the_cutoff() {
    let sine = |t: f64| (std::f64::consts::TAU * CUTOFF_HZ * t).cos();
    let uneven = |times: Vec<f64>| -> Vec<f64> {
        let shift = |k: usize| 1e-4 * (k as f64 * 1.7).sin();
        times
            .iter()
            .enumerate()
            .map(|(k, t)| t + shift(k))
            .collect()
    };
    let cases = [
        (even(2000, 1e-3), 1e-3),
        (even(400, 5e-3), 1e-3),
        (uneven(even(2000, 1e-3)), 5e-3),
    ];
    for (times, bound) in cases {
        for (time_s, mean, _) in filter(&times, sine) {
            let gain = std::f64::consts::FRAC_1_SQRT_2;
            assert!((mean - gain * sine(time_s)).abs() < bound, "{mean}");
        }
    }
}

/// No window spans a gap, and a window of too few instants is dropped.
#[test]
fn no_window_spans_a_gap() {
    let mut times = even(300, 1e-3);
    times.extend(even(300, 1e-3).iter().map(|t| t + 0.4));
    for (time_s, ..) in filter(&times, |t| t) {
        assert!(!(0.25..=0.449).contains(&time_s), "{time_s}");
    }
    assert!(filter(&even(100, 0.03), |t| t).is_empty());
}

/// An instant with an entry that is not finite, or far beyond all measurements, changes no mean and
/// is counted.
#[test]
fn leaves_out_what_is_no_measurement() {
    let clean = filter(&even(300, 1e-3), |t| t);
    for bad in [f64::NAN, f64::INFINITY, -1e31] {
        let mut windows = Windows::of_means(CUTOFF_HZ, 1, 1, 0.0);
        let mut found = Vec::new();
        for (k, time_s) in even(300, 1e-3).into_iter().enumerate() {
            let entry = if k % 50 == 49 { bad } else { time_s };
            if let Some(window) = windows.push(time_s, &[entry]) {
                found.push((window.means[0], window.rates[0]));
            }
        }
        assert_eq!((windows.left_out(), found.len()), (6, clean.len()));
        for ((mean, rate), (_, mean_of_all, rate_of_all)) in found.into_iter().zip(&clean) {
            assert!((mean - mean_of_all).abs() < 1e-5, "{mean}");
            assert!((rate - rate_of_all).abs() < 1e-2, "{rate}");
        }
    }
}

/// The sums of the correlations have the values of the constants.
#[test]
fn correlations_have_their_sums() {
    let [first, second] = NOISE_CORRELATIONS;
    let sum = 1.0 + 2.0 * (first + second);
    assert!((sum - NOISE_CORRELATION).abs() < 1e-13, "{sum}");
    let squares = 1.0 + 2.0 * (first * first + second * second);
    assert!((squares - PRODUCT_CORRELATION).abs() < 1e-4, "{squares}");
}

/// Returns a generator of uniform numbers from -0.5 to 0.5.
fn uniform_noise(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
    }
}

/// The means of white noise have the bandwidth and the correlations of the constants.
#[test]
fn correlation_of_noise() {
    let mut noise = uniform_noise(1);
    let values: Vec<f64> = (0..2_000_000).map(|_| noise()).collect();
    let found = filter(&even(values.len(), 1e-3), |t| {
        values[(t * 1e3).round() as usize]
    });
    let mean: Vec<f64> = found.iter().map(|f| f.1).collect();
    let product = |lag: usize| -> f64 {
        mean.iter()
            .zip(&mean[lag..])
            .map(|(a, b)| a * b)
            .sum::<f64>()
            / mean.len() as f64
    };
    let [first, second] = [1, 2].map(|lag| product(lag) / product(0));
    assert!((first - NOISE_CORRELATIONS[0]).abs() < 0.015, "{first}");
    let bandwidth = product(0) * 12.0 * 100.0; // uniform noise, 100 instants a window
    assert!((bandwidth - NOISE_BANDWIDTH).abs() < 0.05, "{bandwidth}");
    let sum = 1.0 + 2.0 * (first + second);
    assert!((sum - NOISE_CORRELATION).abs() < 0.03, "{sum}");
    let squares = 1.0 + 2.0 * (first * first + second * second);
    assert!((squares - PRODUCT_CORRELATION).abs() < 0.015, "{squares}");
}

/// Of samples that are interpolated between those of a slower sensor, runs of instants show the
/// noise that neighbouring instants share.
#[test]
fn runs_show_the_noise_of_interpolated_samples() {
    const INSTANTS_PER_SAMPLE: usize = 4;
    let mut noise = uniform_noise(7);
    let samples: Vec<f64> = (0..20_000).map(|_| noise()).collect();
    let interpolated = samples.windows(2).flat_map(|pair| {
        let at = |k: usize| k as f64 / INSTANTS_PER_SAMPLE as f64;
        let (from, to) = (pair[0], pair[1]);
        (0..INSTANTS_PER_SAMPLE).map(move |k| from + at(k) * (to - from))
    });
    let instants: Vec<f64> = interpolated.collect();
    let ratio_of = |run_s: f64| -> f64 {
        let mut windows = Windows::of_means(CUTOFF_HZ, 1, 1, run_s);
        let (mut of_means, mut of_differences) = (0.0, 0.0);
        for (time_s, entry) in even(instants.len(), 1e-3).into_iter().zip(&instants) {
            if let Some(window) = windows.push(time_s, &[*entry]) {
                of_means += window.means[0].powi(2);
                of_differences += window.differences[0].powi(2);
            }
        }
        (of_differences / of_means).sqrt()
    };
    assert!(ratio_of(0.0) < 0.1, "{}", ratio_of(0.0));
    assert!((0.5..1.1).contains(&ratio_of(6e-3)), "{}", ratio_of(6e-3));
}

/// Of a motion, the difference of the halves has one percent of the change within a window at most,
/// however long their runs are to be and however far apart the instants.
#[test]
fn motion_is_no_noise_of_long_runs() {
    let change = 3.0 * length_s(CUTOFF_HZ);
    for period_s in [1e-3, 4e-3, 8e-3, 10e-3, 14e-3] {
        let mut windows = Windows::of_means(CUTOFF_HZ, 1, 1, 1.0);
        for time_s in even(3000, period_s) {
            if let Some(window) = windows.push(time_s, &[4.0 - 3.0 * time_s]) {
                let difference = window.differences[0].abs();
                assert!(difference < 0.012 * change, "{period_s}: {difference}");
            }
        }
    }
}
