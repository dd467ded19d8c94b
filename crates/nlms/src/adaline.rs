//! The Adaline of section 3: a linear neuron whose weights are the parameters, with both of its
//! learning rules.

use nalgebra::{SMatrix, SVector};

use crate::{Counts, Estimator, Outcome, SettingError, check_within};

/// The paper's α.
pub const PAPER_ALPHA: f64 = 1.8;
/// The paper's β.
pub const PAPER_BETA: f64 = 0.9;

/// How far a row moves the weights: μ of (53).
pub trait LearningRule {
    /// μ for a row with this squared norm, `uᵀu`.
    fn step(&self, row_squared: f64) -> f64;
}

/// A linear neuron, trained once on each row: `w ← w + μ e u`, (53).
#[derive(Clone, Debug)]
pub struct Adaline<R, const N: usize> {
    weights: SVector<f64, N>,
    rule: R,
    counts: Counts,
}

impl<R, const N: usize> Adaline<R, N> {
    /// The same with the given weights instead of ones, the paper's `w_0`.
    #[must_use]
    pub fn starting_at(self, weights: SVector<f64, N>) -> Self {
        Self { weights, ..self }
    }

    pub(crate) fn with_rule(rule: R) -> Self {
        Self {
            weights: SVector::repeat(1.0),
            rule,
            counts: Counts::default(),
        }
    }
}

impl<R: LearningRule, const N: usize> Adaline<R, N> {
    /// One step on a row that is known to be finite.
    pub(crate) fn learn(&mut self, row: &SVector<f64, N>, wanted: f64) {
        let error = wanted - self.weights.dot(row); // (52)
        self.weights += row * (self.rule.step(row.norm_squared()) * error); // (53)
    }
}

impl<R: LearningRule, const N: usize> Estimator<N> for Adaline<R, N> {
    fn update(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome {
        let outcome = self.counts.admit(row, wanted);
        if outcome == Outcome::Used {
            self.learn(row, wanted);
        }
        outcome
    }

    fn parameters(&self) -> SVector<f64, N> {
        self.weights
    }

    /// `None`: gradient filters keep no second moments.
    fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        None
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

/// A step that is the same for every row: section 3.1.
#[derive(Clone, Copy, Debug)]
pub struct FixedStep(f64);

impl LearningRule for FixedStep {
    fn step(&self, _row_squared: f64) -> f64 {
        self.0
    }
}

/// A step that shrinks with the row's own power: (54).
#[derive(Clone, Copy, Debug)]
pub struct NormalisedStep {
    pub(crate) alpha: f64,
    pub(crate) beta: f64,
}

impl LearningRule for NormalisedStep {
    fn step(&self, row_squared: f64) -> f64 {
        self.alpha / (self.beta + row_squared) // (54)
    }
}

/// Least mean squares with a fixed step, section 3.1.
///
/// Assumes rows of a known scale: it diverges where `step · |row|²` reaches 2.
pub type Lms<const N: usize> = Adaline<FixedStep, N>;

/// Normalised least mean squares, (53)-(54).
///
/// Assumes exact rows: noise on the wanted value is amplified by the misadjustment `α/(2 - α)`,
/// which is 9 at the paper's α.
pub type Nlms<const N: usize> = Adaline<NormalisedStep, N>;

impl<const N: usize> Lms<N> {
    /// With weights of one, as the paper starts.
    ///
    /// # Errors
    /// Where `step` (μ) is not positive and finite.
    pub fn new(step: f64) -> Result<Self, SettingError> {
        check_within("step", step, (0.0, f64::INFINITY), "(0, inf)")?;
        Ok(Self::with_rule(FixedStep(step)))
    }
}

impl<const N: usize> Nlms<N> {
    /// With weights of one, as the paper starts.
    ///
    /// # Errors
    /// Where `alpha` is outside (0, 2) or `beta` outside (0, 1): the conditions below (54).
    pub fn new(alpha: f64, beta: f64) -> Result<Self, SettingError> {
        check_within("alpha", alpha, (0.0, 2.0), "(0, 2)")?;
        check_within("beta", beta, (0.0, 1.0), "(0, 1)")?;
        Ok(Self::with_rule(NormalisedStep { alpha, beta }))
    }

    /// With the paper's settings: α = 1.8, β = 0.9, weights of one.
    #[must_use]
    pub fn paper() -> Self {
        Self::with_rule(NormalisedStep {
            alpha: PAPER_ALPHA,
            beta: PAPER_BETA,
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector3};

    use super::*;

    /// One step of (53)-(54), by hand: e = 7 - 4 = 3, μ = 1.8 / (0.9 + 6).
    #[test]
    fn one_step_is_the_papers() {
        let mut filter = Nlms::<3>::paper();
        filter.update(&Vector3::new(1.0, 2.0, 1.0), 7.0);
        let step = 1.8 * 3.0 / 6.9;
        let expected = Vector3::new(1.0 + step, 1.0 + 2.0 * step, 1.0 + step);
        assert!((filter.parameters() - expected).norm() < 1e-15);
    }

    /// At β = 0⁺ and α = 1 the last row is fulfilled exactly: the step is a projection.
    #[test]
    fn unit_step_projects_onto_the_row() {
        let mut filter = Nlms::<2>::new(1.0, 1e-300).unwrap();
        let row = Vector2::new(0.3, -4.0);
        filter.update(&row, 2.5);
        assert!((filter.parameters().dot(&row) - 2.5).abs() < 1e-14);
    }

    /// LMS diverges beyond its stable step and NLMS does not, on the same large rows.
    #[test]
    fn normalisation_is_what_keeps_large_rows_stable() {
        let truth = Vector2::new(2.0, -1.0);
        let mut lms = Lms::<2>::new(0.1).unwrap();
        let mut nlms = Nlms::<2>::paper();
        for k in 0..1000 {
            let row = Vector2::new((f64::from(k)).cos(), (f64::from(k)).sin()) * 30.0;
            // After a hundred rows its weights are about to overflow.
            if k < 100 {
                lms.update(&row, row.dot(&truth));
            }
            nlms.update(&row, row.dot(&truth));
        }
        assert!(lms.parameters().norm() > 1e6);
        let error = (nlms.parameters() - truth).norm();
        assert!(error < 1e-9, "{error}");
    }

    /// With white noise on the wanted value the mean squared error settles at the misadjustment
    /// α/(2 - α) times what is inevitable, so a larger α is noisier.
    #[test]
    fn misadjustment_grows_with_alpha() {
        let spread = |alpha: f64| {
            let mut filter = Nlms::<2>::new(alpha, 1e-6).unwrap();
            let (mut seed, mut sum) = (1u64, 0.0);
            let mut uniform = || {
                seed = seed
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            };
            for k in 0..40_000 {
                let row = Vector2::new(uniform(), uniform());
                let row = row / row.norm();
                filter.update(&row, row.sum() + 0.1 * uniform());
                if k > 1000 {
                    sum += (filter.parameters() - Vector2::repeat(1.0)).norm_squared();
                }
            }
            sum
        };
        let ratio = spread(1.8) / spread(0.5);
        let expected = (1.8 / 0.2) / (0.5 / 1.5);
        assert!(
            (ratio / expected - 1.0).abs() < 0.2,
            "{ratio} against {expected}"
        );
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        for (alpha, beta) in [
            (0.0, 0.9),
            (2.0, 0.9),
            (-1.0, 0.9),
            (f64::NAN, 0.9),
            (1.8, 0.0),
            (1.8, 1.0),
            (1.8, f64::INFINITY),
        ] {
            assert!(Nlms::<4>::new(alpha, beta).is_err(), "{alpha} {beta}");
        }
        assert!(Lms::<4>::new(0.0).is_err());
        assert!(Lms::<4>::new(f64::INFINITY).is_err());
        let message = Nlms::<4>::new(2.5, 0.9).unwrap_err().to_string();
        assert_eq!(message, "alpha is 2.5, but must lie in (0, 2)");
    }
}
