//! What a recording says about the ten linear parameters: a point and its information.

use nalgebra::{SMatrix, SVector, SymmetricEigen};

use crate::IdentifyError;
use crate::equations::window::NOISE_CORRELATION;
use crate::fit::Fit;
use crate::solve::subspace::{Matrix, NullSpace, Vector};

/// Ratio of an eigenvalue to the largest one, in parameters scaled to an information of one each, at and below which a
/// direction is unobservable: above the rounding of an inverted covariance.
const ROUNDING: f64 = 1e-12;

/// Least variance of an observable direction of a fit, relative to the largest one: below, it is rounding.
const LEAST_VARIANCE: f64 = 1e-13;

/// What one recording says about the payload: a point in the ten linear parameters, and the information on them.
///
/// Unlike a covariance, an information matrix also describes a motion that leaves directions of the parameters
/// unobservable: it is zero along them. The information of independent recordings is additive, so that two motions
/// together may determine what neither does alone. Prior knowledge of the payload (its mass, a bounding box) is not
/// included, because it would count once for each recording.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearEstimate {
    /// Parameters of the payload in the order of
    /// [`InertialParameters`](tactid_dynamics::InertialParameters): mass, kg; first moments, kg m; inertia about the
    /// frame's origin, kg m². They need not be physically consistent, and are arbitrary in unobservable directions.
    pub parameters: SVector<f64, 10>,
    /// Information of the parameters, the inverse of their covariance in the observable directions: symmetric, positive
    /// semidefinite, in the inverse units of the parameters' products. It accounts for the uncertainty of the gains, but
    /// recordings of one robot share the errors of its gains: combined, they count as independent.
    pub information: SMatrix<f64, 10, 10>,
    /// Number of independent windows from which the noise, and with it the information, was estimated; infinite where it is
    /// known. It is part of the test whether recordings agree.
    pub degrees_of_freedom: f64,
}

impl LinearEstimate {
    /// Returns what a fit says about the payload, given the parameters of the `known` bodies that the fit contains.
    pub(crate) fn of_fit(fit: &Fit, known: &Vector) -> Self {
        let windows = fit.weights.len() as f64 / NOISE_CORRELATION;
        Self::new(
            fit.parameters - known,
            &fit.covariance,
            &fit.null_space,
            windows,
        )
    }

    /// Returns the estimate with a covariance that is zero in the directions of a null space.
    pub(crate) fn new(
        parameters: Vector,
        covariance: &Matrix,
        null_space: &NullSpace,
        degrees_of_freedom: f64,
    ) -> Self {
        let scales = null_space.scales();
        let scaled = covariance.component_div(&(scales * scales.transpose()));
        let largest = scaled.diagonal().max().max(f64::MIN_POSITIVE);
        // With a variance of its own, an unobservable direction can be inverted, and is then removed again.
        let directions = null_space.directions().iter();
        let unobservable: Matrix = directions.map(|n| n * n.transpose()).sum();
        let mut eigen = SymmetricEigen::new(scaled + unobservable * largest);
        eigen
            .eigenvalues
            .apply(|variance| *variance = 1.0 / variance.max(LEAST_VARIANCE * largest));
        let information = eigen.recompose() - unobservable / largest;
        Self {
            parameters,
            information: information.component_div(&(scales * scales.transpose())),
            degrees_of_freedom,
        }
    }

    /// Checks that the numbers are finite, and that the information is symmetric and positive semidefinite.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Information`] otherwise, with the index of the `run`.
    pub(crate) fn check(&self, run: usize) -> Result<(), IdentifyError> {
        let wrong = |problem| Err(IdentifyError::Information { run, problem });
        let numbers = self.parameters.iter().chain(self.information.iter());
        if numbers.copied().any(|number| !number.is_finite()) {
            return wrong("contains a number that is not finite");
        }
        if self.degrees_of_freedom.is_nan() || self.degrees_of_freedom <= 0.0 {
            return wrong("has no positive number of degrees of freedom");
        }
        let diagonal = self.information.diagonal();
        let scales = diagonal.map(|entry| if entry > 0.0 { entry.sqrt() } else { 1.0 });
        let scaled = self
            .information
            .component_div(&(scales * scales.transpose()));
        if (scaled - scaled.transpose()).amax() > 1e-6 {
            return wrong("is not symmetric");
        }
        if SymmetricEigen::new(scaled).eigenvalues.min() < -1e-6 {
            return wrong("has a negative eigenvalue");
        }
        Ok(())
    }
}

/// An estimate from information: its parameters, its covariance, and the directions without information.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    pub(crate) parameters: Vector,
    /// Covariance, zero in unobservable directions.
    pub(crate) covariance: Matrix,
    pub(crate) null_space: NullSpace,
}

impl Solved {
    /// Solves for the parameters that minimise the sum of `(π - πᵢ)ᵀ Wᵢ (π - πᵢ)` over pairs of points and information.
    pub(crate) fn new(terms: &[(Vector, Matrix)]) -> Self {
        let information: Matrix = terms.iter().map(|(_, information)| information).sum();
        let scales = scales(&information);
        let eigen = SymmetricEigen::new(information.component_mul(&(scales * scales.transpose())));
        let largest = eigen.eigenvalues.max();
        let is_observable = |k: &usize| eigen.eigenvalues[*k] > ROUNDING * largest;
        let column = |k: usize| -> Vector { eigen.eigenvectors.column(k).into() };
        let observable = (0..10).filter(is_observable);
        let variances = observable.map(|k| {
            let direction = column(k).component_mul(&scales);
            direction * direction.transpose() / eigen.eigenvalues[k]
        });
        let covariance: Matrix = variances.sum();
        // The second pass corrects what cancellation in the first one leaves.
        let mut parameters = Vector::zeros();
        for _ in 0..2 {
            let gradients = terms.iter().map(|(at, weight)| weight * (at - parameters));
            let gradient: Vector = gradients.sum();
            parameters += covariance * gradient;
        }
        let unobservable = (0..10).filter(|k| !is_observable(k));
        Self {
            parameters,
            covariance,
            null_space: NullSpace::new(scales, unobservable.map(column)),
        }
    }

    /// Number of observable directions.
    pub(crate) fn rank(&self) -> u32 {
        10 - self.null_space.directions().len() as u32
    }

    /// Returns the sum that the parameters minimise.
    pub(crate) fn chi_square(&self, terms: &[(Vector, Matrix)]) -> f64 {
        let squares = terms.iter().map(|(at, weight)| {
            let rest = at - self.parameters;
            (weight * rest).dot(&rest)
        });
        squares.sum::<f64>().max(0.0)
    }
}

/// Returns units of the parameters in which each has an information of one; one where it has none.
fn scales(information: &Matrix) -> Vector {
    let unit = |entry: f64| {
        if entry > 0.0 {
            entry.sqrt().recip()
        } else {
            1.0
        }
    };
    information.diagonal().map(unit)
}

/// Returns the information that remains where the parameters of a run also vary with the covariance `between`:
/// `(W⁻¹ + T)⁻¹`, written so that it holds for a singular `W`, too.
pub(crate) fn with_variance(information: &Matrix, between: &Matrix) -> Matrix {
    let scales = scales(information);
    let products = scales * scales.transpose();
    let scaled = information.component_mul(&products);
    let sum = Matrix::identity() + between.component_div(&products) * scaled;
    let Some(inverse) = sum.try_inverse() else {
        return *information;
    };
    let remaining = scaled * inverse;
    (0.5 * (remaining + remaining.transpose())).component_div(&products)
}
