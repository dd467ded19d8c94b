//! Uncertainty of the online estimate: the error of each value that is reported as known is within
//! six of its standard deviations, also in the first second, after a gap and after payload changes.

use crate::arm::{Instant, Run, TOOL, arm, body};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::{BaseKind, MassProperties, Wrench};
use tactid_identify::{EquationSettings, Identifier, PayloadEstimate, PushOutcome};

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

/// Statistics of the errors and of the alarms in a set of runs.
#[derive(Debug, Default)]
struct Statistics {
    /// Number of values that were reported as known.
    known: u64,
    /// Number of known values with an error of more than six standard deviations.
    off: u64,
    /// Number of known values after the first alarm of a run.
    known_after: u64,
    /// Number of known values after the first alarm with an error of more than six standard
    /// deviations.
    off_after: u64,
    /// Largest error, in standard deviations.
    worst: f64,
    /// Where the largest error occurred.
    worst_at: String,
    /// Times from each payload change to its alarm, s.
    delays_s: Vec<f64>,
    /// Number of alarms without a payload change.
    false_alarms: u64,
    /// Number of payload changes without an alarm.
    missed: u64,
    /// Times from each alarm until the standard deviation of the mass is less than 5 % and 20 g, s.
    mass_known_after_s: Vec<f64>,
}

impl Statistics {
    /// Adds the estimate at each sample of one run.
    ///
    /// Between a payload change and its alarm the estimate is from windows before and after the
    /// change. Its errors are not counted; the time is recorded as a delay.
    fn add_run(&mut self, run: &Run, instants: &[Instant], noise: [f64; 2], seed: u64) {
        let robot = arm(run.base);
        let mut identifier =
            Identifier::new(&robot, TOOL, &[TOOL], &EquationSettings::default()).unwrap();
        let mut random = SmallRng::seed_from_u64(seed);
        // The index of the estimated payload, and the time of its alarm until the mass is known.
        let (mut estimated, mut alarm_s) = (0, None);
        for instant in instants
            .iter()
            .filter(|instant| !run.is_in_gap(instant.time_s))
        {
            let held = run.held_at(instant.time_s);
            let wrenches = [noisy(&instant.wrench, noise, &mut random)];
            if identifier.push(&instant.sample(&wrenches)).unwrap() == PushOutcome::PayloadChanged {
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
            self.add_estimate(&estimate, &run.payloads[held].1, || {
                let place = format!(
                    "{:?} {} Hz, motion {}",
                    run.base, run.rate_hz, run.motion_seed
                );
                format!(
                    "{place}, seed {seed}, {} s, alarm {alarm_s:?}",
                    instant.time_s
                )
            });
            let std_dev = estimate.std_devs[0];
            if let Some(from_s) = alarm_s.filter(|_| std_dev < 0.05 * estimate.body.mass_kg + 0.02)
            {
                self.mass_known_after_s.push(instant.time_s - from_s);
                alarm_s = None;
            }
            // Deferred stages that run at once lead to estimates whose errors count, too.
            if estimate.windows.is_multiple_of(16) {
                let mut finished = identifier.clone();
                finished.finish();
                estimate = finished.estimate();
                self.add_estimate(&estimate, &run.payloads[held].1, || "finished".to_owned());
            }
        }
        self.missed += (run.payloads.len() - 1 - estimated) as u64;
    }

    /// Adds one estimate of a payload. `place` says where it occurred.
    fn add_estimate(
        &mut self,
        estimate: &PayloadEstimate,
        truth: &MassProperties,
        place: impl Fn() -> String,
    ) {
        let after = u64::from(estimate.payload_changes > 0);
        assert!(estimate.is_physical || estimate.body.mass_kg <= 0.0);
        let (found, expected) = (estimate.values(), values(truth));
        let std_devs = estimate.std_devs;
        for k in (0..10).filter(|&k| std_devs[k].is_finite()) {
            let ratio = (found[k] - expected[k]).abs() / std_devs[k];
            self.known += 1;
            // A ratio that is not a number counts as an error.
            let off = u64::from(ratio.is_nan() || ratio > 6.0);
            self.off += off;
            self.known_after += after;
            self.off_after += after * off;
            if ratio.is_nan() || ratio > self.worst {
                self.worst = ratio;
                let [found, std_dev, expected] = [found[k], std_devs[k], expected[k]];
                self.worst_at = format!("{}: {k}: {found} ± {std_dev}, not {expected}", place());
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
    let mut draw =
        |std_dev: f64| Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal));
    Wrench {
        force: wrench.force + draw(noise[0]),
        moment: wrench.moment + draw(noise[1]),
    }
}

/// Returns payloads before and after a change: to a lighter one, to a heavier one, of the inertia
/// alone, to next to no mass, and from it.
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

/// Standard deviations of white noise on force, N, and moment, N m, of a precise, a usual and a
/// coarse sensor.
const NOISE: [[f64; 2]; 3] = [[0.05, 0.002], [0.5, 0.02], [2.0, 0.1]];

/// An event in a run besides the first payload change.
#[derive(Clone, Copy, Debug)]
enum Event {
    None,
    /// The samples around the change are missing.
    Gap,
    /// The first payload comes back after 0.6 s, before the new one is known well.
    SecondChange,
}

/// Returns a run whose motion and time of the payload change are drawn with a seed.
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
        Event::None => {}
        Event::Gap => run.gap_s = Some((swap_s - 0.35, swap_s + 0.1)),
        Event::SecondChange => run.payloads.push((swap_s + 0.6, before)),
    }
    run
}

/// A payload change from 4.2 kg to 1.5 kg on a fixed base is detected within 0.2 s. From then on no
/// error exceeds six standard deviations, and the mass is known 0.5 s after the alarm, when the
/// acceleration has shown that the change is no contact.
#[test]
fn a_lighter_payload_has_valid_std_devs() {
    let mut statistics = Statistics::default();
    for rate_hz in [200.0, 500.0, 1000.0] {
        for seed in 0..4 {
            let run = run(BaseKind::Fixed, rate_hz, pairs()[0], Event::None, seed);
            statistics.add_run(&run, &run.instants(), NOISE[1], seed);
        }
    }
    assert_eq!(
        (statistics.off, statistics.missed, statistics.false_alarms),
        (0, 0, 0),
        "{statistics:?}"
    );
    assert_eq!(statistics.delays_s.len(), 12);
    assert!(statistics.longest_delay_s() < 0.2, "{statistics:?}");
    assert_eq!(statistics.mass_known_after_s.len(), 12);
    assert!(
        statistics
            .mass_known_after_s
            .iter()
            .all(|&time_s| time_s < 0.5),
        "{statistics:?}"
    );
    assert!(statistics.known > 250_000, "{statistics:?}");
}

/// No error exceeds six standard deviations: with and without gravity, for all pairs of payloads,
/// all noise and rates, in the first second, after gaps, and after one payload change and two.
#[test]
fn no_error_exceeds_six_std_devs() {
    let mut statistics = Statistics::default();
    sweep(1000..1001, &mut statistics);
    assert_eq!(
        statistics.off, 0,
        "{} at {}",
        statistics.worst, statistics.worst_at
    );
    assert_eq!(statistics.false_alarms, 0);
    assert!(statistics.known > 3_000_000, "{}", statistics.known);
}

/// In so many runs that one error in a million would show, errors of more than six standard
/// deviations are rarer than that after a payload change. In the first seconds of a run the noise
/// is known from few windows: errors in runs with 30 seeds reached 6.7 standard deviations, and 1
/// of 42 000 values was off, most of them in one draw of the noise.
#[test]
#[ignore = "minutes in release mode: cargo test --release -p tactid-identify --test tests payload_change -- --ignored --nocapture"]
fn errors_beyond_six_std_devs_are_rarer_than_one_in_a_million() {
    let mut statistics = Statistics::default();
    sweep(2000..2030, &mut statistics);
    eprintln!("{} of {} off", statistics.off, statistics.known);
    eprintln!(
        "{} of {} off after a change",
        statistics.off_after, statistics.known_after
    );
    eprintln!("worst {} at {}", statistics.worst, statistics.worst_at);
    eprintln!(
        "{} alarms false, {} changes missed",
        statistics.false_alarms, statistics.missed
    );
    assert!(statistics.off_after * 1_000_000 < statistics.known_after);
    assert!(statistics.off * 40_000 < statistics.known);
    assert!(statistics.worst < 7.0);
}

/// Adds runs with these seeds for all bases, rates, payloads, events and noise.
fn sweep(seeds: std::ops::Range<u64>, statistics: &mut Statistics) {
    for seed in seeds {
        for base in [BaseKind::Fixed, BaseKind::Floating] {
            for rate_hz in [200.0, 500.0, 1000.0] {
                for pair in pairs() {
                    for event in [Event::None, Event::Gap, Event::SecondChange] {
                        let run = run(base, rate_hz, pair, event, seed);
                        let instants = run.instants();
                        for noise in NOISE {
                            statistics.add_run(&run, &instants, noise, seed);
                        }
                    }
                }
            }
        }
    }
}
