//! A payload identified with a calibration.

use nalgebra::{SMatrix, SVector};
use schemars::JsonSchema;
use serde::Serialize;
use tactid_batch::BatchResult;

use super::contradiction::Contradiction;
use super::student::DEGREES_OF_FREEDOM;

/// A payload identified from joint efforts with a calibration.
///
/// All standard deviations and the covariance describe normal distributions with the same 95 %
/// intervals: recordings determine their own noise with [`Self::DEGREES_OF_FREEDOM`] degrees of
/// freedom only, and standard deviations are widened by the ratio of Student's quantile to the
/// normal one, so that 1.96 of them contain 95 %.
#[derive(Clone, Debug)]
pub struct CalibratedEstimate {
    /// The payload, its fit and the findings, in the form of every batch identification: channels
    /// are the joints between base and tool, without history, delay and forecast.
    pub result: BatchResult,
    /// Linear parameters of the payload in the tool frame, not projected onto consistent ones.
    pub parameters: SVector<f64, 10>,
    /// Covariance of these parameters, widened, zero in unobservable directions.
    pub covariance: SMatrix<f64, 10, 10>,
    /// Fraction of the variance of each of the [ten values](tactid_identify::VALUE_NAMES) that is
    /// noise of the loaded recordings. The rest is what the calibration does not know of the arm:
    /// no longer recording of the payload reduces it.
    pub noise_fraction: [f64; 10],
    /// Mean square of the whitened residual of each joint: about one where the joint is as noisy as
    /// in the calibration. Where it is larger, it multiplies the variances of the noise.
    pub misfit: Vec<f64>,
    /// How the friction of the joints has changed since the calibration; `None` where the
    /// recordings do not show that it has.
    pub friction_change: Option<ArmChange>,
    /// How the gains of the joints have changed since the calibration; `None` where the recordings
    /// do not show that they have, and where the change is an everyday one.
    pub gain_change: Option<ArmChange>,
    /// The zero of a joint that has moved since the calibration, with
    /// [`Assumption::JointZero`](super::Assumption::JointZero); `None` where the recordings do not
    /// show one, and where their settings do not
    /// [find contradictions](super::CalibrationSettings::finds_contradictions). The intervals do
    /// not contain its effect.
    pub moved_zero: Option<Contradiction>,
    /// Standard deviation of the efforts' residuals with the unloaded recordings, relative to that
    /// without them, where they were left out because they do not fit the loaded ones; `None` where
    /// they are used, and without any.
    pub unloaded_left_out: Option<f64>,
}

/// How friction or gains of the joints have changed since a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ArmChange {
    /// Change of each joint without a unit: a fraction of what it was at the calibration; positive
    /// where it is larger now. The change of friction refers to the velocities of the loaded
    /// recordings, without the friction that depends on the load.
    pub by_joint: Vec<f64>,
    /// Logarithm of the probability of the change less the logarithm for no such change: the
    /// difference of their evidences, and for gains the prior odds `e⁻²`; without a unit.
    pub log_evidence: f64,
}

impl ArmChange {
    /// Returns the rms change of the joints, a fraction.
    #[must_use]
    pub fn rms(&self) -> f64 {
        let squares: f64 = self.by_joint.iter().map(|change| change * change).sum();
        (squares / self.by_joint.len() as f64).sqrt()
    }
}

impl CalibratedEstimate {
    /// Degrees of freedom of Student's distribution for the intervals. Half a minute of motion
    /// contains some ten correlation times of the noise. Shorter recordings contain fewer, but most
    /// of what they leave uncertain is known from the calibration: on twenty simulated arms like a
    /// UR10, 99.8, 98.3, 97.5, 96.8, 95.5, 96.3 and 92.2 % of the intervals of 95 % hold after 1.5,
    /// 2, 3, 5, 10, 20 and 60 s.
    pub const DEGREES_OF_FREEDOM: f64 = DEGREES_OF_FREEDOM;
}
