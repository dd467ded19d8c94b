//! What a recording says about the ten linear parameters: a point, its information and its errors.

use nalgebra::{Dyn, OMatrix, SMatrix, SVector, SymmetricEigen, U10};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::IdentifyError;
use crate::equations::window::NOISE_CORRELATION;
use crate::fit::{Fit, GainErrors};
use crate::serial;
use crate::solve::subspace::{Matrix, NullSpace, Vector};

/// Ratio of an eigenvalue to the largest one, in parameters scaled to an information of one each, at and below which a
/// direction is unobservable: above the rounding of an inverted covariance.
const ROUNDING: f64 = 1e-12;

/// Least variance of an observable direction of a fit, relative to the largest one: below, it is rounding.
const LEAST_VARIANCE: f64 = 1e-13;

/// What one recording says about the payload: a point in the ten linear parameters, the information on them, and its errors.
///
/// Unlike a covariance, an information matrix also describes a motion that leaves directions of the parameters
/// unobservable: it is zero along them. The information of independent recordings is additive, so that two motions
/// together may determine what neither does alone. Prior knowledge of the payload (its mass, a bounding box) is not
/// included, because it would count once for each recording.
///
/// Information and covariance are two estimates. The weight of a recording among others must not depend on the errors of its
/// parameters, or a recording that seems precise by chance counts too much. So the information is that of rows with noise of the
/// size that the channels have on average, and the covariance, which decides how wide an interval is, is estimated from the scatter
/// of the residuals in each direction. They differ by some ten percent in long recordings, and by a factor in short ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LinearEstimate {
    /// Parameters of the payload in the order of
    /// [`InertialParameters`](tactid_dynamics::InertialParameters): mass, kg; first moments, kg m; inertia about the
    /// frame's origin, kg m². They need not be physically consistent, and are arbitrary in unobservable directions.
    #[serde(with = "serial::ten")]
    #[schemars(with = "[f64; 10]")]
    pub parameters: SVector<f64, 10>,
    /// Information of the parameters, the weight of the recording among others: symmetric, positive semidefinite, zero in
    /// unobservable directions, in the inverse units of the parameters' products.
    #[serde(with = "serial::square")]
    #[schemars(with = "[[f64; 10]; 10]")]
    pub information: SMatrix<f64, 10, 10>,
    /// Covariance of the errors of the parameters that no other recording shares: symmetric, positive semidefinite. What it
    /// contains in unobservable directions does not count.
    #[serde(with = "serial::square")]
    #[schemars(with = "[[f64; 10]; 10]")]
    pub covariance: SMatrix<f64, 10, 10>,
    /// Errors that other recordings may share.
    pub shared: SharedErrors,
    /// Number of independent windows from which the covariance was estimated; infinite where it is known. It is part of the
    /// test whether recordings agree.
    pub degrees_of_freedom: f64,
}

/// How errors of unknowns that several recordings may share, such as the gain of a joint, change the parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SharedErrors {
    /// Number of each independent unknown, which is the same in all recordings that share it. The numbers of one recording
    /// differ from each other.
    pub unknowns: Vec<u64>,
    /// Change of the ten parameters by an error of one standard deviation, a column for each of `unknowns`.
    /// It is serialised column by column.
    #[serde(with = "serial::columns")]
    #[schemars(with = "Vec<[f64; 10]>")]
    pub changes: OMatrix<f64, U10, Dyn>,
}

impl SharedErrors {
    /// Returns no errors.
    #[must_use]
    pub fn none() -> Self {
        Self {
            unknowns: Vec::new(),
            changes: GainErrors::zeros(0),
        }
    }

    /// Returns the errors of gains, which all recordings of a robot share.
    fn of_gains(changes: GainErrors) -> Self {
        Self {
            unknowns: (0..changes.ncols() as u64).collect(),
            changes,
        }
    }
}

impl LinearEstimate {
    /// Returns the estimate of a recording whose noise is known, and which shares no error with others.
    #[must_use]
    pub fn with_known_noise(
        parameters: SVector<f64, 10>,
        information: SMatrix<f64, 10, 10>,
    ) -> Self {
        Self {
            parameters,
            information,
            covariance: pseudo_inverse(&information).covariance,
            shared: SharedErrors::none(),
            degrees_of_freedom: f64::INFINITY,
        }
    }

    /// Returns what a fit says about the payload, given the parameters of the `known` bodies that the fit contains, and a factor
    /// on the standard deviations of what the recording does not share with others.
    pub(crate) fn of_fit(fit: &Fit, known: &Vector, widening: f64) -> Self {
        let covariance = (fit.covariance - fit.gain_covariance()) * widening.powi(2);
        let information = information(&fit.bread, &fit.null_space);
        // Windows overlap, and noise may be coloured: by so much the parameters scatter more than by white noise.
        let rank = 10 - fit.null_space.directions().len();
        let ratio = (information * covariance).trace() / rank.max(1) as f64;
        let ratio = if ratio > 0.0 && ratio.is_finite() {
            ratio
        } else {
            1.0
        };
        Self {
            parameters: fit.parameters - known,
            information: information / ratio,
            covariance,
            shared: SharedErrors::of_gains(fit.gain_errors.clone()),
            degrees_of_freedom: fit.weights.len() as f64 / NOISE_CORRELATION,
        }
    }

    /// Checks that the numbers are finite, and that the information is symmetric and positive semidefinite.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Information`] otherwise, with the index of the `run`.
    pub(crate) fn check(&self, run: usize) -> Result<(), IdentifyError> {
        let wrong = |problem| Err(IdentifyError::Information { run, problem });
        let numbers = self.parameters.iter().chain(self.information.iter());
        let numbers = numbers.chain(self.covariance.iter());
        let numbers = numbers.chain(self.shared.changes.iter());
        if numbers.copied().any(|number| !number.is_finite()) {
            return wrong("contains a number that is not finite");
        }
        let unknowns = &self.shared.unknowns;
        let is_repeated = |k: usize| unknowns[..k].contains(&unknowns[k]);
        if unknowns.len() != self.shared.changes.ncols() || (0..unknowns.len()).any(is_repeated) {
            return wrong("has shared errors without a number of their own for each unknown");
        }
        if self.degrees_of_freedom.is_nan() || self.degrees_of_freedom <= 0.0 {
            return wrong("has no positive number of degrees of freedom");
        }
        if !is_symmetric(&self.information) || !is_symmetric(&self.covariance) {
            return wrong("is not symmetric");
        }
        if !is_positive(&self.information) || !is_positive(&self.covariance) {
            return wrong("has a negative eigenvalue");
        }
        Ok(())
    }
}

/// Returns a symmetric matrix in units in which its diagonal is one where it is positive.
fn normalized(matrix: &Matrix) -> Matrix {
    let scales = scales(matrix);
    matrix.component_mul(&(scales * scales.transpose()))
}

fn is_symmetric(matrix: &Matrix) -> bool {
    let scaled = normalized(matrix);
    (scaled - scaled.transpose()).amax() <= 1e-6
}

fn is_positive(matrix: &Matrix) -> bool {
    SymmetricEigen::new(normalized(matrix)).eigenvalues.min() >= -1e-6
}

/// Returns the inverse of a covariance in the observable directions; it is zero in those of the null space.
pub(crate) fn information(covariance: &Matrix, null_space: &NullSpace) -> Matrix {
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
    information.component_div(&(scales * scales.transpose()))
}

/// The inverse of an information in its observable directions.
#[derive(Clone, Debug)]
pub(crate) struct PseudoInverse {
    /// Zero in unobservable directions.
    pub(crate) covariance: Matrix,
    pub(crate) null_space: NullSpace,
}

/// Returns the inverse of an information, and the directions without information.
pub(crate) fn pseudo_inverse(information: &Matrix) -> PseudoInverse {
    let scales = scales(information);
    let eigen = SymmetricEigen::new(normalized(information));
    let largest = eigen.eigenvalues.max();
    let is_observable = |k: &usize| eigen.eigenvalues[*k] > ROUNDING * largest;
    let column = |k: usize| -> Vector { eigen.eigenvectors.column(k).into() };
    let variances = (0..10).filter(is_observable).map(|k| {
        let direction = column(k).component_mul(&scales);
        direction * direction.transpose() / eigen.eigenvalues[k]
    });
    let unobservable = (0..10).filter(|k| !is_observable(k));
    PseudoInverse {
        covariance: variances.sum(),
        null_space: NullSpace::new(scales, unobservable.map(column)),
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
