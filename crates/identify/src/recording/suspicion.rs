//! Signs and gravity that explain the data better than those that were given.

use nalgebra::Vector3;

use crate::Way;
use crate::equation::Equation;
use crate::fit::{Fit, Options};
use crate::noise::Channels;

/// Another gravity is worth a word when it leaves less than this part of the residual.
const FAR_BETTER: f64 = 0.5;

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
