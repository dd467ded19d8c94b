//! Section 4 of Hou et al. 2016 (doi 10.3873/j.issn.1000-1328.2016.10.009) on Rapier: a free-floating spacecraft with
//! a six-joint arm holds an unknown payload between two fingers by friction alone, drives its joints, and records what
//! its sensors say.
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
//! [`Experiment`] is what is run, as a struct or as a TOML file; [`run`] writes a log; [`Simulation`] is the same step
//! by step, for tests and controllers.
//!
//! # Conventions
//!
//! SI units. The world is inertial, without gravity; the base's centre of mass begins at its origin. The payload is
//! described in the frame of the tool link, `tool0` (frame 6 of the paper's Table 1). Wrenches act **on the payload**,
//! in the frame of the finger's link and about its origin. What a [`Sample`]'s one time means is said there.
//!
//! # How far to trust it
//!
//! Every run watches the momentum of the whole system, the payload's place in the grasp, and Newton's and Euler's
//! equations for the payload under the contact forces that the fingers report ([`Checks`]); it ends with a
//! [`SimError::Bound`] that says which one failed when the step is too long or the payload slips.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod checks;
mod contact;
mod convert;
mod error;
mod excitation;
mod experiment;
mod gripper;
mod log;
mod robot;
mod run;
mod sample;
mod scene;
mod sensors;
mod simulation;

pub use checks::Checks;
pub use error::SimError;
pub use experiment::{
    BaseProperties, Bounds, Deviation, Excitation, ExcitationMode, Experiment, Gripper, Handle,
    JointExcitation, NamedPosture, Noise, PAPER_TOML, Payload, Posture, RobotChoice,
};
pub use robot::BUILT_IN_URDF;
pub use run::{Progress, RunReport, run};
pub use sample::{BaseSample, Contact, FingerSample, ImuSample, Sample, Truth};
pub use simulation::Simulation;
