//! A load that the model does not explain, although the sensors would show it.

use tactid_identify::Method;
use tactid_identify::checks::{BEYOND_NOISE, MODEL_ERROR};
use tactid_identify::equations::{Channels, Equation};

use crate::finding::{Finding, UnexplainedLoad};
use crate::fit::Fit;

/// Weighted sums of squares over consecutive channels of one unit.
#[derive(Default)]
struct Squares {
    residual: f64,
    load: f64,
    noise: f64,
    rounding: f64,
    weight: f64,
}

/// Reports consecutive channels of one unit whose residuals are neither small nor explained by
/// noise, those with the largest fraction.
///
/// The measure of the noise is the half-difference between the means over even and over odd
/// instants, in which neither the motion nor an error of the model shows. The equations are those
/// of the recording, and those of the fit.
pub(crate) fn unexplained_load(
    equations: [&[Equation]; 2],
    fit: &Fit,
    channels: &Channels,
    method: Method,
) -> Option<Finding> {
    let groups = units(channels).into_iter().map(|(unit, range)| {
        let squares = squares(equations, fit, range);
        let rms = |sum: f64| (sum / squares.weight.max(f64::MIN_POSITIVE)).sqrt();
        let noise_rms = rms(squares.noise.max(squares.rounding));
        (unit, rms(squares.residual), rms(squares.load), noise_rms)
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
    squares
}
