//! Designs joint motions from which a payload is identified quickly, within the limits of the robot.
//!
//! What a motion does not excite, no estimator can know. [`design`] chooses the motion whose predicted confidence
//! intervals are the smallest relative to their targets, for the method and the noise by which the payload is then
//! identified, within the [limits](Limit) of the joints, the torques, the wrench and the [`Grip`], and with the attitude of
//! a free-floating base [held within a bound](BaseBounds).
//!
//! # How the crate works
//!
//! A motion is a [`Spline`] for each joint. Limits on position, velocity and acceleration are linear in its control points
//! and hold at all times. Everything else (regressor rows, torques, wrenches, the twist of the base) is an output of one
//! model of the robot at a state of the joints, sampled along the motion and differentiated by finite differences. Each
//! step of the design solves a conic program in which functions and limits are linear in the control points, within a trust
//! region. [`margins`] and [`predict`] then evaluate the result without these approximations.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

// The tests in this crate share problems with those beside it.
#[cfg(test)]
extern crate self as tactid_excitation;

mod cones;
mod dense;
mod design;
mod error;
mod fourier;
#[cfg(test)]
mod gradient_tests;
mod grip;
mod joint_limits;
mod joint_rows;
mod limits;
mod motion;
mod objective;
mod plant;
mod prediction;
mod problem;
mod samples;
mod search;
mod shortest;
mod spline;
mod subproblem;

pub use dense::{Excursion, margins};
pub use design::{Design, DesignSettings, design, design_observed};
pub use error::ExcitationError;
pub use fourier::FourierMotion;
pub use grip::Grip;
pub use joint_limits::JointLimits;
pub use limits::{Limit, Margin};
pub use motion::{JointStates, Motion, Trajectory};
pub use prediction::{Prediction, predict};
pub use problem::{BaseBounds, Criterion, Problem, Sensing, targets_within};
pub use search::{Observer, Progress};
pub use shortest::{ShortestSettings, shortest};
pub use spline::{End, FEWEST_CONTROL_POINTS, Spline, SplineBasis};
