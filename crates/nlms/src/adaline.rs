//! The Adaline of the paper's section 3: a linear neuron with the parameters as weights.

use nalgebra::SVector;

use crate::error::ensure;
use crate::{Counts, Estimator, Outcome, SettingError};

/// The step size α of (54) that the paper uses (section 3.2).
pub const PAPER_ALPHA: f64 = 1.8;
/// The regularisation β of (54) that the paper uses (section 3.2).
pub const PAPER_BETA: f64 = 0.9;

/// Chooses the step size μ of (53).
pub trait LearningRule {
    /// Returns μ for a row `u` with the squared norm `row_squared = uᵀu`, in the inverse unit of
    /// `row_squared`.
    fn step(&self, row_squared: f64) -> f64;
}

/// Linear neuron `y = A(k) w`, (51) without bias, with weights `w` that are trained to fulfil
/// `A(k) w = b(k)`, (52).
///
/// Each row trains the weights once: `w ← w + μ e u`, (53), where `u = A(k)ᵀ` is the row, `e` is
/// the target less the output of the neuron, and the [`LearningRule`] chooses μ. [`Lms`] and
/// [`Nlms`] are its two forms.
#[derive(Clone, Debug)]
pub struct Adaline<R, const N: usize> {
    weights: SVector<f64, N>,
    rule: R,
    counts: Counts,
}

impl<R, const N: usize> Adaline<R, N> {
    /// Replaces the weights, which are initially ones (the paper's `w_0`), by `weights`.
    #[must_use]
    pub fn starting_at(self, weights: SVector<f64, N>) -> Self {
        Self { weights, ..self }
    }

    fn with_rule(rule: R) -> Self {
        Self {
            weights: SVector::repeat(1.0), // w_0, section 3.2
            rule,
            counts: Counts::default(),
        }
    }
}

impl<R: LearningRule, const N: usize> Estimator<N> for Adaline<R, N> {
    fn update(&mut self, row: &SVector<f64, N>, target: f64) -> Outcome {
        let outcome = self.counts.admit(row, target);
        if outcome == Outcome::Used {
            let direction = row * self.rule.step(row.norm_squared());
            let error = target - dot(row, &self.weights); // residual of (52)
            self.weights += direction * error; // (53)
        }
        outcome
    }

    fn parameters(&self) -> SVector<f64, N> {
        self.weights
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

/// Number of sums that a [`dot`] product adds up in turn.
const SUMS: usize = 4;

/// Returns the dot product in four sums. The weights of the next row wait for it, and it for the
/// last one of as many additions as there are entries in a sum.
fn dot<const N: usize>(a: &SVector<f64, N>, b: &SVector<f64, N>) -> f64 {
    let mut sums = [-0.0; SUMS]; // The compiler leaves out the addition to -0.0, but not to 0.0, which would change -0.0.
    for (a, b) in a.as_slice().chunks(SUMS).zip(b.as_slice().chunks(SUMS)) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// Step size μ that is the same for every row: the LMS rule of section 3.1.
#[derive(Clone, Copy, Debug)]
pub struct FixedStep(f64);

impl LearningRule for FixedStep {
    fn step(&self, _row_squared: f64) -> f64 {
        self.0
    }
}

/// Step size `μ = α / (β + uᵀu)`, (54), which shrinks as the row grows.
#[derive(Clone, Copy, Debug)]
pub struct NormalisedStep {
    alpha: f64,
    beta: f64,
}

impl LearningRule for NormalisedStep {
    fn step(&self, row_squared: f64) -> f64 {
        self.alpha / (self.beta + row_squared) // (54)
    }
}

/// Least mean squares with a fixed step size, section 3.1 of the paper.
///
/// The rows and targets are assumed to be exact. The estimate may diverge where `step · |row|²`
/// reaches 2, so that the step size must fit the largest row. White noise of variance `σ²` on the
/// targets of rows with unit norm leaves a mean squared prediction error of `σ² step/(2 - step)`,
/// however many rows follow. One row costs `2 N` multiplications.
///
/// ```
/// use nalgebra::Vector1;
/// use tactid_nlms::{Estimator, Lms};
///
/// let mut lms = Lms::<1>::new(0.1)?;
/// for _ in 0..100 {
///     lms.update(&Vector1::new(2.0), 6.0);
/// }
/// assert!((lms.parameters()[0] - 3.0).abs() < 1e-9);
/// # Ok::<(), tactid_nlms::SettingError>(())
/// ```
pub type Lms<const N: usize> = Adaline<FixedStep, N>;

/// Normalised least mean squares, equations (53)-(54): the paper's filter.
///
/// The rows and targets are assumed to be exact. White noise of variance `σ²` on the targets of
/// rows with unit norm leaves a mean squared prediction error of `σ² α/(2 - α)` (the misadjustment:
/// 9 at the paper's α), however many rows follow. Columns of different scale slow the convergence
/// down. One row costs `3 N` multiplications.
///
/// ```
/// use nalgebra::Vector2;
/// use tactid_nlms::{Estimator, Nlms};
///
/// let mut nlms = Nlms::<2>::new(1.0, 0.5)?.starting_at(Vector2::zeros());
/// for k in 0..100 {
///     let row = Vector2::new(f64::from(k).cos(), f64::from(k).sin());
///     nlms.update(&row, row.dot(&Vector2::new(3.0, -0.5)));
/// }
/// assert!((nlms.parameters() - Vector2::new(3.0, -0.5)).norm() < 1e-6);
/// # Ok::<(), tactid_nlms::SettingError>(())
/// ```
pub type Nlms<const N: usize> = Adaline<NormalisedStep, N>;

impl<const N: usize> Lms<N> {
    /// Returns a filter with step size μ = `step` and weights of one, the paper's `w_0`.
    ///
    /// `step` has the inverse unit of a row's squared norm.
    ///
    /// # Errors
    /// Returns [`SettingError`] if `step` is not positive and finite.
    pub fn new(step: f64) -> Result<Self, SettingError> {
        ensure(step > 0.0 && step.is_finite(), "step", step, "(0, inf)")?;
        Ok(Self::with_rule(FixedStep(step)))
    }
}

impl<const N: usize> Nlms<N> {
    /// Returns a filter with the given α and β of (54) and weights of one, the paper's `w_0`.
    ///
    /// `alpha` has no unit, and `beta` the unit of a row's squared norm.
    ///
    /// # Errors
    /// Returns [`SettingError`] if `alpha` is outside (0, 2) or `beta` outside (0, 1): the
    /// conditions for convergence below (54).
    pub fn new(alpha: f64, beta: f64) -> Result<Self, SettingError> {
        ensure(alpha > 0.0 && alpha < 2.0, "alpha", alpha, "(0, 2)")?;
        ensure(beta > 0.0 && beta < 1.0, "beta", beta, "(0, 1)")?;
        Ok(Self::with_rule(NormalisedStep { alpha, beta }))
    }

    /// Returns the paper's filter: α = 1.8, β = 0.9 and weights of one (section 3.2).
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

    /// One step of (53)-(54) by hand: e = 7 - 4 = 3, μ = 1.8 / (0.9 + 6).
    #[test]
    fn one_step_is_the_papers() {
        let mut filter = Nlms::<3>::paper();
        filter.update(&Vector3::new(1.0, 2.0, 1.0), 7.0);
        let step = 1.8 * 3.0 / 6.9;
        let expected = Vector3::new(1.0 + step, 1.0 + 2.0 * step, 1.0 + step);
        assert!((filter.parameters() - expected).norm() < 1e-15);
    }

    /// At α = 1 and as β approaches 0, the step projects the weights onto the solutions of the row.
    #[test]
    fn unit_step_projects_onto_the_row() {
        let mut filter = Nlms::<2>::new(1.0, 1e-300).unwrap();
        let row = Vector2::new(0.3, -4.0);
        filter.update(&row, 2.5);
        assert!((filter.parameters().dot(&row) - 2.5).abs() < 1e-14);
    }

    /// On the same large rows LMS diverges beyond its stable step size and NLMS converges.
    #[test]
    fn normalisation_is_what_keeps_large_rows_stable() {
        let truth = Vector2::new(2.0, -1.0);
        let mut lms = Lms::<2>::new(0.1).unwrap();
        let mut nlms = Nlms::<2>::paper();
        for k in 0..1000 {
            let row = Vector2::new((f64::from(k)).cos(), (f64::from(k)).sin()) * 30.0;
            // After a hundred rows its weights approach the limit of f64.
            if k < 100 {
                lms.update(&row, row.dot(&truth));
            }
            nlms.update(&row, row.dot(&truth));
        }
        assert!(lms.parameters().norm() > 1e6);
        let error = (nlms.parameters() - truth).norm();
        assert!(error < 1e-9, "{error}");
    }

    /// With white noise on the targets the mean squared error settles at the misadjustment α/(2 -
    /// α) times the variance of the noise, so a larger α is noisier.
    #[test]
    fn misadjustment_grows_with_alpha() {
        let squared_error = |alpha: f64| {
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
        let ratio = squared_error(1.8) / squared_error(0.5);
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
        assert_eq!(message, "`alpha` is 2.5, but must lie in (0, 2)");
    }
}
