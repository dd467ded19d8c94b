//! Wrong assumptions that poses at rest show, by the test of recordings.

use crate::diagnosis::wrong_assumptions;
use crate::equations::window::WindowMean;
use crate::equations::{Equation, EquationStream, Model};
use crate::finding::WrongAssumption;
use crate::fit::{FitOptions, least_squares};

/// Returns the equation of a pose in the tool frame: that of a window whose samples are all the last instant
/// of the model.
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

/// Returns the causes of what a payload leaves unexplained between poses; none where it leaves next to nothing, or the poses
/// are too few to tell.
pub(super) fn causes(equations: &[Equation], stream: &EquationStream) -> Vec<WrongAssumption> {
    let channels = stream.channels();
    let options = FitOptions {
        covariance: false,
        ..FitOptions::new(&channels)
    };
    let fit = least_squares::fit(equations, options);
    let found = fit.and_then(|fit| wrong_assumptions(equations, &fit, None, stream));
    found.map_or_else(Vec::new, |found| found.causes)
}
