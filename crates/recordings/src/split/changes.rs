//! The segments of a recording: the cheapest way to explain all windows by bodies and transients.
//!
//! Each body costs [`CHANGE`] and its squared residuals in variances of the noise, and each window
//! of a transient costs [`TRANSIENT`]. Dynamic programming over the windows finds the cheapest
//! sequence: for each window it knows the cost of all that came before it, and fits a body to the
//! windows since each place where the present segment may have begun, of which the best are kept.

use nalgebra::SVector;
use tactid_dynamics::words::three_digits;
use tactid_identify::equations::Equation;

use super::sums::{CHANNELS, Line, Lines, Sums, UNKNOWNS, Variances, residuals};
use crate::RecordingError;

/// Cost of a body: a difference between two bodies is found where it explains more. Noise alone
/// explains this much with 16 unknowns by a chance of less than 1e-50; the rest is for what no model
/// of a robot has, such as cables.
const CHANGE: f64 = 300.0;

/// Cost of a window that no body explains: χ² of six channels exceeds it by a chance of 1e-6.
const TRANSIENT: f64 = 38.3;

/// Shortest time for which a body is held, s.
const SHORTEST_S: f64 = 1.5;

/// Places where a segment may have begun that are kept, besides those of the last
/// [`SHORTEST_S`].
const PLACES: usize = 48;

/// Standard deviation of what no model explains, as a fraction of that of the measurements.
const UNMODELLED: f64 = 0.02;

/// Variance of a channel that has no noise, N² or N² m².
const LEAST_VARIANCE: f64 = 1e-12;

/// Time over which a body is fitted to find the noise, s.
const BLOCK_S: f64 = 2.0;

/// Fewest windows of such a block: twice as many rows as unknowns.
const LEAST_WINDOWS: usize = 6;

/// Standard deviation of the acceleration against gravity of an arm at rest, m/s².
const REST_M_S2: f64 = 0.2;

/// Number of times that the noise is estimated from the segments that were found with the noise
/// before.
const PASSES: usize = 3;

/// The equations of a recording.
#[derive(Debug, Default)]
pub(super) struct Windows {
    /// Middle of each window, s.
    pub(super) times_s: Vec<f64>,
    lines: Vec<Lines>,
}

impl Windows {
    /// Adds an equation, whose first six channels are those of the wrench.
    pub(super) fn push(&mut self, equation: &Equation) {
        let Some(rows) = equation.rows.first_chunk::<CHANNELS>() else {
            return;
        };
        let line = |channel: usize| Line {
            regressor: rows[channel].regressor,
            target: rows[channel].target,
        };
        self.times_s.push(equation.time_s);
        self.lines.push(std::array::from_fn(line));
    }

    /// Returns the time from one window to another one, s, of which each stands for the stride in its
    /// middle.
    fn time_between(&self, first: usize, last: usize, stride_s: f64) -> f64 {
        self.times_s[last] - self.times_s[first] + stride_s
    }

    /// Returns whether the arm rests from a window to another one: its acceleration against gravity,
    /// along the axes of the wrench, is constant.
    fn is_rest(&self, (first, last): (usize, usize)) -> bool {
        let lines = &self.lines[first..=last];
        let count = lines.len() as f64;
        (0..3).all(|axis| {
            let of_mass = lines.iter().map(|lines| lines[axis].regressor[0]);
            let mean = of_mass.clone().sum::<f64>() / count;
            let square = of_mass.map(|entry| (entry - mean).powi(2)).sum::<f64>();
            square < count * REST_M_S2 * REST_M_S2
        })
    }
}

/// Returns the segments of a recording, of which there are windows, as their first and last
/// windows, which follow each other by a stride.
///
/// # Errors
/// Returns [`RecordingError::Data`] if there is no segment.
pub(super) fn segments(
    windows: &Windows,
    stride_s: f64,
) -> Result<Vec<(usize, usize)>, RecordingError> {
    let floor = unmodelled(windows);
    let mut variances = noise_of_blocks(windows, stride_s).zip_map(&floor, f64::max);
    let mut found = Vec::new();
    for _ in 0..PASSES {
        found = joined(windows, cheapest(windows, &variances, stride_s), &variances);
        let larger = noise_of(windows, &found).zip_map(&variances, f64::max);
        if larger.component_div(&variances).max() < 1.5 {
            break;
        }
        variances = larger;
    }
    let count = found.len();
    found.retain(|segment| count == 1 || !windows.is_rest(*segment));
    if found.is_empty() {
        let length_s = windows.time_between(0, windows.times_s.len() - 1, stride_s);
        return Err(RecordingError::data(why_none(count, length_s)));
    }
    Ok(joined(windows, found, &variances))
}

/// Says why a recording of a length, s, in which so many bodies are held at rest, has no segment.
fn why_none(at_rest: usize, length_s: f64) -> String {
    if at_rest > 0 {
        return "no segment: the wrenches change while the arm rests, as they do by contacts; a payload makes a segment \
                where the arm moves with it"
            .to_owned();
    }
    if length_s < SHORTEST_S {
        return format!(
            "no segment: the recording has {} s, but a payload has to be held for {SHORTEST_S} s at least",
            three_digits(length_s)
        );
    }
    format!("no segment: no body explains the wrenches for {SHORTEST_S} s")
}

/// Returns the variance of what no model explains of each channel.
fn unmodelled(windows: &Windows) -> Variances {
    let count = windows.lines.len() as f64;
    let targets = windows
        .lines
        .iter()
        .map(|lines| SVector::from_fn(|c, _| lines[c].target));
    let mean: Variances = targets.clone().sum::<Variances>() / count;
    let square: Variances = targets.map(|each| (each - mean).map(|e| e * e)).sum();
    (square / count).map(|each| (UNMODELLED * UNMODELLED * each).max(LEAST_VARIANCE))
}

/// Returns the median of the noise of blocks, of which most have one body.
fn noise_of_blocks(windows: &Windows, stride_s: f64) -> Variances {
    let count = windows.lines.len();
    let length = ((BLOCK_S / stride_s) as usize)
        .max(LEAST_WINDOWS)
        .min(count);
    let blocks: Vec<(usize, usize)> = (0..count / length)
        .map(|block| (block * length, (block + 1) * length - 1))
        .collect();
    let each: Vec<Variances> = blocks
        .iter()
        .map(|block| noise_of(windows, &[*block]))
        .collect();
    SVector::from_fn(|channel, _| {
        let mut sorted: Vec<f64> = each.iter().map(|noise| noise[channel]).collect();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    })
}

/// Returns the mean squares of the residuals of each channel within segments. The unknowns of each
/// segment take as many rows, which the channels share.
fn noise_of(windows: &Windows, segments: &[(usize, usize)]) -> Variances {
    let mut variances = Variances::repeat(1.0);
    // The first time for weights, the second time with them.
    for _ in 0..2 {
        let (mut squares, mut count) = (Variances::zeros(), 0);
        for &(first, last) in segments {
            let lines = &windows.lines[first..=last];
            let Some(solution) = Sums::of(lines, &variances).solution() else {
                continue;
            };
            for each in lines {
                squares += residuals(each, &solution).map(|residual| residual * residual);
            }
            count += lines.len().saturating_sub(UNKNOWNS.div_ceil(CHANNELS));
        }
        variances = (squares / count.max(1) as f64).map(|each| each.max(LEAST_VARIANCE));
    }
    variances
}

/// A place where the present segment may have begun.
struct Begun {
    first: usize,
    /// Cost of all before it.
    before: f64,
    sums: Sums,
    /// Cost of all up to now, if it has begun there.
    cost: f64,
}

/// Returns the segments of the cheapest sequence of bodies and transients.
fn cheapest(windows: &Windows, variances: &Variances, stride_s: f64) -> Vec<(usize, usize)> {
    let count = windows.lines.len();
    // Cost of all before a window, and where the segment that ends there has begun; `None` where a
    // transient ends there.
    let mut best: Vec<(f64, Option<usize>)> = vec![(0.0, None)];
    let mut places: Vec<Begun> = Vec::new();
    for now in 0..count {
        let before = best[now].0;
        places.push(Begun {
            first: now,
            before: before + CHANGE,
            sums: Sums::new(),
            cost: 0.0,
        });
        let mut next = (before + TRANSIENT, None);
        for place in &mut places {
            place.sums.add(&windows.lines[now], variances);
            place.cost = place.before + place.sums.cost();
            let held_s = windows.time_between(place.first, now, stride_s);
            if held_s >= SHORTEST_S && place.cost < next.0 {
                next = (place.cost, Some(place.first));
            }
        }
        best.push(next);
        prune(&mut places, |first| {
            windows.time_between(first, now, stride_s) < SHORTEST_S
        });
    }
    let (mut found, mut end) = (Vec::new(), count);
    while end > 0 {
        match best[end].1 {
            Some(first) => {
                found.push((first, end - 1));
                end = first;
            }
            None => end -= 1,
        }
    }
    found.reverse();
    found
}

/// Keeps the places that are so recent that they cannot be judged, and the best of the others.
fn prune(places: &mut Vec<Begun>, is_recent: impl Fn(usize) -> bool) {
    let mut costs: Vec<f64> = places
        .iter()
        .filter(|place| !is_recent(place.first))
        .map(|place| place.cost)
        .collect();
    if costs.len() <= PLACES {
        return;
    }
    let (_, &mut worst, _) = costs.select_nth_unstable_by(PLACES - 1, f64::total_cmp);
    places.retain(|place| is_recent(place.first) || place.cost <= worst);
}

/// Joins segments that follow each other and have the same body: what separates them is a
/// disturbance.
fn joined(
    windows: &Windows,
    segments: Vec<(usize, usize)>,
    variances: &Variances,
) -> Vec<(usize, usize)> {
    let lines = |(first, last): (usize, usize)| windows.lines[first..=last].iter();
    let cost = |segment| Sums::of(lines(segment), variances).cost();
    let mut found: Vec<(usize, usize)> = Vec::new();
    for segment in segments {
        if let Some(last) = found.last_mut() {
            let both = Sums::of(lines(*last).chain(lines(segment)), variances).cost();
            if both - cost(*last) - cost(segment) < CHANGE {
                last.1 = segment.1;
                continue;
            }
        }
        found.push(segment);
    }
    found
}
