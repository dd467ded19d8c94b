//! Wrong assumptions that poses at rest show, by the test of recordings.

use std::ops::Range;

use nalgebra::Vector2;
use tactid_identify::KINDS;
use tactid_identify::equations::window::WindowMean;
use tactid_identify::equations::{Equation, EquationStream, Model, Unknowns};
use tactid_identify::solve::{HALF_WIDTH_95, values_of};

use super::fit::{ANGLES, RestFit};
use super::outliers::{WithoutOutliers, chance_beyond};
use super::pose_fit::Poses;
use crate::diagnosis::{CONTRADICTION, wrong_assumptions};
use crate::finding::{Hypothesis, WrongAssumption};
use crate::fit::{FitOptions, further};
use crate::hypotheses::{MATERIAL, value_change};

/// Returns the equation of a pose in the tool frame: that of a window whose samples are all the
/// last instant of the model.
pub(super) fn equation_at_rest(model: &Model) -> Equation {
    let mut window = WindowMean::new(model.entry_count(), model.row_count());
    window.means.copy_from_slice(model.last_entries());
    window.instants = 1;
    let mut equation = Equation::new(model.row_count());
    model.set_equation(&mut equation, &window);
    equation
}

/// Returns the mean of samples in one pose, given the sum of their equations.
pub(super) fn mean(sum: &Equation, samples: usize) -> Equation {
    let mut mean = Equation::new(sum.rows.len());
    mean.add_mean(sum, 1.0 / samples as f64);
    mean
}

/// Returns the causes of what a fit of poses leaves unexplained; none where it leaves next to
/// nothing, or the poses are too few to tell.
///
/// At rest, the size of gravity and the mass are one thing, so that only another direction of
/// gravity is a cause, in the place of another gravity of any size, or of what explains less.
pub(super) fn causes(
    poses: &Poses<'_>,
    solution: &WithoutOutliers,
    stream: &EquationStream,
) -> Vec<WrongAssumption> {
    let given = &solution.found.fit;
    if !given.can_contradict() {
        return Vec::new();
    }
    let mut causes = causes_of(&poses.kept(&solution.kept), stream, poses.unknowns);
    let Some(direction) = other_direction(poses, &solution.kept, given) else {
        return causes;
    };
    match causes
        .first()
        .map(|first| (first.cause, first.residual_ratio))
    {
        Some((Hypothesis::Gravity, _)) => causes[0] = direction,
        Some((_, ratio)) if ratio < direction.residual_ratio => {}
        _ => causes = vec![direction],
    }
    causes
}

fn causes_of(
    equations: &[Equation],
    stream: &EquationStream,
    unknowns: Unknowns,
) -> Vec<WrongAssumption> {
    let channels = stream.channels();
    let options = FitOptions {
        covariance: false,
        ..FitOptions::new(&channels)
    };
    let fit = further::fit(equations, options, &stream.gravity(), unknowns);
    let found =
        fit.and_then(|found| wrong_assumptions(equations, &found.fit, Some(&found.values), stream));
    found.map_or_else(Vec::new, |found| found.causes)
}

/// Returns whether a fit, with so many `further` unknowns, explains poses far better than the given
/// one: beyond chance, and by more than what a sound sensor leaves.
pub(super) fn is_far_better(other: &RestFit, given: &RestFit, further: usize) -> bool {
    given.p_value_beside(other, further) <= chance_beyond(CONTRADICTION)
        && given.squares(other) >= (1.0 + MATERIAL) * other.squares(other)
}

/// Returns gravity of another direction where it explains the poses that are `kept` far better than
/// the fit with the `given` one.
fn other_direction(poses: &Poses<'_>, kept: &[bool], given: &RestFit) -> Option<WrongAssumption> {
    let found = poses.with_unknown_gravity()?.fit(kept);
    let gravity = found.gravity_estimate()?;
    let other = found.fit;
    if !is_far_better(&other, given, ANGLES.len()) {
        return None;
    }
    let old = values_of(&given.parameters).unwrap_or([f64::NAN; 10]);
    let (new, std_devs) = (values_of(&other.parameters)?, other.value_std_devs());
    let distance = |values: Range<usize>| {
        let squares = values.map(|k| {
            let half_width = HALF_WIDTH_95 * std_devs[k];
            Vector2::new((new[k] - old[k]).powi(2), half_width.powi(2))
        });
        let squares: Vector2<f64> = squares.sum();
        (squares[0].sqrt() - squares[1].sqrt()).max(0.0)
    };
    let mass_kg = other.parameters[0];
    Some(WrongAssumption {
        cause: Hypothesis::Gravity,
        runner_up: None,
        names: ["x", "y", "z"].map(str::to_owned).to_vec(),
        values: gravity.values.to_vec(),
        std_devs: gravity.std_devs.to_vec(),
        assumed: poses.gravity.as_slice().to_vec(),
        frame: poses.frame.name().clone(),
        along_m_s2: None,
        residual_ratio: (other.squares(&other) / given.squares(&other)).sqrt(),
        mass_kg,
        mass_std_dev_kg: std_devs[0],
        mass_change: distance(KINDS[0].clone()) / mass_kg.abs(),
        shift_m: distance(KINDS[1].clone()),
        value_change: value_change([(old, given.value_std_devs()), (new, std_devs)]),
        is_applied: false,
    })
}
