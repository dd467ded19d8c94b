//! A model of an arm's joint efforts, calibrated from recordings, and payloads identified by it.
//!
//! The effort of joint `j` at the time `t + d` is equation (C1), with all motion at the time `t`:
//!
//! ```text
//! u = T + o + b q̇ + Σ c tanh(q̇ / v) + k s (|T| - T0) + l s (|T| - |A|) + I q̈ + e,    A = a (Y β + B),    T = A + a P π
//! ```
//!
//! with the inverse gain `a` (efforts times the gain are torques), the inertial parameters `β` of
//! the links and `π` of the payload with their regressors `Y` and `P`, the torque `B` of bodies
//! that are not between base and tool, as described, offset `o`, viscous friction `b`, Coulomb
//! friction and what replaces it near standstill `c`, load-dependent friction `k` and by what the
//! payload's differs `l` (`s` is the smoothed sign of the velocity, `T0` the rms torque in a first
//! fit, which separates `k` from `c`), rotor inertia `I`, and noise `e` of three kinds. Magnitudes
//! are smoothed: `|x|` is the root of `x² + (0.1 T0)²`. The efforts lag the motion by the delay
//! `d`, which all joints share. The noisy efforts stand alone on the left, because the inverse gain
//! is the unknown: nothing biases the gains.
//!
//! 1. An [`EffortRecorder`] turns the samples of one recording into window means of all these
//!    columns, an [`EffortRecording`]. One pass over the samples is enough; an hour needs 120 MB.
//! 2. [`calibrate()`] fits the unknowns of the arm and the noise of each joint to recordings
//!    without payload, and with payloads of which something is known. The result, a
//!    [`Calibration`], is the mean **and the precision** of all unknowns, as plain data that can be
//!    written to a file.
//! 3. [`Calibration::identify`] estimates the payload of other recordings **together with the
//!    arm**, with the calibration as prior: the covariance of the payload contains what the
//!    calibration does not know.
//!
//! The columns are computed at instants and averaged afterwards, with the polynomials and the
//! windows of the [equation stream](tactid_identify::EquationStream): friction at the mean velocity
//! of a window is not the mean friction. Only the load-dependent friction is a product of means,
//! because the torque changes little within a window.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod arm;
mod calibrate;
mod change;
mod checks;
mod compare;
mod contradiction;
mod delay;
mod description;
mod error;
mod estimate;
mod fingerprint;
mod fit;
mod identify;
mod interruption;
mod layout;
mod model;
mod moved_zero;
mod noise;
mod noise_fit;
mod payload;
mod plausibility;
mod posterior;
mod recorder;
mod recording;
mod reference;
mod report;
mod rows;
mod scale;
mod settings;
mod similar_robot;
mod simplex;
mod solver;
mod student;
mod unloaded;
mod words;

pub use calibrate::{calibrate, calibrate_interruptibly};
pub use compare::EffortComparison;
pub use contradiction::{Assumption, Contradiction};
pub use description::LinkDescription;
pub use error::CalibrateError;
pub use estimate::{ArmChange, CalibratedEstimate};
pub use interruption::InterruptionCheck;
pub use model::Calibration;
pub use noise::EffortNoise;
pub use payload::KnownPayload;
pub use recorder::EffortRecorder;
pub use recording::EffortRecording;
pub use report::{
    CalibratingRecording, CalibrationReport, CalibrationResult, JointCalibration, LinkCalibration,
    MotionShortage,
};
pub use settings::CalibrationSettings;
