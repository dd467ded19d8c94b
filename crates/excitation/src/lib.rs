//! Designs joint motions that identify a payload quickly, within the limits of the robot.
//!
//! An estimator cannot determine a parameter that the motion does not excite. [`design`] chooses
//! the motion with the smallest predicted confidence intervals relative to their targets, for the
//! method and the noise by which the payload is then identified, within the [limits](Limit) of the
//! joints, the torques, the wrench and the [`Grip`], and with the attitude of a free-floating base
//! [held within a bound](BaseBounds).
//!
//! ```
//! # use tactid_dynamics::{BaseKind, MassProperties, Urdf};
//! # use tactid_excitation::*;
//! # use tactid_identify::EquationSettings;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let urdf = Urdf::from_xml(include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../sim/robots/tactid.urdf")))?;
//! let robot = urdf.manipulator(BaseKind::Fixed)?;
//! // A box of 1.5 kg: what is expected of the payload.
//! let payload = MassProperties {
//!     mass_kg: 1.5,
//!     center_of_mass: [0.03, -0.02, 0.08].into(),
//!     inertia: nalgebra::Matrix3::from_diagonal(&[0.005, 0.008, 0.007].into()),
//! }
//! .into();
//! let limits = JointLimits::of_robot(&robot, 5.0, 1.0)?; // 5 rad/s², full speed
//! let sensing = Sensing {
//!     sensors: vec!["tool0".to_owned()],
//!     equations: EquationSettings {
//!         wrench_noise: vec![[0.5, 0.5, 0.5, 0.05, 0.05, 0.05]], // N and N m
//!         ..EquationSettings::default()
//!     },
//!     rate_hz: 200.0,
//!     base_noise: None,
//! };
//! let start = [0.0, -1.2, 1.6, -0.4, 1.5, 0.0, 0.0, 0.0];
//! let targets = targets_within(&payload, 0.05).ok_or("no mass")?;
//! let mut problem = Problem::new(robot, "tool0", &start, limits, sensing, payload, targets);
//! problem.duration_s = 4.0;
//! let quick = DesignSettings { starts: 1, iterations: 15, ..DesignSettings::default() };
//! let design = design(&problem, &quick)?;
//! let (_, ratio) = design.prediction.largest();
//! assert!(ratio < 1.0); // all ten intervals are within their targets
//! # Ok(())
//! # }
//! ```
//!
//! A [`Planner`] does the same online: from what is known of the payload so far, it plans the next
//! second of motion, until all intervals are within their targets.
//!
//! # How the crate works
//!
//! A motion is a [`Spline`] for each joint. Limits on position, velocity and acceleration are
//! linear in its control points and hold at all times. Everything else (regressor rows, torques,
//! wrenches, the twist of the base) is an output of one model of the robot at a state of the
//! joints, sampled along the motion and differentiated by finite differences. Each step of the
//! design solves a conic program in which functions and limits are linear in the control points,
//! within a trust region. [`margins`] and [`predict`] then evaluate the result without these
//! approximations.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

// The tests in this crate share problems with those beside it.
#[cfg(test)]
extern crate self as tactid_excitation;

mod active;
mod checks;
mod collisions;
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
#[allow(dead_code, reason = "not each test uses all of it")]
mod common;
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
mod plan;
mod plant;
mod prediction;
mod problem;
mod progress;
mod request;
mod rest;
mod samples;
mod search;
mod settings;
mod shapes;
mod shortest;
mod spline;
mod start;
mod subproblem;
mod untested;
mod variables;
mod whitening;
mod workspace_bounds;

pub use active::{ActiveSettings, Planner, Prior, PriorBound, PriorContradiction, Step};
pub use checks::LARGEST_SIZE_M;
pub use dense::{BasePath, Excursion, margins};
pub use design::{Design, design, design_observed};
pub use error::ExcitationError;
pub use fourier::FourierMotion;
pub use grip::Grip;
pub use joint_limits::JointLimits;
pub use limits::{Limit, Margin};
pub use motion::{JointStates, Motion, Trajectory};
pub use plan::MotionPlan;
pub use prediction::{MotionWindows, Prediction, predict};
pub use problem::{BaseBounds, Criterion, Problem, Sensing, targets_within};
pub use progress::{Observer, Progress};
pub use request::MotionRequest;
pub use settings::DesignSettings;
pub use shapes::{CollisionFinding, CollisionModel, MeshReader, NotTested};
pub use shortest::{ShortestSettings, shortest};
pub use spline::{FEWEST_CONTROL_POINTS, Spline};
pub use start::Start;
pub use untested::{UntestedLink, UntestedLinks};
pub use variables::End;
pub use workspace_bounds::{KeepOutBox, MAX_KEEP_OUT, OrientedBox, WorkspaceBounds};
