//! Simulation of the experiment in section 4 of Hou et al. 2016 (doi
//! 10.3873/j.issn.1000-1328.2016.10.009) with the physics engine Rapier: a free-floating spacecraft
//! with a six-joint arm holds a payload between two fingers by friction, drives its joints and
//! records its sensors.
//!
//! ```
//! use std::ops::ControlFlow;
//! use tactid_sim::{Experiment, run};
//!
//! let mut experiment = Experiment::paper(); // 100 kg, joints 3, 5 and 6 one after another, 300 s
//! experiment.duration_s = 0.6;
//! experiment.payload.mass_kg = 80.0;
//! let log = std::env::temp_dir().join("tactid-sim-example.mcap");
//! let report = run(&experiment, &log, |progress| {
//!     let _done = progress.time_s / progress.duration_s; // for a progress bar
//!     ControlFlow::Continue(())
//! })?;
//! assert_eq!(report.steps, 600);
//! assert!(report.checks.grasp_drift_m < 1e-4); // it was held
//! # std::fs::remove_file(log).ok();
//! # Ok::<(), tactid_sim::SimError>(())
//! ```
//!
//! [`Experiment`] describes a run, as a struct or as a TOML file. [`run()`] simulates it and writes
//! a log. [`Simulation`] simulates it step by step without a log, for tests and controllers.
//!
//! # Conventions
//!
//! - Units are SI.
//! - `world` is an inertial frame. The centre of mass of a floating base starts at its origin,
//!   without gravity. A fixed base stands at its origin, and gravity acts along its -z axis unless
//!   the experiment says otherwise.
//! - The payload is described in the frame of the link `tool0` (frame 6 of the paper's Table 1).
//! - Wrenches act **on the payload**, in the frame of the finger's link and about its origin.
//! - [`Sample`] documents to which instant each of its quantities belongs.
//!
//! # Validity
//!
//! Every run monitors the momentum of the whole system, the pose of the payload in the grasp, and
//! the Newton and Euler equations of the payload under the reported contact forces ([`Checks`]). A
//! run with a step that is too long or a payload that slips ends with [`SimError::Bound`], which
//! names the violated bound.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod checks;
mod contact;
mod convert;
mod error;
mod excitation;
mod experiment;
mod file;
mod gripper;
mod log;
mod motion;
mod robot;
mod roles;
mod run;
mod sample;
mod scene;
mod sensors;
mod simulation;

pub use checks::{BaseExcursion, Checks};
pub use error::SimError;
pub use excitation::{ActiveContradiction, ActiveReport};
pub use experiment::{
    ActiveExcitation, BaseMount, BaseProperties, Bounds, BoxCorners, Excitation, ExcitationKind,
    ExcitationMode, Experiment, Gripper, Handle, JointExcitation, NamedPosture, Noise, PAPER_TOML,
    Payload, Posture, RobotChoice, StdDev,
};
pub use motion::JointMotion;
pub use robot::BUILT_IN_URDF;
pub use run::{Progress, RunReport, run};
pub use sample::{BaseSample, Contact, FingerSample, ImuSample, Sample, Truth};
pub use simulation::Simulation;
