//! Recursive least squares in square-root form.

use nalgebra::{SMatrix, SVector};

use crate::{Counts, Estimator, Outcome};

/// Weight of the start against one row of unit size: small enough to leave no trace in an excited
/// direction, large enough to hold a direction that no row excites where it started.
const PRIOR: f64 = 1e-6;

/// Recursive least squares over all rows with equal weight.
///
/// Keeps the upper triangle `R` of the rows' QR decomposition, each row turned in by Givens
/// rotations, so that nothing is squared: right to rounding where the covariance form loses half of
/// its digits. A direction that no row excites keeps its starting value.
///
/// Assumes noise on the wanted value alone, white and of one size.
#[derive(Clone, Debug)]
pub struct Rls<const N: usize> {
    /// `R`, upper triangular: `RᵀR` is the information.
    triangle: SMatrix<f64, N, N>,
    /// `z` in `R x = z`.
    target: SVector<f64, N>,
    residual_squares: f64,
    counts: Counts,
}

impl<const N: usize> Default for Rls<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Rls<N> {
    /// Starting at ones, as the paper's filters do.
    #[must_use]
    pub fn new() -> Self {
        Self {
            triangle: SMatrix::identity() * PRIOR,
            target: SVector::repeat(PRIOR),
            residual_squares: 0.0,
            counts: Counts::default(),
        }
    }

    /// The same, starting at the given parameters. To be said before the first row.
    #[must_use]
    pub fn starting_at(self, parameters: SVector<f64, N>) -> Self {
        Self {
            target: self.triangle * parameters,
            ..self
        }
    }

    /// Sum of the squared residuals at the present parameters.
    #[must_use]
    pub fn residual_squares(&self) -> f64 {
        self.residual_squares
    }

    /// Covariance of the parameters, from the rows and the residuals' variance; `None` until there
    /// are more rows than parameters. A direction that no row excites has a vast one.
    #[must_use]
    pub fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        let freedom = self
            .counts
            .used
            .checked_sub(N as u64)
            .filter(|&rest| rest > 0)?;
        let mut inverse = SMatrix::<f64, N, N>::identity();
        self.triangle.solve_upper_triangular_mut(&mut inverse);
        Some(inverse * inverse.transpose() * (self.residual_squares / freedom as f64))
    }
}

impl<const N: usize> Estimator<N> for Rls<N> {
    fn update(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome {
        let outcome = self.counts.admit(row, wanted);
        if outcome == Outcome::Refused {
            return outcome;
        }
        let (mut row, mut wanted) = (*row, wanted);
        for k in 0..N {
            if row[k] == 0.0 {
                continue;
            }
            // Turns row k of the triangle and the new row so that the new one's entry k vanishes.
            let diagonal = self.triangle[(k, k)];
            let length = diagonal.hypot(row[k]);
            let (cosine, sine) = (diagonal / length, row[k] / length);
            for column in k..N {
                let (above, below) = (self.triangle[(k, column)], row[column]);
                self.triangle[(k, column)] = cosine * above + sine * below;
                row[column] = cosine * below - sine * above;
            }
            let above = self.target[k];
            self.target[k] = cosine * above + sine * wanted;
            wanted = cosine * wanted - sine * above;
        }
        self.residual_squares += wanted * wanted;
        outcome
    }

    fn parameters(&self) -> SVector<f64, N> {
        let mut parameters = self.target;
        // The diagonal starts positive and only grows, so the triangle is never singular.
        self.triangle.solve_upper_triangular_mut(&mut parameters);
        parameters
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector, Vector3};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// After any rows the parameters are the batch least-squares solution of the same rows, and
        /// the covariance is the textbook's.
        #[test]
        fn equals_batch_least_squares(
            entries in proptest::collection::vec(-5.0..5.0f64, 4 * 30),
        ) {
            let mut rls = Rls::<3>::new();
            for row in entries.chunks(4) {
                rls.update(&Vector3::new(row[0], row[1] * 10.0, row[2]), row[3]);
            }
            let a = DMatrix::from_fn(30, 3, |i, j| entries[4 * i + j] * [1.0, 10.0, 1.0][j]);
            let b = DVector::from_fn(30, |i, _| entries[4 * i + 3]);
            let batch = a.clone().svd(true, true).solve(&b, 1e-14).unwrap();
            prop_assert!((rls.parameters() - &batch).norm() < 1e-9 * (1.0 + batch.norm()));
            let squares = (&a * &batch - &b).norm_squared();
            prop_assert!((rls.residual_squares() - squares).abs() < 1e-9 * squares);
            let covariance = (a.transpose() * &a).try_inverse().unwrap() * (squares / 27.0);
            let difference = (rls.covariance().unwrap() - &covariance).norm();
            prop_assert!(difference < 1e-8 * covariance.norm());
        }
    }

    /// A direction that no row excites keeps its start; the others are found.
    #[test]
    fn an_unexcited_direction_keeps_its_start() {
        let mut rls = Rls::<3>::new();
        for k in 0..50 {
            let row = Vector3::new(f64::from(k).cos(), f64::from(k).sin(), 0.0);
            rls.update(&row, row.dot(&Vector3::new(4.0, -2.0, 0.0)));
        }
        assert!((rls.parameters() - Vector3::new(4.0, -2.0, 1.0)).norm() < 1e-9);
    }

    /// Ill-conditioned rows (1e6 between columns) are solved to rounding: nothing is squared.
    #[test]
    fn keeps_its_digits_on_badly_scaled_rows() {
        let truth = Vector3::new(1e-3, 2.0, -700.0);
        let mut rls = Rls::<3>::new();
        for k in 0..10_000 {
            let t = f64::from(k) * 0.01;
            let row = Vector3::new(1e4 * t.cos(), t.sin(), 1e-2 * (1.7 * t).cos());
            rls.update(&row, row.dot(&truth));
        }
        let error = (rls.parameters() - truth).component_div(&truth).amax();
        assert!(error < 1e-9, "{error:e}");
    }

    /// A row with NaN or infinity changes nothing and is counted.
    #[test]
    fn refuses_what_is_not_finite() {
        let mut rls = Rls::<3>::new();
        rls.update(&Vector3::new(1.0, 2.0, 3.0), 4.0);
        let before = rls.parameters();
        for (row, wanted) in [
            (Vector3::new(f64::NAN, 0.0, 0.0), 1.0),
            (Vector3::new(0.0, f64::INFINITY, 0.0), 1.0),
            (Vector3::new(1.0, 1.0, 1.0), f64::NAN),
        ] {
            assert_eq!(rls.update(&row, wanted), Outcome::Refused);
        }
        assert_eq!(rls.parameters(), before);
        let expected = Counts {
            used: 1,
            refused: 3,
        };
        assert_eq!(rls.counts(), expected);
    }
}
