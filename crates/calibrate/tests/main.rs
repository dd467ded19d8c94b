//! The integration tests of this crate, as one program.

#![allow(clippy::panic, clippy::unwrap_used)]

#[path = "common/effort_arm.rs"]
mod effort_arm;

mod calibration;
mod calibration_assumptions;
mod calibration_changes;
mod calibration_errors;
mod calibration_masses;
mod calibration_similar_robot;
mod calibration_unloaded;
mod gain_changes;
mod moved_zeros;
mod short_recordings;
