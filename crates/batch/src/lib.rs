//! Identifies a payload from a whole recording at once, and finds the assumptions that it contradicts.
//!
//! `tactid-identify` turns samples into equations and solves them in a control loop. This crate
//! solves all equations of a recording together, which a controller does not need:
//!
//! - [`BatchIdentifier`]: robust least squares over all windows of a recording, with its motion
//!   where that is uncertain ([`MotionEstimate`]);
//! - [`LagIdentifier`]: the same estimate of motion and payload while samples come;
//! - [`RestIdentifier`]: least squares over poses at rest, without times;
//! - [`RecordedContact`]: the wrench of the contact at each sample;
//! - [`Finding`]: what samples or equations show about the assumptions, with its severity and its
//!   words. [`online_findings`] has those of an online identifier.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod attitudes;
mod contact;
pub mod diagnosis;
pub mod distributions;
mod equation_batch;
mod finding;
mod fit;
mod forecast;
mod history;
mod hypotheses;
mod identifier;
mod linear_estimate;
mod online_findings;
mod other_load;
mod poses;
pub mod preview;
mod prior;
mod range_findings;
mod recorded_values;
mod report;
mod rests;
mod serial;
mod shown_offset;
pub mod solve;
mod trajectory;

pub use contact::{ContactSample, LoadEstimate, RecordedContact, RecordedWrenches};
pub use equation_batch::EquationBatch;
pub use finding::{
    Disagreement, FarCenter, Finding, Hypothesis, NextAttitude, OtherLoad, OutlyingPose,
    RestingPoses, Rests, UnexplainedLoad, WrongAssumption, distance_of_runs, p_equals, probability,
};
pub use fit::{Delay, GainErrors};
pub use forecast::Forecast;
pub use identifier::{BatchIdentifier, BatchResult, BatchSettings};
pub use linear_estimate::{LinearEstimate, SharedErrors};
pub use online_findings::online_findings;
pub use poses::RestIdentifier;
pub use prior::PriorKnowledge;
pub use range_findings::range_findings;
pub use recorded_values::{GravityEstimate, HistoryPoint, WeightEstimate};
pub use report::FitReport;
pub use serial::Table;
pub use solve::PrincipalMoments;
pub use trajectory::{LagIdentifier, LagSettings, MotionEstimate};
