//! The stages of the update by one averaging window.

/// Deferred stage of the update by the most recent window. One stage runs per sample, which bounds
/// the worst-case time of a sample.
///
/// The stages are in the order in which they run; those before
/// [`StartProjection`](Self::StartProjection) are stages of the estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Stage {
    /// Adds the window to the sums of products.
    AddRows,
    /// Updates the triangular factor with the rows of the window.
    UpdateSquareRoot,
    /// Updates the noise with the residuals of the window.
    UpdateNoise,
    /// Solves for the parameters.
    Solve,
    /// Computes the sandwich covariance of the parameters.
    ComputeCovariance,
    /// Sets the target of the projection onto physically consistent parameters.
    StartProjection,
    /// Takes one step of the projection.
    StepProjection,
    /// Replaces the reported estimate.
    Report,
}

impl Stage {
    /// Number of stages.
    pub(crate) const COUNT: usize = Self::Report as usize + 1;

    /// Returns the stage that follows, `None` after the last one. A window that shows nothing of
    /// the noise skips [`UpdateNoise`](Self::UpdateNoise).
    pub(crate) fn next(self, shows_noise: bool) -> Option<Self> {
        match self {
            Self::AddRows => Some(Self::UpdateSquareRoot),
            Self::UpdateSquareRoot if shows_noise => Some(Self::UpdateNoise),
            Self::UpdateSquareRoot | Self::UpdateNoise => Some(Self::Solve),
            Self::Solve => Some(Self::ComputeCovariance),
            Self::ComputeCovariance => Some(Self::StartProjection),
            Self::StartProjection => Some(Self::StepProjection),
            Self::StepProjection => Some(Self::Report),
            Self::Report => None,
        }
    }

    /// Whether the estimator does this stage. The others report its result.
    pub(crate) fn is_estimation(self) -> bool {
        self < Self::StartProjection
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stages from the first to the last are as many as the constant says, in the order of the
    /// enumeration.
    #[test]
    fn stages_follow_each_other() {
        let stages: Vec<Stage> =
            std::iter::successors(Some(Stage::AddRows), |stage| stage.next(true)).collect();
        assert_eq!(stages.len(), Stage::COUNT);
        assert!(stages.is_sorted_by(|before, after| before < after));
        let without_noise = std::iter::successors(Some(Stage::AddRows), |stage| stage.next(false));
        let expected = stages.iter().filter(|stage| **stage != Stage::UpdateNoise);
        assert!(without_noise.eq(expected.copied()));
    }
}
