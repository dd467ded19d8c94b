//! A load that the model does not explain, although the sensors would show it.

use tactid_identify::Method;
use tactid_identify::checks::{BEYOND_NOISE, FOURTH_ROUGHNESS, INTERVAL_S, MODEL_ERROR};
use tactid_identify::equations::{Channels, Equation};

use crate::finding::{Finding, UnexplainedLoad};
use crate::fit::Fit;

/// Factors of a fourth difference.
const BINOMIALS: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];

/// Weighted sums of squares over consecutive channels of one unit.
#[derive(Default)]
struct Squares {
    residual: f64,
    load: f64,
    noise: f64,
    rounding: f64,
    weight: f64,
    /// Rms noise that fourth differences show: of the residuals, and of the load of the motion.
    shared_rms: [f64; 2],
}

/// Reports consecutive channels of one unit whose residuals are neither small nor explained by
/// noise, those with the largest fraction.
///
/// There are two measures of the noise, in neither of which the motion or an error of the model
/// shows: the half-difference between the means over even and over odd instants, and, of noise that
/// neighbouring instants share, fourth differences of the residuals over 0.1 s. The second one
/// counts where the motion has little such noise, less than [`MODEL_ERROR`] of the load, because more
/// would bias the parameters. The equations are those of the recording, and those of the fit.
pub(crate) fn unexplained_load(
    equations: [&[Equation]; 2],
    fit: &Fit,
    channels: &Channels,
    method: Method,
) -> Option<Finding> {
    let groups = units(channels).into_iter().map(|(unit, range)| {
        let squares = squares(equations, fit, range);
        let rms = |sum: f64| (sum / squares.weight.max(f64::MIN_POSITIVE)).sqrt();
        let (load_rms, [shared_rms, of_motion_rms]) = (rms(squares.load), squares.shared_rms);
        let noise_rms = rms(squares.noise.max(squares.rounding));
        let is_shared = of_motion_rms < MODEL_ERROR * load_rms;
        let noise_rms = if is_shared {
            noise_rms.max(shared_rms)
        } else {
            noise_rms
        };
        (unit, rms(squares.residual), load_rms, noise_rms)
    });
    let fraction =
        |(_, residual, load, _): &(_, f64, f64, _)| residual / load.max(f64::MIN_POSITIVE);
    let (unit, residual_rms, load_rms, noise_rms) = groups
        .filter(|group| fraction(group) > MODEL_ERROR && group.1 > BEYOND_NOISE * group.3)
        .max_by(|a, b| fraction(a).total_cmp(&fraction(b)))?;
    Some(Finding::LoadUnexplained(UnexplainedLoad {
        joint: None,
        unit: unit.into(),
        residual_rms,
        load_rms,
        noise_rms,
        method,
        has_unloaded: false,
    }))
}

/// Returns consecutive channels of one source and unit.
fn units(channels: &Channels) -> Vec<(&'static str, std::ops::Range<usize>)> {
    let source_of = channels.source_of();
    let mut groups: Vec<(&'static str, std::ops::Range<usize>)> = Vec::new();
    for (k, channel) in channels.channels.iter().enumerate() {
        match groups.last_mut() {
            Some((unit, range))
                if *unit == channel.unit && source_of[range.start] == source_of[k] =>
            {
                range.end = k + 1;
            }
            _ => groups.push((channel.unit, k..k + 1)),
        }
    }
    groups
}

/// Returns the weighted sums of squares of the channels in a range.
fn squares(equations: [&[Equation]; 2], fit: &Fit, range: std::ops::Range<usize>) -> Squares {
    let mut squares = Squares::default();
    let [measured, fitted] = equations;
    for ((measured, equation), weight) in measured.iter().zip(fitted).zip(&fit.weights) {
        for channel in range.clone() {
            squares.residual += weight * fit.residual(equation, channel).powi(2);
            squares.load += weight * measured.rows[channel].target.powi(2);
            squares.noise += weight * fit.remainder(&equation.differences[channel]).powi(2);
            squares.rounding += weight * fit.noise.floor(channel).powi(2);
            squares.weight += weight;
        }
    }
    squares.shared_rms = shared_noise(fitted, fit, range);
    squares
}

/// Returns the rms noise of the channels in a range from fourth differences of their residuals, and
/// of the load that the motion and the parameters give; 0 where windows are too few or too far
/// apart.
///
/// Each difference is over at least [`INTERVAL_S`], a quarter of which the noise of most filtered
/// sensors does not outlast. A difference of windows that are `T` apart keeps `(2 sin πfT)⁸ / 70` of
/// the square of an error of the model, or of a motion, at a frequency `f`: less than a twentieth
/// below `0.2 / T`, which is 6 Hz at a cutoff of 10 Hz.
fn shared_noise(equations: &[Equation], fit: &Fit, range: std::ops::Range<usize>) -> [f64; 2] {
    let lengths_s = equations
        .windows(2)
        .map(|pair| pair[1].time_s - pair[0].time_s);
    let step_s = lengths_s
        .filter(|length_s| *length_s > 0.0)
        .fold(f64::INFINITY, f64::min);
    let order = BINOMIALS.len() - 1;
    let spacing = (INTERVAL_S / (order as f64 * step_s)).ceil().max(1.0);
    let (longest_s, spacing) = (2.0 * order as f64 * spacing * step_s, spacing as usize);
    let (mut squares, mut weights) = ([0.0; 2], 0.0);
    for first in 0..equations
        .len()
        .saturating_sub(order.saturating_mul(spacing))
    {
        let windows: [usize; BINOMIALS.len()] = std::array::from_fn(|k| first + k * spacing);
        let span_s = equations[windows[order]].time_s - equations[first].time_s;
        if !(0.0..=longest_s).contains(&span_s) {
            continue;
        }
        let weight = windows
            .map(|k| fit.weights[k])
            .into_iter()
            .fold(1.0, f64::min);
        for channel in range.clone() {
            let mut differences = [0.0; 2];
            for (k, factor) in windows.into_iter().zip(BINOMIALS) {
                let row = &equations[k].rows[channel];
                let residual = fit.remainder(row);
                differences[0] += factor * residual;
                differences[1] += factor * (row.target - residual);
            }
            for (sum, difference) in squares.iter_mut().zip(differences) {
                *sum += weight * difference.powi(2) / FOURTH_ROUGHNESS;
            }
            weights += weight;
        }
    }
    squares.map(|sum| f64::sqrt(sum / f64::max(weights, f64::MIN_POSITIVE)))
}
