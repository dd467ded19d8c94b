//! Identifies the mass, centre of mass and inertia of a payload that a robot holds.
//!
//! An [`Identifier`] takes one [`Sample`] at a time (joints, base, wrenches) and can be asked at any
//! time for its [`PayloadEstimate`]; [`identify_log`] feeds the same identifier from a rosbag2 log.
//! Measurements become the end-effector's motion by (1)-(20) of Hou et al. 2016, motion and wrench
//! become rows by (29)-(48), and rows become parameters by (49)-(54).
//!
//! ```no_run
//! use std::ops::ControlFlow;
//! use std::path::Path;
//! use tactid_identify::{Request, identify_log};
//!
//! let result = identify_log(
//!     Path::new("run.mcap"),
//!     &Request::default(),
//!     &mut |_progress| ControlFlow::Continue(()),
//! )?;
//! println!("{} kg", result.estimate.body.mass_kg);
//! # Ok::<(), tactid_identify::IdentifyError>(())
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod covariance;
mod equation;
mod error;
mod estimate;
mod excitation;
mod fit;
mod forecast;
mod front;
mod gram;
mod identifier;
mod information;
mod knowledge;
mod latest;
mod method;
mod model;
mod noise;
mod offset;
mod physical;
mod principal;
mod recent;
mod recording;
mod recursive;
mod sample;
mod settings;
mod stencil;
mod uncertainty;
mod window;

pub use error::IdentifyError;
pub use estimate::{PayloadEstimate, VALUE_NAMES};
pub use excitation::SingularValues;
pub use identifier::{Identifier, Pushed};
pub use knowledge::{BoundingBox, KnownMass};
pub use offset::Offset;
pub use principal::PrincipalMoments;
pub use recording::{
    ActsOn, Clock, Dirt, FitReport, HistoryPoint, Identification, Progress, Request, Topics,
    identify_log, identify_samples, write_estimates,
};
pub use sample::{BaseState, Sample, states_of_poses};
pub use settings::{EstimatorKind, Settings, Way};
