//! What a recording says about the ten linear parameters: a point, its information and its errors.

use nalgebra::{Dyn, OMatrix, SMatrix, SVector, U10};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_identify::KnownBodies;
use tactid_identify::solve::Vector;

use crate::fit::{Fit, GainErrors};
use crate::serial;
use crate::solve::{information, pseudo_inverse};

/// What one recording says about the payload: a point in the ten linear parameters, the information
/// on them, and its errors.
///
/// Unlike a covariance, an information matrix also describes a motion that leaves directions of the
/// parameters unobservable: it is zero along them. The information of independent recordings is
/// additive, so that two motions together may determine what neither does alone. Prior knowledge of
/// the payload (its mass, a bounding box) is not included, because it would count once for each
/// recording.
///
/// Information and covariance are two estimates. The weight of a recording among others must not
/// depend on the errors of its parameters, or a recording that seems precise by chance counts too
/// much. So the information is that of rows with noise of the size that the channels have on
/// average, and the covariance, which decides how wide an interval is, is estimated from the
/// scatter of the residuals in each direction. They differ by some ten percent in long recordings,
/// and by a factor in short ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LinearEstimate {
    /// Parameters of the payload in the order of
    /// [`InertialParameters`](tactid_dynamics::InertialParameters): mass, kg; first moments, kg m;
    /// inertia about the frame's origin, kg m². They need not be physically consistent, and are
    /// arbitrary in unobservable directions.
    #[serde(with = "serial::ten")]
    #[schemars(with = "[f64; 10]")]
    pub parameters: SVector<f64, 10>,
    /// Information of the parameters, the weight of the recording among others: symmetric, positive
    /// semidefinite, zero in unobservable directions, in the inverse units of the parameters'
    /// products.
    #[serde(with = "serial::square")]
    #[schemars(with = "[[f64; 10]; 10]")]
    pub information: SMatrix<f64, 10, 10>,
    /// Covariance of the errors of the parameters that no other recording shares: symmetric,
    /// positive semidefinite. What it contains in unobservable directions does not count.
    #[serde(with = "serial::square")]
    #[schemars(with = "[[f64; 10]; 10]")]
    pub covariance: SMatrix<f64, 10, 10>,
    /// Errors that other recordings may share.
    pub shared: SharedErrors,
    /// Number of independent windows, or of degrees of freedom of the noise where the motion was
    /// estimated with the payload, from which the covariance was estimated; infinite where it is
    /// known. It is part of the test whether recordings agree.
    pub degrees_of_freedom: f64,
}

/// How errors of unknowns that several recordings may share, such as the gain of a joint, change
/// the parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SharedErrors {
    /// Number of each independent unknown, which is the same in all recordings that share it. The
    /// numbers of one recording differ from each other.
    pub unknowns: Vec<u64>,
    /// Change of the ten parameters by an error of one standard deviation, a column for each of
    /// `unknowns`. It is serialised column by column.
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

    /// Returns the errors of gains, which all recordings of a robot share, and those of a known
    /// tool, which all recordings with this tool share.
    pub(crate) fn new(of_gains: &GainErrors, of_tool: impl Iterator<Item = (u64, Vector)>) -> Self {
        let gains = of_gains.column_iter().map(Vector::from);
        let (unknowns, changes): (_, Vec<_>) = (0..).zip(gains).chain(of_tool).unzip();
        Self {
            unknowns,
            changes: GainErrors::from_fn(changes.len(), |row, column| changes[column][row]),
        }
    }
}

impl LinearEstimate {
    /// Returns the estimate of a recording whose noise is known, and which shares no error with
    /// others.
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

    /// Returns what a fit says about the payload, given the `known` bodies that the fit contains,
    /// and a factor on the standard deviations of what the recording does not share with others.
    pub(crate) fn of_fit(fit: &Fit, known: &KnownBodies, widening: f64) -> Self {
        let covariance = (fit.covariance - fit.gain_covariance()) * widening.powi(2);
        let information = information(&fit.bread, &fit.null_space);
        // Windows overlap, and noise may be coloured: by so much the parameters scatter more than
        // by white noise.
        let rank = 10 - fit.null_space.directions().len();
        let ratio = (information * covariance).trace() / rank.max(1) as f64;
        let ratio = if ratio > 0.0 && ratio.is_finite() {
            ratio
        } else {
            1.0
        };
        Self {
            parameters: fit.parameters - known.parameters,
            information: information / ratio,
            covariance,
            shared: SharedErrors::new(&fit.gain_errors, known.errors()),
            degrees_of_freedom: fit.independent,
        }
    }
}
