//! Signs and gravity that explain the data better than those that were given.

use nalgebra::Vector3;

use crate::Way;
use crate::equation::Equation;
use crate::fit::{Fit, Options};
use crate::noise::Channels;
use crate::offset::Offset;
use crate::uncertainty::HALF_WIDTH_95;

/// Another gravity is worth a word when it leaves less than this part of the residual.
const FAR_BETTER: f64 = 0.5;

/// A constant offset is worth a word when one channel's is so many times its deviation, and all leave
/// less than this part of the residual.
const SIGNIFICANT: f64 = 6.0;
const CLEARLY_BETTER: f64 = 0.8;

/// That the sensors seem to be off by a constant, where their offset was not among the unknowns.
pub(crate) fn suspect_offset(
    equations: &[Equation],
    fit: &Fit,
    channels: &Channels,
    named: &[(String, &'static str)],
) -> Option<String> {
    let with_offsets = channels.clone().with_offsets(true);
    let options = Options {
        weights: Some(fit),
        mass: fit.mass,
        ..Options::new(&with_offsets)
    };
    let other = Fit::new(equations, options)?;
    let size = |offset: &Offset| offset.value.abs() / offset.deviation;
    let pairs = other.offsets.iter().zip(named);
    let (largest, (name, unit)) = pairs.max_by(|a, b| size(a.0).total_cmp(&size(b.0)))?;
    let is_better = other.misfit < CLEARLY_BETTER * fit.misfit;
    (size(largest) > SIGNIFICANT && is_better).then(|| {
        format!(
            "The wrenches seem to be off by a constant ({name} by {:.3} ± {:.3} {unit}): --wrench-offset \
             identifies it as well.",
            largest.value,
            HALF_WIDTH_95 * largest.deviation
        )
    })
}

/// What is suspect about the given signs, a sentence each. Nothing is switched.
pub(crate) fn suspicions(
    equations: &[Equation],
    (fit, channels): (&Fit, &Channels),
    gravity: &Vector3<f64>,
    way: Way,
) -> Vec<String> {
    let mut found = Vec::new();
    let load = match way {
        Way::Effort => "effort",
        Way::Tactile | Way::JointSensing => "wrench",
        Way::Combined { .. } => "load",
    };
    let mut best_mass = fit.parameters[0];
    let mut best = FAR_BETTER * fit.misfit;
    let mut better = None;
    if gravity.norm() > 0.0 {
        for (gravity_off, what) in [
            (1.0, "No gravity at all"),
            (2.0, "The opposite sign of gravity"),
        ] {
            let options = Options {
                gravity_off,
                weights: Some(fit),
                covariance: false,
                ..Options::new(channels)
            };
            match Fit::new(equations, options) {
                Some(other) if other.misfit < best => {
                    best = other.misfit;
                    best_mass = other.parameters[0];
                    better = Some((what, 1.0 - gravity_off));
                }
                _ => {}
            }
        }
    }
    if let Some((what, factor)) = better {
        let other = gravity * factor + Vector3::zeros();
        found.push(format!(
            "{what}, ({}, {}, {}) m/s², explains the {load} far better (residual {:.2e} of what it is \
             with the given one): check the sign of gravity and the axes of the world.",
            other.x + 0.0,
            other.y + 0.0,
            other.z + 0.0,
            best / fit.misfit,
        ));
    }
    if best_mass < 0.0 {
        let weighs = gravity.norm() > 0.0 && better.is_none();
        let gravity = if weighs { ", or of gravity," } else { "" };
        let option = match way {
            Way::Tactile => " (--wrench-acts-on)",
            Way::Effort => " (--effort-gain with a minus)",
            Way::JointSensing | Way::Combined { .. } => "",
        };
        found.push(format!(
            "The mass comes out negative: the opposite sign of the {load}{option}{gravity} would explain \
             the data."
        ));
    }
    found
}
