//! Uncertainty of the online estimate: whenever a value is reported as known, its error is within six of
//! its standard deviations, also in the first second, after a gap and after changes of the payload.

#![allow(clippy::unwrap_used)]

#[path = "common/arm.rs"]
mod arm;

use arm::{Instant, Run, TOOL, arm, body};
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
        let mut identifier =
            Identifier::new(&robot, TOOL, &[TOOL], &EquationSettings::default()).unwrap();
        let mut random = SmallRng::seed_from_u64(seed);
        // The payload that the estimate is of, and the time of its alarm until the mass is known.
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
            let std_dev = estimate.std_devs.unwrap()[0];
            if let Some(from_s) = alarm_s.filter(|_| std_dev < 0.05 * estimate.body.mass_kg + 0.02)
            {
                self.mass_known_after_s.push(instant.time_s - from_s);
                alarm_s = None;
            }
            // Work that was deferred changes nothing about the honesty of an estimate.
            if estimate.windows.is_multiple_of(16) {
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
        let after = u64::from(estimate.payload_changes > 0);
        assert!(estimate.is_physical || estimate.body.mass_kg <= 0.0);
        let (found, expected) = (estimate.values(), values(truth));
        let std_devs = estimate.std_devs.unwrap();
        for k in (0..10).filter(|&k| std_devs[k].is_finite()) {
            let ratio = (found[k] - expected[k]).abs() / std_devs[k];
            self.judged += 1;
            // One that is not a number is off, too.
            let off = u64::from(ratio.is_nan() || ratio > 6.0);
            self.off += off;
            self.judged_after += after;
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
