//! Whether an estimate can be combined with others.

use nalgebra::SymmetricEigen;
use tactid_batch::LinearEstimate;
use tactid_batch::solve::normalized;
use tactid_identify::solve::Matrix;

use crate::RecordingError;

/// Checks that the numbers are finite, and that the information is symmetric and positive
/// semidefinite.
///
/// # Errors
/// Returns [`RecordingError::Together`] otherwise, with the number of the `run`.
pub(crate) fn check_run(of: &LinearEstimate, run: usize) -> Result<(), RecordingError> {
    let wrong = |problem| {
        Err(RecordingError::Together(format!(
            "the information or the covariance of recording {} {problem}",
            run + 1
        )))
    };
    let numbers = of.parameters.iter().chain(of.information.iter());
    let numbers = numbers.chain(of.covariance.iter());
    let numbers = numbers.chain(of.shared.changes.iter());
    if numbers.copied().any(|number| !number.is_finite()) {
        return wrong("contains a number that is not finite");
    }
    let unknowns = &of.shared.unknowns;
    let is_repeated = |k: usize| unknowns[..k].contains(&unknowns[k]);
    if unknowns.len() != of.shared.changes.ncols() || (0..unknowns.len()).any(is_repeated) {
        return wrong("has shared errors without a number of their own for each unknown");
    }
    if of.degrees_of_freedom.is_nan() || of.degrees_of_freedom <= 0.0 {
        return wrong("has no positive number of degrees of freedom");
    }
    if !is_symmetric(&of.information) || !is_symmetric(&of.covariance) {
        return wrong("is not symmetric");
    }
    if !is_positive(&of.information) || !is_positive(&of.covariance) {
        return wrong("has a negative eigenvalue");
    }
    Ok(())
}

fn is_symmetric(matrix: &Matrix) -> bool {
    let scaled = normalized(matrix);
    (scaled - scaled.transpose()).amax() <= 1e-6
}

fn is_positive(matrix: &Matrix) -> bool {
    SymmetricEigen::new(normalized(matrix)).eigenvalues.min() >= -1e-6
}
