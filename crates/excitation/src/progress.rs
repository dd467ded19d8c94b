//! Reports of a design's progress to its caller.

use std::ops::ControlFlow;

use crate::ExcitationError;

/// Progress of a design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Index of the start: from 0, and after the last one their number, for the steps that improve
    /// the best and those that tighten limits.
    pub start: usize,
    /// Steps tried from this start, or in this phase: each round of tightening begins at 0.
    pub iteration: usize,
    /// Largest ratio of a predicted interval to its target; for
    /// [`Criterion::Volume`](crate::Criterion::Volume), the geometric mean of the one-sigma
    /// semi-axes of the confidence ellipsoid, in mixed units.
    pub objective: f64,
    /// Largest fraction by which a limit is exceeded: zero for a motion that is possible.
    pub excess: f64,
}

/// Called in each step of a design, which stops when it returns [`ControlFlow::Break`].
pub type Observer<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// Reports progress to the observer.
///
/// # Errors
/// Returns [`ExcitationError::Interrupted`] if the observer stops the design.
pub(crate) fn report(
    observer: &mut Observer<'_>,
    progress: Progress,
) -> Result<(), ExcitationError> {
    match observer(&progress) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(ExcitationError::Interrupted),
    }
}
